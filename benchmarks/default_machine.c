/* The cam actuator of the decks, integrated by a program that shares nothing with the package: a motor with
   viscous and dry friction, a cam of a uniform cubic B-spline, a piecewise linear rubber beside one or two Maxwell
   branches. A position servo leads it along a wanted course and reads the counts of an encoder. */
#include <math.h>

#if defined(_WIN32)
#define SHOWN __declspec(dllexport)
#else
#define SHOWN __attribute__((visibility("default")))
#endif

#define MOST 80

typedef struct {
    double inertia, drive, limit, pretension, elements, last, width, area, length;
    double viscous, dry, creep, count;
    double modulus[2], viscosity[2];
    double knots, arms;
    double knot[MOST], stiffness[MOST], arm[MOST];
} machine;

/* Extension and lever arm: the B-spline from its control values, its integral knot by knot. */
static void cam(const machine *m, double angle, double *extension, double *lever)
{
    const double root = sqrt(angle * angle + m->width * m->width), q = root - m->width;
    const double on = q < m->last ? q : m->last, step = m->last / (m->arms - 3.0);
    int cell = (int)(on / step);
    double sum = 0.0, x, h = 0.0;
    if (cell > (int)m->arms - 4) {
        cell = (int)m->arms - 4;
    }
    for (int k = 0; k < cell; ++k) {
        sum += (m->arm[k] + 11.0 * m->arm[k + 1] + 11.0 * m->arm[k + 2] + m->arm[k + 3]) / 24.0;
    }
    x = on / step - cell;
    {
        const double *c = m->arm + cell, y = 1.0 - x, x2 = x * x, x3 = x2 * x, x4 = x3 * x;
        h = c[0] * y * y * y + c[1] * (3.0 * x3 - 6.0 * x2 + 4.0) + c[2] * (-3.0 * x3 + 3.0 * x2 + 3.0 * x + 1.0) +
            c[3] * x3;
        sum += (c[0] * (1.0 - y * y * y * y) / 4.0 + c[1] * (0.75 * x4 - 2.0 * x3 + 4.0 * x) +
                c[2] * (-0.75 * x4 + x3 + 1.5 * x2 + x) + c[3] * x4 / 4.0) / 6.0;
    }
    *extension = sum * step + h / 6.0 * (q - on);
    *lever = h / 6.0 * angle / root;
}

/* Torque of the spring, and the rates of the inner strains. */
static double spring(const machine *m, double angle, const double *inner, double *rate)
{
    double extension, lever, stress = 0.0;
    cam(m, angle, &extension, &lever);
    const double strain = (m->pretension + extension) / m->length;
    for (int k = 0; k < (int)m->knots; ++k) {
        stress += m->stiffness[k] * (strain > m->knot[k] ? strain - m->knot[k] : 0.0);
    }
    for (int k = 0; k < 2; ++k) {
        const double pull = m->modulus[k] * (strain - inner[k]);
        rate[k] = pull / m->viscosity[k];
        stress += pull;
    }
    return m->elements * lever * m->area * stress;
}

static void rates(const machine *m, const double *x, double current, double *d)
{
    const double torque = spring(m, x[0], x + 2, d + 2);
    d[0] = x[1];
    d[1] = (m->drive * current - torque - m->viscous * x[1] - m->dry * tanh(x[1] / m->creep)) / m->inertia;
}

static void advance(const machine *m, double *x, double current, double time, int parts)
{
    const double h = time / parts;
    for (int part = 0; part < parts; ++part) {
        double k[4][4], at[4];
        rates(m, x, current, k[0]);
        for (int stage = 1; stage < 4; ++stage) {
            for (int i = 0; i < 4; ++i) {
                at[i] = x[i] + (stage == 3 ? h : h / 2.0) * k[stage - 1][i];
            }
            rates(m, at, current, k[stage]);
        }
        for (int i = 0; i < 4; ++i) {
            x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        }
    }
}

static void at_rest(const machine *m, double *x)
{
    double extension, lever;
    cam(m, x[0], &extension, &lever);
    x[1] = 0.0;
    x[2] = x[3] = (m->pretension + extension) / m->length;
}

SHOWN double torque_at_rest(const machine *m, double angle)
{
    double x[4] = {angle, 0.0, 0.0, 0.0}, d[2];
    at_rest(m, x);
    return spring(m, angle, x + 2, d);
}

/* Led by a servo along wanted angle, rate and acceleration; gives counted angle, current and torque. With a servo
   of no bandwidth the given currents act. */
SHOWN void run(const machine *m, int samples, double time, int parts, double bandwidth, double declared_slope,
         const double *wanted, double *angle, double *current, double *torque)
{
    double x[4] = {0.0, 0.0, 0.0, 0.0}, before = 0.0, d[2];
    at_rest(m, x);
    for (int k = 0; k < samples; ++k) {
        const double read = m->count > 0.0 ? m->count * floor(x[0] / m->count + 0.5) : x[0];
        if (bandwidth > 0.0) {
            const double *w = wanted + 3 * k, speed = (read - before) / time;
            double push = w[2] + 2.0 * bandwidth * (w[1] - speed) + bandwidth * bandwidth * (w[0] - read);
            push /= declared_slope;
            current[k] = fmin(fmax(push, -m->limit), m->limit);
        }
        before = angle[k] = read;
        torque[k] = spring(m, x[0], x + 2, d);
        advance(m, x, current[k], time, parts);
    }
}

