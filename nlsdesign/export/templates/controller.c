@title@
#include <float.h>
#include <math.h>
#include <stddef.h>

#include "@name@.h"

#ifdef __FAST_MATH__
#error "the guards need IEEE arithmetic: compile without -ffast-math"
#endif

@tables@
static const @name@_parameters start_parameters = {
    @start_parameters@
};

static const @name@_states start_states = {
    @start_states@
};

static const @name@_inputs start_inputs = {
    @start_inputs@
};

static const @name@_outputs start_outputs = {
    @start_outputs@
};

@default_block@
@guards@
void @name@_defaults(@name@_parameters *parameters)
{
    *parameters = start_parameters;
}

@derive@
@set_parameters@
{
    uint32_t status = 0u;

    if (state->started != @NAME@_INTERFACE_VERSION) {
        status = @NAME@_NOT_STARTED;
    } else {
        @assignments@
        @derived@
    }
    return status;
}

@block_check@
@init@
{
    state->parameters = start_parameters;
    state->states = start_states;
    state->inputs = start_inputs;
    state->outputs = start_outputs;
    @take_block@
    @start_readings@
    state->begun = 0u;
    state->started = @NAME@_INTERFACE_VERSION;
    @derived@
    return parameters == NULL ? 0u : @name@_set_parameters(state, parameters);
}

@load@
@settled@
/* Takes the inputs of a sample; begins with the first usable readings. */
static uint32_t @name@_take(@name@_state *state, const @name@_inputs *inputs)
{
    uint32_t status = 0u;

    @take@
    return status;
}

/* Computes the outputs of this sample and the state of the next from the inputs that were taken. */
static uint32_t @name@_advance(@name@_state *state, @name@_outputs *outputs)
{
    uint32_t status = 0u;

    @body@
    return status;
}

@step@
{
    uint32_t status = @NAME@_NOT_STARTED;

    if (state->started != @NAME@_INTERFACE_VERSION) {
        *outputs = (@name@_outputs){0};
    } else {
        status = @name@_take(state, inputs);
        if (state->begun == 0u) {
            *outputs = state->outputs;
            status |= @NAME@_WAITING;
        } else {
            status |= @name@_advance(state, outputs);
        }
    }
    @noted@
    return status;
}

#define PERIOD @period@u /* us */

@step_at@
{
    const uint32_t elapsed = microseconds - clock->last;
    uint32_t status = 0u;
    uint32_t known = 0u;

    if (clock->running != 0u && state->started == @NAME@_INTERFACE_VERSION) {
        known = 1u;
    }
    if (known != 0u && elapsed < PERIOD / 2u) {
        *outputs = state->outputs;
        status = @NAME@_SAMPLE_REPEATED;
    } else {
        if (known != 0u && elapsed >= PERIOD + PERIOD / 2u) {
            status = @NAME@_SAMPLE_LATE;
            @missed@
        }
        clock->last = microseconds;
        clock->running = 1u;
        status |= @name@_step(state, inputs, outputs);
    }
    return status;
}
