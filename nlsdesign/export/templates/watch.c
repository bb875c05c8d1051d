@title@
#include <math.h>
#include <stddef.h>

#include "@name@.h"

#ifdef __FAST_MATH__
#error "the guards need IEEE arithmetic: compile without -ffast-math"
#endif
#if defined(__BYTE_ORDER__) && defined(__ORDER_LITTLE_ENDIAN__) && (__BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__)
#error "records have the least significant byte first"
#endif

#define STARTED 0x57415443u
#define SETTLING @settling@u
#define HALF ((@NAME@_MOST + 1u) / 2u) /* rows */

enum { ONE_WAY = 1u, FORWARD = 2u, BACKWARD = 3u };

typedef struct {
    uint32_t changes; /* how many there are; the rest of a row is zero */
    uint32_t first_bit; /* in the word */
    uint32_t kinds; /* of motion that it has to see */
    @real@ least_speed; /* below which friction may stick */
    @real@ speeds[2]; /* between bins */
    @real@ load;
} block_numbers;

static const block_numbers numbers[@NAME@_BLOCKS] = {
    @numbers@
};

/* Adds the products of one mean. */
static void add(@name@_moments *moments, const @real@ *mean)
{
    uint32_t at = 0u;

    moments->count += @one@;
    for (uint32_t i = 0u; i <= @NAME@_MOST; ++i) {
        for (uint32_t j = 0u; j <= i; ++j) {
            moments->products[at] += mean[i] * mean[j];
            ++at;
        }
    }
}

/* Forgets a share. */
static void forget(@name@_moments *moments, @real@ kept)
{
    moments->count *= kept;
    for (uint32_t i = 0u; i < @NAME@_PAIRS; ++i) {
        moments->products[i] *= kept;
    }
}

/* Writes the moments as a full matrix, with what is known before of the changes, where the residuals leave a square. */
static void fill(@real@ (*work)[@NAME@_MOST + 1u], const @name@_moments *moments, @real@ square)
{
    const @real@ prior = (square / (moments->count + @one@)) * @prior@ + @tiny@;
    uint32_t at = 0u;

    for (uint32_t i = 0u; i <= @NAME@_MOST; ++i) {
        for (uint32_t j = 0u; j <= i; ++j) {
            work[i][j] = moments->products[at];
            work[j][i] = moments->products[at];
            ++at;
        }
    }
    for (uint32_t i = 0u; i < @NAME@_MOST; ++i) {
        work[i][i] += (work[i][i] * @ridge@) + prior;
    }
}

/* Solves for one more change: a step of Gauss and Jordan in place, in two halves. */
static void sweep(@real@ (*work)[@NAME@_MOST + 1u], uint32_t pivot, uint32_t half)
{
    uint32_t end = @NAME@_MOST + 1u;

    if (half == 0u) {
        const @real@ inverse = @one@ / work[pivot][pivot];

        end = HALF;
        for (uint32_t j = 0u; j <= @NAME@_MOST; ++j) {
            work[pivot][j] *= inverse;
        }
        work[pivot][pivot] = inverse;
    }
    for (uint32_t i = half * HALF; i < end; ++i) {
        if (i != pivot) {
            const @real@ factor = work[i][pivot];

            work[i][pivot] = @zero@;
            for (uint32_t j = 0u; j <= @NAME@_MOST; ++j) {
                work[i][j] -= factor * work[pivot][j];
            }
        }
    }
}

/* Says which changes are as large as is to be noticed, and surely so. */
static uint32_t judged(@name@_state *state, const @name@_moments *moments, const block_numbers *block)
{
    @real@ (*const work)[@NAME@_MOST + 1u] = state->work;
    const uint32_t changes = block->changes;
    uint32_t word = 0u;

    if (moments->count < @least@) {
        word = @NAME@_LITTLE_EVIDENCE;
    } else if (state->kinds < block->kinds) {
        word = @NAME@_LITTLE_EVIDENCE | @NAME@_ONE_MOTION;
    } else {
        const @real@ variance = work[@NAME@_MOST][@NAME@_MOST] / (moments->count - (@real@)changes);

        for (uint32_t i = 0u; i < changes; ++i) {
            const @real@ change = work[i][@NAME@_MOST];

            if (work[i][i] > @zero@ && @fabs@(change) > @limit@ && change * change > @sure@ * variance * work[i][i]) {
                word |= @NAME@_CHANGED | (1u << (block->first_bit + i));
            }
        }
        if (variance > block->load * block->load) {
            word |= @NAME@_CHANGED | @NAME@_MISFIT;
        }
    }
    return word;
}

