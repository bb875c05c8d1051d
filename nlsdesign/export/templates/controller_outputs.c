if (@finite@) {
    @stores@
} else {
    status |= @NAME@_OUTPUT_HELD;
    *outputs = state->outputs;
}
