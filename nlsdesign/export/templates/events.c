/* The modes of the switches: which have ended, which follow, and how the states jump with them. The same rules as
   in the package's own simulation. Included, not compiled alone.
   Sources: Shampine and Thompson 2000; Pfeiffer and Glocker 1996 (laws that hold a rate). */

enum { MOST_AT_ONCE = 40 };
enum { SETTLED = 0, ENDLESS = 1, DRIFTED = 2 };
static const double MOST_DRIFT = 1e-4; /* largest change of a rate that is held, as a share of the nominal size */

/* Of the switches that hold a rate; zero for the others. */
typedef struct {
    double rate[MODEL_SWITCHES];
    double target[MODEL_SWITCHES];        /* the rate after landing */
    double leads[MODEL_SWITCHES];         /* the mode when it is let go */
    double reach[ORDER][MODEL_SWITCHES];  /* change of the derivatives per effort */
    double slope[MODEL_SWITCHES][ORDER];  /* of the rate by the states */
} landing;

/* Time, inputs and parameters, which do not change while modes do. */
typedef struct {
    double t;
    const double *u;
    const double *p;
} setting;

static void land(const setting *at, const double x[], const double m[], landing *to)
{
    model_landing(at->t, x, at->u, at->p, m, to->rate, to->target, to->leads, to->reach, to->slope);
}

static void indicate(const setting *at, const double x[], const double m[], double z[], double slope[])
{
    model_indicators(at->t, x, at->u, at->p, m, z, slope);
}

static int steepest(const landing *to, int i)
{
    int best = 0;
    for (int j = 1; j < MODEL_STATES; ++j) {
        if (fabs(to->slope[i][j]) > fabs(to->slope[i][best])) {
            best = j;
        }
    }
    return best;
}

static double effect(const landing *to, int i, int k)
{
    double sum = 0.0;
    for (int j = 0; j < MODEL_STATES; ++j) {
        sum += to->slope[i][j] * to->reach[j][k];
    }
    return sum;
}

/* An impact may let others go that stuck. */
static void free_others(const setting *at, int i, const double x[], double m[])
{
    double natural[MODEL_SWITCHES];

    model_natural(at->t, x, at->u, at->p, natural);
    for (int k = 0; k < MODEL_SWITCHES; ++k) {
        if (k != i && model_holds[k]) {
            m[k] = natural[k];
        }
    }
}

/* Changes one mode that has ended. */
static void change_mode(const setting *at, int i, double x[], double m[])
{
    double z[MODEL_SWITCHES], slope[MODEL_SWITCHES];
    landing to;

    if (!model_holds[i]) {
        m[i] = -m[i];
        return;
    }
    land(at, x, m, &to);
    if (!(m[i] < 0.0 || m[i] > 0.0)) {
        m[i] = to.leads[i];
        return;
    }
    const double impulse = (to.target[i] - to.rate[i]) / effect(&to, i, i);
    for (int j = 0; j < MODEL_STATES; ++j) {
        x[j] += to.reach[j][i] * impulse;
    }
    if (fabs(to.target[i]) > 0.0) {
        free_others(at, i, x, m);
        return;
    }
    if (fabs(to.rate[i]) > 1e-9) {
        free_others(at, i, x, m);
    }
    const int first = steepest(&to, i);
    const double by = to.slope[i][first];
    land(at, x, m, &to);
    x[first] -= to.rate[i] / by;
    m[i] = 0.0;
    indicate(at, x, m, z, slope);
    if (z[i] < 0.0) {
        land(at, x, m, &to);
        m[i] = to.leads[i];
    }
}

/* Solves n equations in place by elimination with row exchanges. */
static void eliminate(int n, double a[MODEL_SWITCHES][MODEL_SWITCHES], double b[MODEL_SWITCHES])
{
    for (int k = 0; k < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i) {
            best = fabs(a[i][k]) > fabs(a[best][k]) ? i : best;
        }
        for (int j = 0; j < n; ++j) {
            const double moved = a[k][j];
            a[k][j] = a[best][j];
            a[best][j] = moved;
        }
        const double moved = b[k];
        b[k] = b[best];
        b[best] = moved;
        for (int i = k + 1; i < n; ++i) {
            const double share = a[i][k] / a[k][k];
            for (int j = k; j < n; ++j) {
                a[i][j] -= share * a[k][j];
            }
            b[i] -= share * b[k];
        }
    }
    for (int i = n - 1; i >= 0; --i) {
        for (int j = i + 1; j < n; ++j) {
            b[i] -= a[i][j] * b[j];
        }
        b[i] /= a[i][i];
    }
}

