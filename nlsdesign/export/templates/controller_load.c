@load@
{
    @name@_block_result result = @NAME@_BLOCK_NOT_STARTED;

    if (state->started == @NAME@_INTERFACE_VERSION) {
        result = @name@_check(block);
        if (result == @NAME@_BLOCK_FITS) {
            @name@_take_block(state, block);
            @derived@
        }
    }
    return result;
}

