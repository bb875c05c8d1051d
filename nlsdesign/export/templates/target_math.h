/* What generated code needs of math.h, for a compiler without a library: functions with one right answer each. */
#ifndef TARGET_MATH_H
#define TARGET_MATH_H

#define INFINITY (__builtin_inff())
#define NAN (__builtin_nanf(""))
#define fabs __builtin_fabs
#define fabsf __builtin_fabsf
#define copysign __builtin_copysign
#define copysignf __builtin_copysignf
#define sqrt __builtin_sqrt
#define sqrtf __builtin_sqrtf
#define floor __builtin_floor
#define floorf __builtin_floorf
#define ceil __builtin_ceil
#define ceilf __builtin_ceilf
#define fmod __builtin_fmod
#define fmodf __builtin_fmodf

#endif
