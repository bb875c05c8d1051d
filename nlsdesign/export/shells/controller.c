@title@
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

@guards@
void @name@_defaults(@name@_parameters *parameters)
{
    *parameters = start_parameters;
}

@set_parameters@
{
    uint32_t status = 0u;

    @assignments@
    return status;
}

@init@
{
    state->parameters = start_parameters;
    state->states = start_states;
    state->inputs = start_inputs;
    state->outputs = start_outputs;
    return parameters == NULL ? 0u : @name@_set_parameters(state, parameters);
}

@step@
{
    uint32_t status = 0u;

    @body@
    return status;
}
