#ifndef OBSERVER_BY_HAND_H
#define OBSERVER_BY_HAND_H

#include <stdint.h>

#define POINTS 61
#define COLUMNS 31
#define LOWER (-1.5)
#define PER_STEP 20.0

typedef struct {
    double scale;
    double x[4];
    double current;   /* last good one */
    double angle;     /* last good reading */
    double slope;     /* its change in the last sample */
    double candidate; /* last refused reading */
    double mover;     /* current when the reading last changed */
    double given[2];
    uint32_t missed, agreeing, unchanged, moved, seen, begun, started;
} by_hand_state;

void by_hand_init(by_hand_state *s);
uint32_t by_hand_step(by_hand_state *s, const double u[2], double y[2]);

#endif
