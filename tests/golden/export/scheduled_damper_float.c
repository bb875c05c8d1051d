/* scheduled damper: Force of a damper whose viscosity depends on speed
   Sample time 0.01 s; all numbers in SI units, given in brackets.
   Written by nlsdesign (version) with CasADi (version); do not edit. */
#include <math.h>
#include <stddef.h>

#include "scheduled_damper.h"

#ifdef __FAST_MATH__
#error "the guards need IEEE arithmetic: compile without -ffast-math"
#endif

/* Elementary functions of our own: the same bits on every processor with IEEE arithmetic, as long as the compiler
   forms no fused multiply-add (-ffp-contract=off). An ulp is a unit of the last place. */
#include <string.h>

/* 2^(exponent - bias) from its biased exponent, which lies in the lowest bits. */
static float portable_power_of_twof(uint32_t biased)
{
    const uint32_t bits = biased << 23u;
    float power;

    (void)memcpy(&power, &bits, sizeof power);
    return power;
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
    const float shifted = x * 1.442695f + 1.2582912e+07f;

    (void)memcpy(bits, &shifted, sizeof shifted);
    return shifted - 1.2582912e+07f;
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
};

static const scheduled_damper_outputs start_outputs = {
    .piston.force = 0.0f,
};

/* Keeps one input usable: held at its last good value while it is not finite, saturated outside its range. */
static float usable(float given, float lowest, float highest, float *last, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *last = given;
    } else if (given - given == 0.0f) { /* finite: NaN and the infinities give NaN here */
        *last = given < lowest ? lowest : highest;
        *status |= SCHEDULED_DAMPER_INPUT_SATURATED | which;
    } else {
        *status |= SCHEDULED_DAMPER_INPUT_HELD | which;
    }
    return *last;
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

    take_over(parameters->memory.gain, 0.0f, 10.0f, &state->parameters.memory.gain, 0x100u, &status);
    return status;
}

uint32_t scheduled_damper_init(scheduled_damper_state *state, const scheduled_damper_parameters *parameters)
{
    state->parameters = start_parameters;
    state->states = start_states;
    state->inputs = start_inputs;
    state->outputs = start_outputs;
    return parameters == NULL ? 0u : scheduled_damper_set_parameters(state, parameters);
}

uint32_t scheduled_damper_step(
    scheduled_damper_state *state,
    const scheduled_damper_inputs *inputs,
    scheduled_damper_outputs *outputs)
{
    uint32_t status = 0u;

    const float u0 = usable(inputs->piston.speed, -1.0f, 1.0f, &state->inputs.piston.speed, 0x100u, &status);
    const float x0 = state->states.piston.filtered;
    const float p0 = state->parameters.memory.gain;
    const float raw_0 = (u0 + 1.0f) * 1.0f;
    const float above_0 = raw_0 > 0.0f ? raw_0 : 0.0f; /* NaN becomes the lower end */
    const float place_0 = above_0 < 2.0f ? above_0 : 2.0f;
    const int32_t floor_0 = (int32_t)place_0;
    const int32_t left_0 = floor_0 < 1 ? floor_0 : 1;
    const float share_0 = place_0 - (float)left_0;
    const float *const row_0 = table_0[left_0];
    const float *const row_0_next = table_0[left_0 + 1];
    const float w0 = row_0[0] + share_0 * (row_0_next[0] - row_0[0]);
    const float a13 = w0 * u0 + p0 * x0;
    const float f0 = 0.5f * x0 + 0.25f * u0;
    const float y0 = (u0 < 0.0f) ? (a13 < 2.0f ? a13 : 2.0f) : portable_expf(-u0) * a13;

    if ((f0 - f0) == 0.0f) {
        state->states.piston.filtered = f0;
    } else {
        status |= SCHEDULED_DAMPER_STATE_HELD;
    }
    if ((y0 - y0) == 0.0f) {
        outputs->piston.force = state->outputs.piston.force = y0;
    } else {
        status |= SCHEDULED_DAMPER_OUTPUT_HELD;
        *outputs = state->outputs;
    }
    return status;
}
