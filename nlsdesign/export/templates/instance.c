/* One running instance behind either version of FMI: its values, phases, steps and copies. Included, not
   compiled alone, so that nothing but the functions of FMI is visible outside. */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.c"
#if MODEL_CONTINUOUS
#include "integrator.c"
#endif
#if MODEL_SWITCHES > 0
#include "events.c"
#include "switched.c"
#endif

/* The numbers that both versions of FMI give to ok, warning, discard, error. */
enum { ALL_WELL = 0, WARNED = 1, DISCARDED = 2, REFUSED = 3 };
/* Most samples in one step: eleven hours at 1 kHz, computed in seconds. */
enum { MOST_SAMPLES = 40000000 };
/* What an instance was made for; the last one in FMI 3.0 only. */
enum { CO_SIMULATION = 0, MODEL_EXCHANGE = 1, CO_SIMULATION_WITH_EVENTS = 2 };
enum { INSTANTIATED = 1, INITIALIZATION = 2, STEPPING = 4, TERMINATED = 8, FAILED = 16, EVENT = 32, CONTINUOUS = 64 };

/* Everything that a copy of the state holds; plain data. */
typedef struct {
    double time; /* as the importer counts it */
    double elapsed, lost; /* sum of all steps, and what its rounding has lost: a clock drifts where it is large */
    double first_time;
    double last_time;
    int32_t has_last_time;
    int32_t phase;
    int32_t purpose;
    int32_t arriving; /* has just entered the event mode */
    int32_t outdated; /* outputs and signals belong to other inputs */
    int32_t status;   /* status word of the last sample */
    uint64_t samples; /* done since first_time */
    double value[MODEL_VALUES]; /* by value reference */
#if MODEL_CONTINUOUS
    integrator_memory memory;
#else
    model_memory memory;
#endif
} moment;

typedef struct instance {
    moment now;
    int solver_logged;
    int may_return_early; /* at an event */
    char *name;
    void (*report)(const struct instance *me, int status, const char *category, const char *text);
} instance;

static int say(const instance *me, int status, const char *format, ...)
{
    char text[400];
    va_list arguments;

    if (status == ALL_WELL && !me->solver_logged) {
        return status;
    }
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    me->report(me, status,
               status == ALL_WELL ? "logSolver" : status == WARNED ? "logStatusWarning" : "logStatusError", text);
    return status;
}

static int allowed(const instance *me, int phases, const char *function)
{
    if ((me->now.phase & phases) == 0) {
        (void)say(me, REFUSED, "%s: not allowed in this phase", function);
    }
    return (me->now.phase & phases) != 0;
}

static int within(uint32_t reference, uint32_t first, uint32_t count)
{
    return reference >= first && reference - first < count;
}

static int known(const instance *me, uint32_t reference)
{
    if (reference >= MODEL_VALUES) {
        (void)say(me, REFUSED, "there is no variable of this type with value reference %lu", (unsigned long)reference);
    }
    return reference < MODEL_VALUES;
}

static void begin(instance *me, int purpose)
{
    memset(&me->now, 0, sizeof me->now);
    me->now.purpose = purpose;
    me->now.phase = INSTANTIATED;
    me->now.outdated = 1;
    for (uint32_t i = 0; i < MODEL_VALUES; ++i) {
        me->now.value[i] = model_variable[i].start;
    }
}

/* Brings what depends on states, inputs and parameters up to date. */
static void refresh(instance *me)
{
    double *v = me->now.value;

    if (!me->now.outdated) {
        return;
    }
    v[0] = me->now.time;
#if MODEL_CONTINUOUS
#if MODEL_SWITCHES > 0
    double slope[MODEL_SWITCHES];
    if ((me->now.phase & (INSTANTIATED | INITIALIZATION)) != 0) {
        model_natural(v[0], &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_M]);
    }
    model_indicators(v[0], &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_M], &v[MODEL_Z], slope);
#endif
    model_equations(v[0], &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_M], &v[MODEL_D], &v[MODEL_Y], &v[MODEL_S]);
