
/* Whether a switch holds a rate in its mode 0. */
static const int model_holds[MODEL_SWITCHES] = {@holds@};

/* The modes m at a state. */
static void model_natural(double t, const double x[], const double u[], const double p[], double m[])
{
    (void)t, (void)x, (void)u, (void)p;
    @natural@
}

/* Not negative as long as a mode lasts, and how fast that changes while the inputs do not. */
static void model_indicators(double t, const double x[], const double u[], const double p[], const double m[], double z[], double slope[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m;
    @indicators@
}

static void model_landing(double t, const double x[], const double u[], const double p[], const double m[], double rate[], double target[], double leads[], double reach[][MODEL_SWITCHES], double slope[][MODEL_STATES > 0 ? MODEL_STATES : 1])
{
    (void)t, (void)x, (void)u, (void)p, (void)m;
    @landing@
}
