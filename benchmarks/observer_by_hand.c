/* The observer of observer_step.py as an engineer writes it: arrays and loops. With GUARDED the same guards as in the
   generated code. The table comes from the program that compiles this file. */
#include <stdint.h>

#include "observer_by_hand.h"

static const double table[POINTS][COLUMNS] =
#include "observer_table.h"
    ;

void by_hand_init(by_hand_state *s)
{
    *s = (by_hand_state){.scale = 1.0};
}

uint32_t by_hand_step(by_hand_state *s, const double u[2], double y[2])
{
    uint32_t status = 0;
    double w[COLUMNS], next[4];

#if GUARDED
    static const double limit[2] = {1.5, 20.0};
    double in[2];
    for (int i = 0; i < 2; ++i) {
        if (u[i] >= -limit[i] && u[i] <= limit[i]) {
            s->last[i] = u[i];
        } else if (u[i] - u[i] == 0.0) {
            s->last[i] = u[i] < 0.0 ? -limit[i] : limit[i];
            status |= 2u | 0x100u << i;
        } else {
            status |= 1u | 0x100u << i;
        }
        in[i] = s->last[i];
    }
#else
    const double *in = u;
#endif

    double place = (in[0] - LOWER) * PER_STEP;
    place = place > 0.0 ? place : 0.0;
    place = place < POINTS - 1 ? place : POINTS - 1;
    int32_t left = (int32_t)place;
    left = left < POINTS - 2 ? left : POINTS - 2;
    const double share = place - left;
    for (int c = 0; c < COLUMNS; ++c) {
        w[c] = table[left][c] + share * (table[left + 1][c] - table[left][c]);
    }

    const double *a = w, *b = w + 16, *l = w + 20;
    const double extension = w[28], lever = w[29], force = w[30];
    const double e0 = s->scale * (extension - s->x[1]), e1 = s->scale * (in[0] - s->x[2]);
    for (int i = 0; i < 4; ++i) {
        next[i] = b[i] * in[1] + l[2 * i] * e0 + l[2 * i + 1] * e1;
        for (int j = 0; j < 4; ++j) {
            next[i] += a[4 * i + j] * s->x[j];
        }
    }
    const double torque = 2.0 * lever * (s->x[0] + force), speed = s->x[3];

#if GUARDED
    if ((next[0] - next[0]) + (next[1] - next[1]) + (next[2] - next[2]) + (next[3] - next[3]) == 0.0) {
        for (int i = 0; i < 4; ++i) {
            s->x[i] = next[i];
        }
    } else {
        status |= 4u;
    }
    if ((torque - torque) + (speed - speed) == 0.0) {
        y[0] = s->given[0] = torque;
        y[1] = s->given[1] = speed;
    } else {
        status |= 8u;
        y[0] = s->given[0];
        y[1] = s->given[1];
    }
#else
    for (int i = 0; i < 4; ++i) {
        s->x[i] = next[i];
    }
    y[0] = torque;
    y[1] = speed;
#endif
    return status;
}
