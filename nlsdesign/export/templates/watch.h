@title@
#ifndef @NAME@_H
#define @NAME@_H

#include <stdint.h>

#include "@name@_residuals.h"

#define @NAME@_BLOCKS @blocks@u
#define @NAME@_MOST @most@u /* changes of the block that has most */
#define @NAME@_PAIRS @pairs@u /* products of the residual and the changes, each pair once */
#define @NAME@_BINS @bins@u /* of speed, load and temperature */
#define @NAME@_COLUMNS (@NAME@_MOST + 3u) /* of a block in a sample: changes, residual, speed, load */
#define @NAME@_LENGTH @length@u /* samples whose mean is one residual */
#define @NAME@_PERIOD @period@u /* such means between two judgements */

/* Word of a step, that of the last judgement: */
#define @NAME@_CHANGED 0x1u /* the model no longer holds; bits from 8 on say what the evidence points to */
#define @NAME@_LITTLE_EVIDENCE 0x2u /* too little motion of late to say anything */
#define @NAME@_NOT_USED 0x4u /* this sample: a reading was refused, or the machine stands still */
#define @NAME@_NOT_STARTED 0x8u /* init was not called */
#define @NAME@_MISFIT 0x10u /* with CHANGED: more efforts are left than the usual load, and no change takes them away */
#define @NAME@_ONE_MOTION 0x20u /* with LITTLE_EVIDENCE: the motion of late was too much alike, and commission was not called */
@names@

/* Sums of products over means that were used. */
typedef struct {
    @real@ count;
    @real@ products[@NAME@_PAIRS];
} @name@_moments;

/* What is kept for `nlsdesign watch read`: write it to a file as it lies in memory, after @name@_seal. */
typedef struct {
    uint32_t magic;
    uint32_t version;
    uint32_t size; /* B, of the whole */
    uint32_t real; /* B, of a number */
    uint32_t digest[4]; /* of the deck, then of what is watched */
    uint32_t judged; /* periods since init */
    uint32_t word; /* of the last judgement */
    @real@ reference[@NAME@_BLOCKS][@NAME@_MOST]; /* changes that count as none; a unit is the change to be noticed */
    @name@_moments recent[@NAME@_BLOCKS]; /* what is judged; a quarter of it is forgotten in each period */
    @name@_moments bins[@NAME@_BLOCKS][@NAME@_BINS]; /* forgotten with a time constant of @memory@ s */
    uint32_t checksum; /* CRC-32 of all before it */
    uint32_t spare;
} @name@_record;

/* Sums of the mean that is being formed. */
typedef struct {
    @real@ sum[@NAME@_COLUMNS];
    @real@ held[@NAME@_MOST + 1u]; /* the last mean */
    @real@ mean[@NAME@_MOST + 1u]; /* the one before it, where it is used */
    uint32_t bin; /* of the last mean */
    uint32_t refused; /* samples that cannot be used */
    uint32_t forward; /* samples of motion in the positive direction */
    uint32_t before; /* how the last mean can be used, 0 if not */
    uint32_t earlier; /* the same of the one before it */
    uint32_t fresh; /* whether a mean waits to be added to the recent ones */
} @name@_gathered;

/* One running instance; the caller owns it. No pointer may be null; none is checked. */
typedef struct {
    @name@_record record; /* first: descriptions for other tools count from here */
    @name@_residuals_state residuals;
    @name@_gathered gathered[@NAME@_BLOCKS];
    @real@ work[@NAME@_MOST + 1u][@NAME@_MOST + 1u];
    uint32_t sample; /* in the mean */
    uint32_t means; /* in the period */
    uint32_t task; /* of the judgement, 0 where none goes on */
    uint32_t found; /* word of the judgement that goes on */
    uint32_t settling; /* samples until the filters have settled */
    uint32_t kinds; /* of motion that the block of the judgement has seen */
    uint32_t commissioned; /* kinds that need not be seen, as the machine is held against itself */
    uint32_t started;
} @name@_state;

#ifdef __cplusplus
extern "C" {
#endif

void @name@_init(@name@_state *state);

/* Looks at one sample: the readings as the observer takes them, and a temperature in degrees Celsius that chooses the bin
   (0 where there is none). Returns the word. */
uint32_t @name@_step(@name@_state *state, const @name@_residuals_inputs *inputs, @real@ temperature);

/* The second half of the step, from what the residuals give; for tests. */
uint32_t @name@_take(@name@_state *state, const @real@ given[@NAME@_BLOCKS * @NAME@_COLUMNS], uint32_t usable, @real@ temperature);

/* Takes the machine as it is for the one that is to be held: what the evidence of the last minutes points to counts as
   no change from now on. 1 if it was taken, 0 if there is too little evidence. To be called between two steps, beside
   the samples: it takes as long as a judgement in one piece. */
uint32_t @name@_commission(@name@_state *state);

/* Gives the record its checksum. */
void @name@_seal(@name@_record *record);

#ifdef __cplusplus
}
#endif

#endif
