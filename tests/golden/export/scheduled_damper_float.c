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
    float number;
    uint32_t bits;
} portable_number;

/* 2^(exponent - bias) from its biased exponent, which lies in the lowest bits. */
static float portable_power_of_twof(uint32_t biased)
{
    portable_number power;

    power.bits = biased << 23u;
    return power.number;
}

/* exp(r) - 1 for |r| up to half of ln 2. */
static float portable_expm1_kernelf(float r)
{
    const float polynomial = 0.5f + r * (0.16666506f + r * (0.041666165f + r * (0.008370322f + r * (0.0013953072f))));

    return r + r * r * polynomial;
}

/* x / ln 2, rounded to an integer that stands in the lowest bits; other bits are those of 1.2582912e+07f. */
static float portable_binary_exponentf(float x, uint32_t *bits)
{
    portable_number shifted;

    shifted.number = x * 1.442695f + 1.2582912e+07f;
    *bits = shifted.bits;
    return shifted.number - 1.2582912e+07f;
}

/* exp(x); at most 1.1 ulp. NaN stays NaN, what is too large becomes infinite, what is too small zero. */
static float portable_expf(float x)
{
    const float above = x < -104.0f ? -104.0f : x;
    const float inside = above > 89.0f ? 89.0f : above;
    uint32_t bits;
    const float n = portable_binary_exponentf(inside, &bits);
    const float r = (inside - n * 0.69314575f) - n * 1.4286068e-06f;
    const float result = 1.0f + portable_expm1_kernelf(r);
    const uint32_t both = bits - 1262485250u;
    const uint32_t half = both >> 1;

    return result * portable_power_of_twof(half) * portable_power_of_twof(both - half);
}

/* Over piston.speed from -1.0 by 1.0: viscosity [N*s/m] */
static const float table_0[3][1] = {
    {3.0f},
    {2.0f},
    {4.0f},
};

static const scheduled_damper_parameters start_parameters = {
    .memory.gain = 0.75f,
};

static const scheduled_damper_states start_states = {
    .piston.filtered = 0.0f,
};

static const scheduled_damper_inputs start_inputs = {
    .piston.speed = 0.0f,
    .valve.opening = 1.0f,
};

static const scheduled_damper_outputs start_outputs = {
    .piston.force = 0.0f,
};

/* Keeps one command usable: held at its last good value while it is not finite, saturated outside its range. */
static void usable(float given, float lowest, float highest, float *last, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *last = given;
    } else if (given >= -FLT_MAX && given <= FLT_MAX) {
        *last = given < lowest ? lowest : highest;
        *status |= SCHEDULED_DAMPER_INPUT_SATURATED | which;
    } else {
        *status |= SCHEDULED_DAMPER_INPUT_HELD | which;
    }
}

/* Follows one command as fast as the drive can; the first one is taken as it is. */
static void followed(float given, float lowest, float highest, float change, float *last, uint32_t which,
                     uint32_t *status)
{
    float wanted = *last;

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
    float lowest;
    float highest;
    float change;
    float noticeable;
    uint32_t patience;
} reading_limits;

static const reading_limits reading_0 = {-1.0f, 1.0f, 0.06f, 0.1f, 25u};

/* Takes a reading if it can be true, else what the last ones let expect. Refused readings that agree with one
   another 3 times in a row are believed. Returns whether the model has to resume after a gap. */
