/* Two machines under a digital loop in ordinary use, as compiled code; the equations are those of `bench` and
   `two_bodies`, and no model code is shared with the package.

   Arguments: seed, seconds, second of the change, then ten numbers for the machine as built and ten for the machine
   after the change: factors of friction, stiffness, inertia, damping, torque per ampere, relaxation time and weight,
   friction that goes with the load (share), constant effort (N m), delay of the drive (s). Then, for what looks, the
   second of commissioning and a file; then, for a current that is given in place of the loop, which of `given`, its size
   (A), its frequency (Hz), and 1 where it runs straight between samples instead of being held. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "machine.h" /* tables and numbers, written by `watched` */

enum { FRICTION, STIFFNESS, INERTIA, DAMPING, TORQUE, RELAXATION, WEIGHT, LOAD_FRICTION, OFFSET, DELAY, NUMBERS };

typedef struct {
    double motor, load, current; /* as read: angles in whole counts, current with its noise */
} reading;

/* What looks at the readings: given by the program that this file is linked with. */
extern void look_begin(int argc, char **argv);
extern void look(double time, const reading *read);
extern void look_end(void);

static uint64_t word;

static double uniform(void) /* 0 to 1 */
{
    word ^= word << 13;
    word ^= word >> 7;
    word ^= word << 17;
    return (double)(word >> 11) * 0x1p-53;
}

static double normal(void)
{
    static double spare;
    static int has;
    if (has) {
        has = 0;
        return spare;
    }
    const double size = sqrt(-2.0 * log(1.0 - uniform())), turn = 6.283185307179586 * uniform();
    spare = size * sin(turn);
    has = 1;
    return size * cos(turn);
}

static double prox(double speed, double threshold)
{
    return speed > threshold ? speed - threshold : speed < -threshold ? speed + threshold : 0.0;
}

static double place, speed, load_place, load_speed;

#if CAM
static double stretched, branch; /* extension of the rubber, force of its branch */

static double keep, gain, per_inertia;

static double rubber(double y, double soft, double *slope)
{
    const double at = (y - LOWEST) * (1.0 / GRID);
    const int j = (int)at;
    const double rise = soft * (equilibrium[j + 1] - equilibrium[j]);
    *slope = rise * (1.0 / GRID) + gain;
    return soft * equilibrium[j] + (at - j) * rise + keep * branch + gain * (y - stretched);
}

static void prepare(const double *now)
{
    const double time = RELAXATION_TIME * now[RELAXATION];
    keep = exp(-STEP / time);
    gain = now[STIFFNESS] * BRANCH * time / STEP * (1.0 - keep);
    per_inertia = STEP / (MOTOR_INERTIA * now[INERTIA]);
}

static void advance(double drive, const double *now)
{
    const double at = fabs(place) * (1.0 / CAM_GRID);
    const int j = (int)at;
    const double part = at - j, arm = lever_arm[j] + part * (lever_arm[j + 1] - lever_arm[j]);
    double y = extension[j] + 0.5 * part * CAM_GRID * (lever_arm[j] + arm), slope;
    double force = rubber(y, now[STIFFNESS], &slope);
    if (force < 0.0) {
        for (int turn = 0; turn < 20; ++turn) {
            y -= rubber(y, now[STIFFNESS], &slope) / slope;
        }
        force = 0.0;
    }
    branch = keep * branch + gain * (y - stretched);
    stretched = y;
    const double load = place >= 0.0 ? arm * force : -arm * force;
    const double level = SLIDING * now[FRICTION] + now[LOAD_FRICTION] * fabs(load);
    speed = prox(speed + per_inertia * (drive - VISCOUS * now[DAMPING] * speed - load), per_inertia * level);
    place += STEP * speed;
    load_place = place;
}
#else
static const double half = 0.5 * STEP, coupled = 0.5 * STEP * SPRING_VISCOUS;
static double drag, load_drag, per, load_per, whole;

static void prepare(const double *now)
{
    const double inertia = MOTOR_INERTIA * now[INERTIA];
    drag = half * VISCOUS * now[DAMPING] / inertia;
    load_drag = half * LOAD_VISCOUS / LOAD_INERTIA;
    per = 1.0 / (inertia * (1.0 + drag));
    load_per = 1.0 / (LOAD_INERTIA * (1.0 + load_drag));
    whole = coupled / (1.0 + coupled * (per + load_per));
}

static void advance(double effort, const double *now)
{
    place += half * speed;
    load_place += half * load_speed;
    const double twist = STIFF * now[STIFFNESS] * (place - load_place);
    double free = (1.0 - drag) / (1.0 + drag) * speed + STEP * per * (effort - twist);
    const double pull = twist - HEAVY * now[WEIGHT] * sin(load_place);
    double load_free = (1.0 - load_drag) / (1.0 + load_drag) * load_speed + STEP * load_per * pull;
    const double rate = speed - load_speed;
    const double impulse = whole * (rate + free - load_free);
    free -= impulse * per;
    load_free += impulse * load_per;
    const double level = SLIDING * now[FRICTION] + now[LOAD_FRICTION] * fabs(twist + SPRING_VISCOUS * rate);
    speed = prox(free, STEP * level * per * (1.0 + drag));
    load_speed = load_free;
    place += half * speed;
    load_place += half * load_speed;
}
#endif

