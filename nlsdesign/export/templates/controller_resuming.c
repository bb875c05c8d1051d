} else if (state->begun != 0u && resuming != 0u) {
    @name@_resume(state);
} else {
    /* goes on, or waits for the first readings */
