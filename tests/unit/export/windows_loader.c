/* Runs the co-simulation FMU in a Windows library on x86-64 Linux: maps the sections, applies the relocations,
   binds the imports to the C library of this machine through the Windows calling convention, and calls FMI 3.0.
   Only what the libraries of this project need; a test, not an emulator. */
#define _GNU_SOURCE
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#define WINDOWS __attribute__((ms_abi))

static WINDOWS void *w_malloc(size_t n) { return malloc(n); }
static WINDOWS void *w_calloc(size_t n, size_t m) { return calloc(n, m); }
static WINDOWS void w_free(void *p) { free(p); }
static WINDOWS size_t w_strlen(const char *s) { return strlen(s); }
static WINDOWS int w_strcmp(const char *a, const char *b) { return strcmp(a, b); }
static WINDOWS int w_memcmp(const void *a, const void *b, size_t n) { return memcmp(a, b, n); }
static WINDOWS void *w_memcpy(void *a, const void *b, size_t n) { return memcpy(a, b, n); }
static WINDOWS void *w_memset(void *a, int c, size_t n) { return memset(a, c, n); }
static WINDOWS double w_exp(double x) { return exp(x); }
static WINDOWS double w_log1p(double x) { return log1p(x); }
static WINDOWS double w_tanh(double x) { return tanh(x); }
static WINDOWS double w_erf(double x) { return erf(x); }
static WINDOWS double w_expm1(double x) { return expm1(x); }
static WINDOWS double w_pow(double x, double y) { return pow(x, y); }
static WINDOWS double w_ceil(double x) { return ceil(x); }
static WINDOWS double w_fabs(double x) { return fabs(x); }
static WINDOWS double w_sqrt(double x) { return sqrt(x); }
static WINDOWS double w_fmax(double x, double y) { return fmax(x, y); }
static WINDOWS double w_fmin(double x, double y) { return fmin(x, y); }
static WINDOWS int w_vsprintf(uint64_t o, char *text, size_t n, const char *format, void *l, void *arguments)
{
    (void)o, (void)l, (void)arguments;
    return snprintf(text, n, "%s", format);
}

static const struct {
    const char *name;
    void *function;
} known[] = {
    {"malloc", (void *)w_malloc}, {"calloc", (void *)w_calloc}, {"free", (void *)w_free},
    {"strlen", (void *)w_strlen}, {"strcmp", (void *)w_strcmp}, {"memcmp", (void *)w_memcmp},
    {"memcpy", (void *)w_memcpy}, {"memset", (void *)w_memset}, {"exp", (void *)w_exp},
    {"erf", (void *)w_erf},       {"expm1", (void *)w_expm1},
    {"log1p", (void *)w_log1p},   {"tanh", (void *)w_tanh},     {"pow", (void *)w_pow},
    {"ceil", (void *)w_ceil},     {"fabs", (void *)w_fabs},     {"sqrt", (void *)w_sqrt},
    {"fmax", (void *)w_fmax},     {"fmin", (void *)w_fmin},     {"__stdio_common_vsprintf", (void *)w_vsprintf},
};

static uint32_t u32(const uint8_t *at) { uint32_t v; memcpy(&v, at, 4); return v; }
static uint16_t u16(const uint8_t *at) { uint16_t v; memcpy(&v, at, 2); return v; }
static uint64_t u64(const uint8_t *at) { uint64_t v; memcpy(&v, at, 8); return v; }

static void *bound(const char *name)
{
    for (size_t k = 0; k < sizeof known / sizeof known[0]; ++k) {
        if (strcmp(known[k].name, name) == 0) {
            return known[k].function;
        }
    }
    fprintf(stderr, "unknown import %s\n", name);
    return NULL;
}

