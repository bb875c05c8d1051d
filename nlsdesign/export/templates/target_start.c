/* Start of a Cortex-M with a floating-point unit in the emulator, and its way to speak: semihosting. */
#include <stdint.h>

#include "target.h"

extern uint32_t stack_top[], data_start[], data_end[], data_load[], bss_start[], bss_end[];

void start(void);

/* Asks the emulator for an operation of semihosting. */
static void ask(uint32_t operation, const void *argument)
{
    register uint32_t number __asm__("r0") = operation;
    register const void *where __asm__("r1") = argument;

    __asm__ volatile("bkpt 0xab" : "+r"(number) : "r"(where) : "memory");
}

void say(const char *text)
{
    ask(4u, text);
}

void say_number(uint32_t number)
{
    char text[10];

    for (int k = 0; k < 8; ++k) {
        text[7 - k] = "0123456789abcdef"[(number >> (4 * k)) & 15u];
    }
    text[8] = ' ';
    text[9] = '\0';
    say(text);
}

void start(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* the floating-point unit is off at reset */
    __asm__ volatile("dsb\n\tisb");
    for (uint32_t *to = data_start, *from = data_load; to < data_end; ++to, ++from) {
        *to = *from;
    }
    for (uint32_t *to = bss_start; to < bss_end; ++to) {
        *to = 0u;
    }
    *(volatile uint32_t *)0xE000E014u = 0x00FFFFFFu; /* SysTick counts down, from the clock of the processor */
    *(volatile uint32_t *)0xE000E018u = 0u;
    *(volatile uint32_t *)0xE000E010u = 5u;
    run();
    ask(0x18u, (const void *)0x20026u); /* ends the emulator */
    for (;;) {
    }
}

static void failed(void)
{
    say("fault\n");
    ask(0x18u, (const void *)0x20023u);
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (const void *)start, (const void *)failed, (const void *)failed, (const void *)failed,
    (const void *)failed, (const void *)failed,
};
