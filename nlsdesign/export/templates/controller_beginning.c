if (@condition@) {
    @begin@
    state->begun = 1u;
@resume@
}
