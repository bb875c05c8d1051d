@title@
/* Timer interrupt of a Cortex-M: SysTick calls the step every sample time. Give your clock as CORE_CLOCK in Hz, and
   compile with the hard floating-point unit and -ffp-contract=off. */
#include <stddef.h>
#include <stdint.h>

#include "@name@.h"

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
static volatile uint32_t last_status;

void SysTick_Handler(void);

/* Put the readings of your sensors here. */
static void read_inputs(@name@_inputs *given)
{
    @name@_inputs inputs = {0};
    @read@
    *given = inputs;
}

void SysTick_Handler(void)
{
    @name@_inputs inputs;

    read_inputs(&inputs);
    last_status = @name@_step(&state, &inputs, &outputs);
    /* Put the outputs where they act; a flag in last_status says that they are less sure than usual. */
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
    }
}
