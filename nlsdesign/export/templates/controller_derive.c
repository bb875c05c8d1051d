/* Computes what follows from the parameters alone. */
static void @name@_derive(@name@_state *state)
{
    @statements@
}
