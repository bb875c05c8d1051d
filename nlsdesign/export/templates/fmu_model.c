/* @name@: @description@. Generated; do not edit. */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>

#define MODEL_TOKEN @token@
#define MODEL_LARGEST DBL_MAX
@sizes@

typedef struct {
    const char *name;
    double start, lowest, highest;
} variable;

/* By value reference. */
static const variable model_variable[MODEL_VALUES] = {
    @variables@
};