/* A joint extended Kalman filter of the three states and the logarithms of some numbers of the machine, with slopes
   by differences at the estimate: the plainest observer that learns. */
#define NUMBERS 20
#define SIZE (3 + NUMBERS)

static void carried(const machine *declared, double *const *place, int numbers, const double *z, double current,
                    double time, double *next)
{
    machine m = *declared;
    for (int i = 0; i < numbers; ++i) {
        double *number = (double *)((char *)&m + ((char *)place[i] - (char *)declared));
        *number *= exp(z[3 + i]);
    }
    double x[4] = {z[0], z[1], z[2], z[2]};
    advance(&m, x, current, time, 2);
    for (int i = 0; i < 3 + numbers; ++i) {
        next[i] = i < 3 ? x[i] : z[i];
    }
}

static double seen_torque(const machine *declared, double *const *place, int numbers, const double *z)
{
    machine m = *declared;
    double d[2];
    for (int i = 0; i < numbers; ++i) {
        double *number = (double *)((char *)&m + ((char *)place[i] - (char *)declared));
        *number *= exp(z[3 + i]);
    }
    const double inner[2] = {z[2], z[2]};
    return spring(&m, z[0], inner, d);
}

SHOWN void joint_filter(machine *declared, int numbers, const int *places, const double *deviations, int samples,
                  double time, double push, const double *angle, const double *current, double *torque, double *said)
{
    double p[SIZE][SIZE] = {{0.0}}, z[SIZE] = {0.0}, *place[NUMBERS];
    const double step[3] = {1e-5, 1e-3, 1e-5}, noise = declared->count * declared->count / 12.0;
    const int n = 3 + numbers;
    double x[4] = {angle[0], 0.0, 0.0, 0.0};
    at_rest(declared, x);
    z[0] = x[0], z[2] = x[2];
    p[0][0] = noise, p[1][1] = 0.01, p[2][2] = 1e-6;
    for (int i = 0; i < numbers; ++i) {
        place[i] = (double *)declared + places[i];
        p[3 + i][3 + i] = deviations[i] * deviations[i];
    }
    for (int k = 0; k < samples; ++k) {
        const double variance = p[0][0] + noise, error = angle[k] - z[0];
        double gain[SIZE], slope[SIZE], f[SIZE][SIZE], fp[SIZE][SIZE], base[SIZE], moved[SIZE];
        for (int i = 0; i < n; ++i) {
            gain[i] = p[i][0] / variance;
        }
        for (int i = 0; i < n; ++i) {
            z[i] += gain[i] * error;
            slope[i] = p[0][i];
        }
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                p[i][j] -= gain[i] * slope[j];
            }
        }
        torque[k] = seen_torque(declared, place, numbers, z);
        for (int j = 0; j < n; ++j) {
            const double h = j < 3 ? step[j] : 1e-4, kept = z[j];
            z[j] += h;
            slope[j] = (seen_torque(declared, place, numbers, z) - torque[k]) / h;
            z[j] = kept;
        }
        said[k] = 0.0;
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                said[k] += slope[i] * p[i][j] * slope[j];
            }
        }
        said[k] = sqrt(fmax(said[k], 0.0));
        carried(declared, place, numbers, z, current[k], time, base);
        for (int j = 0; j < n; ++j) {
            const double h = j < 3 ? step[j] : 1e-4, kept = z[j];
            z[j] += h;
            carried(declared, place, numbers, z, current[k], time, moved);
            z[j] = kept;
            for (int i = 0; i < n; ++i) {
                f[i][j] = (moved[i] - base[i]) / h;
            }
        }
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                fp[i][j] = p[i][j];
                if (i < 3) {
                    fp[i][j] = 0.0;
                    for (int l = 0; l < n; ++l) {
                        fp[i][j] += f[i][l] * p[l][j];
                    }
                }
            }
        }
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                p[i][j] = fp[i][j];
                if (j < 3) {
                    p[i][j] = 0.0;
                    for (int l = 0; l < n; ++l) {
                        p[i][j] += fp[i][l] * f[j][l];
                    }
                }
            }
        }
        p[1][1] += push * push * time;
        for (int i = 0; i < n; ++i) {
            z[i] = base[i];
        }
    }
}

/* An observer in generated C, fed with a record: its first two outputs are kept. */
typedef unsigned (*observer_step)(void *state, const double *inputs, double *outputs);

SHOWN void watch(observer_step step, void *state, int samples, const double *angle, const double *current, double *torque,
           double *said)
{
    for (int k = 0; k < samples; ++k) {
        double out[64] = {0.0};
        /* The observer is told the current of the sample that begins with this reading. */
        const double in[2] = {angle[k], current[k]};
        (void)step(state, in, out);
        torque[k] = out[0];
        said[k] = out[1];
    }
}
