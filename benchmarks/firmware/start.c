/* Start-up of the example firmware on the emulated Cortex-M: floating-point unit, memory, vectors. */
#include <stdint.h>

extern uint32_t stack_top[], data_start[], data_end[], data_load[], bss_start[], bss_end[];
#define FAULTS (*(volatile uint32_t *)0x20300010u) /* board.h: struct board */
#define STARTS (*(volatile uint32_t *)0x20300014u)

int main(void);
void start(void);
void SysTick_Handler(void);

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
    STARTS = STARTS + 1u;
    (void)main();
    for (;;) {
    }
}

/* A fault of the processor is counted, and the program begins anew, as a watchdog would have it. */
static void failed(void)
{
    FAULTS = FAULTS + 1u;
    *(volatile uint32_t *)0xE000ED0Cu = 0x05FA0004u; /* AIRCR: request a reset */
    for (;;) {
    }
}

/* Here the interrupt of the timer is held, at an instruction that does nothing, and goes on behind it. On a page of its own:
   the emulator runs a page on which it is held instruction by instruction. */
__attribute__((naked, aligned(4096))) static void timer(void)
{
    __asm__ volatile("nop\n\tb.w SysTick_Handler\n\t.space 4090");
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (const void *)start, (const void *)failed, (const void *)failed, (const void *)failed,
    (const void *)failed, (const void *)failed, 0, 0, 0, 0, (const void *)failed, (const void *)failed, 0,
    (const void *)failed, (const void *)timer,
};