/* Ordinary use: from one place to another in a time that is drawn, smoothly, then a pause. */
typedef struct {
    double from, to, begin, duration, pause;
} reach;

static void wanted(reach *now, double time, double *goal, double *pace, double *bend)
{
    if (time >= now->begin + now->duration + now->pause) {
        now->from = now->to;
        now->to = REACH * (2.0 * uniform() - 1.0);
        now->begin = time;
        now->duration = SHORTEST * pow(4.0, uniform());
        now->pause = uniform() < 0.5 ? 0.0 : uniform();
    }
    double x = (time - now->begin) / now->duration;
    x = x > 1.0 ? 1.0 : x;
    const double way = now->to - now->from, t = now->duration, rest = 1.0 - x;
    *goal = now->from + way * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
    *pace = way / t * 30.0 * x * x * rest * rest;
    *bend = way / (t * t) * 60.0 * x * rest * (1.0 - 2.0 * x);
}

/* A current that is given: nothing, a sine, levels, noise, or a sine that gets faster for half a minute. */
static double given(int kind, double size, double frequency, double time)
{
    static double level, since = -1e9;
    const double turn = 6.283185307179586 * frequency, sweep = fmod(time, 30.0);
    if ((kind == 3 || kind == 4) && time - since >= (kind == 3 ? 1.0 : 0.1) / frequency - 1e-9) {
        level = size * (2.0 * uniform() - 1.0);
        since = time;
    }
    switch (kind) {
    case 1: return 0.0;
    case 2: return size * sin(turn * time);
    case 5: return size * sin(turn * sweep * (0.05 + sweep / 30.0 * 0.475));
    default: return level;
    }
}

#define MOST_LATE 64 /* steps of the plant by which the drive may be late */

int main(int argc, char **argv)
{
    double built[NUMBERS], after[NUMBERS];
    if (argc < 4 + 2 * NUMBERS) {
        (void)fprintf(stderr, "too few arguments\n");
        return 2;
    }
    word = 0x9e3779b97f4a7c15u * (uint64_t)(1 + atol(argv[1]));
    for (int i = 0; i < 20; ++i) {
        (void)uniform();
    }
    for (int i = 0; i < NUMBERS; ++i) {
        built[i] = atof(argv[4 + i]);
        after[i] = atof(argv[4 + NUMBERS + i]);
    }
    look_begin(argc, argv);
    const int64_t samples = (int64_t)(atof(argv[2]) * RATE), change = (int64_t)(atof(argv[3]) * RATE);
    const int steps = (int)(1.0 / (RATE * STEP) + 0.5);
    const double period = 1.0 / RATE, smooth = 1.0 - exp(-6.283185307179586 * 60.0 * period);
    double integral = 0.0, filtered = 0.0, before = 0.0, goal, pace, bend;
    double late[2 * MOST_LATE] = {0.0}; /* efforts of the last steps, in a ring */
    int newest = 0;
    reach use = {0.0, 0.0, 0.0, 1.0, 0.0};
    const int kind = argc > 29 ? atoi(argv[26]) : 0;
    const double size = kind ? atof(argv[27]) : 0.0, frequency = kind ? atof(argv[28]) : 0.0;
    double next = given(kind, size, frequency, 0.0);
    for (int64_t k = 0; k < samples; ++k) {
        const double *const now = k < change ? built : after;
        if (k == 0 || k == change) {
            prepare(now);
        }
        const double read = COUNT * floor(place / COUNT + 0.5);
        wanted(&use, (double)k * period, &goal, &pace, &bend);
        filtered += smooth * ((read - before) / period - filtered);
        before = read;
        double current = PROPORTIONAL * (goal - read) + DERIVATIVE * (pace - filtered) + integral + FEED * bend;
        if (fabs(current) <= LIMIT) {
            integral += period * INTEGRAL * (goal - read);
        } else {
            current = current > 0.0 ? LIMIT : -LIMIT;
        }
        const double rise = kind && atoi(argv[29]) ? (given(kind, size, frequency, (double)(k + 1) * period) - next) : 0.0;
        if (kind) {
            current = next;
            next = given(kind, size, frequency, (double)(k + 1) * period);
        }
        const reading seen = {read, LOAD_COUNT * floor(load_place / LOAD_COUNT + 0.5),
                              current + CURRENT_NOISE * normal()};
        look((double)k * period, &seen);
        const int ago = (int)(now[DELAY] / STEP + 0.5);
        for (int i = 0; i < steps; ++i) {
            newest = (newest + 1) % (2 * MOST_LATE);
            late[newest] = PER_AMPERE * now[TORQUE] * (current + rise * ((double)i + 0.5) / (double)steps);
            advance(late[(newest + 2 * MOST_LATE - ago) % (2 * MOST_LATE)] + now[OFFSET], now);
        }
    }
    look_end();
    return 0;
}
