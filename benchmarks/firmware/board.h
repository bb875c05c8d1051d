/* The emulated board of the example firmware. Its peripherals are cells in the middle of the memory, which a program on the
   other side reads and writes while the processor stands still; they outlive a reset. */
#include <math.h>

#define QUANTUM ENCODER_QUANTUM       /* rad in one count */
#define LEAST (-WISH_SPAN)            /* N m at ADC count 0 */
#define PER_COUNT (WISH_SPAN / 2048.0) /* N m in one count of a converter of 12 bits */

struct board {
    volatile int32_t encoder;    /* counts */
    volatile uint32_t frame;     /* number of the frame in which they came */
    volatile uint32_t converter; /* counts of the wish, 0 to 4095 */
    volatile uint32_t status;    /* last status word */
    volatile uint32_t faults;    /* of the processor, counted by its handler */
    volatile uint32_t starts;    /* of the program */
    volatile double current;     /* A, what the amplifier is given */
    volatile double torque;      /* N m, for the log */
    volatile float share;        /* of the current that the supervisor lets act; the amplifier here takes all */
    volatile uint32_t clock;     /* SysTick when the step ended */
    volatile uint32_t samples;   /* written last: the sample is over */
};
#define BOARD_CELLS ((struct board *)0x20300000u)

static void read_inputs(torque_loop_inputs *given)
{
    static uint32_t last_frame;
    const uint32_t frame = BOARD_CELLS->frame;

    given->motor.angle = frame != last_frame ? (REAL)((double)BOARD_CELLS->encoder * QUANTUM) : (REAL)NAN;
    given->spring.torque.desired = (REAL)(LEAST + (double)BOARD_CELLS->converter * PER_COUNT);
    last_frame = frame;
}

static void write_outputs(const torque_loop_outputs *given, uint32_t status, float share)
{
    BOARD_CELLS->current = (double)given->motor.current;
    BOARD_CELLS->torque = (double)given->spring.torque;
    BOARD_CELLS->status = status;
    BOARD_CELLS->share = share;
    BOARD_CELLS->clock = SYST_CVR;
    BOARD_CELLS->samples = BOARD_CELLS->samples + 1u;
}