/* One piece of a judgement: bins forget one by one, then the recent evidence of each block is solved. */
static void go_on(@name@_state *state)
{
    const uint32_t each = @NAME@_BINS + (2u * @NAME@_MOST) + 2u;
    const uint32_t block = (state->task - 1u) / each;
    const uint32_t piece = (state->task - 1u) % each;
    @name@_moments *const recent = &state->record.recent[block];

    if (piece < @NAME@_BINS) {
        @name@_moments *const bin = &state->record.bins[block][piece];

        /* What a model lacks looks like a change where one motion comes again and again, cold or warm. */
        if (piece == 0u) {
            state->kinds = state->commissioned;
        }
        if (piece < @NAME@_BINS / 2u && bin->count + bin[@NAME@_BINS / 2u].count >= @some@) {
            ++state->kinds;
        }
        forget(bin, @kept@);
    } else if (piece == @NAME@_BINS) {
        fill(state->work, recent, recent->products[@NAME@_PAIRS - 1u]);
    } else if (piece <= @NAME@_BINS + (2u * numbers[block].changes)) {
        const uint32_t turn = piece - @NAME@_BINS - 1u;

        sweep(state->work, turn / 2u, turn % 2u);
    } else if (piece == each - 1u) {
        state->found |= judged(state, recent, &numbers[block]);
        forget(recent, @recently@);
        if (block == @NAME@_BLOCKS - 1u) {
            state->record.word = state->found;
            ++state->record.judged;
            state->task = 0u;
        }
    } else {
        /* a block with fewer changes */
    }
    if (state->task != 0u) {
        ++state->task;
    }
}

/* Adds one sample to the sums of a block. */
static void gather(@name@_gathered *to, const @real@ *given, const block_numbers *block, uint32_t usable)
{
    const @real@ speed = @fabs@(given[@NAME@_MOST + 1u]);

    for (uint32_t i = 0u; i <= @NAME@_MOST; ++i) {
        to->sum[i] += given[i];
    }
    to->sum[@NAME@_MOST + 1u] += speed;
    to->sum[@NAME@_MOST + 2u] += @fabs@(given[@NAME@_MOST + 2u]);
    if (usable == 0u || !(speed >= block->least_speed)) {
        ++to->refused;
    }
    if (given[@NAME@_MOST + 1u] > @zero@) {
        ++to->forward;
    }
}

/* Ends a mean. The one before it is used where those on both sides can be used too: the filter has seen a reversal some
   samples before its own speed turns, and some after. */
static void finish(@name@_state *state, uint32_t number, @real@ temperature)
{
    const block_numbers *const block = &numbers[number];
    @name@_gathered *const from = &state->gathered[number];
    const @real@ *const reference = state->record.reference[number];
    const @real@ speed = from->sum[@NAME@_MOST + 1u] * @share@;
    uint32_t way = (from->refused == 0u) ? ONE_WAY : 0u;

    if (way != 0u && block->least_speed > @zero@) {
        way = (from->forward == 0u) ? BACKWARD : ((from->forward == @NAME@_LENGTH) ? FORWARD : 0u);
    }
    from->fresh = 0u;
    if (way != 0u && from->before == way && from->earlier == way) {
        @real@ residual = from->held[@NAME@_MOST];

        from->fresh = 1u;
        for (uint32_t i = 0u; i < @NAME@_MOST; ++i) {
            from->mean[i] = from->held[i];
            residual -= reference[i] * from->held[i];
        }
        from->mean[@NAME@_MOST] = residual;
        add(&state->record.bins[number][from->bin], from->mean);
    }
    from->earlier = from->before;
    from->before = way;
    from->bin = 0u;
    from->bin += (speed > block->speeds[0]) ? 1u : 0u;
    from->bin += (speed > block->speeds[1]) ? 1u : 0u;
    from->bin += (from->sum[@NAME@_MOST + 2u] * @share@ > block->load) ? 3u : 0u;
    from->bin += (temperature > @warm@) ? 6u : 0u;
    for (uint32_t i = 0u; i <= @NAME@_MOST; ++i) {
        from->held[i] = from->sum[i] * @share@;
        from->sum[i] = @zero@;
    }
    from->sum[@NAME@_MOST + 1u] = @zero@;
    from->sum[@NAME@_MOST + 2u] = @zero@;
    from->refused = 0u;
    from->forward = 0u;
}

