@title@
/* A timer by micros(): every sample time it reads, steps and writes. For less jitter call the step from a timer interrupt. */
#include <@name@.h>

static @name@_state state;
static @name@_inputs inputs;
static @name@_outputs outputs;
static uint32_t next_time;

/* Put the readings of your sensors here. */
static void read_inputs(void)
{
    @read@
}

/* Put the outputs where they act, and decide what a flag of the status word means for your machine. */
static void write_outputs(uint32_t status)
{
    if ((status & @NAME@_STATE_RESTARTED) != 0u) {
        /* cut the drive */
    }
}

void setup()
{
    (void)@name@_init(&state, 0);
    next_time = micros();
}

void loop()
{
    if ((int32_t)(micros() - next_time) >= 0) {
        next_time += @period@ul;
        if ((int32_t)(micros() - next_time) >= 0) { /* late by a whole period or more: what was missed is not made up for */
            next_time = micros() + @period@ul;
        }
        read_inputs();
        write_outputs(@name@_step(&state, &inputs, &outputs));
    }
}