/* Sets the rates that are held to exactly zero, without changing any momentum. Where an input has moved one by more
   than rounding and integration do, it is DRIFTED and x stays. */
static int keep_held(const setting *at, double x[], const double m[], int *which)
{
    double matrix[MODEL_SWITCHES][MODEL_SWITCHES], right[MODEL_SWITCHES];
    int held[MODEL_SWITCHES], count = 0, moved = 0;
    landing to;

    for (int i = 0; i < MODEL_SWITCHES; ++i) {
        if (model_holds[i] && !(m[i] < 0.0 || m[i] > 0.0)) {
            held[count++] = i;
        }
    }
    if (count == 0) {
        return SETTLED;
    }
    land(at, x, m, &to);
    for (int i = 0; i < count; ++i) {
        right[i] = -to.rate[held[i]];
        moved = moved || !(fabs(right[i]) <= 0.0);
        for (int k = 0; k < count; ++k) {
            matrix[i][k] = effect(&to, held[i], held[k]);
        }
    }
    if (!moved) {
        return SETTLED;
    }
    for (int i = 0; i < count; ++i) {
        const int first = steepest(&to, held[i]);
        if (!(fabs(right[i]) <= MOST_DRIFT * model_nominal[first] * fabs(to.slope[held[i]][first]))) {
            *which = held[i];
            return DRIFTED;
        }
    }
    eliminate(count, matrix, right);
    for (int j = 0; j < MODEL_STATES; ++j) {
        for (int k = 0; k < count; ++k) {
            x[j] += to.reach[j][held[k]] * right[k];
        }
    }
    for (int i = 0; i < count; ++i) { /* what rounding has left */
        const int first = steepest(&to, held[i]);
        const double by = to.slope[held[i]][first];
        landing left;
        land(at, x, m, &left);
        x[first] -= left.rate[held[i]] / by;
    }
    return SETTLED;
}

/* Tells whether a mode has ended. Where an importer has stopped exactly at the event or just before it, the
   indicator is zero or positive by rounding: then its slope tells. */
static int has_ended(const setting *at, int i, double mode, double z, double slope, int arriving)
{
    const double soon = 1e-14 + 8.0 * DBL_EPSILON * fabs(at->t);

    if (z < 0.0 || !arriving) {
        return z < 0.0;
    }
    if (model_holds[i] && !(mode < 0.0 || mode > 0.0) && !(z > 0.0)) {
        return slope <= 0.0;
    }
    return slope < 0.0 && z <= -slope * soon;
}

/* Changes the modes that have ended until no mode ends. */
static int settle(const setting *at, double x[], double m[], int arriving, int *which)
{
    double z[MODEL_SWITCHES], slope[MODEL_SWITCHES], natural[MODEL_SWITCHES];

    for (int round = 0; round < MOST_AT_ONCE; ++round) {
        int ended[MODEL_SWITCHES], any = 0;
        indicate(at, x, m, z, slope);
        for (int i = 0; i < MODEL_SWITCHES; ++i) {
            ended[i] = has_ended(at, i, m[i], z[i], slope[i], arriving && round == 0);
            if (ended[i]) {
                any = 1;
                *which = i;
            }
        }
        if (!any && keep_held(at, x, m, which) == SETTLED) {
            return SETTLED;
        }
        if (!any) { /* an input has torn it away */
            model_natural(at->t, x, at->u, at->p, natural);
            m[*which] = natural[*which];
        }
        for (int i = 0; i < MODEL_SWITCHES; ++i) {
            if (ended[i]) {
                change_mode(at, i, x, m);
            }
        }
    }
    return ENDLESS;
}
