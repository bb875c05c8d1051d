/* Integration of equations with switches. Between events all modes are held, so each step has smooth equations. A
   step in which a mode ends is repeated with shorter lengths until the time of the event is known; then the modes
   change, and the states that jump with them. Included, not compiled alone.
   Sources: Shampine and Thompson 2000; Chandrupatla 1997 (bracketing). */

enum { MOST_EVENTS = 200, MOST_TRIALS = 200, ACCUMULATED = 3 };
static const double EVENT_WINDOW = 1e-7; /* so many events within this share of a step, at most of 1 s, have no end */
static const double LOCATED = 1e-12;     /* accuracy of an event, likewise */

/* One trial step from a state, which may be repeated with other lengths. */
typedef struct {
    setting at; /* at its beginning */
    const double *m;
    const double *largest;
    double tolerance;
    double now[ORDER], next[ORDER], error[ORDER], slope[ORDER], jacobian[ORDER][ORDER];
    int tried;
} trial;

/* Tries a step and returns its error; at most 1 is accepted. */
static double attempt(trial *one, double h)
{
    ++one->tried;
    return rodas4(one->at.t, h, one->now, one->at.u, one->at.p, one->m, one->jacobian, one->slope, one->next,
                  one->error)
               ? measured_error(one->now, one->next, one->error, one->largest, one->tolerance)
               : 1e9;
}

static double least(const double z[])
{
    double found = z[0];
    for (int i = 1; i < MODEL_SWITCHES; ++i) {
        found = z[i] < found ? z[i] : found;
    }
    return found;
}

/* The least event indicator after a step that has been tried: negative if a mode has ended. */
static double least_after(const trial *one, double h)
{
    double z[MODEL_SWITCHES], slope[MODEL_SWITCHES];
    const setting at = {one->at.t + h, one->at.u, one->at.p};
    indicate(&at, one->next, one->m, z, slope);
    return least(z);
}

static double least_in_the_middle(const trial *one, double h)
{
    double z[MODEL_SWITCHES], slope[MODEL_SWITCHES], first[ORDER], last[ORDER], middle[ORDER];
    const setting at = {one->at.t + 0.5 * h, one->at.u, one->at.p};
    model_rates(one->at.t, one->now, at.u, at.p, one->m, first);
    model_rates(one->at.t + h, one->next, at.u, at.p, one->m, last);
    for (int i = 0; i < MODEL_STATES; ++i) {
        middle[i] = 0.5 * (one->now[i] + one->next[i]) + 0.125 * h * (first[i] - last[i]);
    }
    indicate(&at, middle, one->m, z, slope);
    return least(z);
}

static double lasts(trial *one, double h)
{
    (void)attempt(one, h);
    return least_after(one, h);
}

/* The next point in the bracket, as a share of its width. */
static double next_share(double a, double fa, double b, double fb, double c, double fc)
{
    if (!(fabs(fb) <= DBL_MAX && fabs(fc) <= DBL_MAX) || !(fabs(fc - fa) > 0.0) || !(fabs(fc - fb) > 0.0)) {
        return 0.5;
    }
    const double place = (a - b) / (c - b), value = (fa - fb) / (fc - fb);
    if (value * value >= place || (1.0 - value) * (1.0 - value) >= 1.0 - place) {
        return 0.5;
    }
    return fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb);
}

/* Returns the shortest known length at which a mode has ended; that step is the last one tried. */
static double locate(trial *one, double length, double finest)
{
    /* At length zero a mode may just have changed, so the indicator is not asked there. */
    double a = length, fa = lasts(one, length), b = 0.0, fb = (double)INFINITY, share = 0.5, last = length;

    for (int round = 0; round < MOST_TRIALS && fabs(b - a) > finest; ++round) {
        const double least_share = 0.5 * finest / fabs(b - a);
        double c = a, fc = fa;
        last = a + fmin(fmax(share, least_share), 1.0 - least_share) * (b - a);
        const double value = lasts(one, last);
        if ((value < 0.0) != (fa < 0.0)) {
            c = b, fc = fb;
            b = a, fb = fa;
        }
        a = last, fa = value;
        share = next_share(a, fa, b, fb, c, fc);
    }
    const double ended = fa < 0.0 ? a : b;
    if (last < ended || last > ended) {
        (void)lasts(one, ended);
    }
    return ended;
}

