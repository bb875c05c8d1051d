/* @title@
@origin@
   All numbers in SI units. Written by nlsdesign @version@; do not edit. */
#ifndef @guard@_H
#define @guard@_H

@macros@
enum {
    @name@_STATES = @states@,
    @name@_INPUTS = @inputs@,
    @name@_PARAMETERS = @parameters@,
    @name@_BODIES = @bodies@,
    @name@_INNER = @inner@,
    @name@_OUTPUTS = @outputs@
};

/* Values of the deck, in the order of the names in @name@.py. */
extern const double @name@_values[];

/* x: motion and rate of each body, then the inner states; u: inputs; p: parameters.
   effort: on each body, from all parts and drives; rate: of the inner states; y: outputs. */
void @name@_evaluate(
    double t, const double *x, const double *u, const double *p, double *effort, double *rate, double *y);

#endif