uint32_t @name@_take(@name@_state *state, const @real@ given[@NAME@_BLOCKS * @NAME@_COLUMNS], uint32_t usable, @real@ temperature)
{
    uint32_t word = @NAME@_NOT_STARTED;

    if (state->started == STARTED) {
        const uint32_t sample = state->sample;
        uint32_t used = usable;

        if (state->settling > 0u) {
            --state->settling;
            used = 0u;
        }
        for (uint32_t i = 0u; i < @NAME@_BLOCKS; ++i) {
            gather(&state->gathered[i], &given[i * @NAME@_COLUMNS], &numbers[i], used);
        }
        if (sample < @NAME@_BLOCKS) {
            finish(state, sample, temperature);
        } else if (sample < 2u * @NAME@_BLOCKS) {
            const uint32_t number = sample - @NAME@_BLOCKS;

            if (state->gathered[number].fresh != 0u) {
                add(&state->record.recent[number], state->gathered[number].mean);
            }
        } else if (state->task != 0u) {
            go_on(state);
        } else {
            /* nothing to do */
        }
        state->sample = (sample + 1u == @NAME@_LENGTH) ? 0u : sample + 1u;
        if (state->sample == 0u) {
            ++state->means;
            if (state->means == @NAME@_PERIOD) {
                state->means = 0u;
                state->task = 1u;
                state->found = 0u;
            }
        }
        word = state->record.word | ((state->gathered[0].refused != 0u) ? @NAME@_NOT_USED : 0u);
    }
    return word;
}

uint32_t @name@_step(@name@_state *state, const @name@_residuals_inputs *inputs, @real@ temperature)
{
    @name@_residuals_outputs outputs;
    const uint32_t status = @name@_residuals_step(&state->residuals, inputs, &outputs);
    const @real@ given[@NAME@_BLOCKS * @NAME@_COLUMNS] = {
        @given@
    };

    return @name@_take(state, given, (status == 0u) ? 1u : 0u, temperature);
}

void @name@_init(@name@_state *state)
{
    static const uint32_t digest[4] = {@digest@};

    *state = (@name@_state){0};
    (void)@name@_residuals_init(&state->residuals, NULL);
    state->record.magic = @magic@;
    state->record.version = @version@u;
    state->record.size = (uint32_t)sizeof(@name@_record);
    state->record.real = (uint32_t)sizeof(@real@);
    state->record.word = @NAME@_LITTLE_EVIDENCE;
    for (uint32_t i = 0u; i < 4u; ++i) {
        state->record.digest[i] = digest[i];
    }
    for (uint32_t i = 0u; i < @NAME@_BLOCKS; ++i) {
        state->gathered[i].refused = 1u;
    }
    state->settling = SETTLING;
    state->started = STARTED;
}

uint32_t @name@_commission(@name@_state *state)
{
    uint32_t enough = 0u;

    if (state->started == STARTED) {
        enough = 1u;
    }
    for (uint32_t number = 0u; number < @NAME@_BLOCKS && enough != 0u; ++number) {
        @real@ count = @zero@;

        for (uint32_t bin = 0u; bin < @NAME@_BINS; ++bin) {
            count += state->record.bins[number][bin].count;
        }
        if (!(count >= @enough@)) {
            enough = 0u;
        }
    }
    for (uint32_t number = 0u; number < @NAME@_BLOCKS && enough != 0u; ++number) {
        const uint32_t changes = numbers[number].changes;
        @name@_moments *const bins = state->record.bins[number];
        @name@_moments all = bins[0];

        for (uint32_t bin = 1u; bin < @NAME@_BINS; ++bin) {
            all.count += bins[bin].count;
            for (uint32_t i = 0u; i < @NAME@_PAIRS; ++i) {
                all.products[i] += bins[bin].products[i];
            }
        }
        @real@ square = all.products[@NAME@_PAIRS - 1u];

        /* First with all that is left as noise, then with what the first solution leaves. */
        for (uint32_t turn = 0u; turn < 2u; ++turn) {
            fill(state->work, &all, square);
            for (uint32_t i = 0u; i < changes; ++i) {
                sweep(state->work, i, 0u);
                sweep(state->work, i, 1u);
            }
            square = state->work[@NAME@_MOST][@NAME@_MOST];
        }
        for (uint32_t i = 0u; i < changes; ++i) {
            state->record.reference[number][i] += state->work[i][@NAME@_MOST];
        }
        for (uint32_t bin = 0u; bin < @NAME@_BINS; ++bin) {
            forget(&bins[bin], @zero@);
        }
        forget(&state->record.recent[number], @zero@);
        state->gathered[number].before = 0u;
        state->gathered[number].earlier = 0u;
        state->gathered[number].fresh = 0u;
    }
    if (enough != 0u) {
        state->task = 0u;
        state->commissioned = @kinds@u;
        state->record.word = @NAME@_LITTLE_EVIDENCE;
    }
    return enough;
}

void @name@_seal(@name@_record *record)
{
    static const uint32_t of_half_byte[16] = {
        @half_bytes@
    };
    const unsigned char *const bytes = (const unsigned char *)record;
    const size_t end = offsetof(@name@_record, checksum);
    uint32_t sum = 0xffffffffu;

    for (size_t i = 0u; i < end; ++i) {
        sum ^= bytes[i];
        sum = (sum >> 4u) ^ of_half_byte[sum & 15u];
        sum = (sum >> 4u) ^ of_half_byte[sum & 15u];
    }
    record->checksum = sum ^ 0xffffffffu;
}
