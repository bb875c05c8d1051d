/* scheduled damper: Force of a damper whose viscosity depends on speed
   Sample time 0.01 s; all numbers in SI units, given in brackets.
   Deck damper, 111111111111 (SHA-256 of its parts).
   From older_damper, 000000000000 (diagnosed).
   Written by nlsdesign (version) with CasADi (version); do not edit. */
#ifndef SCHEDULED_DAMPER_H
#define SCHEDULED_DAMPER_H

#include <stddef.h> /* NULL, for init */
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SCHEDULED_DAMPER_SAMPLE_TIME 0.01 /* s */
#define SCHEDULED_DAMPER_DECK "damper"
#define SCHEDULED_DAMPER_DECK_DIGEST "1111111111111111111111111111111111111111111111111111111111111111"
#define SCHEDULED_DAMPER_PARENT_DIGEST "0000000000000000000000000000000000000000000000000000000000000000"
#define SCHEDULED_DAMPER_INTERFACE_VERSION 0xa012fa8bu /* another one where structures, functions or units differ */

/* Bits of the status word. Bit 16 + i names input i (of step) or parameter i (of init and
   set_parameters) as numbered below; bit 30 stands for all from 14 on: of these the refused parameters are those
   that differ from the state's afterwards. */
#define SCHEDULED_DAMPER_INPUT_HELD 0x1u /* an input was not finite; its last good value, or what was expected, was used */
#define SCHEDULED_DAMPER_INPUT_SATURATED 0x2u /* a command was outside its range, the limit was used */
#define SCHEDULED_DAMPER_STATE_RESTARTED 0x4u /* the next state was not finite; the next sample begins anew from its readings */
#define SCHEDULED_DAMPER_OUTPUT_HELD 0x8u /* an output was not finite, the last good outputs were given */
#define SCHEDULED_DAMPER_PARAMETER_REFUSED 0x10u /* a parameter was not finite or outside its range, it was not taken */
#define SCHEDULED_DAMPER_INPUT_OUT_OF_RANGE 0x20u /* a reading was outside its range; what was expected was used */
#define SCHEDULED_DAMPER_INPUT_JUMPED 0x40u /* a reading changed faster than its largest rate; what was expected was used */
#define SCHEDULED_DAMPER_INPUT_STALE 0x80u /* a reading has not changed for its stale time while the drive has; it was used all the same */
#define SCHEDULED_DAMPER_OUT_OF_TABLE 0x100u /* a table was read beyond its ends, where it holds its last numbers */
#define SCHEDULED_DAMPER_RECOVERED 0x200u /* a reading is used again after a gap */
#define SCHEDULED_DAMPER_WAITING 0x400u /* no usable reading has come yet; the outputs are those of the start */
#define SCHEDULED_DAMPER_NOT_STARTED 0x800u /* init has not been called; all outputs are 0, nothing was taken */
#define SCHEDULED_DAMPER_COMMAND_SLOWED 0x1000u /* a command changed faster than the drive can follow; what it can reach was used */
#define SCHEDULED_DAMPER_SAMPLE_LATE 0x2000u /* of step_at: samples are missing before this one */
#define SCHEDULED_DAMPER_SAMPLE_REPEATED 0x4000u /* of step_at: the sample came twice; the last outputs were given */
#define SCHEDULED_DAMPER_INNOVATION_LARGE 0x8000u /* readings have differed from what is expected by more than the deck explains; nothing was changed */

/* What step reads. */
typedef struct {
    struct {
        double speed; /* 0: [m/s, -1 to 1] Speed */
    } piston;
    struct {
        double opening; /* 1: [1, 0 to 1] Opening of the valve */
    } valve;
} scheduled_damper_inputs;

/* What step gives, always finite. */
typedef struct {
    struct {
        double force; /* [N] Force */
    } piston;
} scheduled_damper_outputs;

/* Tunable numbers. */
typedef struct {
    struct {
        double gain; /* 0: [N*s/m, 0 to 10] Weight of the past; bench 2024-05-01 */
    } memory;
} scheduled_damper_parameters;

/* What is remembered from sample to sample. */
typedef struct {
    struct {
        double filtered; /* [m/s] Filtered speed */
    } piston;
} scheduled_damper_states;

/* What is remembered of a measured input. */
typedef struct {
    double last; /* last good reading */
    double slope; /* its change in the last sample */
    double candidate; /* last refused reading */
    double mover; /* what moves the machine, when the reading last changed */
    uint32_t missed; /* samples since the last good reading */
    uint32_t agreeing; /* refused readings in a row that agree with one another */
    uint32_t unchanged; /* samples without change */
    uint32_t moved; /* whether what moves the machine has changed meanwhile */
    uint32_t seen; /* whether there has been a good reading */
} scheduled_damper_reading;

/* One running instance; the caller owns it, there may be many. */
typedef struct {
    scheduled_damper_parameters parameters;
    scheduled_damper_states states;
    scheduled_damper_inputs inputs; /* as they were taken */
    scheduled_damper_outputs outputs; /* last good */
    scheduled_damper_reading readings[1]; /* in the order of the inputs */
    uint32_t begun; /* 0 until a usable reading has come, and after a state that was not finite */
    uint32_t started; /* SCHEDULED_DAMPER_INTERFACE_VERSION from init on; with any other number step gives NOT_STARTED */
} scheduled_damper_state;

/* No pointer may be null but the parameters of init; none is checked. */

/* Gives the parameters of the design. */
void scheduled_damper_defaults(scheduled_damper_parameters *parameters);

/* Starts an instance; null stands for the parameters of the design. The first step takes its states from the
   first usable readings, of a machine at rest. Returns a status word. */
uint32_t scheduled_damper_init(scheduled_damper_state *state, const scheduled_damper_parameters *parameters);

/* Takes over parameters, each only if it is within its range. Returns a status word; before init nothing is taken. */
uint32_t scheduled_damper_set_parameters(
    scheduled_damper_state *state,
    const scheduled_damper_parameters *parameters);

/* Computes the outputs of this sample and the state of the next. Returns a status word. Before init, with a state
   of any content, all outputs are 0 and the word is SCHEDULED_DAMPER_NOT_STARTED. */
uint32_t scheduled_damper_step(
    scheduled_damper_state *state,
    const scheduled_damper_inputs *inputs,
    scheduled_damper_outputs *outputs);

/* When the last sample was taken; all zero before the first. The caller owns it. */
typedef struct {
    uint32_t last; /* us */
    uint32_t running; /* 0 before the first sample */
} scheduled_damper_clock;

/* The same with the time in us at which the inputs were read, from a counter that may run over. A sample less than half
   a sample time after the last one is SCHEDULED_DAMPER_SAMPLE_REPEATED: nothing is computed, the outputs are the last ones.
   One later than one and a half is SCHEDULED_DAMPER_SAMPLE_LATE, and counts as one after missing readings. */
uint32_t scheduled_damper_step_at(
    scheduled_damper_clock *clock,
    scheduled_damper_state *state,
    const scheduled_damper_inputs *inputs,
    scheduled_damper_outputs *outputs,
    uint32_t microseconds);

#ifdef __cplusplus
}
#endif

/* Numbers of the deck, each with its source.
   gain = 0.75 N*s/m +- 10 % (bench 2024-05-01) */

#endif
