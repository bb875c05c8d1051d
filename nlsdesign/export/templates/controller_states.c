if (@finite@) {
    @stores@
} else {
    state->states = start_states;
    state->begun = 0u;
    status |= @NAME@_STATE_RESTARTED;
}
