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
    double last[2];
    double given[2];
} by_hand_state;

void by_hand_init(by_hand_state *s);
uint32_t by_hand_step(by_hand_state *s, const double u[2], double y[2]);

#endif
