/* Calls what a controller would call, with functions that do nothing where that is asked for: the difference of two
   images is what the controller adds. */
#include <stddef.h>

#include "@name@.h"
#include "target.h"

#if @present@ == 0
uint32_t @name@_init(@name@_state *state, const @name@_parameters *parameters)
{
    (void)state;
    return parameters == NULL ? 0u : 1u;
}

uint32_t @name@_step(@name@_state *state, const @name@_inputs *inputs, @name@_outputs *outputs)
{
    (void)state;
    (void)inputs;
    (void)outputs;
    return 0u;
}
#endif

void run(void)
{
    static @name@_state state;
    static @name@_inputs inputs;
    static @name@_outputs outputs;

    say_number(@name@_init(&state, NULL));
    for (;;) {
        say_number(@name@_step(&state, &inputs, &outputs));
    }
}
