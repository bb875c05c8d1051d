/* What generated code needs of string.h, for a compiler without a library. */
#ifndef TARGET_STRING_H
#define TARGET_STRING_H

#define memcpy __builtin_memcpy

#endif
