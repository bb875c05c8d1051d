/* cam rubber plant: Cam that stretches two rubbers, turned by a motor. Generated; do not edit. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>

#define MODEL_TOKEN "{token}"
#define MODEL_LARGEST DBL_MAX
#define MODEL_CONTINUOUS 1
#define MODEL_STATES 3
#define MODEL_INPUTS 1
#define MODEL_PARAMETERS 10
#define MODEL_X 1
#define MODEL_D 4
#define MODEL_U 7
#define MODEL_P 8
#define MODEL_Y 18
#define MODEL_S 19
#define MODEL_Z 20
#define MODEL_M 20
#define MODEL_SWITCHES 0
#define MODEL_EXTRA 20
#define MODEL_VALUES 21

typedef struct {
    const char *name;
    double start, lowest, highest;
} variable;

/* By value reference. */
static const variable model_variable[MODEL_VALUES] = {
    {"time", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"spring.rubber.relaxing.dashpot.extension", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"motor.angle", 0.1, -2.0, 2.0},
    {"motor.speed", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"der(spring.rubber.relaxing.dashpot.extension)", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"der(motor.angle)", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"der(motor.speed)", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"motor.current", 0.0, -20.0, 20.0},
    {"motor.inertia", 0.000597, 1e-05, 0.1},
    {"motor.torque_constant", 0.22, 0.001, 10.0},
    {"motor.friction.coulomb", 0.02, 0.0, 1.0},
    {"motor.friction.viscous", 0.001, 0.0, 1.0},
    {"spring.cam.lever_arm", 0.015, 0.001, 0.1},
    {"spring.cam.corner", 0.2, 0.001, 2.0},
    {"spring.rubber.equilibrium.stiffness", 9000.0, 0.0, 1000000.0},
    {"spring.rubber.equilibrium.hardening", 60.0, 0.0, 10000.0},
    {"spring.rubber.relaxing.spring.stiffness", 4600.0, 0.0, 1000000.0},
    {"spring.rubber.relaxing.dashpot.viscosity", 200.0, 0.001, 1000000.0},
    {"spring.torque", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"spring.rubber.force", 0.0, -1.7976931348623157e+308, 1.7976931348623157e+308},
    {"solver.relative_tolerance", 1e-08, 1e-13, 0.01},
};

static const double model_nominal[MODEL_STATES > 0 ? MODEL_STATES : 1] = {0.001, 2.0, 10.0};

