/* Calls the look-up of a table with all floats whose bits are a multiple of a stride, NaN and infinities too, and
   compares the cell that it finds with the one that counting gives. Prints the first argument that differs. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "table.c"

static int32_t found(float u, float *share)
{
#include "statements.c"
    *share = SHARE;
    return LEFT;
}

/* Whether this is the cell; beside a point of a uniform grid either neighbour may be found. */
static int right(float u, int32_t cell)
{
#ifdef POINTS
    int32_t counted = 0;

    while (counted < CELLS - 1 && u >= POINTS[counted + 1]) {
        ++counted;
    }
    return cell == counted;
#else
    (void)u;
    return cell >= 0 && cell < CELLS;
#endif
}

int main(int count, char **words)
{
    const uint64_t stride = strtoull(words[1], NULL, 10);

    (void)count;
    for (uint64_t bits = 0; bits <= UINT32_MAX; bits += stride) {
        const uint32_t low = (uint32_t)bits;
        float u;
        float share;

        (void)memcpy(&u, &low, sizeof u);
        if (!right(u, found(u, &share)) || !(share >= 0.0f && share <= 1.0f)) {
            (void)printf("%.9g\n", (double)u);
            return 1;
        }
    }
    return 0;
}
