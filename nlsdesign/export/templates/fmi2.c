/* FMI 2.0 for co-simulation and, of a continuous model, model exchange. */
#include "fmi2Functions.h"

#include "instance.c"

typedef struct {
    instance base;
    const fmi2CallbackFunctions *callbacks;
    int set_up;
} instance2;

static void report2(const instance *me, int status, const char *category, const char *text)
{
    const fmi2CallbackFunctions *callbacks = ((const instance2 *)(const void *)me)->callbacks;
    if (callbacks != NULL && callbacks->logger != NULL) {
        callbacks->logger(callbacks->componentEnvironment, me->name, (fmi2Status)status, category, text);
    }
}

#define RETURN_UNLESS(me, phases, function)                          \
    if ((me) == NULL || !allowed((instance *)(me), phases, function)) \
    return fmi2Error

#define RUNNING (INITIALIZATION | STEPPING | EVENT | CONTINUOUS)
#define ANY_TIME (INSTANTIATED | RUNNING | TERMINATED | FAILED)

static fmi2Status unsupported(fmi2Component me, const char *function)
{
    if (me != NULL) {
        (void)say(me, REFUSED, "%s: this model does not offer it", function);
    }
    return fmi2Error;
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component me, fmi2Boolean on, size_t count, const fmi2String categories[])
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2SetDebugLogging");
    int solver = count == 0;
    for (size_t k = 0; k < count; ++k) {
        solver = solver || strcmp(categories[k], "logSolver") == 0;
    }
    ((instance *)me)->solver_logged = on && solver;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)resources, (void)visible;
    if (name == NULL || guid == NULL || strcmp(guid, MODEL_TOKEN) != 0 || (type == fmi2ModelExchange && !MODEL_CONTINUOUS)) {
        if (callbacks != NULL && callbacks->logger != NULL) {
            callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError",
                              type == fmi2ModelExchange && !MODEL_CONTINUOUS ? "a sampled model offers co-simulation only"
                                                                             : "the GUID is that of another model");
        }
        return NULL;
    }
    instance2 *me = (instance2 *)(void *)establish(sizeof(instance2), name, type == fmi2ModelExchange ? MODEL_EXCHANGE : CO_SIMULATION, report2);
    if (me != NULL) {
        me->callbacks = callbacks;
        me->base.solver_logged = logging;
    }
    return me;
}

void fmi2FreeInstance(fmi2Component me)
{
    if (me != NULL) {
        release(me);
    }
}

fmi2Status fmi2SetupExperiment(fmi2Component me, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop)
{
    RETURN_UNLESS(me, INSTANTIATED, "fmi2SetupExperiment");
    const uint32_t reference = MODEL_EXTRA;
    if (MODEL_CONTINUOUS && has_tolerance && set_values(me, &reference, 1, &tolerance) != ALL_WELL) {
        return fmi2Error;
    }
    ((instance2 *)me)->set_up = enter_initialization(me, start, has_stop, stop) == ALL_WELL;
    return ((instance2 *)me)->set_up ? fmi2OK : fmi2Error;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component me)
{
    RETURN_UNLESS(me, INSTANTIATED, "fmi2EnterInitializationMode");
    if (!((instance2 *)me)->set_up) {
        return (fmi2Status)say(me, REFUSED, "fmi2SetupExperiment must be called first");
    }
    ((instance *)me)->now.phase = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component me)
{
    RETURN_UNLESS(me, INITIALIZATION, "fmi2ExitInitializationMode");
    return (fmi2Status)leave_initialization(me);
}

fmi2Status fmi2Terminate(fmi2Component me)
{
    RETURN_UNLESS(me, STEPPING | EVENT | CONTINUOUS | FAILED, "fmi2Terminate");
    ((instance *)me)->now.phase = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component me)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2Reset");
    begin(me, ((instance *)me)->now.purpose);
    ((instance2 *)me)->set_up = 0;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component me, fmi2Real from, fmi2Real length, fmi2Boolean no_set_state_before)
{
    (void)no_set_state_before;
    RETURN_UNLESS(me, STEPPING, "fmi2DoStep");
    int event = 0;
    return (fmi2Status)do_step(me, from, length, &event);
}

fmi2Status fmi2GetReal(fmi2Component me, const fmi2ValueReference references[], size_t count, fmi2Real values[])
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2GetReal");
    return (fmi2Status)get_values(me, references, count, values);
}

fmi2Status fmi2SetReal(fmi2Component me, const fmi2ValueReference references[], size_t count, const fmi2Real values[])
{
    RETURN_UNLESS(me, INSTANTIATED | RUNNING, "fmi2SetReal");
    return (fmi2Status)set_values(me, references, count, values);
}

fmi2Status fmi2GetInteger(fmi2Component me, const fmi2ValueReference references[], size_t count, fmi2Integer values[])
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2GetInteger");
    refresh(me);
    for (size_t k = 0; k < count; ++k) {
        if (MODEL_CONTINUOUS || references[k] != MODEL_VALUES) {
            return (fmi2Status)say(me, REFUSED, "there is no Integer variable with value reference %lu",
                                   (unsigned long)references[k]);
        }
        values[k] = ((instance *)me)->now.status;
    }
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component me, const fmi2ValueReference unknowns[], size_t unknown_count,
                                        const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[],
                                        fmi2Real result[])
{
    RETURN_UNLESS(me, RUNNING, "fmi2GetDirectionalDerivative");
    return (fmi2Status)derive(me, unknowns, unknown_count, knowns, known_count, seed, result);
}

