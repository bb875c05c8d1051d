#include <stddef.h>
#include "@name@.h"
#ifdef _WIN32
#define GIVEN __declspec(dllexport)
#else
#define GIVEN __attribute__((visibility("default")))
#endif
static void taken(@name@_parameters *to, const @real@ p[])
{
    @name@_defaults(to);
    (void)p;
    @parameters@
}
GIVEN size_t adapter_size(void) { return sizeof(@name@_state); }
GIVEN uint32_t adapter_set_parameters(@name@_state *state, const @real@ p[])
{
    @name@_parameters parameters;
    taken(&parameters, p);
    return @name@_set_parameters(state, &parameters);
}
GIVEN uint32_t adapter_init(@name@_state *state, const @real@ p[])
{
    @name@_parameters parameters;
    if (p != NULL) {
        taken(&parameters, p);
    }
    return @name@_init(state, p != NULL ? &parameters : NULL);
}
GIVEN uint32_t adapter_step(@name@_state *state, const @real@ u[], @real@ y[])
{
    @name@_inputs inputs = {0};
    @name@_outputs outputs = {0};
    (void)u, (void)y;
    @inputs@
    const uint32_t status = @name@_step(state, &inputs, &outputs);
    @outputs@
    return status;
}
GIVEN void adapter_states(const @name@_state *state, @real@ x[])
{
    (void)state, (void)x;
    @states@
}
