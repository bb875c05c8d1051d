/* Frames between @name@ on a board and a desk, least significant byte first; a log of a robot is a row of frames to the desk.
   to the board   "NLSI", sequence, inputs, CRC-32 of all before it
   to the desk    "NLSO", sequence, status word, outputs, CRC-32 of all before it
   Sequence and words have 4 bytes, inputs and outputs are numbers of the step in the order below. Sequence 0 starts the
   step anew; a frame that comes again is answered again, without a step. */
#ifndef @NAME@_LINK_H
#define @NAME@_LINK_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "@name@.h"

#define @NAME@_REQUEST (12u + @inputs@u * sizeof(@real@)) /* B */
#define @NAME@_FRAME (16u + @outputs@u * sizeof(@real@)) /* B */

/* One running instance behind a wire; the caller owns it. All zero at the start. */
typedef struct {
    @name@_state state;
    uint32_t sequence; /* of the last request */
    uint32_t count; /* bytes that are here of the next one */
    uint8_t request[@NAME@_REQUEST];
    uint8_t frame[@NAME@_FRAME]; /* the last answer */
} @name@_link;

static inline uint32_t @name@_frame_sum(const uint8_t *bytes, size_t count)
{
    static const uint32_t of_half_byte[16] = {
        @half_bytes@
    };
    uint32_t sum = 0xffffffffu;

    for (size_t i = 0u; i < count; ++i) {
        sum ^= bytes[i];
        sum = (sum >> 4u) ^ of_half_byte[sum & 15u];
        sum = (sum >> 4u) ^ of_half_byte[sum & 15u];
    }
    return sum ^ 0xffffffffu;
}

/* Writes what a sample gave as a frame. */
static inline void @name@_log(uint8_t *frame, uint32_t sequence, uint32_t status, const @name@_outputs *outputs)
{
    const @real@ numbers[@outputs@] = {
        @given@
    };
    uint32_t sum;

    (void)memcpy(frame, "NLSO", 4u);
    (void)memcpy(frame + 4, &sequence, 4u);
    (void)memcpy(frame + 8, &status, 4u);
    (void)memcpy(frame + 12, numbers, sizeof numbers);
    sum = @name@_frame_sum(frame, @NAME@_FRAME - 4u);
    (void)memcpy(frame + @NAME@_FRAME - 4u, &sum, 4u);
}

/* Takes one byte from the wire; returns 1 when the frame is an answer that is to be sent. */
static inline int @name@_take(@name@_link *link, uint8_t byte)
{
    @real@ numbers[@inputs@];
    uint32_t sequence;
    uint32_t sum;
    @name@_inputs inputs = {0};
    @name@_outputs outputs;

    link->request[link->count] = byte;
    ++link->count;
    if (link->count == 4u && memcmp(link->request, "NLSI", 4u) != 0) {
        (void)memmove(link->request, link->request + 1, 3u);
        link->count = 3u;
    }
    if (link->count < @NAME@_REQUEST) {
        return 0;
    }
    link->count = 0u;
    (void)memcpy(&sum, link->request + @NAME@_REQUEST - 4u, 4u);
    if (sum != @name@_frame_sum(link->request, @NAME@_REQUEST - 4u)) {
        return 0; /* the desk asks again */
    }
    (void)memcpy(&sequence, link->request + 4, 4u);
    (void)memcpy(numbers, link->request + 8, sizeof numbers);
    if (sequence == 0u) {
        (void)@name@_init(&link->state, NULL);
    } else if (sequence == link->sequence) {
        return 1;
    } else if (sequence != link->sequence + 1u) {
        return 0;
    } else {
        /* the next sample */
    }
    link->sequence = sequence;
    @assignments@
    const uint32_t status = @name@_step(&link->state, &inputs, &outputs);
    @name@_log(link->frame, sequence, status, &outputs);
    return 1;
}

#if defined(__BYTE_ORDER__) && defined(__ORDER_LITTLE_ENDIAN__) && (__BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__)
#error "frames have the least significant byte first"
#endif
#endif
