@title@
/* Main program on a POSIX timer: every sample time it reads, steps and writes. Link with -lm. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "@name@.h"

#define PERIOD @nanoseconds@L /* ns */

/* Put the readings of your sensors here. */
static void read_inputs(@name@_inputs *given)
{
    @name@_inputs inputs = {0};
    @read@
    *given = inputs;
}

/* Put the outputs where they act, and decide what a flag of the status word means for your machine. */
static void write_outputs(const @name@_outputs *outputs, uint32_t status)
{
    const uint32_t unsure = @NAME@_INPUT_HELD | @NAME@_INPUT_OUT_OF_RANGE | @NAME@_INPUT_JUMPED | @NAME@_INPUT_STALE |
                            @NAME@_STATE_RESTARTED | @NAME@_OUTPUT_HELD;
    if ((status & unsure) != 0u) {
        (void)fprintf(stderr, "status 0x%lx\n", (unsigned long)status);
    }
    (void)outputs;
}

int main(int count, char *words[])
{
    static @name@_state state;
    struct timespec next;
    const long samples = count > 1 ? strtol(words[1], NULL, 10) : -1L;

    if (@name@_init(&state, NULL) != 0u || clock_gettime(CLOCK_MONOTONIC, &next) != 0) {
        return 1;
    }
    for (long k = 0L; k != samples; ++k) {
        @name@_inputs inputs;
        @name@_outputs outputs;

        read_inputs(&inputs);
        write_outputs(&outputs, @name@_step(&state, &inputs, &outputs));
        next.tv_nsec += PERIOD;
        while (next.tv_nsec >= 1000000000L) {
            next.tv_nsec -= 1000000000L;
            ++next.tv_sec;
        }
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL) == EINTR) {
        }
    }
    return 0;
}