#else
    /* Before the first sample: what it would give, on a copy. */
    model_memory trial;
    memset(&trial, 0, sizeof trial);
    model_start(&trial, &v[MODEL_X], &v[MODEL_P]);
    double states[MODEL_STATES > 0 ? MODEL_STATES : 1]; /* those that are set stay shown until the first sample */
    me->now.status = model_sample(&trial, &v[MODEL_U], states, &v[MODEL_Y], &v[MODEL_S]);
#endif
    me->now.outdated = 0;
}

static int get_values(instance *me, const uint32_t references[], size_t count, double values[])
{
    refresh(me);
    for (size_t k = 0; k < count; ++k) {
        const uint32_t r = references[k];
        if (!known(me, r)) {
            return REFUSED;
        }
        values[k] = me->now.value[r];
        if (!within(r, MODEL_U, MODEL_INPUTS) && !(fabs(values[k]) <= MODEL_LARGEST)) {
            return say(me, REFUSED, "%s is not finite at time %.9g s", model_variable[r].name, me->now.time);
        }
    }
    return ALL_WELL;
}

/* Judges one value that is to be set. */
static int judge(const instance *me, uint32_t r, double value)
{
    if (!known(me, r)) {
        return REFUSED;
    }
    const variable *is = &model_variable[r];
    const int input = within(r, MODEL_U, MODEL_INPUTS), parameter = within(r, MODEL_P, MODEL_PARAMETERS);
    /* In model exchange some importers set the states by their value references. */
    const int moved = me->now.purpose == MODEL_EXCHANGE && within(r, MODEL_X, MODEL_STATES);
    const int phases = input || moved || (parameter && !MODEL_CONTINUOUS)
                           ? INSTANTIATED | INITIALIZATION | STEPPING | EVENT | CONTINUOUS
                           : INSTANTIATED | INITIALIZATION;
    if (!input && !parameter && !within(r, MODEL_X, MODEL_STATES) && !(MODEL_CONTINUOUS && r == MODEL_EXTRA)) {
        return say(me, REFUSED, "%s is computed and cannot be set", is->name);
    }
    if ((me->now.phase & phases) == 0) {
        return say(me, REFUSED, "%s cannot be set in this phase", is->name);
    }
    if (input && !MODEL_CONTINUOUS) {
        return ALL_WELL; /* the guards of the controller take anything */
    }
    if (moved && (me->now.phase & (EVENT | CONTINUOUS)) != 0 && fabs(value) <= MODEL_LARGEST) {
        return ALL_WELL;
    }
    if (input && fabs(value) <= MODEL_LARGEST && !(value >= is->lowest && value <= is->highest)) {
        return say(me, WARNED, "%s = %.9g is outside the range [%.9g, %.9g] for which the laws are stated", is->name,
                   value, is->lowest, is->highest);
    }
    if (!(value >= is->lowest && value <= is->highest)) {
        return say(me, REFUSED, "%s = %.9g must lie in [%.9g, %.9g]", is->name, value, is->lowest, is->highest);
    }
    return ALL_WELL;
}

/* Sets all values or, if one is refused, none. */
static int set_values(instance *me, const uint32_t references[], size_t count, const double values[])
{
    int worst = ALL_WELL;

    for (size_t k = 0; k < count; ++k) {
        const int verdict = judge(me, references[k], values[k]);
        worst = verdict > worst ? verdict : worst;
    }
    for (size_t k = 0; worst != REFUSED && k < count; ++k) {
        me->now.value[references[k]] = values[k];
    }
#if MODEL_CONTINUOUS
    me->now.outdated = 1;
#else
    if (me->now.phase == STEPPING) {
        model_tune(&me->now.memory, &me->now.value[MODEL_P]);
    } else {
        me->now.outdated = 1;
    }
#endif
    return worst;
}

static int enter_initialization(instance *me, double first_time, int has_last_time, double last_time)
{
    if (!(fabs(first_time) <= MODEL_LARGEST) || (has_last_time && !(last_time >= first_time))) {
        return say(me, REFUSED, "start time %.9g s and stop time %.9g s make no interval", first_time, last_time);
    }
    me->now.time = me->now.first_time = me->now.value[0] = first_time;
    me->now.has_last_time = has_last_time;
    me->now.last_time = last_time;
    me->now.outdated = 1;
    return ALL_WELL;
}

