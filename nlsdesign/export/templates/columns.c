#include <math.h>
#include <stdint.h>
#include <string.h>

#define WIDTH @width@
#ifdef _WIN32
#define SHOWN __declspec(dllexport)
#else
#define SHOWN __attribute__((visibility("default")))
#endif
typedef double column __attribute__((vector_size(WIDTH * 8)));
typedef int64_t mask __attribute__((vector_size(WIDTH * 8)));

static inline column all(double value) { return (column){0} + value; }
static inline column choose(mask which, column a, column b) {
    return (column)(((mask)a & which) | ((mask)b & ~which));
}
static inline column number(mask which) { return (column)((mask)all(1.0) & which); }
static inline column load(const double *from) {
    column value;
    memcpy(&value, from, sizeof value);
    return value;
}
static inline void store(double *to, column value) { memcpy(to, &value, sizeof value); }
