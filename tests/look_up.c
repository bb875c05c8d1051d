/* Calls the look-up of a table with all floats whose bits are a multiple of a stride, NaN and infinities too, and
   holds the cell that it finds against its ends. Prints the first argument that is not in it. */
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
    return cell >= 0 && cell < CELLS && (cell == 0 || u >= POINTS[cell]) &&
           (cell == CELLS - 1 || !(u >= POINTS[cell + 1]));
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
