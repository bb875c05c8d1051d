/* scheduled damper: Force of a damper whose viscosity depends on speed
   Sample time 0.01 s; all numbers in SI units, given in brackets.
   Deck damper, 111111111111 (SHA-256 of its parts).
   It was diagnosed from older_damper, 000000000000.
   Written by nlsdesign (version) with CasADi (version); do not edit. */
#ifndef SCHEDULED_DAMPER_H
#define SCHEDULED_DAMPER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SCHEDULED_DAMPER_SAMPLE_TIME 0.01 /* s */
#define SCHEDULED_DAMPER_DECK "damper"
#define SCHEDULED_DAMPER_DECK_DIGEST "1111111111111111111111111111111111111111111111111111111111111111"
#define SCHEDULED_DAMPER_PARENT_DIGEST "0000000000000000000000000000000000000000000000000000000000000000"
#define SCHEDULED_DAMPER_INTERFACE_VERSION 0xc2554f9fu /* another one where structures, functions or units differ */

/* Bits of the status word. Bit 8 + i names input i (of step) or parameter i (of init and
   set_parameters) as numbered below; bit 30 stands for all from 22 on. */
#define SCHEDULED_DAMPER_INPUT_HELD 0x1u /* an input was not finite, its last good value was used */
#define SCHEDULED_DAMPER_INPUT_SATURATED 0x2u /* an input was outside its range, the limit was used */
#define SCHEDULED_DAMPER_STATE_HELD 0x4u /* the next state was not finite, the state was kept */
#define SCHEDULED_DAMPER_OUTPUT_HELD 0x8u /* an output was not finite, the last good outputs were given */
#define SCHEDULED_DAMPER_PARAMETER_REFUSED 0x10u /* a parameter was not finite or outside its range, it was not taken */

/* What step reads. */
typedef struct {
    struct {
        double speed; /* 0: [m/s, -1 to 1] Speed */
    } piston;
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

/* One running instance; the caller owns it, there may be many. */
typedef struct {
    scheduled_damper_parameters parameters;
    scheduled_damper_states states;
    scheduled_damper_inputs inputs; /* last good */
    scheduled_damper_outputs outputs; /* last good */
} scheduled_damper_state;

/* Gives the parameters of the design. */
void scheduled_damper_defaults(scheduled_damper_parameters *parameters);

/* Starts an instance; null stands for the parameters of the design. Returns a status word. */
uint32_t scheduled_damper_init(scheduled_damper_state *state, const scheduled_damper_parameters *parameters);

/* Takes over parameters, each only if it is within its range. Returns a status word. */
uint32_t scheduled_damper_set_parameters(
    scheduled_damper_state *state,
    const scheduled_damper_parameters *parameters);

/* Computes the outputs of this sample and the state of the next. Returns a status word. */
uint32_t scheduled_damper_step(
    scheduled_damper_state *state,
    const scheduled_damper_inputs *inputs,
    scheduled_damper_outputs *outputs);

#ifdef __cplusplus
}
#endif

/* Numbers of the deck, each with its source.
   gain = 0.75 N*s/m +- 10 % (bench 2024-05-01) */

#endif
