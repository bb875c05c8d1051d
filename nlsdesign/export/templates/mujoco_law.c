/* @title@
@origin@
   All numbers in SI units. Written by nlsdesign @version@; do not edit. */
#include <math.h>
#include "@name@.h"

const double @name@_values[] = {
    @values@
    0.0 /* end */
};

void @name@_evaluate(
    double t, const double *x, const double *u, const double *p, double *effort, double *rate, double *y)
{
    (void)t; (void)x; (void)u; (void)p; (void)effort; (void)rate; (void)y;
    @statements@
}
@numbers@
