/* scheduled damper: Force of a damper whose viscosity depends on speed
   Sample time 0.01 s; all numbers in SI units, given in brackets.
   Deck damper, 111111111111 (SHA-256 of its parts).
   From older_damper, 000000000000 (diagnosed).
   Written by nlsdesign (version) with CasADi (version); do not edit. */
#include <float.h>
#include <math.h>
#include <stddef.h>

#include "scheduled_damper.h"

#ifdef __FAST_MATH__
#error "the guards need IEEE arithmetic: compile without -ffast-math"
#endif

/* Elementary functions of our own: the same bits on every processor with IEEE arithmetic, as long as the compiler
   forms no fused multiply-add (-ffp-contract=off). An ulp is a unit of the last place. */
typedef union {
    double number;
    uint64_t bits;
} portable_number;

/* 2^(exponent - bias) from its biased exponent, which lies in the lowest bits. */
static double portable_power_of_two(uint64_t biased)
{
    portable_number power;

    power.bits = biased << 52u;
    return power.number;
}

/* exp(r) - 1 for |r| up to half of ln 2. */
static double portable_expm1_kernel(double r)
{
    const double polynomial = 0.5000000000000016 + r * (0.16666666666666707 + r * (0.04166666666648961 + r * (0.008333333333302679 + r * (0.0013888888954309993 + r * (0.00019841269927075347 + r * (2.480148195553756e-05 + r * (2.755720774317938e-06 + r * (2.7634255816265273e-07 + r * (2.5120538967661165e-08)))))))));

    return r + r * r * polynomial;
}

/* x / ln 2, rounded to an integer that stands in the lowest bits; other bits are those of 6755399441055744.0. */
static double portable_binary_exponent(double x, uint64_t *bits)
{
    portable_number shifted;

    shifted.number = x * 1.4426950408889634 + 6755399441055744.0;
    *bits = shifted.bits;
    return shifted.number - 6755399441055744.0;
}

/* exp(x); at most 1.1 ulp. NaN stays NaN, what is too large becomes infinite, what is too small zero. */
static double portable_exp(double x)
{
    const double above = x < -746.0 ? -746.0 : x;
    const double inside = above > 710.0 ? 710.0 : above;
    uint64_t bits;
    const double n = portable_binary_exponent(inside, &bits);
    const double r = (inside - n * 0.693147180559663) - n * 2.8235290563031577e-13;
    const double result = 1.0 + portable_expm1_kernel(r);
    const uint64_t both = bits - 4843621399236966402u;
    const uint64_t half = both >> 1;

    return result * portable_power_of_two(half) * portable_power_of_two(both - half);
}

/* Over piston.speed from -1.0 by 1.0: viscosity [N*s/m] */
static const double table_0[3][1] = {
    {3.0},
    {2.0},
    {4.0},
};

static const scheduled_damper_parameters start_parameters = {
    .memory.gain = 0.75,
};

static const scheduled_damper_states start_states = {
    .piston.filtered = 0.0,
};

static const scheduled_damper_inputs start_inputs = {
    .piston.speed = 0.0,
    .valve.opening = 1.0,
};

static const scheduled_damper_outputs start_outputs = {
    .piston.force = 0.0,
};

/* Keeps one command usable: held at its last good value while it is not finite, saturated outside its range. */
static void usable(double given, double lowest, double highest, double *last, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *last = given;
    } else if (given >= -DBL_MAX && given <= DBL_MAX) {
        *last = given < lowest ? lowest : highest;
        *status |= SCHEDULED_DAMPER_INPUT_SATURATED | which;
    } else {
        *status |= SCHEDULED_DAMPER_INPUT_HELD | which;
    }
}

/* Follows one command as fast as the drive can; the first one is taken as it is. */
static void followed(double given, double lowest, double highest, double change, double *last, uint32_t which,
                     uint32_t *status)
{
    double wanted = *last;

    usable(given, lowest, highest, &wanted, which, status);
    if (wanted > *last + change) {
        *last += change;
        *status |= SCHEDULED_DAMPER_COMMAND_SLOWED | which;
    } else if (wanted < *last - change) {
        *last -= change;
        *status |= SCHEDULED_DAMPER_COMMAND_SLOWED | which;
    } else {
        *last = wanted;
    }
}

/* What a reading can be, per sample; patience is the number of samples without change after which it is stale. */
typedef struct {
    double lowest;
    double highest;
    double change;
    double noticeable;
    uint32_t patience;
} reading_limits;

static const reading_limits reading_0 = {-1.0, 1.0, 0.060000000000000005, 0.1, 25u};

/* Takes a reading if it can be true, else what the last ones let expect. Refused readings that agree with one
   another 3 times in a row are believed. Returns whether the model has to resume after a gap. */
