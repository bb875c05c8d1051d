/* What is remembered of a measured input. */
typedef struct {
    @real@ last; /* last good reading */
    @real@ slope; /* its change in the last sample */
    @real@ candidate; /* last refused reading */
    @real@ mover; /* what moves the machine, when the reading last changed */
    uint32_t missed; /* samples since the last good reading */
    uint32_t agreeing; /* refused readings in a row that agree with one another */
    uint32_t unchanged; /* samples without change */
    uint32_t moved; /* whether what moves the machine has changed meanwhile */
    uint32_t seen; /* whether there has been a good reading */
} @name@_reading;