/* As integrate(), with switches; stops after the first event if that is wanted. The modes m change with x. */
static int integrate_switched(double from, double length, double x[], const double u[], const double p[], double m[],
                              double tolerance, int stop, integrator_memory *memory, integrator_report *report)
{
    trial one = {.at = {from, u, p}, .m = m, .largest = memory->largest, .tolerance = tolerance, .tried = 0};
    const double span = fmin(length, 1.0);
    double recent[MOST_EVENTS] = {0.0}, t = 0.0, step = memory->step > 0.0 ? memory->step : length;
    int events = 0, growing = 1, which = 0;

    report->time = 0.0;
    report->accepted = report->rejected = report->stopped = 0;
    for (int i = 0; i < MODEL_STATES; ++i) {
        one.now[i] = x[i];
        memory->largest[i] = fmax(memory->largest[i], fmax(fabs(x[i]), 1e-6 * model_nominal[i]));
    }
    if (settle(&one.at, one.now, m, 0, &which) != SETTLED) {
        return ACCUMULATED;
    }
    while (t < length) {
        const int last = t + 1.001 * step >= length;
        double h = last ? length - t : step;
        report->time = t;
        if (one.tried >= MOST_ATTEMPTS) {
            return TOO_LONG;
        }
        if (!last && !(h > 16.0 * DBL_EPSILON * t)) {
            return NO_STEP;
        }
        one.at.t = from + t;
        model_jacobian(one.at.t, one.now, u, p, m, one.jacobian, one.slope);
        double size = attempt(&one, h);
        double factor = 0.9 * pow(fmax(size, 1e-10), -0.25);
        int ended = 0;
        if (size <= 1.0) {
            const double finest = fmax(LOCATED * span, 4.0 * DBL_EPSILON * t), whole = h;
            ended = least_after(&one, h) < 0.0;
            if (!ended && least_in_the_middle(&one, h) < 0.0) {
                /* A mode has ended in the middle of the step, and begun again. */
                ended = lasts(&one, 0.5 * h) < 0.0;
                h = ended ? 0.5 * h : h;
                size = ended ? size : attempt(&one, h);
            }
            if (ended) {
                h = locate(&one, h, finest);
                size = measured_error(one.now, one.next, one.error, memory->largest, tolerance);
            }
            t = !(size <= 1.0) ? t : last && !(h < whole) ? length : t + h;
        }
        if (!(size <= 1.0)) { /* also NaN */
            step = h * (factor > 0.2 && factor < 1.0 ? factor : 0.2);
            growing = 0;
            ++report->rejected;
            continue;
        }
        for (int i = 0; i < MODEL_STATES; ++i) {
            one.now[i] = one.next[i];
            memory->largest[i] = fmax(memory->largest[i], fabs(one.now[i]));
        }
        const double wanted = h * fmin(fmax(factor, 0.2), growing ? 5.0 : 1.0);
        step = last || ended ? fmax(step, wanted) : wanted;
        growing = 1;
        ++report->accepted;
        one.at.t = from + t;
        if (ended && stop) { /* its modes change in the event mode */
            report->stopped = 1;
            break;
        }
        if (settle(&one.at, one.now, m, 0, &which) != SETTLED) {
            return ACCUMULATED;
        }
        if (ended) {
            const double before = recent[events % MOST_EVENTS];
            recent[events % MOST_EVENTS] = t;
            if (++events > MOST_EVENTS && t - before < EVENT_WINDOW * span) {
                return ACCUMULATED;
            }
        }
    }
    for (int i = 0; i < MODEL_STATES; ++i) {
        x[i] = one.now[i];
    }
    memory->step = step;
    report->time = t;
    return INTEGRATED;
}
