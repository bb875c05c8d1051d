/* The observer of observer_step.py as an engineer writes it: arrays and loops. With GUARDED the same guards as in the
   generated code. The table comes from the program that compiles this file. */
#include <math.h>
#include <stdint.h>

#include "observer_by_hand.h"

static const double table[POINTS][COLUMNS] =
#include "observer_table.h"
    ;

enum {
    HELD = 0x1, SATURATED = 0x2, RESTARTED = 0x4, OUTPUT_HELD = 0x8, OUT_OF_RANGE = 0x20, JUMPED = 0x40,
    STALE = 0x80, RECOVERED = 0x200, WAITING = 0x400, NOT_STARTED = 0x800, ANGLE = 0x10000, CURRENT = 0x20000
};
#define MAGIC 0x62793031u
#define CHANGE (25.0 * 1e-3 + 1.5e-3) /* rad in a sample */
#define PATIENCE 50u                  /* samples without change, after which an encoder is stale */

void by_hand_init(by_hand_state *s)
{
    *s = (by_hand_state){.scale = 1.0, .started = MAGIC};
}

#if GUARDED
static double current_of(by_hand_state *s, double given, uint32_t *status)
{
    if (given >= -20.0 && given <= 20.0) {
        s->current = given;
    } else if (given - given == 0.0) {
        s->current = given < 0.0 ? -20.0 : 20.0;
        *status |= SATURATED | CURRENT;
    } else {
        *status |= HELD | CURRENT;
    }
    return s->current;
}

static double angle_of(by_hand_state *s, double given, uint32_t *status)
{
    uint32_t flaw = 0u;

    if (!(given >= -1.5 && given <= 1.5)) {
        s->agreeing = 0u;
        flaw = given - given == 0.0 ? OUT_OF_RANGE : HELD;
    } else if (!s->seen || fabs(given - s->angle) <= CHANGE * (s->missed + 1.0)) {
        s->agreeing = 0u;
    } else {
        s->agreeing = fabs(given - s->candidate) <= CHANGE ? s->agreeing + 1u : 1u;
        s->candidate = given;
        flaw = s->agreeing < 3u ? JUMPED : 0u;
    }
    if (flaw) {
        s->missed += s->missed < 1000000u;
        const double ahead = s->angle + (s->missed < 3u ? s->missed : 3u) * s->slope;
        *status |= flaw | ANGLE;
        return ahead < -1.5 ? -1.5 : ahead > 1.5 ? 1.5 : ahead;
    }
    const int same = s->seen && given >= s->angle && given <= s->angle;
    if (s->missed || (!same && s->moved && s->unchanged >= PATIENCE)) {
        *status |= RECOVERED | ANGLE;
    }
    s->slope = s->seen && !s->missed && !s->agreeing ? given - s->angle : 0.0;
    if (same) {
        s->unchanged += s->unchanged < 1000000u;
        s->moved |= fabs(s->current - s->mover) > 0.5;
    } else {
        s->unchanged = s->moved = 0u;
        s->mover = s->current;
    }
    if (s->moved && s->unchanged >= PATIENCE) {
        *status |= STALE | ANGLE;
    }
    s->angle = given;
    s->missed = s->agreeing = 0u;
    s->seen = 1u;
    return given;
}
#endif

uint32_t by_hand_step(by_hand_state *s, const double u[2], double y[2])
{
    uint32_t status = 0u;
    double w[COLUMNS], next[4];

#if GUARDED
    if (s->started != MAGIC) {
        y[0] = y[1] = 0.0;
        return NOT_STARTED;
    }
    const double current = current_of(s, u[1], &status);
    const double in[2] = {angle_of(s, u[0], &status), current};
    s->begun |= s->seen;
    if (!s->begun) {
        y[0] = s->given[0];
        y[1] = s->given[1];
        return status | WAITING;
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
        for (int i = 0; i < 4; ++i) {
            s->x[i] = 0.0;
        }
        s->begun = 0u;
        status |= RESTARTED;
    }
    if ((torque - torque) + (speed - speed) == 0.0) {
        y[0] = s->given[0] = torque;
        y[1] = s->given[1] = speed;
    } else {
        status |= OUTPUT_HELD;
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