static uint32_t plausible(double given, double mover, const reading_limits *can, scheduled_damper_reading *seen, double *used,
                          uint32_t which, uint32_t *status)
{
    uint32_t flaw = 0u;
    uint32_t resuming = 0u;

    if (!(given >= can->lowest && given <= can->highest)) {
        seen->agreeing = 0u;
        flaw = SCHEDULED_DAMPER_INPUT_HELD;
        if (given >= -DBL_MAX && given <= DBL_MAX) {
            flaw = SCHEDULED_DAMPER_INPUT_OUT_OF_RANGE;
        }
    } else if (seen->seen == 0u || fabs(given - seen->last) <= can->change * ((double)seen->missed + (double)1)) {
        seen->agreeing = 0u;
    } else {
        if (!(fabs(given - seen->candidate) <= can->change)) {
            seen->agreeing = 0u;
        }
        seen->agreeing = seen->agreeing + 1u;
        seen->candidate = given;
        if (seen->agreeing < 3u) {
            flaw = SCHEDULED_DAMPER_INPUT_JUMPED;
        }
    }
    if (flaw != 0u) {
        seen->missed = seen->missed < 1000000u ? seen->missed + 1u : 1000000u;
        const double ahead = seen->last + (double)(seen->missed < 3u ? seen->missed : 3u) * seen->slope;
        *used = ahead < can->lowest ? can->lowest : (ahead > can->highest ? can->highest : ahead);
        *status |= flaw | which;
    } else {
        uint32_t same = 0u;
        if (seen->seen != 0u && given >= seen->last && given <= seen->last) {
            same = 1u;
        }
        if (seen->missed > 0u || (same == 0u && seen->moved != 0u && seen->unchanged >= can->patience)) {
            *status |= SCHEDULED_DAMPER_RECOVERED | which;
        }
        if (seen->agreeing >= 3u || seen->missed >= 3u) {
            resuming = 1u;
        }
        seen->slope = (seen->seen != 0u && seen->missed == 0u && seen->agreeing == 0u) ? given - seen->last : 0.0;
        if (same == 0u) {
            seen->unchanged = 0u;
            seen->moved = 0u;
            seen->mover = mover;
        } else {
            seen->unchanged = seen->unchanged < 1000000u ? seen->unchanged + 1u : 1000000u;
            if (fabs(mover - seen->mover) > can->noticeable) {
                seen->moved = 1u;
            }
        }
        if (seen->moved != 0u && seen->unchanged >= can->patience) {
            *status |= SCHEDULED_DAMPER_INPUT_STALE | which;
        }
        seen->last = given;
        seen->missed = 0u;
        seen->agreeing = 0u;
        seen->seen = 1u;
        *used = given;
    }
    return resuming;
}

/* Counts samples that did not come as missing readings. */
static void lacking(scheduled_damper_reading *seen, uint32_t samples)
{
    seen->missed = samples < 1000000u - seen->missed ? seen->missed + samples : 1000000u;
}

/* Takes over one parameter, unless it is not finite or outside its range. */
static void take_over(double given, double lowest, double highest, double *taken, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *taken = given;
    } else {
        *status |= SCHEDULED_DAMPER_PARAMETER_REFUSED | which;
    }
}

void scheduled_damper_defaults(scheduled_damper_parameters *parameters)
{
    *parameters = start_parameters;
}

uint32_t scheduled_damper_set_parameters(
    scheduled_damper_state *state,
    const scheduled_damper_parameters *parameters)
{
    uint32_t status = 0u;

    if (state->started != SCHEDULED_DAMPER_INTERFACE_VERSION) {
        status = SCHEDULED_DAMPER_NOT_STARTED;
    } else {
        take_over(parameters->memory.gain, 0.0, 10.0, &state->parameters.memory.gain, 0x10000u, &status);
    }
    return status;
}

uint32_t scheduled_damper_init(scheduled_damper_state *state, const scheduled_damper_parameters *parameters)
{
    state->parameters = start_parameters;
    state->states = start_states;
    state->inputs = start_inputs;
    state->outputs = start_outputs;
    state->readings[0] = (scheduled_damper_reading){0};
    state->readings[0].last = start_inputs.piston.speed;
    state->begun = 0u;
    state->started = SCHEDULED_DAMPER_INTERFACE_VERSION;
    return parameters == NULL ? 0u : scheduled_damper_set_parameters(state, parameters);
}

/* Sets the states of a machine that rests at its first readings. */
static void scheduled_damper_begin(scheduled_damper_state *state)
{
    const double u0 = state->inputs.piston.speed;
    state->states.piston.filtered = u0;
}

/* Sets the states of a machine that goes on after a gap in its readings. */
static void scheduled_damper_resume(scheduled_damper_state *state)
{
    const double u0 = state->inputs.piston.speed;
    const double x0 = state->states.piston.filtered;
    state->states.piston.filtered = x0 < u0 ? x0 : u0;
}

