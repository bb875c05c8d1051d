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
static double portable_power_of_two(uint64_t biased)
{
    const uint64_t bits = biased << 52u;
    double power;

    (void)memcpy(&power, &bits, sizeof power);
    return power;
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
    const double shifted = x * 1.4426950408889634 + 6755399441055744.0;

    (void)memcpy(bits, &shifted, sizeof shifted);
    return shifted - 6755399441055744.0;
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
};

static const scheduled_damper_outputs start_outputs = {
    .piston.force = 0.0,
};

/* Keeps one input usable: held at its last good value while it is not finite, saturated outside its range. */
static double usable(double given, double lowest, double highest, double *last, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *last = given;
    } else if (given - given == 0.0) { /* finite: NaN and the infinities give NaN here */
        *last = given < lowest ? lowest : highest;
        *status |= SCHEDULED_DAMPER_INPUT_SATURATED | which;
    } else {
        *status |= SCHEDULED_DAMPER_INPUT_HELD | which;
    }
    return *last;
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

    take_over(parameters->memory.gain, 0.0, 10.0, &state->parameters.memory.gain, 0x100u, &status);
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

    const double u0 = usable(inputs->piston.speed, -1.0, 1.0, &state->inputs.piston.speed, 0x100u, &status);
    const double x0 = state->states.piston.filtered;
    const double p0 = state->parameters.memory.gain;
    const double raw_0 = (u0 + 1.0) * 1.0;
    const double above_0 = raw_0 > 0.0 ? raw_0 : 0.0; /* NaN becomes the lower end */
    const double place_0 = above_0 < 2.0 ? above_0 : 2.0;
    const int32_t floor_0 = (int32_t)place_0;
    const int32_t left_0 = floor_0 < 1 ? floor_0 : 1;
    const double share_0 = place_0 - (double)left_0;
    const double *const row_0 = table_0[left_0];
    const double *const row_0_next = table_0[left_0 + 1];
    const double w0 = row_0[0] + share_0 * (row_0_next[0] - row_0[0]);
    const double a13 = w0 * u0 + p0 * x0;
    const double f0 = 0.5 * x0 + 0.25 * u0;
    const double y0 = (u0 < 0.0) ? (a13 < 2.0 ? a13 : 2.0) : portable_exp(-u0) * a13;

    if ((f0 - f0) == 0.0) {
        state->states.piston.filtered = f0;
    } else {
        status |= SCHEDULED_DAMPER_STATE_HELD;
    }
    if ((y0 - y0) == 0.0) {
        outputs->piston.force = state->outputs.piston.force = y0;
    } else {
        status |= SCHEDULED_DAMPER_OUTPUT_HELD;
        *outputs = state->outputs;
    }
    return status;
}
