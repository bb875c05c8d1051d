/* Runs the step of @name@ on recorded inputs and says for each sample: status, outputs, ticks, stack. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "@name@.h"
#include "target.h"

#define SAMPLES @samples@
#define TICKS 8000u
#define PAINTED 16384u
#define PAINT 0xA5A5A5A5u

typedef uint32_t step_function(@name@_state *, const @name@_inputs *, @name@_outputs *);

@given@
static @name@_state now;
static @name@_state scratch;
static @name@_inputs inputs;
static @name@_outputs outputs;

/* Two instructions. */
__attribute__((naked)) static uint32_t nothing(@name@_state *s, const @name@_inputs *i, @name@_outputs *o)
{
    __asm__("movs r0, #0\n\tbx lr");
}

/* 2003 instructions. */
__attribute__((naked)) static uint32_t known(@name@_state *s, const @name@_inputs *i, @name@_outputs *o)
{
    __asm__("movw r3, #1000\n1:\tsubs r3, #1\n\tbne 1b\n\tmovs r0, #0\n\tbx lr" ::: "r3");
}

/* Ticks of repeated calls from one and the same state. */
__attribute__((noinline)) static uint32_t ticks(step_function *volatile *step, uint32_t calls)
{
    const uint32_t begin = *(volatile uint32_t *)0xE000E018u;

    for (uint32_t k = 0u; k < calls; ++k) {
        scratch = now;
        (void)(*step)(&scratch, &inputs, &outputs);
    }
    return (begin - *(volatile uint32_t *)0xE000E018u) & 0x00FFFFFFu;
}

/* Says the calls, their ticks, and those of as many calls of a function that does nothing. */
static void say_ticks(step_function *chosen)
{
    step_function *volatile step = chosen;
    step_function *volatile empty = nothing;
    const uint32_t once = ticks(&step, 1u) + 1u;
    const uint32_t calls = TICKS / once + 1u;

    say_number(calls);
    say_number(ticks(&step, calls));
    say_number(ticks(&empty, calls));
}

/* Bytes of stack that one call touches. */
__attribute__((noinline)) static uint32_t stack_of(step_function *volatile *step)
{
    uint32_t *here;
    uint32_t *lowest;

    scratch = now;
    __asm__ volatile("mov %0, sp" : "=r"(here));
    lowest = here - PAINTED / 4u;
    for (uint32_t *p = lowest; p < here; ++p) {
        *(volatile uint32_t *)p = PAINT;
    }
    (void)(*step)(&scratch, &inputs, &outputs);
    for (uint32_t *p = lowest; p < here && *(volatile uint32_t *)p == PAINT; ++p) {
        lowest = p + 1;
    }
    return (uint32_t)(here - lowest) * 4u;
}

static void say_real(@real@ number)
{
    uint32_t words[sizeof number / 4u];

    (void)memcpy(words, &number, sizeof number);
    for (size_t k = 0u; k < sizeof words / 4u; ++k) {
        say_number(words[k]);
    }
}

void run(void)
{
    step_function *volatile step = @name@_step;

    say_number((uint32_t)sizeof(@name@_state));
    say_ticks(known);
    say_number(@name@_init(&now, NULL));
    say("\n");
    for (int k = 0; k < SAMPLES; ++k) {
        @assignments@
        say_ticks(@name@_step);
        say_number(stack_of(&step));
        say_number(@name@_step(&now, &inputs, &outputs));
        @outputs@
        say("\n");
    }
}
