/* Model exchange: the importer integrates and locates events, this side gives derivatives and event indicators
   and changes the modes of the switches. Included, not compiled alone. */

static int set_time(instance *me, double time)
{
    if (!(fabs(time) <= MODEL_LARGEST)) {
        return say(me, REFUSED, "the time must be finite");
    }
    me->now.time = me->now.value[0] = time;
    me->now.outdated = 1;
    return ALL_WELL;
}

static int right_count(const instance *me, size_t count, size_t expected, const char *what)
{
    return count == expected ? ALL_WELL
                             : say(me, REFUSED, "there are %lu %s, not %lu", (unsigned long)expected, what,
                                   (unsigned long)count);
}

static int set_states(instance *me, const double x[], size_t count)
{
    if (right_count(me, count, MODEL_STATES, "continuous states") != ALL_WELL) {
        return REFUSED;
    }
    for (size_t i = 0; i < count; ++i) {
        me->now.value[MODEL_X + i] = x[i];
    }
    me->now.outdated = 1;
    return ALL_WELL;
}

/* Copies neighbouring values out; DISCARDED where one is not finite, so that an integrator may try a shorter step. */
static int copy_out(instance *me, size_t first, size_t count, double values[])
{
    int worst = ALL_WELL;
    for (size_t i = 0; i < count; ++i) {
        values[i] = me->now.value[first + i];
        if (!(fabs(values[i]) <= MODEL_LARGEST)) {
            worst = say(me, DISCARDED, "%s is not finite at time %.9g s", model_variable[first + i].name, me->now.time);
        }
    }
    return worst;
}

static int get_states(instance *me, double x[], size_t count)
{
    return right_count(me, count, MODEL_STATES, "continuous states") == ALL_WELL
               ? copy_out(me, MODEL_X, count, x)
               : REFUSED;
}

static int get_rates(instance *me, double f[], size_t count)
{
    if (right_count(me, count, MODEL_STATES, "derivatives") != ALL_WELL) {
        return REFUSED;
    }
    refresh(me);
    return copy_out(me, MODEL_D, count, f);
}

static int get_indicators(instance *me, double z[], size_t count)
{
    if (right_count(me, count, MODEL_SWITCHES, "event indicators") != ALL_WELL) {
        return REFUSED;
    }
    refresh(me);
    return copy_out(me, MODEL_Z, count, z);
}

static int get_nominals(instance *me, double nominal[], size_t count)
{
    if (right_count(me, count, MODEL_STATES, "continuous states") != ALL_WELL) {
        return REFUSED;
    }
    for (size_t i = 0; i < count; ++i) {
#if MODEL_CONTINUOUS
        nominal[i] = model_nominal[i];
#else
        nominal[i] = 1.0;
#endif
    }
    return ALL_WELL;
}

static void enter_event_mode(instance *me)
{
    me->now.phase = EVENT;
    me->now.arriving = 1;
}

/* Changes the modes that have ended and the states that jump with them. */
static int update_discrete(instance *me, int *states_changed)
{
    *states_changed = 0;
#if MODEL_SWITCHES > 0
    double before[ORDER];
    memcpy(before, &me->now.value[MODEL_X], MODEL_STATES * sizeof before[0]);
    if (settle_modes(me, me->now.arriving) != ALL_WELL) {
        return REFUSED;
    }
    *states_changed = memcmp(before, &me->now.value[MODEL_X], MODEL_STATES * sizeof before[0]) != 0;
#endif
    me->now.arriving = 0;
    return ALL_WELL;
}

/* Tells whether a mode has ended without the importer having seen it. */
static int event_is_due(instance *me)
{
    int due = 0;
#if MODEL_SWITCHES > 0
    refresh(me);
    for (size_t i = 0; i < MODEL_SWITCHES; ++i) {
        due = due || me->now.value[MODEL_Z + i] < 0.0;
    }
    const setting at = {me->now.time, &me->now.value[MODEL_U], &me->now.value[MODEL_P]};
    double x[ORDER];
    int which = 0;
    memcpy(x, &me->now.value[MODEL_X], sizeof x);
    due = due || keep_held(&at, x, &me->now.value[MODEL_M], &which) != SETTLED;
#else
    (void)me;
#endif
    return due;
}
