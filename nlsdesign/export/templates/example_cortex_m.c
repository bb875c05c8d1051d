@title@
/* Timer interrupt of a Cortex-M: SysTick calls the step every sample time. Give your clock as CORE_CLOCK in Hz, and
   compile with the hard floating-point unit and -ffp-contract=off. */
#include <stddef.h>
#include <stdint.h>

#include "@name@.h"
#include "@name@_supervisor.h"

#if defined(__arm__) && !defined(SOFT_NUMBERS)
#if !defined(__ARM_FP) || (__ARM_FP & @unit@) == 0
#error "no floating-point unit for @real@: a step takes forty times longer. Give the flags of the unit (-mfpu, -mfloat-abi=hard), export with --real float for one without double, or define SOFT_NUMBERS where the time is there"
#endif
#endif

#ifndef CORE_CLOCK
#define CORE_CLOCK 168000000u /* Hz */
#endif
#define PERIOD @microseconds@u /* us */

/* System timer of the Armv7-M architecture (Arm DDI 0403E, B3.3). */
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)

static @name@_state state;
static @name@_outputs outputs;
static uint32_t last_status;
static @name@_supervisor supervisor;

void SysTick_Handler(void);

#ifdef BOARD /* a header with the two functions below for your board: -DBOARD='"my_board.h"'; then nothing here is edited */
#include BOARD
#else
/* Put the readings of your sensors here. */
static void read_inputs(@name@_inputs *given)
{
    @name@_inputs inputs = {0};
    @read@
    *given = inputs;
}

/* Put the outputs where they act; of a command only the share that the supervisor leaves. */
static void write_outputs(const @name@_outputs *given, uint32_t status, float share)
{
    (void)given;
    (void)status;
    (void)share;
}
#endif

void SysTick_Handler(void)
{
    @name@_inputs inputs;

    read_inputs(&inputs);
    last_status = @name@_step(&state, &inputs, &outputs);
    write_outputs(&outputs, last_status, @name@_supervise(&supervisor, last_status));
}

int main(void)
{
    if (@name@_init(&state, NULL) != 0u) {
        return 1;
    }
    SYST_RVR = (uint32_t)((uint64_t)CORE_CLOCK * PERIOD / 1000000u) - 1u; /* at most 24 bits */
    SYST_CVR = 0u;
    SYST_CSR = 7u; /* processor clock, interrupt, on */
    for (;;) {
#if defined(__GNUC__) && defined(__arm__)
        __asm__ volatile("wfi"); /* sleeps until the next interrupt */
#endif
    }
}