#if MODEL_SWITCHES > 0
static int settle_modes(instance *me, int arriving)
{
    double *v = me->now.value;
    const setting at = {v[0], &v[MODEL_U], &v[MODEL_P]};
    int which = 0;
    const int found = settle(&at, &v[MODEL_X], &v[MODEL_M], arriving, &which);

    me->now.outdated = 1;
    if (found != SETTLED) {
        me->now.phase = FAILED;
        return say(me, REFUSED, "%s: events do not end at time %.9g s", model_variable[MODEL_M + which].name,
                   me->now.time);
    }
    return ALL_WELL;
}
#endif

static int leave_initialization(instance *me)
{
    refresh(me);
#if !MODEL_CONTINUOUS
    model_start(&me->now.memory, &me->now.value[MODEL_X], &me->now.value[MODEL_P]);
#elif MODEL_SWITCHES > 0
    if (settle_modes(me, 0) != ALL_WELL) {
        return REFUSED;
    }
#endif
    me->now.phase = me->now.purpose == CO_SIMULATION ? STEPPING : EVENT;
    return ALL_WELL;
}

/* Adds a step to the sum of all steps. Source: Neumaier 1974. */
static void count_time(instance *me, double length)
{
    const double before = me->now.elapsed, sum = before + length;
    me->now.lost += before >= length ? (before - sum) + length : (length - sum) + before;
    me->now.elapsed = sum;
}

/* Advances by a length of time, or to the first event if the importer wants that; gives how far. */
#if MODEL_CONTINUOUS
static int advance(instance *me, double from, double length, double *reached, int *event)
{
    double *v = me->now.value;
    const moment before = me->now;
    integrator_report done;
#if MODEL_SWITCHES > 0
    const int found = integrate_switched(from, length, &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_M],
                                         v[MODEL_EXTRA], me->may_return_early, &me->now.memory, &done);
#else
    const int found = integrate(from, length, &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_M], v[MODEL_EXTRA],
                                &me->now.memory, &done);
#endif
    if (found != INTEGRATED) {
        me->now = before;
    }
    if (found == TOO_LONG) {
        return say(me, REFUSED, "the step of %.9g s needs more than %d steps of the integrator; it came to %.9g s",
                   length, MOST_ATTEMPTS, from + done.time);
    }
    if (found != INTEGRATED) {
        me->now.phase = FAILED;
    }
    if (found != INTEGRATED && found != NO_STEP) {
        return say(me, REFUSED, "events accumulate at time %.9g s; give a stop a speed below which it rests",
                   from + done.time);
    }
    if (found == NO_STEP) {
        return say(me, REFUSED, "no step size gives the relative tolerance %.3g at time %.9g s (%d steps, %d rejected)",
                   v[MODEL_EXTRA], from + done.time, done.accepted, done.rejected);
    }
    (void)say(me, ALL_WELL, "time %.9g s: %d steps, %d rejected", from + done.time, done.accepted, done.rejected);
    me->now.outdated = 1;
    count_time(me, done.time);
    *reached = done.time;
    *event = done.stopped;
    return ALL_WELL;
}
#else
/* Samples are counted, not timed: the one at the end belongs to the next step, whatever the rounding of the clock. */
static int advance(instance *me, double from, double length, double *reached, int *event)
{
    double *v = me->now.value;
    const double before = me->now.elapsed, lost = me->now.lost;

    count_time(me, length);
    const double elapsed = me->now.elapsed + me->now.lost;
    const double rounding = 8.0 * DBL_EPSILON * (fabs(from) + elapsed);
    const double due = ceil((elapsed - rounding) / MODEL_SAMPLE_TIME - 1e-6);
    const double needed = due - (double)me->now.samples;
    if (!(rounding <= 0.25 * MODEL_SAMPLE_TIME) || !(needed <= (double)MOST_SAMPLES)) {
        me->now.elapsed = before;
        me->now.lost = lost;
        return needed > (double)MOST_SAMPLES
                   ? say(me, REFUSED, "the step of %.9g s would need %.9g samples, one step takes at most %d", length,
                         needed, MOST_SAMPLES)
                   : say(me, REFUSED, "at %.9g s the clock is too coarse for samples every %.9g s", from,
                         MODEL_SAMPLE_TIME);
    }
    while ((double)me->now.samples < due) {
        me->now.status = model_sample(&me->now.memory, &v[MODEL_U], &v[MODEL_X], &v[MODEL_Y], &v[MODEL_S]);
        ++me->now.samples;
    }
    *reached = length;
    *event = 0;
    return ALL_WELL;
}
#endif

