/* Goes on with the mean of a squared output over what the deck explains, a single one counting @OUTLIER@ times that at
   most. The pace is that of the window, less where nothing moves. Returns the flag where the mean is above 1. */
static uint32_t surprising(@real@ output, @real@ explained, @real@ pace, @real@ at_rest, @real@ *mean)
{
    const @real@ most = @outlier@;
    const @real@ over = @one@ / explained;
    const @real@ now = output * output * over;
    const @real@ next = *mean + (pace - at_rest * over) * ((now < most ? now : most) - *mean);

    *mean = (next >= @zero@ && next <= most) ? next : most;
    return *mean > @one@ ? @NAME@_INNOVATION_LARGE : 0u;
}
