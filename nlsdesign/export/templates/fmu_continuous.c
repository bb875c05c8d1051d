static const double model_nominal[MODEL_STATES > 0 ? MODEL_STATES : 1] = {@nominal@};

static void model_rates(double t, const double x[], const double u[], const double p[], const double m[], double f[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m, (void)f;
    @rates@
}

static void model_equations(double t, const double x[], const double u[], const double p[], const double m[], double f[], double y[], double s[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m, (void)f, (void)y, (void)s;
    @equations@
}

static void model_jacobian(double t, const double x[], const double u[], const double p[], const double m[], double jacobian[][MODEL_STATES > 0 ? MODEL_STATES : 1], double slope[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m, (void)jacobian, (void)slope;
    @jacobian@
}

static void model_directional(double t, const double x[], const double u[], const double p[], const double m[], double dt, const double dx[], const double du[], const double dp[], double f[], double y[], double s[], double z[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m;
    (void)dt, (void)dx, (void)du, (void)dp, (void)f, (void)y, (void)s, (void)z;
    @directional@
}
