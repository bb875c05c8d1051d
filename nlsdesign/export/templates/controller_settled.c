/* Sets the states of a machine that @words@. */
static void @name@_@verb@(@name@_state *state)
{
    @body@
}
