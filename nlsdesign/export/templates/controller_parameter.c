/* Takes over one parameter, unless it is not finite or outside its range. */
static void take_over(@real@ given, @real@ lowest, @real@ highest, @real@ *taken, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *taken = given;
    } else {
        *status |= @NAME@_PARAMETER_REFUSED | which;
    }
}
