/* Rodas4: Rosenbrock method of order 4 with an embedded one of order 3; six stages, L-stable, stiffly accurate.
   E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, 2nd edition, Springer 1996, section IV.7.
   The Jacobian is exact, so no Newton iteration can fail; what can fail is the step size, and then it says so. */
#include <float.h>

enum { ORDER = MODEL_STATES > 0 ? MODEL_STATES : 1, STAGES = 6 };
enum { MOST_ATTEMPTS = 200000 };                 /* in one communication step */
enum { INTEGRATED = 0, NO_STEP = 1, TOO_LONG = 2 };

static const double RODAS_GAMMA = 0.25;
static const double RODAS_TIME[STAGES] = {0.0, 0.386, 0.21, 0.63, 1.0, 1.0};
static const double RODAS_SLOPE[STAGES] = {0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0};
static const double RODAS_A[STAGES][STAGES - 1] = {
    {0.0, 0.0, 0.0, 0.0, 0.0},
    {1.544000000000000, 0.0, 0.0, 0.0, 0.0},
    {0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0},
    {3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 0.0},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0},
};
static const double RODAS_C[STAGES][STAGES - 1] = {
    {0.0, 0.0, 0.0, 0.0, 0.0},
    {-5.668800000000000, 0.0, 0.0, 0.0, 0.0},
    {-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0.0},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054},
};

/* What the integrator remembers between communication points. */
typedef struct {
    double step;           /* next trial step, s; 0 before the first */
    double largest[ORDER]; /* largest size of each state so far: errors are measured against it */
} integrator_memory;

typedef struct {
    double time; /* how far it came from the beginning of the step, s */
    int accepted;
    int rejected;
    int stopped; /* at an event */
} integrator_report;

/* Factorises a in place with row exchanges; returns 0 if it is singular or not finite. */
static int factorise(double a[ORDER][ORDER], int row[ORDER])
{
    for (int k = 0; k < ORDER; ++k) {
        int best = k;
        for (int i = k + 1; i < ORDER; ++i) {
            if (fabs(a[i][k]) > fabs(a[best][k])) {
                best = i;
            }
        }
        row[k] = best;
        if (!(fabs(a[best][k]) > 0.0 && fabs(a[best][k]) <= DBL_MAX)) {
            return 0;
        }
        for (int j = 0; best != k && j < ORDER; ++j) {
            const double moved = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = moved;
        }
        for (int i = k + 1; i < ORDER; ++i) {
            a[i][k] /= a[k][k];
            for (int j = k + 1; j < ORDER; ++j) {
                a[i][j] -= a[i][k] * a[k][j];
            }
        }
    }
    return 1;
}

static void solve(double a[ORDER][ORDER], const int row[ORDER], double b[ORDER])
{
    for (int k = 0; k < ORDER; ++k) {
        const double moved = b[row[k]];
        b[row[k]] = b[k];
        b[k] = moved;
    }
    for (int i = 1; i < ORDER; ++i) {
        for (int j = 0; j < i; ++j) {
            b[i] -= a[i][j] * b[j];
        }
    }
    for (int i = ORDER - 1; i >= 0; --i) {
        for (int j = i + 1; j < ORDER; ++j) {
            b[i] -= a[i][j] * b[j];
        }
        b[i] /= a[i][i];
    }
}

/* One step of length h from x with the Jacobian df/dx and the slope df/dt at its beginning; gives the state at
   the end and the estimate of its error. Returns 0 if the matrix is singular. */