static uint32_t plausible(float given, float mover, const reading_limits *can, scheduled_damper_reading *seen, float *used,
                          uint32_t which, uint32_t *status)
{
    uint32_t flaw = 0u;
    uint32_t resuming = 0u;

    if (!(given >= can->lowest && given <= can->highest)) {
        seen->agreeing = 0u;
        flaw = SCHEDULED_DAMPER_INPUT_HELD;
        if (given >= -FLT_MAX && given <= FLT_MAX) {
            flaw = SCHEDULED_DAMPER_INPUT_OUT_OF_RANGE;
        }
    } else if (seen->seen == 0u || fabsf(given - seen->last) <= can->change * ((float)seen->missed + (float)1)) {
        seen->agreeing = 0u;
    } else {
        if (!(fabsf(given - seen->candidate) <= can->change)) {
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
        const float ahead = seen->last + (float)(seen->missed < 3u ? seen->missed : 3u) * seen->slope;
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
        seen->slope = (seen->seen != 0u && seen->missed == 0u && seen->agreeing == 0u) ? given - seen->last : 0.0f;
        if (same == 0u) {
            seen->unchanged = 0u;
            seen->moved = 0u;
            seen->mover = mover;
        } else {
            seen->unchanged = seen->unchanged < 1000000u ? seen->unchanged + 1u : 1000000u;
            if (fabsf(mover - seen->mover) > can->noticeable) {
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
static void take_over(float given, float lowest, float highest, float *taken, uint32_t which, uint32_t *status)
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
        take_over(parameters->memory.gain, 0.0f, 10.0f, &state->parameters.memory.gain, 0x10000u, &status);
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
    const float u0 = state->inputs.piston.speed;
    state->states.piston.filtered = u0;
}

/* Sets the states of a machine that goes on after a gap in its readings. */
static void scheduled_damper_resume(scheduled_damper_state *state)
{
    const float u0 = state->inputs.piston.speed;
    const float x0 = state->states.piston.filtered;
    state->states.piston.filtered = x0 < u0 ? x0 : u0;
}

/* Takes the inputs of a sample; begins with the first usable readings. */
static uint32_t scheduled_damper_take(scheduled_damper_state *state, const scheduled_damper_inputs *inputs)
{
    uint32_t status = 0u;

    uint32_t resuming = 0u;
    followed(inputs->valve.opening, 0.0f, 1.0f, state->begun == 0u ? 3.4028235e+38f : 0.3f, &state->inputs.valve.opening, 0x20000u, &status);
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

    const float u0 = state->inputs.piston.speed;
    const float u1 = state->inputs.valve.opening;
    const float x0 = state->states.piston.filtered;
    const float p0 = state->parameters.memory.gain;
    const float q0 = state->readings[0].missed > 0u ? 1.0f : 0.0f;
    status |= (u0 < -1.0f || u0 > 1.0f) ? SCHEDULED_DAMPER_OUT_OF_TABLE : 0u;
    const float raw_0 = (u0 + 1.0f) * 1.0f;
    const float above_0 = raw_0 > 0.0f ? raw_0 : 0.0f; /* NaN becomes the lower end */
    const float place_0 = above_0 < 2.0f ? above_0 : 2.0f;
    const int32_t floor_0 = (int32_t)place_0;
    const int32_t left_0 = floor_0 < 1 ? floor_0 : 1;
    const float share_0 = place_0 - (float)left_0;
    const float *const row_0 = table_0[left_0];
    const float *const row_0_next = table_0[left_0 + 1];
    const float w0 = row_0[0] + share_0 * (row_0_next[0] - row_0[0]);
    const float a10 = (0.5f < q0) ? x0 : u0;
    const float a21 = u1 * (w0 * a10 + p0 * x0);
    const float f0 = 0.5f * x0 + 0.25f * a10;
    const float y0 = (a10 < 0.0f) ? (a21 < 2.0f ? a21 : 2.0f) : portable_expf(-a10) * a21;

    if ((f0 - f0) >= 0.0f) {
        state->states.piston.filtered = f0;
    } else {
        state->states = start_states;
        state->begun = 0u;
        status |= SCHEDULED_DAMPER_STATE_RESTARTED;
    }
    if ((y0 - y0) >= 0.0f) {
        state->outputs.piston.force = y0;
        outputs->piston.force = y0;
        status |= y0 > 3.0f ? SCHEDULED_DAMPER_INNOVATION_LARGE : 0u;
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
