@title@
#ifndef @NAME@_H
#define @NAME@_H

#include <stddef.h> /* NULL, for init */
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define @NAME@_SAMPLE_TIME @sample_time@ /* s */
@provenance@
#define @NAME@_INTERFACE_VERSION @interface@ /* another one where structures, functions or units differ */

/* Bits of the status word. Bit 16 + i names input i (of step) or parameter i (of init and
   set_parameters) as numbered below; bit 30 stands for all from 14 on: of these the refused parameters are those
   that differ from the state's afterwards. */
@bits@

@inputs@

@outputs@

@parameters@

@states@

@reading@
@block@
/* One running instance; the caller owns it, there may be many. */
typedef struct {
    @name@_parameters parameters;
    @name@_states states;
    @name@_inputs inputs; /* as they were taken */
    @name@_outputs outputs; /* last good */
    @loaded@
    @readings@
    @derived@
    uint32_t begun; /* 0 until a usable reading has come, and after a state that was not finite */
    uint32_t started; /* @NAME@_INTERFACE_VERSION from init on; with any other number step gives NOT_STARTED */
} @name@_state;

/* No pointer may be null but the parameters of init; none is checked. */

/* Gives the parameters of the design. */
void @name@_defaults(@name@_parameters *parameters);

/* Starts an instance; null stands for the parameters of the design. The first step takes its states from the
   first usable readings, of a machine at rest. Returns a status word. */
@init@;

/* Takes over parameters, each only if it is within its range. Returns a status word; before init nothing is taken. */
@set_parameters@;

@load_head@
/* Computes the outputs of this sample and the state of the next. Returns a status word. Before init, with a state
   of any content, all outputs are 0 and the word is @NAME@_NOT_STARTED. */
@step@;

/* When the last sample was taken; all zero before the first. The caller owns it. */
typedef struct {
    uint32_t last; /* us */
    uint32_t running; /* 0 before the first sample */
} @name@_clock;

/* The same with the time in us at which the inputs were read, from a counter that may run over. A sample less than half
   a sample time after the last one is @NAME@_SAMPLE_REPEATED: nothing is computed, the outputs are the last ones.
   One later than one and a half is @NAME@_SAMPLE_LATE, and counts as one after missing readings. */
@step_at@;

#ifdef __cplusplus
}
#endif
@numbers@

#endif