static int rodas4(double t, double h, const double x[], const double u[], const double p[],
                  const double m[], double jacobian[ORDER][ORDER], const double slope[ORDER], double next[ORDER],
                  double error[ORDER])
{
    double matrix[ORDER][ORDER], k[STAGES][ORDER];
    int row[ORDER];

    for (int i = 0; i < ORDER; ++i) {
        for (int j = 0; j < ORDER; ++j) {
            matrix[i][j] = (i == j ? 1.0 / (h * RODAS_GAMMA) : 0.0) - jacobian[i][j];
        }
    }
    if (!factorise(matrix, row)) {
        return 0;
    }
    for (int stage = 0; stage < STAGES; ++stage) {
        for (int i = 0; i < ORDER; ++i) {
            next[i] = x[i];
            for (int j = 0; j < stage; ++j) {
                next[i] += RODAS_A[stage][j] * k[j][i];
            }
        }
        model_rates(t + RODAS_TIME[stage] * h, next, u, p, m, k[stage]);
        for (int i = 0; i < ORDER; ++i) {
            k[stage][i] += h * RODAS_SLOPE[stage] * slope[i];
            for (int j = 0; j < stage; ++j) {
                k[stage][i] += RODAS_C[stage][j] / h * k[j][i];
            }
        }
        solve(matrix, row, k[stage]);
    }
    for (int i = 0; i < ORDER; ++i) {
        error[i] = k[STAGES - 1][i];
        next[i] += error[i];
    }
    return 1;
}

/* Root mean square of the errors in units of what is allowed; NaN if anything is not finite. */
static double measured_error(const double x[], const double next[], const double error[],
                             const double largest[], double tolerance)
{
    double sum = 0.0;
    for (int i = 0; i < ORDER; ++i) {
        const double size = fmax(largest[i], fmax(fabs(x[i]), fabs(next[i])));
        const double share = error[i] / (tolerance * size) + 0.0 * next[i];
        sum += share * share;
    }
    return sqrt(sum / (double)ORDER);
}

#if MODEL_SWITCHES == 0
/* Integrates over a length of time with constant inputs. Time is counted from the beginning of the step, so that
   a large clock does not bound the step size. Where the result is not INTEGRATED, x is as it was. */
static int integrate(double from, double length, double x[], const double u[], const double p[], const double m[],
                     double tolerance, integrator_memory *memory, integrator_report *report)
{
    double now[ORDER], next[ORDER], error[ORDER], slope[ORDER], jacobian[ORDER][ORDER];
    double t = 0.0, step = memory->step > 0.0 ? memory->step : length;
    int fresh = 0, growing = 1;

    report->time = 0.0;
    report->accepted = report->rejected = report->stopped = 0;
    for (int i = 0; i < MODEL_STATES; ++i) {
        now[i] = x[i];
        memory->largest[i] = fmax(memory->largest[i], fmax(fabs(x[i]), 1e-6 * model_nominal[i]));
    }
    while (MODEL_STATES > 0 && t < length) {
        const int last = t + 1.001 * step >= length;
        const double h = last ? length - t : step;
        report->time = t;
        if (report->accepted + report->rejected >= MOST_ATTEMPTS) {
            return TOO_LONG;
        }
        if (!last && !(h > 16.0 * DBL_EPSILON * t)) {
            return NO_STEP;
        }
        if (!fresh) {
            model_jacobian(from + t, now, u, p, m, jacobian, slope);
            fresh = 1;
        }
        const int solved = rodas4(from + t, h, now, u, p, m, jacobian, slope, next, error);
        const double size = solved ? measured_error(now, next, error, memory->largest, tolerance) : 1e9;
        const double factor = 0.9 * pow(fmax(size, 1e-10), -0.25);
        if (!(size <= 1.0)) { /* also NaN */
            step = h * (factor > 0.2 ? factor : 0.2);
            growing = 0;
            ++report->rejected;
            continue;
        }
        t = last ? length : t + h;
        for (int i = 0; i < ORDER; ++i) {
            now[i] = next[i];
            memory->largest[i] = fmax(memory->largest[i], fabs(now[i]));
        }
        const double wanted = h * fmin(fmax(factor, 0.2), growing ? 5.0 : 1.0);
        step = last ? fmax(step, wanted) : wanted;
        fresh = 0;
        growing = 1;
        ++report->accepted;
    }
    for (int i = 0; i < MODEL_STATES; ++i) {
        x[i] = now[i];
    }
    memory->step = step;
    report->time = length;
    return INTEGRATED;
}
#endif
