/* Copies of the state, and their bytes. Included, not compiled alone.

   The bytes: format, number of bytes, instantiation token, the state itself, and a check sum over all before it
   (FNV-1a of 64 bits; every change of a single byte changes it). They belong to this model on this platform. */

enum { STATE_FORMAT = 1 };

typedef struct {
    uint64_t format;
    uint64_t size;
    char token[(sizeof MODEL_TOKEN + 7) / 8 * 8];
    moment state;
    uint64_t check;
} written_state;

enum { WRITTEN_SIZE = sizeof(written_state) };

static uint64_t check_sum(const unsigned char bytes[], size_t count)
{
    uint64_t sum = 0xcbf29ce484222325u;
    for (size_t k = 0; k < count; ++k) {
        sum = (sum ^ bytes[k]) * 0x100000001b3u;
    }
    return sum;
}

static int copy_state(const instance *me, void **copy)
{
    if (*copy == NULL) {
        *copy = malloc(sizeof me->now);
    }
    if (*copy == NULL) {
        return say(me, REFUSED, "no memory for a copy of the state");
    }
    memcpy(*copy, &me->now, sizeof me->now);
    return ALL_WELL;
}

static int restore_state(instance *me, const void *copy)
{
    if (copy == NULL) {
        return say(me, REFUSED, "there is no copy to restore");
    }
    if (((const moment *)copy)->purpose != me->now.purpose) {
        return say(me, REFUSED, "this copy is that of an instance for another purpose: model exchange, or "
                                "co-simulation with or without event mode");
    }
    memcpy(&me->now, copy, sizeof me->now);
    return ALL_WELL;
}

static int write_state(const instance *me, const void *copy, unsigned char bytes[], size_t size)
{
    written_state all;

    if (copy == NULL || size < WRITTEN_SIZE) {
        return say(me, REFUSED, "there is no copy, or not enough room to write it");
    }
    memset(&all, 0, sizeof all);
    all.format = STATE_FORMAT;
    all.size = sizeof all;
    memcpy(all.token, MODEL_TOKEN, sizeof MODEL_TOKEN);
    memcpy(&all.state, copy, sizeof all.state);
    all.check = check_sum((const unsigned char *)&all, offsetof(written_state, check));
    memcpy(bytes, &all, sizeof all);
    return ALL_WELL;
}

static int read_state(const instance *me, const unsigned char bytes[], size_t size, void **copy)
{
    written_state all;

    if (size != WRITTEN_SIZE) {
        return say(me, REFUSED, "these bytes are not a state of this model: %lu bytes, one has %lu",
                   (unsigned long)size, (unsigned long)WRITTEN_SIZE);
    }
    memcpy(&all, bytes, sizeof all);
    if (all.format != STATE_FORMAT || all.size != sizeof all ||
        memcmp(all.token, MODEL_TOKEN, sizeof MODEL_TOKEN) != 0) {
        return say(me, REFUSED, "these bytes are not a state of this model: another format or token");
    }
    if (all.check != check_sum(bytes, offsetof(written_state, check))) {
        return say(me, REFUSED, "these bytes are not a state of this model: they are damaged, the check sum differs");
    }
    if (all.state.purpose != me->now.purpose) {
        return say(me, REFUSED, "these bytes are the state of an instance for another purpose: model exchange, or "
                                "co-simulation with or without event mode");
    }
    if (copy_state(me, copy) != ALL_WELL) {
        return REFUSED;
    }
    memcpy(*copy, &all.state, sizeof all.state);
    return ALL_WELL;
}