/* Returns the mapped image, or null. */
static uint8_t *mapped(const uint8_t *file)
{
    const uint8_t *pe = file + u32(file + 0x3c), *optional = pe + 24, *directories = optional + 112;
    const uint8_t *section = optional + u16(pe + 20);
    uint8_t *image = mmap(NULL, u32(optional + 56), PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (image == MAP_FAILED) {
        return NULL;
    }
    memcpy(image, file, u32(optional + 60));
    for (int k = 0; k < u16(pe + 6); ++k, section += 40) {
        const uint32_t size = u32(section + 8), raw = u32(section + 16);
        memcpy(image + u32(section + 12), file + u32(section + 20), raw < size ? raw : size);
    }
    const uint64_t moved = (uint64_t)(uintptr_t)image - u64(optional + 24);
    uint8_t *block = image + u32(directories + 5 * 8), *end = block + u32(directories + 5 * 8 + 4);
    for (; block < end; block += u32(block + 4)) {
        for (uint8_t *entry = block + 8; entry < block + u32(block + 4); entry += 2) {
            if (u16(entry) >> 12 == 10) {
                uint8_t *at = image + u32(block) + (u16(entry) & 0xfff);
                const uint64_t value = u64(at) + moved;
                memcpy(at, &value, 8);
            }
        }
    }
    for (uint8_t *library = image + u32(directories + 1 * 8); u32(library + 12) != 0; library += 20) {
        for (uint8_t *slot = image + u32(library + 16); u64(slot) != 0; slot += 8) {
            void *function = bound((const char *)image + u64(slot) + 2);
            if (function == NULL) {
                return NULL;
            }
            memcpy(slot, &function, 8);
        }
    }
    return image;
}

static void *exported(uint8_t *image, const char *name)
{
    const uint8_t *optional = image + u32(image + 0x3c) + 24, *table = image + u32(optional + 112);
    for (uint32_t k = 0; k < u32(table + 24); ++k) {
        const char *found = (const char *)image + u32(image + u32(table + 32) + 4 * k);
        if (strcmp(found, name) == 0) {
            const uint16_t ordinal = u16(image + u32(table + 36) + 2 * k);
            return image + u32(image + u32(table + 28) + 4 * ordinal);
        }
    }
    return NULL;
}

typedef WINDOWS void *instantiate(const char *, const char *, const char *, int, int, int, int, const uint32_t *, size_t,
                                  void *, void *, void *);
typedef WINDOWS int begin(void *, int, double, double, int, double);
typedef WINDOWS int simple(void *);
typedef WINDOWS int values(void *, const uint32_t *, size_t, double *, size_t);
typedef WINDOWS int step(void *, double, double, int, uint8_t *, uint8_t *, uint8_t *, double *);
typedef WINDOWS int start(void *, unsigned long, void *);

/* Feeds count samples of one input and reads one output after each step. Returns 0 or a negative number. */
__attribute__((visibility("default"))) int run(const uint8_t *file, const char *token, uint32_t input, double *given,
                                               int count, double length, uint32_t output, double *read)
{
    uint8_t *image = mapped(file), event, terminate, early;
    double last;
    if (image == NULL) {
        return -1;
    }
    start *entry = (start *)(void *)(image + u32(image + u32(image + 0x3c) + 24 + 16));
    if (entry(image, 1, NULL) != 1) {
        return -2;
    }
    void *me = ((instantiate *)exported(image, "fmi3InstantiateCoSimulation"))("one", token, "", 0, 0, 0, 0, NULL, 0, NULL,
                                                                               NULL, NULL);
    if (me == NULL || ((begin *)exported(image, "fmi3EnterInitializationMode"))(me, 0, 0.0, 0.0, 0, 0.0) != 0 ||
        ((simple *)exported(image, "fmi3ExitInitializationMode"))(me) != 0) {
        return -3;
    }
    for (int k = 0; k < count; ++k) {
        if (((values *)exported(image, "fmi3SetFloat64"))(me, &input, 1, &given[k], 1) != 0 ||
            ((step *)exported(image, "fmi3DoStep"))(me, k * length, length, 1, &event, &terminate, &early, &last) != 0 ||
            ((values *)exported(image, "fmi3GetFloat64"))(me, &output, 1, &read[k], 1) != 0) {
            return -4 - k;
        }
    }
    return 0;
}
