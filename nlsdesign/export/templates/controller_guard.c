/* Keeps one command usable: held at its last good value while it is not finite, saturated outside its range. */
static void usable(@real@ given, @real@ lowest, @real@ highest, @real@ *last, uint32_t which, uint32_t *status)
{
    if (given >= lowest && given <= highest) {
        *last = given;
    } else if (given >= -@LARGEST@ && given <= @LARGEST@) {
        *last = given < lowest ? lowest : highest;
        *status |= @NAME@_INPUT_SATURATED | which;
    } else {
        *status |= @NAME@_INPUT_HELD | which;
    }
}
