/* Self-test of @name@: returns 0, or what differs: 1 the word, 2 the evidence, 3 the checksum. */
#include <math.h>
#include <stdio.h>

#include "@name@.h"

@expected@
int main(void)
{
    static @name@_state state;
    @real@ given[@NAME@_BLOCKS * @NAME@_COLUMNS] = {0};
    uint32_t word = 1u;
    uint32_t told = 0u;
    int differs = 0;

    @name@_init(&state);
    state.settling = 0u;
    for (uint32_t k = 0u; k < @test_samples@u; ++k) {
        const uint32_t turn = k / @NAME@_LENGTH;

        @drawn@
        told = @name@_take(&state, given, 1u, @zero@);
    }
    if ((told & ~@NAME@_NOT_USED) != @expected_word@ || state.record.word != @expected_word@) {
        differs = 1;
    }
    for (uint32_t i = 0u; i < 2u * @NAME@_BLOCKS && differs == 0; ++i) {
        for (uint32_t j = 0u; j <= @NAME@_PAIRS; ++j) {
            @real@ sum = @zero@;

            for (uint32_t bin = 0u; bin < @NAME@_BINS; ++bin) {
                const @name@_moments *const from = (i < @NAME@_BLOCKS)
                    ? &state.record.recent[i] : &state.record.bins[i - @NAME@_BLOCKS][bin];

                if (i >= @NAME@_BLOCKS || bin == 0u) {
                    sum += (j == 0u) ? from->count : from->products[j - 1u];
                }
            }
            if (!(@fabs@(sum - expected[i][j]) <= @tolerance@ * expected[i][0])) {
                differs = 2;
            }
        }
    }
    @name@_seal(&state.record);
    told = state.record.checksum;
    state.record.bins[0][0].count += @one@;
    @name@_seal(&state.record);
    if (differs == 0 && told == state.record.checksum) {
        differs = 3;
    }
    if (differs != 0) {
        (void)printf("%d differs\n", differs);
    }
    return differs;
}
