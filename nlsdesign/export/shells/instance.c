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

enum { ALL_WELL = 0, WARNED = 1, REFUSED = 3 }; /* the numbers that both versions of FMI give to ok, warning, error */
enum { INSTANTIATED = 1, INITIALIZATION = 2, STEPPING = 4, TERMINATED = 8, FAILED = 16 };

/* Everything that a copy of the state holds; plain data. */
typedef struct {
    double time;
    double first_time;
    double last_time;
    int32_t has_last_time;
    int32_t phase;
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

static void begin(instance *me)
{
    memset(&me->now, 0, sizeof me->now);
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
    model_equations(v[0], &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], &v[MODEL_D], &v[MODEL_Y], &v[MODEL_S]);
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
    int phases = input || (parameter && !MODEL_CONTINUOUS) ? INSTANTIATED | INITIALIZATION | STEPPING
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

static int enter_stepping(instance *me)
{
    refresh(me);
#if !MODEL_CONTINUOUS
    model_start(&me->now.memory, &me->now.value[MODEL_X], &me->now.value[MODEL_P]);
#endif
    me->now.phase = STEPPING;
    return ALL_WELL;
}

static int advance(instance *me, double to)
{
    double *v = me->now.value;
#if MODEL_CONTINUOUS
    integrator_report done;
    if (!integrate(me->now.time, to, &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], v[MODEL_EXTRA], &me->now.memory, &done)) {
        me->now.phase = FAILED;
        return say(me, REFUSED, "no step size gives the relative tolerance %.3g at time %.9g s (%d steps, %d rejected)",
                   v[MODEL_EXTRA], done.time, done.accepted, done.rejected);
    }
    (void)say(me, ALL_WELL, "time %.9g s: %d steps, %d rejected", to, done.accepted, done.rejected);
    me->now.outdated = 1;
#else
    /* Samples are counted, not timed: the one at to belongs to the next step, whatever the rounding of to. */
    const double due = ceil((to - me->now.first_time) / MODEL_SAMPLE_TIME - 1e-6);
    while ((double)me->now.samples < due) {
        me->now.status = model_sample(&me->now.memory, &v[MODEL_U], &v[MODEL_X], &v[MODEL_Y], &v[MODEL_S]);
        ++me->now.samples;
    }
#endif
    me->now.time = v[0] = to;
    return ALL_WELL;
}

static int do_step(instance *me, double from, double length)
{
    const double to = from + length;

    if (!(length > 0.0 && length <= MODEL_LARGEST)) {
        return say(me, REFUSED, "a communication step of %.9g s is not possible", length);
    }
    if (!(fabs(from - me->now.time) <= 1e-6 * length)) {
        return say(me, REFUSED, "the communication point is %.9g s, the model stands at %.9g s", from, me->now.time);
    }
    if (me->now.has_last_time && to > me->now.last_time + 1e-6 * length) {
        return say(me, REFUSED, "the step to %.9g s goes beyond the stop time %.9g s", to, me->now.last_time);
    }
    return advance(me, to);
}

/* Sensitivities of derivatives, outputs and signals to time, states, inputs and parameters. */
static int derive(instance *me, const uint32_t unknowns[], size_t unknown_count, const uint32_t knowns[],
                  size_t known_count, const double seed[], double result[])
{
#if MODEL_CONTINUOUS
    const double *v = me->now.value;
    double in[MODEL_VALUES] = {0.0}, out[MODEL_VALUES] = {0.0};

    for (size_t k = 0; k < known_count; ++k) {
        const uint32_t r = knowns[k];
        if (!known(me, r)) {
            return REFUSED;
        }
        if (r != 0 && !within(r, MODEL_X, MODEL_STATES) && !within(r, MODEL_U, MODEL_INPUTS) &&
            !within(r, MODEL_P, MODEL_PARAMETERS)) {
            return say(me, REFUSED, "%s is not a known", model_variable[r].name);
        }
        in[r] += seed[k];
    }
    memcpy(out, in, sizeof out);
    model_directional(v[0], &v[MODEL_X], &v[MODEL_U], &v[MODEL_P], in[0], &in[MODEL_X], &in[MODEL_U], &in[MODEL_P],
                      &out[MODEL_D], &out[MODEL_Y], &out[MODEL_S]);
    for (size_t k = 0; k < unknown_count; ++k) {
        if (!known(me, unknowns[k])) {
            return REFUSED;
        }
        result[k] = out[unknowns[k]];
    }
    return ALL_WELL;
#else
    (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count, (void)seed, (void)result;
    return say(me, REFUSED, "a sampled model has no directional derivatives");
#endif
}

static int copy_state(const instance *me, void **copy)
{
    if (*copy == NULL) {
        *copy = malloc(sizeof me->now);
    }
    if (*copy == NULL) {
        return say(me, REFUSED, "no memory for a copy of the state");
    }
    memcpy(*copy, &me->now, sizeof me->now);
    return ALL_WELL;
}

static int restore_state(instance *me, const void *copy)
{
    if (copy == NULL) {
        return say(me, REFUSED, "there is no copy to restore");
    }
    memcpy(&me->now, copy, sizeof me->now);
    return ALL_WELL;
}

enum { TOKEN_SIZE = sizeof MODEL_TOKEN, WRITTEN_SIZE = sizeof MODEL_TOKEN + sizeof(moment) };

static int write_state(const instance *me, const void *copy, unsigned char bytes[], size_t size)
{
    if (copy == NULL || size < WRITTEN_SIZE) {
        return say(me, REFUSED, "there is no copy, or not enough room to write it");
    }
    memcpy(bytes, MODEL_TOKEN, TOKEN_SIZE);
    memcpy(bytes + TOKEN_SIZE, copy, sizeof(moment));
    return ALL_WELL;
}

static int read_state(const instance *me, const unsigned char bytes[], size_t size, void **copy)
{
    if (size < WRITTEN_SIZE || memcmp(bytes, MODEL_TOKEN, TOKEN_SIZE) != 0) {
        return say(me, REFUSED, "these bytes are not a state of this model");
    }
    if (copy_state(me, copy) != ALL_WELL) {
        return REFUSED;
    }
    memcpy(*copy, bytes + TOKEN_SIZE, sizeof(moment));
    return ALL_WELL;
}

static void release(instance *me)
{
    free(me->name);
    free(me);
}

/* Gives a new instance in memory of the given size, or null. */
static instance *establish(size_t size, const char *name,
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
        begin(me);
    }
    return me;
}
