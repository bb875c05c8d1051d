/* Follows one command as fast as the drive can; the first one is taken as it is. */
static void followed(@real@ given, @real@ lowest, @real@ highest, @real@ change, @real@ *last, uint32_t which,
                     uint32_t *status)
{
    @real@ wanted = *last;

    usable(given, lowest, highest, &wanted, which, status);
    if (wanted > *last + change) {
        *last += change;
        *status |= @NAME@_COMMAND_SLOWED | which;
    } else if (wanted < *last - change) {
        *last -= change;
        *status |= @NAME@_COMMAND_SLOWED | which;
    } else {
        *last = wanted;
    }
}
