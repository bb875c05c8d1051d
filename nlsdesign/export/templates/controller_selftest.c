/* Self-test of @name@: returns 0, or the number of the first sample that differs. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>

#include "@name@.h"

#define SAMPLES @samples@

@given@
@expected@
@tolerance@
static const uint32_t word[SAMPLES] = {@status@};

int main(void)
{
    @name@_state state;
    @name@_inputs inputs = {0};
    @name@_outputs outputs = {0};

    if (@name@_init(&state, NULL) != 0u) {
        return 1;
    }
    for (int k = 0; k < SAMPLES; ++k) {
        @assignments@
        int differs = @name@_step(&state, &inputs, &outputs) != word[k];
        @comparisons@
        if (differs) {
            (void)printf("sample %d differs\n", k + 1);
            return k + 1;
        }
    }
    return 0;
}
