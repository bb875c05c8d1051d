/* scheduled damper: Force of a damper whose viscosity depends on speed. Generated; do not edit. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>

#define MODEL_TOKEN "{token}"
#define MODEL_LARGEST DBL_MAX
#define MODEL_CONTINUOUS 0
#define MODEL_STATES 1
#define MODEL_INPUTS 2
#define MODEL_PARAMETERS 1
#define MODEL_X 1
#define MODEL_D 2
#define MODEL_U 2
#define MODEL_P 4
#define MODEL_Y 5
#define MODEL_S 6
#define MODEL_Z 7
#define MODEL_M 7
#define MODEL_SWITCHES 0
#define MODEL_EXTRA 7
#define MODEL_VALUES 8
#define MODEL_SAMPLE_TIME 0.01

typedef struct {
    const char *name;
    double start, lowest, highest;
} variable;

/* By value reference. */
static const variable model_variable[MODEL_VALUES] = {
    {"time", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"piston.filtered", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"piston.speed", 0.0, -1.0, 1.0},
    {"valve.opening", 1.0, 0.0, 1.0},
    {"memory.gain", 0.75, 0.0, 10.0},
    {"piston.force", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"force.squared", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"sample.time", 0.01, -1.7976931348623157e+308, 1.7976931348623157e+308},
};

#include "scheduled_damper.c"

typedef scheduled_damper_state model_memory;

static void model_tune(model_memory *memory, const double p[])
{
    scheduled_damper_parameters parameters;

    scheduled_damper_defaults(&parameters);
    parameters.memory.gain = p[0];
    (void)scheduled_damper_set_parameters(memory, &parameters);
    (void)p;
}

static void model_start(model_memory *memory, const double x[], const double p[])
{
    (void)scheduled_damper_init(memory, NULL);
    memory->states.piston.filtered = x[0];
    model_tune(memory, p);
    for (int i = 0; i < MODEL_STATES; ++i) { /* states that were set are not taken from the first readings */
        if (x[i] < model_variable[MODEL_X + i].start || x[i] > model_variable[MODEL_X + i].start) {
            memory->begun = 1u;
        }
    }
    (void)x;
}

/* One sample. The states that are shown are those that its outputs came from. */
static int32_t model_sample(model_memory *memory, const double u[], double x[], double y[],
                            double s[])
{
    scheduled_damper_inputs inputs = {0};
    scheduled_damper_outputs outputs = {0};

    inputs.piston.speed = u[0];
    inputs.valve.opening = u[1];
    uint32_t status = scheduled_damper_take(memory, &inputs);
    const scheduled_damper_states before = memory->states;
    if (memory->begun == 0u) {
        outputs = memory->outputs;
        status |= SCHEDULED_DAMPER_WAITING;
    } else {
        status |= scheduled_damper_advance(memory, &outputs);
    }
    x[0] = before.piston.filtered;
    y[0] = outputs.piston.force;
    const double raw_0 = (memory->inputs.piston.speed + 1.0) * 1.0;
    const double above_0 = raw_0 > 0.0 ? raw_0 : 0.0; /* NaN becomes the lower end */
    const double place_0 = above_0 < 2.0 ? above_0 : 2.0;
    const int32_t floor_0 = (int32_t)place_0;
    const int32_t left_0 = floor_0 < 1 ? floor_0 : 1;
    const double share_0 = place_0 - (double)left_0;
    const double *const row_0 = table_0[left_0];
    const double *const row_0_next = table_0[left_0 + 1];
    const double w0 = row_0[0] + share_0 * (row_0_next[0] - row_0[0]);
    const double a7 = w0 * memory->inputs.piston.speed + memory->parameters.memory.gain * before.piston.filtered;
    const double a8 = memory->inputs.valve.opening * a7;
    s[0] = a8 * a8;
    (void)before, (void)u, (void)x, (void)y, (void)s;
    return (int32_t)status;
}

/* How outputs and signals of the last sample change with the states before it, the inputs that it took and the
   parameters. Gives 0 where guards have put something else in the place of an input or output. */
static int model_directional(const model_memory *memory, int32_t status, const double x[], const double dx[],
                             const double du[], const double dp[], double dy[], double ds[])
{
    if (((uint32_t)status & ~(SCHEDULED_DAMPER_OUT_OF_TABLE | SCHEDULED_DAMPER_INNOVATION_LARGE)) != 0u) {
        return 0;
    }
    const double raw_0 = (memory->inputs.piston.speed + 1.0) * 1.0;
    const double above_0 = raw_0 > 0.0 ? raw_0 : 0.0; /* NaN becomes the lower end */
    const double place_0 = above_0 < 2.0 ? above_0 : 2.0;
    const int32_t floor_0 = (int32_t)place_0;
    const int32_t left_0 = floor_0 < 1 ? floor_0 : 1;
    const double share_0 = place_0 - (double)left_0;
    const double *const row_0 = table_0[left_0];
    const double *const row_0_next = table_0[left_0 + 1];
    const double w0 = row_0[0] + share_0 * (row_0_next[0] - row_0[0]);
    const double per_0 = raw_0 > 0.0 && raw_0 < 2.0 ? 1.0 : 0.0;
    const double slope0 = (row_0_next[0] - row_0[0]) * per_0;
    const double dw0 = slope0 * du[0];
    const double a9 = w0 * memory->inputs.piston.speed + memory->parameters.memory.gain * x[0];
    const double a10 = memory->inputs.valve.opening * a9;
    const int a12 = a10 <= 2.0;
    const double a15 = (a12 ? 1.0 : 0.0) / ((a12 ? 1.0 : 0.0) + (2.0 <= a10 ? 1.0 : 0.0));
    const double a28 = memory->inputs.piston.speed * dw0 + w0 * du[0] + (x[0] * dp[0] + memory->parameters.memory.gain * dx[0]);
    const double a30 = a9 * du[1] + memory->inputs.valve.opening * a28;
    const double a35 = exp(-memory->inputs.piston.speed);
    dy[0] = (memory->inputs.piston.speed < 0.0) ? a15 * a30 : a35 * a30 - a10 * (a35 * du[0]);
    ds[0] = 2.0 * a10 * a30;
    (void)memory, (void)x, (void)dx, (void)du, (void)dp, (void)dy, (void)ds;
    return 1;
}

