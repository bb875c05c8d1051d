/* What is proved of @name@, read by Frama-C's Eva: it takes all values at once, and runs nothing. */
#include <float.h>
#include <string.h>
#include "__fc_builtin.h"
#include "@name@.h"

static @name@_state state;
static @name@_inputs given;
static @name@_outputs outputs;
static @name@_parameters parameters;

static @real@ any_finite(void)
{
    return Frama_C_@real@_interval(-@largest@, @largest@);
}

/* A state of any content, any inputs, any parameters: nothing undefined, whatever the caller did before. */
void any_content(void)
{
    Frama_C_make_unknown((char *)&state, sizeof state);
    Frama_C_make_unknown((char *)&given, sizeof given);
    Frama_C_make_unknown((char *)&parameters, sizeof parameters);
    Frama_C_make_unknown((char *)&outputs, sizeof outputs);
    (void)@name@_set_parameters(&state, &parameters);
    (void)@name@_step(&state, &given, &outputs);
}

/* What holds after init holds after every step, by induction: all that is remembered and given is finite. */
void every_step(void)
{
    Frama_C_make_unknown((char *)&given, sizeof given);
    Frama_C_make_unknown((char *)&parameters, sizeof parameters);
    (void)@name@_init(&state, &parameters);
    @shown_at_first@
    @supposed@
    state.begun = Frama_C_unsigned_int_interval(0u, 1u);
    Frama_C_make_unknown((char *)&outputs, sizeof outputs);
    Frama_C_make_unknown((char *)&parameters, sizeof parameters);
    (void)@name@_set_parameters(&state, &parameters);
    (void)@name@_step(&state, &given, &outputs);
    @shown@
}