/* Takes the inputs of a sample; begins with the first usable readings. */
static uint32_t scheduled_damper_take(scheduled_damper_state *state, const scheduled_damper_inputs *inputs)
{
    uint32_t status = 0u;

    uint32_t resuming = 0u;
    followed(inputs->valve.opening, 0.0, 1.0, state->begun == 0u ? 1.7976931348623157e+308 : 0.3, &state->inputs.valve.opening, 0x20000u, &status);
    resuming |= plausible(inputs->piston.speed, state->inputs.valve.opening, &reading_0, &state->readings[0], &state->inputs.piston.speed, 0x10000u, &status);
    if (state->begun == 0u && state->readings[0].seen != 0u) {
        scheduled_damper_begin(state);
        state->begun = 1u;
    } else if (state->begun != 0u && resuming != 0u) {
        scheduled_damper_resume(state);
    } else {
        /* goes on, or waits for the first readings */
    }
    return status;
}

/* Computes the outputs of this sample and the state of the next from the inputs that were taken. */
static uint32_t scheduled_damper_advance(scheduled_damper_state *state, scheduled_damper_outputs *outputs)
{
    uint32_t status = 0u;

    const double u0 = state->inputs.piston.speed;
    const double u1 = state->inputs.valve.opening;
    const double x0 = state->states.piston.filtered;
    const double p0 = state->parameters.memory.gain;
    const double q0 = state->readings[0].missed > 0u ? 1.0 : 0.0;
    status |= (u0 < -1.0 || u0 > 1.0) ? SCHEDULED_DAMPER_OUT_OF_TABLE : 0u;
    const double raw_0 = (u0 + 1.0) * 1.0;
    const double above_0 = raw_0 > 0.0 ? raw_0 : 0.0; /* NaN becomes the lower end */
    const double place_0 = above_0 < 2.0 ? above_0 : 2.0;
    const int32_t floor_0 = (int32_t)place_0;
    const int32_t left_0 = floor_0 < 1 ? floor_0 : 1;
    const double share_0 = place_0 - (double)left_0;
    const double *const row_0 = table_0[left_0];
    const double *const row_0_next = table_0[left_0 + 1];
    const double w0 = row_0[0] + share_0 * (row_0_next[0] - row_0[0]);
    const double a10 = (0.5 < q0) ? x0 : u0;
    const double a21 = u1 * (w0 * a10 + p0 * x0);
    const double f0 = 0.5 * x0 + 0.25 * a10;
    const double y0 = (a10 < 0.0) ? (a21 < 2.0 ? a21 : 2.0) : portable_exp(-a10) * a21;

    if ((f0 - f0) >= 0.0) {
        state->states.piston.filtered = f0;
    } else {
        state->states = start_states;
        state->begun = 0u;
        status |= SCHEDULED_DAMPER_STATE_RESTARTED;
    }
    if ((y0 - y0) >= 0.0) {
        state->outputs.piston.force = y0;
        outputs->piston.force = y0;
        status |= y0 > 3.0 ? SCHEDULED_DAMPER_INNOVATION_LARGE : 0u;
    } else {
        status |= SCHEDULED_DAMPER_OUTPUT_HELD;
        *outputs = state->outputs;
    }
    return status;
}

uint32_t scheduled_damper_step(
    scheduled_damper_state *state,
    const scheduled_damper_inputs *inputs,
    scheduled_damper_outputs *outputs)
{
    uint32_t status = SCHEDULED_DAMPER_NOT_STARTED;

    if (state->started != SCHEDULED_DAMPER_INTERFACE_VERSION) {
        *outputs = (scheduled_damper_outputs){0};
    } else {
        status = scheduled_damper_take(state, inputs);
        if (state->begun == 0u) {
            *outputs = state->outputs;
            status |= SCHEDULED_DAMPER_WAITING;
        } else {
            status |= scheduled_damper_advance(state, outputs);
        }
    }
    return status;
}

#define PERIOD 10000u /* us */

uint32_t scheduled_damper_step_at(
    scheduled_damper_clock *clock,
    scheduled_damper_state *state,
    const scheduled_damper_inputs *inputs,
    scheduled_damper_outputs *outputs,
    uint32_t microseconds)
{
    const uint32_t elapsed = microseconds - clock->last;
    uint32_t status = 0u;
    uint32_t known = 0u;

    if (clock->running != 0u && state->started == SCHEDULED_DAMPER_INTERFACE_VERSION) {
        known = 1u;
    }
    if (known != 0u && elapsed < PERIOD / 2u) {
        *outputs = state->outputs;
        status = SCHEDULED_DAMPER_SAMPLE_REPEATED;
    } else {
        if (known != 0u && elapsed >= PERIOD + PERIOD / 2u) {
            status = SCHEDULED_DAMPER_SAMPLE_LATE;
            lacking(&state->readings[0], (elapsed + PERIOD / 2u) / PERIOD - 1u);
        }
        clock->last = microseconds;
        clock->running = 1u;
        status |= scheduled_damper_step(state, inputs, outputs);
    }
    return status;
}
