/* What the program under the emulator may call. */
#ifndef TARGET_H
#define TARGET_H

#include <stdint.h>

/* Writes a text. */
void say(const char *text);

/* Writes a number as eight hexadecimal digits and a space. */
void say_number(uint32_t number);

/* The program. */
void run(void);

#endif
