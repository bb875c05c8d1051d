/* Keeps one input usable: held at its last good value while it is not finite, saturated outside its range. */
static @real@ usable(@real@ given, @real@ lowest, @real@ highest, @real@ *last, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *last = given;
    } else if (given - given == @zero@) { /* finite: NaN and the infinities give NaN here */
        *last = given < lowest ? lowest : highest;
        *status |= @NAME@_INPUT_SATURATED | which;
    } else {
        *status |= @NAME@_INPUT_HELD | which;
    }
    return *last;
}
