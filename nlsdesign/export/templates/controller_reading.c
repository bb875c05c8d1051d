/* What a reading can be, per sample; patience is the number of samples without change after which it is stale. */
typedef struct {
    @real@ lowest;
    @real@ highest;
    @real@ change;
    @real@ noticeable;
    uint32_t patience;
} reading_limits;

@readings@

/* Takes a reading if it can be true, else what the last ones let expect. Refused readings that agree with one
   another @AGREEING@ times in a row are believed. Returns whether the model has to resume after a gap. */
static uint32_t plausible(@real@ given, @real@ mover, const reading_limits *can, @name@_reading *seen, @real@ *used,
                          uint32_t which, uint32_t *status)
{
    uint32_t flaw = 0u;
    uint32_t resuming = 0u;

    if (!(given >= can->lowest && given <= can->highest)) {
        seen->agreeing = 0u;
        flaw = @NAME@_INPUT_HELD;
        if (given >= -@LARGEST@ && given <= @LARGEST@) {
            flaw = @NAME@_INPUT_OUT_OF_RANGE;
        }
    } else if (seen->seen == 0u || @fabs@(given - seen->last) <= can->change * ((@real@)seen->missed + (@real@)1)) {
        seen->agreeing = 0u;
    } else {
        if (!(@fabs@(given - seen->candidate) <= can->change)) {
            seen->agreeing = 0u;
        }
        seen->agreeing = seen->agreeing + 1u;
        seen->candidate = given;
        if (seen->agreeing < @AGREEING@u) {
            flaw = @NAME@_INPUT_JUMPED;
        }
    }
    if (flaw != 0u) {
        seen->missed = seen->missed < @MOST@u ? seen->missed + 1u : @MOST@u;
        const @real@ ahead = seen->last + (@real@)(seen->missed < @GAP@u ? seen->missed : @GAP@u) * seen->slope;
        *used = ahead < can->lowest ? can->lowest : (ahead > can->highest ? can->highest : ahead);
        *status |= flaw | which;
    } else {
        uint32_t same = 0u;
        if (seen->seen != 0u && given >= seen->last && given <= seen->last) {
            same = 1u;
        }
        if (seen->missed > 0u || (same == 0u && seen->moved != 0u && seen->unchanged >= can->patience)) {
            *status |= @NAME@_RECOVERED | which;
        }
        if (seen->agreeing >= @AGREEING@u || seen->missed >= @GAP@u) {
            resuming = 1u;
        }
        seen->slope = (seen->seen != 0u && seen->missed == 0u && seen->agreeing == 0u) ? given - seen->last : @zero@;
        if (same == 0u) {
            seen->unchanged = 0u;
            seen->moved = 0u;
            seen->mover = mover;
        } else {
            seen->unchanged = seen->unchanged < @MOST@u ? seen->unchanged + 1u : @MOST@u;
            if (@fabs@(mover - seen->mover) > can->noticeable) {
                seen->moved = 1u;
            }
        }
        if (seen->moved != 0u && seen->unchanged >= can->patience) {
            *status |= @NAME@_INPUT_STALE | which;
        }
        seen->last = given;
        seen->missed = 0u;
        seen->agreeing = 0u;
        seen->seen = 1u;
        *used = given;
    }
    return resuming;
}

/* Counts samples that did not come as missing readings. */
static void lacking(@name@_reading *seen, uint32_t samples)
{
    seen->missed = samples < @MOST@u - seen->missed ? seen->missed + samples : @MOST@u;
}