static void model_rates(double t, const double x[], const double u[], const double p[], const double m[], double f[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m, (void)f;
    const double a5 = x[1] / p[5];
    const double a6 = fabs(a5);
    const double a14 = p[4] * p[5] * (a6 + log1p(exp(-2.0 * a6)) - 0.6931471805599453);
    const double a17 = p[8] * (a14 - x[0]);
    const double a44 = 2.0 * (p[4] * tanh(a5)) * (p[6] * a14 * (1.0 + p[7] * a14) + a17);
    f[0] = a17 / p[9];
    f[1] = x[2];
    f[2] = (p[1] * u[0] - (p[2] * tanh(x[2] / 0.1) + p[3] * x[2]) - a44) / p[0];
}

static void model_equations(double t, const double x[], const double u[], const double p[], const double m[], double f[], double y[], double s[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m, (void)f, (void)y, (void)s;
    const double a5 = x[1] / p[5];
    const double a6 = fabs(a5);
    const double a14 = p[4] * p[5] * (a6 + log1p(exp(-2.0 * a6)) - 0.6931471805599453);
    const double a17 = p[8] * (a14 - x[0]);
    const double a43 = p[6] * a14 * (1.0 + p[7] * a14) + a17;
    const double a44 = 2.0 * (p[4] * tanh(a5)) * a43;
    f[0] = a17 / p[9];
    f[1] = x[2];
    f[2] = (p[1] * u[0] - (p[2] * tanh(x[2] / 0.1) + p[3] * x[2]) - a44) / p[0];
    y[0] = a44;
    s[0] = a43;
}

static void model_jacobian(double t, const double x[], const double u[], const double p[], const double m[], double jacobian[][MODEL_STATES > 0 ? MODEL_STATES : 1], double slope[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m, (void)jacobian, (void)slope;
    const double a8 = x[1] / p[5];
    const double a9 = tanh(a8);
    const double a11 = 2.0 * (p[4] * a9);
    const double a15 = p[4] * p[5];
    const double a17 = (double)((a8 > 0.0) - (a8 < 0.0)) / p[5];
    const double a19 = fabs(a8);
    const double a21 = exp(-2.0 * a19);
    const double a28 = a15 * (a17 + a21 * (-2.0 * a17) / (1.0 + a21));
    const double a29 = p[8] * a28;
    const double a36 = a15 * (a19 + log1p(a21) - 0.6931471805599453);
    const double a37 = p[6] * a36;
    const double a40 = 1.0 + p[7] * a36;
    const double a51 = (a37 * a40 + p[8] * (a36 - x[0])) * (2.0 * (p[4] * ((1.0 - a9 * a9) / p[5])));
    const double a60 = (a51 + a11 * (a40 * (p[6] * a28) + a37 * (p[7] * a28) + a29)) / p[0];
    const double a67 = tanh(x[2] / 0.1);
    jacobian[0][0] = -(p[8] / p[9]);
    jacobian[1][0] = 0.0;
    jacobian[2][0] = a11 * p[8] / p[0];
    jacobian[0][1] = a29 / p[9];
    jacobian[1][1] = 0.0;
    jacobian[2][1] = -a60;
    jacobian[0][2] = 0.0;
    jacobian[1][2] = 1.0;
    jacobian[2][2] = -((p[2] * (10.0 * (1.0 - a67 * a67)) + p[3]) / p[0]);
    slope[0] = 0.0;
    slope[1] = 0.0;
    slope[2] = 0.0;
}

static void model_directional(double t, const double x[], const double u[], const double p[], const double m[], double dt, const double dx[], const double du[], const double dp[], double f[], double y[], double s[], double z[])
{
    (void)t, (void)x, (void)u, (void)p, (void)m;
    (void)dt, (void)dx, (void)du, (void)dp, (void)f, (void)y, (void)s, (void)z;
    const double a2 = p[4] * p[5];
    const double a4 = x[1] / p[5];
    const double a5 = fabs(a4);
    const double a8 = exp(-2.0 * a5);
    const double a12 = a5 + log1p(a8) - 0.6931471805599453;
    const double a13 = a2 * a12;
    const double a15 = a13 - x[0];
    const double a30 = dx[1] / p[5] - a4 / p[5] * dp[5];
    const double a31 = (double)((a4 > 0.0) - (a4 < 0.0)) * a30;
    const double a39 = a12 * (p[5] * dp[4] + p[4] * dp[5]) + a2 * (a31 + a8 * (-2.0 * a31) / (1.0 + a8));
    const double a43 = a15 * dp[8] + p[8] * (a39 - dx[0]);
    const double a46 = p[8] * a15;
    const double a63 = tanh(x[2] / 0.1);
    const double a79 = a63 * dp[2] + p[2] * ((1.0 - a63 * a63) * (10.0 * dx[2])) + (x[2] * dp[3] + p[3] * dx[2]);
    const double a82 = p[6] * a13;
    const double a85 = 1.0 + p[7] * a13;
    const double a87 = a82 * a85 + a46;
    const double a88 = tanh(a4);
    const double a98 = 2.0 * (p[4] * a88);
    const double a109 = a85 * (a13 * dp[6] + p[6] * a39) + a82 * (a13 * dp[7] + p[7] * a39);
    const double a110 = a109 + a43;
    const double a112 = a87 * (2.0 * (a88 * dp[4] + p[4] * ((1.0 - a88 * a88) * a30))) + a98 * a110;
    const double a124 = (p[1] * u[0] - (p[2] * a63 + p[3] * x[2]) - a98 * a87) / p[0] / p[0];
    f[0] = a43 / p[9] - a46 / p[9] / p[9] * dp[9];
    f[1] = dx[2];
    f[2] = (u[0] * dp[1] + p[1] * du[0] - a79 - a112) / p[0] - a124 * dp[0];
    y[0] = a112;
    s[0] = a110;
}
