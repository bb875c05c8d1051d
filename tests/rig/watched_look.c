/* The monitor beside the loop of `watched_bench`: says when it first found a change, and how often. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "watched_names.h"

typedef struct {
    double motor, load, current;
} reading;

static watch_state state;
static double commission, first = INFINITY;
static uint32_t judged, before, bits;
static long alarms, usable;
static const char *file = "";

void look_begin(int argc, char **argv)
{
    commission = argc > 24 ? atof(argv[24]) : 0.0;
    file = argc > 25 ? argv[25] : "";
    watch_init(&state);
}

void look(double time, const reading *read)
{
    watch_residuals_inputs inputs;
    TAKE_READINGS
    const uint32_t word = watch_step(&state, &inputs, 0);
    if (commission > 0.0 && time >= commission) {
        if (watch_commission(&state) == 0u) {
            (void)fprintf(stderr, "too little evidence\n");
            exit(3);
        }
        commission = 0.0;
        before = 0u;
        judged = state.record.judged;
        return;
    }
    if (state.record.judged != judged) {
        judged = state.record.judged;
        usable += (word & WATCH_LITTLE_EVIDENCE) == 0u;
        if (commission > 0.0) {
            return;
        }
        if ((word & WATCH_CHANGED) != 0u && (before & WATCH_CHANGED) == 0u) {
            ++alarms;
            if (time < first) {
                first = time;
                bits = word;
            }
            if (getenv("WATCH_TOLD") != NULL) {
                (void)fprintf(stderr, "%.1f %x\n", time, (unsigned)word);
            }
        }
        before = word;
    }
}

void look_end(void)
{
    watch_seal(&state.record);
    if (file[0] != '\0') {
        FILE *const out = fopen(file, "wb");
        if (out == NULL || fwrite(&state.record, sizeof state.record, 1, out) != 1) {
            exit(4);
        }
        (void)fclose(out);
    }
    (void)printf("%.3f %x %ld %lu %ld\n", first, (unsigned)bits, alarms, (unsigned long)judged, usable);
}