/* Makes a step; event tells that it has ended at one. */
static int do_step(instance *me, double from, double length, int *event)
{
    const double to = from + length;
    double reached = 0.0;

    *event = 0;
    if (!(length > 0.0 && fabs(to) <= MODEL_LARGEST)) {
        return say(me, REFUSED, "a communication step of %.9g s is not possible", length);
    }
    /* An importer may add its steps up or multiply, so that its clock differs by rounding. */
    const double clock = 4.0 * DBL_EPSILON * fmax(fabs(from), fabs(me->now.time)), allowance = 1e-6 * length + clock;
    if (!(fabs(from - me->now.time) <= allowance)) {
        return say(me, REFUSED, "the communication point is %.9g s, the model stands at %.9g s", from, me->now.time);
    }
    if (me->now.has_last_time && to > me->now.last_time + allowance) {
        return say(me, REFUSED, "the step to %.9g s goes beyond the stop time %.9g s", to, me->now.last_time);
    }
    if (advance(me, from, length, &reached, event) != ALL_WELL) {
        return REFUSED;
    }
    me->now.time = me->now.value[0] = from + reached;
    return ALL_WELL;
}

/* Sensitivities of derivatives, outputs and signals to time, states, inputs and parameters. */
static int derive(instance *me, const uint32_t unknowns[], size_t unknown_count, const uint32_t knowns[],
                  size_t known_count, const double seed[], double result[])
{
    const double *v = me->now.value;
    double in[MODEL_VALUES] = {0.0}, out[MODEL_VALUES] = {0.0};

    for (size_t k = 0; k < known_count; ++k) {
        const uint32_t r = knowns[k];
        if (!known(me, r)) {
            return REFUSED;
        }
        if (!(MODEL_CONTINUOUS && r == 0) && !within(r, MODEL_X, MODEL_STATES) && !within(r, MODEL_U, MODEL_INPUTS) &&
            !within(r, MODEL_P, MODEL_PARAMETERS)) {
            return say(me, REFUSED, "%s is not a known", model_variable[r].name);
        }
        in[r] += seed[k];
    }
    memcpy(out, in, sizeof out);
#if MODEL_CONTINUOUS
    model_directional(v[0], &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_M], in[0], &in[MODEL_X], &in[MODEL_U],
                      &in[MODEL_P], &out[MODEL_D], &out[MODEL_Y], &out[MODEL_S], &out[MODEL_Z]);
#else
    if (me->now.samples == 0 || !model_directional(&me->now.memory, me->now.status, &v[MODEL_X], &in[MODEL_X],
                                                   &in[MODEL_U], &in[MODEL_P], &out[MODEL_Y], &out[MODEL_S])) {
        return say(me, REFUSED, "there are derivatives of a sample that was taken as it was, status %ld",
                   (long)me->now.status);
    }
#endif
    for (size_t k = 0; k < unknown_count; ++k) {
        if (!known(me, unknowns[k])) {
            return REFUSED;
        }
        result[k] = out[unknowns[k]];
    }
    return ALL_WELL;
}

#include "exchange.c"
#include "saved_state.c"

static void release(instance *me)
{
    free(me->name);
    free(me);
}

/* Gives a new instance in memory of the given size, or null. */
static instance *establish(size_t size, const char *name, int purpose,
                           void (*report)(const instance *, int, const char *, const char *))
{
    instance *me = calloc(1, size);
    if (me != NULL) {
        me->report = report;
        me->name = malloc(strlen(name) + 1);
        if (me->name == NULL) {
            free(me);
            return NULL;
        }
        memcpy(me->name, name, strlen(name) + 1);
        begin(me, purpose);
    }
    return me;
}