fmi2Status fmi2GetFMUstate(fmi2Component me, fmi2FMUstate *state)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2GetFMUstate");
    return (fmi2Status)copy_state(me, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component me, fmi2FMUstate state)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2SetFMUstate");
    const fmi2Status done = (fmi2Status)restore_state(me, state);
    /* A copy holds the start and stop time too. */
    ((instance2 *)me)->set_up = ((instance2 *)me)->set_up || done == fmi2OK;
    return done;
}

fmi2Status fmi2FreeFMUstate(fmi2Component me, fmi2FMUstate *state)
{
    (void)me;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component me, fmi2FMUstate state, size_t *size)
{
    (void)me, (void)state;
    *size = WRITTEN_SIZE;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component me, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2SerializeFMUstate");
    return (fmi2Status)write_state(me, state, (unsigned char *)bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component me, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2DeSerializeFMUstate");
    return (fmi2Status)read_state(me, (const unsigned char *)bytes, size, state);
}

fmi2Status fmi2GetRealStatus(fmi2Component me, const fmi2StatusKind kind, fmi2Real *value)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2GetRealStatus");
    if (kind != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = ((instance *)me)->now.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component me, const fmi2StatusKind kind, fmi2Boolean *value)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2GetBooleanStatus");
    if (kind != fmi2Terminated) {
        return fmi2Discard;
    }
    *value = fmi2False;
    return fmi2OK;
}

/* What the standard names and this model does not have. */
#define REF const fmi2ValueReference references[], size_t count
#define NO_VALUES(Name, type)                                                        \
    fmi2Status fmi2##Name(fmi2Component me, REF, type values[])                       \
    {                                                                                \
        (void)references, (void)values;                                              \
        return count == 0 ? fmi2OK : unsupported(me, "fmi2" #Name);                  \
    }
NO_VALUES(GetBoolean, fmi2Boolean)
NO_VALUES(GetString, fmi2String)
NO_VALUES(SetInteger, const fmi2Integer)
NO_VALUES(SetBoolean, const fmi2Boolean)
NO_VALUES(SetString, const fmi2String)

fmi2Status fmi2SetRealInputDerivatives(fmi2Component me, REF, const fmi2Integer orders[], const fmi2Real values[])
{
    (void)references, (void)count, (void)orders, (void)values;
    return unsupported(me, "fmi2SetRealInputDerivatives");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component me, REF, const fmi2Integer orders[], fmi2Real values[])
{
    (void)references, (void)count, (void)orders, (void)values;
    return unsupported(me, "fmi2GetRealOutputDerivatives");
}

fmi2Status fmi2CancelStep(fmi2Component me)
{
    return unsupported(me, "fmi2CancelStep");
}

#define NO_STATUS(Name, type)                                                        \
    fmi2Status fmi2##Name(fmi2Component me, const fmi2StatusKind kind, type *value)   \
    {                                                                                \
        (void)me, (void)kind, (void)value;                                           \
        return fmi2Discard;                                                          \
    }
NO_STATUS(GetStatus, fmi2Status)
NO_STATUS(GetIntegerStatus, fmi2Integer)
NO_STATUS(GetStringStatus, fmi2String)

/* Model exchange. */
fmi2Status fmi2EnterEventMode(fmi2Component me)
{
    RETURN_UNLESS(me, EVENT | CONTINUOUS, "fmi2EnterEventMode");
    enter_event_mode(me);
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component me, fmi2EventInfo *info)
{
    RETURN_UNLESS(me, EVENT, "fmi2NewDiscreteStates");
    int changed = 0;
    const fmi2Status done = (fmi2Status)update_discrete(me, &changed);
    info->newDiscreteStatesNeeded = info->terminateSimulation = info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = changed;
    info->nextEventTimeDefined = fmi2False;
    info->nextEventTime = 0.0;
    return done;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component me)
{
    RETURN_UNLESS(me, EVENT, "fmi2EnterContinuousTimeMode");
    ((instance *)me)->now.phase = CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component me, fmi2Boolean no_set_state_before, fmi2Boolean *event,
                                       fmi2Boolean *terminate)
{
    (void)no_set_state_before;
    RETURN_UNLESS(me, CONTINUOUS, "fmi2CompletedIntegratorStep");
    *event = event_is_due(me);
    *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component me, fmi2Real time)
{
    RETURN_UNLESS(me, EVENT | CONTINUOUS, "fmi2SetTime");
    return (fmi2Status)set_time(me, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component me, const fmi2Real x[], size_t count)
{
    RETURN_UNLESS(me, EVENT | CONTINUOUS, "fmi2SetContinuousStates");
    return (fmi2Status)set_states(me, x, count);
}

fmi2Status fmi2GetDerivatives(fmi2Component me, fmi2Real rates[], size_t count)
{
    RETURN_UNLESS(me, EVENT | CONTINUOUS | TERMINATED | FAILED, "fmi2GetDerivatives");
    return (fmi2Status)get_rates(me, rates, count);
}

fmi2Status fmi2GetEventIndicators(fmi2Component me, fmi2Real indicators[], size_t count)
{
    RETURN_UNLESS(me, RUNNING | TERMINATED | FAILED, "fmi2GetEventIndicators");
    return (fmi2Status)get_indicators(me, indicators, count);
}

fmi2Status fmi2GetContinuousStates(fmi2Component me, fmi2Real x[], size_t count)
{
    RETURN_UNLESS(me, RUNNING | TERMINATED | FAILED, "fmi2GetContinuousStates");
    return (fmi2Status)get_states(me, x, count);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component me, fmi2Real nominals[], size_t count)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi2GetNominalsOfContinuousStates");
    return (fmi2Status)get_nominals(me, nominals, count);
}
