@title@
/* Main program on a POSIX timer: every sample time it reads, steps and writes. Link with -lm. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "@name@.h"
#include "@name@_supervisor.h"

#define PERIOD @nanoseconds@L /* ns */

/* Put the readings of your sensors here. */
static void read_inputs(@name@_inputs *given)
{
    @name@_inputs inputs = {0};
    @read@
    *given = inputs;
}

/* Put the outputs where they act; of a command only the share that the supervisor leaves. */
static void write_outputs(const @name@_outputs *outputs, uint32_t status, float share)
{
    if (share < 1.0f) {
        (void)fprintf(stderr, "status 0x%lx, share %g\n", (unsigned long)status, (double)share);
    }
    (void)outputs;
}

int main(int count, char *words[])
{
    static @name@_state state;
    static @name@_supervisor supervisor;
    struct timespec next;
    const long samples = count > 1 ? strtol(words[1], NULL, 10) : -1L;

    if (@name@_init(&state, NULL) != 0u || clock_gettime(CLOCK_MONOTONIC, &next) != 0) {
        return 1;
    }
    for (long k = 0L; k != samples; ++k) {
        @name@_inputs inputs;
        @name@_outputs outputs;

        read_inputs(&inputs);
        const uint32_t status = @name@_step(&state, &inputs, &outputs);
        write_outputs(&outputs, status, @name@_supervise(&supervisor, status));
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
