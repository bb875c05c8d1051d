/* Largest error of each of our functions, in units of the last place, against the library in more digits.
   Arguments are all numbers whose bits are a multiple of a stride. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "functions.c"

static REAL number(BITS bits)
{
    REAL value;

    (void)memcpy(&value, &bits, sizeof value);
    return value;
}

/* Error in units of the last place of the exact value; what has no finite value must agree in kind and sign. */
static double error(REAL found, WIDE exact)
{
    const REAL rounded = (REAL)exact;
    int power = 0;

    if (exact != exact) {
        return found != found ? 0.0 : HUGE_VAL;
    }
    if (rounded - rounded != 0) { /* an infinite one must be the same, a barely infinite one may be the largest */
        return found == rounded || (exact - exact == 0 && fabs((double)found) >= LARGEST) ? 0.0 : HUGE_VAL;
    }
    if (found - found != 0) {
        return fabsl((long double)exact) > 0.999999L * LARGEST ? 1.0 : HUGE_VAL;
    }
#if DIGITS == 24
    {
        /* The same by the exponent of a double, for all floats in a minute. */
        const double size = fabs((double)exact);
        uint64_t bits;
        double per_unit;

        (void)memcpy(&bits, &size, sizeof bits);
        power = (int)(bits >> 52) - 1022;
        power = power < LEAST ? LEAST : power;
        bits = (uint64_t)(1023 + DIGITS - power) << 52;
        (void)memcpy(&per_unit, &bits, sizeof bits);
        return fabs((double)found - (double)exact) * per_unit;
    }
#else
    (void)frexpl((long double)exact, &power);
    power = power < LEAST ? LEAST : power;
    return (double)ldexpl(fabsl((long double)found - (long double)exact), DIGITS - power);
#endif
}

static const struct {
    const char *name;
    REAL (*found)(REAL);
    WIDE (*exact)(WIDE);
    double limit;
} functions[] = {
#include "rows.c"
};

int main(int count, char **words)
{
    const uint64_t stride = strtoull(words[1], NULL, 10);

    for (size_t k = 0; k < sizeof functions / sizeof functions[0]; ++k) {
        uint64_t bits = 0;
        double worst = 0.0;
        REAL where = 0;

        if (count > 2 && strcmp(words[2], functions[k].name) != 0) {
            continue;
        }
        do {
            const REAL x = number((BITS)bits);

            if (!(fabs((double)x) > functions[k].limit)) {
                const double e = error(functions[k].found(x), functions[k].exact((WIDE)x));

                if (!(e <= worst)) {
                    worst = e;
                    where = x;
                }
            }
            bits += stride;
        } while (bits >= stride && bits <= (uint64_t)(BITS)-1);
        (void)printf("%s %.6f %.17g\n", functions[k].name, worst, (double)where);
    }
    return 0;
}
