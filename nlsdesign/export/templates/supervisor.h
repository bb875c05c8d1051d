/* A supervisor of @name@: from the flags of the status word, what share of the command may act. A usual rule to begin with:
   change it where your machine needs another. */
#ifndef @NAME@_SUPERVISOR_H
#define @NAME@_SUPERVISOR_H

#include <stdint.h>

#include "@name@.h"

#define @NAME@_DERATE_AFTER 5u /* faulty samples, less the good ones since, up to which the whole command acts */
#define @NAME@_CUT_AFTER 10u /* faulty samples, less the good ones since, from which nothing acts until it is reset */

/* All zero at the start; the caller owns it. */
typedef struct {
    uint32_t faulty; /* samples with a refused reading, less the good ones since */
    uint32_t cut; /* 1 from a cut on */
} @name@_supervisor;

/* Takes the status word of a sample. Returns the share of the command that may act, 0 to 1. */
static inline float @name@_supervise(@name@_supervisor *supervisor, uint32_t status)
{
    const uint32_t grave = @NAME@_STATE_RESTARTED | @NAME@_INPUT_STALE;
    const uint32_t faulty = @NAME@_INPUT_HELD | @NAME@_INPUT_OUT_OF_RANGE | @NAME@_INPUT_JUMPED | @NAME@_OUTPUT_HELD;
    const uint32_t absent = @NAME@_WAITING | @NAME@_NOT_STARTED;
    const uint32_t steps = @NAME@_CUT_AFTER - @NAME@_DERATE_AFTER;
    float share = 1.0f;

    if ((status & faulty) != 0u) {
        supervisor->faulty = supervisor->faulty + 1u;
    } else if (supervisor->faulty > 0u) {
        supervisor->faulty = supervisor->faulty - 1u;
    } else {
        /* clean for long */
    }
    if ((status & grave) != 0u || supervisor->faulty >= @NAME@_CUT_AFTER) {
        supervisor->faulty = 0u;
        supervisor->cut = 1u;
    }
    if (supervisor->cut != 0u || (status & absent) != 0u) {
        share = 0.0f;
    } else if (supervisor->faulty > @NAME@_DERATE_AFTER) {
        const uint32_t remaining = @NAME@_CUT_AFTER - supervisor->faulty;

        share = (float)remaining / (float)steps;
    } else {
        /* the whole command acts */
    }
    return share;
}

#endif
