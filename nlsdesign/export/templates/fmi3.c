/* FMI 3.0 for co-simulation and, of a continuous model, model exchange. */
#include "fmi3Functions.h"

#include "instance.c"

typedef struct {
    instance base;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} instance3;

static void report3(const instance *me, int status, const char *category, const char *text)
{
    const instance3 *all = (const instance3 *)(const void *)me;
    if (all->log != NULL) {
        all->log(all->environment, (fmi3Status)status, category, text);
    }
}

#define RETURN_UNLESS(me, phases, function)                          \
    if ((me) == NULL || !allowed((instance *)(me), phases, function)) \
    return fmi3Error

#define RUNNING (INITIALIZATION | STEPPING | EVENT | CONTINUOUS)
#define ANY_TIME (INSTANTIATED | RUNNING | TERMINATED | FAILED)

static fmi3Status unsupported(fmi3Instance me, const char *function)
{
    if (me != NULL) {
        (void)say(me, REFUSED, "%s: this model does not offer it", function);
    }
    return fmi3Error;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance me, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3SetDebugLogging");
    int solver = count == 0;
    for (size_t k = 0; k < count; ++k) {
        solver = solver || strcmp(categories[k], "logSolver") == 0;
    }
    ((instance *)me)->solver_logged = on && solver;
    return fmi3OK;
}

static fmi3Instance created(fmi3String name, fmi3String token, fmi3Boolean logging, int purpose,
                            fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, const char *refusal)
{
    if (refusal == NULL && (name == NULL || token == NULL || strcmp(token, MODEL_TOKEN) != 0)) {
        refusal = "the instantiation token is that of another model";
    }
    if (refusal != NULL) {
        if (log != NULL) {
            log(environment, fmi3Error, "logStatusError", refusal);
        }
        return NULL;
    }
    instance3 *me = (instance3 *)(void *)establish(sizeof(instance3), name, purpose, report3);
    if (me != NULL) {
        me->environment = environment;
        me->log = log;
        me->base.solver_logged = logging;
    }
    return me;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t intermediate_count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    (void)resources, (void)visible, (void)intermediate, (void)intermediate_count, (void)update;
    instance3 *me = created(name, token, logging, event_mode ? CO_SIMULATION_WITH_EVENTS : CO_SIMULATION, environment,
                            log, event_mode && MODEL_SWITCHES == 0 ? "this model has no events" : NULL);
    if (me != NULL) {
        me->base.may_return_early = event_mode && early_return;
    }
    return me;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    (void)resources, (void)visible;
    return created(name, token, logging, MODEL_EXCHANGE, environment, log,
                   MODEL_CONTINUOUS ? NULL : "a sampled model offers co-simulation only");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)resources, (void)visible, (void)update, (void)lock, (void)unlock;
    return created(name, token, logging, CO_SIMULATION, environment, log, "this model offers no scheduled execution");
}

void fmi3FreeInstance(fmi3Instance me)
{
    if (me != NULL) {
        release(me);
    }
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance me, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    RETURN_UNLESS(me, INSTANTIATED, "fmi3EnterInitializationMode");
    const uint32_t reference = MODEL_EXTRA;
    if (MODEL_CONTINUOUS && has_tolerance && set_values(me, &reference, 1, &tolerance) != ALL_WELL) {
        return fmi3Error;
    }
    if (enter_initialization(me, start, has_stop, stop) != ALL_WELL) {
        return fmi3Error;
    }
    ((instance *)me)->now.phase = INITIALIZATION;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance me)
{
    RETURN_UNLESS(me, INITIALIZATION, "fmi3ExitInitializationMode");
    return (fmi3Status)leave_initialization(me);
}

fmi3Status fmi3Terminate(fmi3Instance me)
{
    RETURN_UNLESS(me, STEPPING | EVENT | CONTINUOUS | FAILED, "fmi3Terminate");
    ((instance *)me)->now.phase = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance me)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3Reset");
    begin(me, ((instance *)me)->now.purpose);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance me, fmi3Float64 from, fmi3Float64 length, fmi3Boolean no_set_state_before,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last_time)
{
    (void)no_set_state_before;
    RETURN_UNLESS(me, STEPPING, "fmi3DoStep");
    int found = 0;
    const int status = do_step(me, from, length, &found);
    *event = found != 0;
    *terminate = false;
    *early = found && ((instance *)me)->now.time < from + length;
    *last_time = ((instance *)me)->now.time;
    return (fmi3Status)status;
}

fmi3Status fmi3GetFloat64(fmi3Instance me, const fmi3ValueReference references[], size_t count, fmi3Float64 values[],
                          size_t value_count)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3GetFloat64");
    return count == value_count ? (fmi3Status)get_values(me, references, count, values) : fmi3Error;
}

fmi3Status fmi3SetFloat64(fmi3Instance me, const fmi3ValueReference references[], size_t count,
                          const fmi3Float64 values[], size_t value_count)
{
    RETURN_UNLESS(me, INSTANTIATED | RUNNING, "fmi3SetFloat64");
    return count == value_count ? (fmi3Status)set_values(me, references, count, values) : fmi3Error;
}

fmi3Status fmi3GetInt32(fmi3Instance me, const fmi3ValueReference references[], size_t count, fmi3Int32 values[],
                        size_t value_count)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3GetInt32");
    refresh(me);
    for (size_t k = 0; k < count; ++k) {
        if (MODEL_CONTINUOUS || references[k] != MODEL_VALUES || count != value_count) {
            return (fmi3Status)say(me, REFUSED, "there is no Int32 variable with value reference %lu",
                                   (unsigned long)references[k]);
        }
        values[k] = ((instance *)me)->now.status;
    }
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance me, const fmi3ValueReference unknowns[], size_t unknown_count,
                                        const fmi3ValueReference knowns[], size_t known_count,
                                        const fmi3Float64 seed[], size_t seed_count, fmi3Float64 result[],
                                        size_t result_count)
{
    RETURN_UNLESS(me, RUNNING, "fmi3GetDirectionalDerivative");
    if (known_count != seed_count || unknown_count != result_count) {
        return fmi3Error;
    }
    return (fmi3Status)derive(me, unknowns, unknown_count, knowns, known_count, seed, result);
}

fmi3Status fmi3GetFMUState(fmi3Instance me, fmi3FMUState *state)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3GetFMUState");
    return (fmi3Status)copy_state(me, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance me, fmi3FMUState state)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3SetFMUState");
    return (fmi3Status)restore_state(me, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance me, fmi3FMUState *state)
{
    (void)me;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance me, fmi3FMUState state, size_t *size)
{
    (void)me, (void)state;
    *size = WRITTEN_SIZE;
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance me, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3SerializeFMUState");
    return (fmi3Status)write_state(me, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance me, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3DeserializeFMUState");
    return (fmi3Status)read_state(me, bytes, size, state);
}

/* Model exchange and event mode. */
fmi3Status fmi3EnterEventMode(fmi3Instance me)
{
    const int steps = me != NULL && ((instance *)me)->now.purpose == CO_SIMULATION_WITH_EVENTS ? STEPPING : 0;
    RETURN_UNLESS(me, EVENT | CONTINUOUS | steps, "fmi3EnterEventMode");
    enter_event_mode(me);
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance me, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                    fmi3Boolean *next_event_defined, fmi3Float64 *next_event)
{
    RETURN_UNLESS(me, EVENT, "fmi3UpdateDiscreteStates");
    int changed = 0;
    const fmi3Status done = (fmi3Status)update_discrete(me, &changed);
    *again = *terminate = *nominals_changed = *next_event_defined = false;
    *states_changed = changed != 0;
    *next_event = 0.0;
    return done;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance me)
{
    RETURN_UNLESS(me, EVENT, "fmi3EnterContinuousTimeMode");
    if (((instance *)me)->now.purpose != MODEL_EXCHANGE) {
        return unsupported(me, "fmi3EnterContinuousTimeMode");
    }
    ((instance *)me)->now.phase = CONTINUOUS;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance me)
{
    RETURN_UNLESS(me, EVENT, "fmi3EnterStepMode");
    if (((instance *)me)->now.purpose != CO_SIMULATION_WITH_EVENTS) {
        return unsupported(me, "fmi3EnterStepMode");
    }
    ((instance *)me)->now.phase = STEPPING;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance me, fmi3Boolean no_set_state_before, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    (void)no_set_state_before;
    RETURN_UNLESS(me, CONTINUOUS, "fmi3CompletedIntegratorStep");
    *event = event_is_due(me) != 0;
    *terminate = false;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance me, fmi3Float64 time)
{
    RETURN_UNLESS(me, EVENT | CONTINUOUS, "fmi3SetTime");
    return (fmi3Status)set_time(me, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance me, const fmi3Float64 x[], size_t count)
{
    RETURN_UNLESS(me, EVENT | CONTINUOUS, "fmi3SetContinuousStates");
    return (fmi3Status)set_states(me, x, count);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance me, fmi3Float64 rates[], size_t count)
{
    RETURN_UNLESS(me, RUNNING | TERMINATED | FAILED, "fmi3GetContinuousStateDerivatives");
    return (fmi3Status)get_rates(me, rates, count);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance me, fmi3Float64 indicators[], size_t count)
{
    RETURN_UNLESS(me, RUNNING | TERMINATED | FAILED, "fmi3GetEventIndicators");
    return (fmi3Status)get_indicators(me, indicators, count);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance me, fmi3Float64 x[], size_t count)
{
    RETURN_UNLESS(me, RUNNING | TERMINATED | FAILED, "fmi3GetContinuousStates");
    return (fmi3Status)get_states(me, x, count);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance me, fmi3Float64 nominals[], size_t count)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3GetNominalsOfContinuousStates");
    return (fmi3Status)get_nominals(me, nominals, count);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance me, size_t *count)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3GetNumberOfEventIndicators");
    *count = MODEL_SWITCHES;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance me, size_t *count)
{
    RETURN_UNLESS(me, ANY_TIME, "fmi3GetNumberOfContinuousStates");
    *count = MODEL_CONTINUOUS ? MODEL_STATES : 0;
    return fmi3OK;
}

/* What the standard names and this model does not have. */
#define REF const fmi3ValueReference references[]
#define NO_TYPE(Type)                                                                                                \
    fmi3Status fmi3Get##Type(fmi3Instance me, REF, size_t count, fmi3##Type values[], size_t value_count)             \
    {                                                                                                                \
        (void)references, (void)values, (void)value_count;                                                           \
        return count == 0 ? fmi3OK : unsupported(me, "fmi3Get" #Type);                                               \
    }                                                                                                                \
    NO_SET(Type)
#define NO_SET(Type)                                                                                                 \
    fmi3Status fmi3Set##Type(fmi3Instance me, REF, size_t count, const fmi3##Type values[], size_t value_count)       \
    {                                                                                                                \
        (void)references, (void)values, (void)value_count;                                                           \
        return count == 0 ? fmi3OK : unsupported(me, "fmi3Set" #Type);                                               \
    }
NO_TYPE(Float32)
NO_TYPE(Int8)
NO_TYPE(UInt8)
NO_TYPE(Int16)
NO_TYPE(UInt16)
NO_SET(Int32)
NO_TYPE(UInt32)
NO_TYPE(Int64)
NO_TYPE(UInt64)
NO_TYPE(Boolean)
NO_TYPE(String)

#define NO_FUNCTION(Name, arguments, unused)          \
    fmi3Status fmi3##Name arguments                   \
    {                                                 \
        unused;                                       \
        return unsupported(me, "fmi3" #Name);         \
    }
#define ME fmi3Instance me
NO_FUNCTION(EnterConfigurationMode, (ME), )
NO_FUNCTION(ExitConfigurationMode, (ME), )
NO_FUNCTION(EvaluateDiscreteStates, (ME), )
NO_FUNCTION(GetBinary, (ME, REF, size_t n, size_t sizes[], fmi3Binary values[], size_t m),
            ((void)references, (void)n, (void)sizes, (void)values, (void)m))
NO_FUNCTION(SetBinary, (ME, REF, size_t n, const size_t sizes[], const fmi3Binary values[], size_t m),
            ((void)references, (void)n, (void)sizes, (void)values, (void)m))
NO_FUNCTION(GetClock, (ME, REF, size_t n, fmi3Clock values[]), ((void)references, (void)n, (void)values))
NO_FUNCTION(SetClock, (ME, REF, size_t n, const fmi3Clock values[]), ((void)references, (void)n, (void)values))
NO_FUNCTION(GetNumberOfVariableDependencies, (ME, fmi3ValueReference r, size_t *n), ((void)r, (void)n))
NO_FUNCTION(GetVariableDependencies,
            (ME, fmi3ValueReference r, size_t rows[], fmi3ValueReference on[], size_t columns[],
             fmi3DependencyKind kinds[], size_t n),
            ((void)r, (void)rows, (void)on, (void)columns, (void)kinds, (void)n))
NO_FUNCTION(GetAdjointDerivative,
            (ME, REF, size_t n, const fmi3ValueReference knowns[], size_t m, const fmi3Float64 seed[], size_t k,
             fmi3Float64 result[], size_t l),
            ((void)references, (void)n, (void)knowns, (void)m, (void)seed, (void)k, (void)result, (void)l))
NO_FUNCTION(GetIntervalDecimal, (ME, REF, size_t n, fmi3Float64 values[], fmi3IntervalQualifier kinds[]),
            ((void)references, (void)n, (void)values, (void)kinds))
NO_FUNCTION(GetIntervalFraction,
            (ME, REF, size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier kinds[]),
            ((void)references, (void)n, (void)counters, (void)resolutions, (void)kinds))
NO_FUNCTION(GetShiftDecimal, (ME, REF, size_t n, fmi3Float64 values[]), ((void)references, (void)n, (void)values))
NO_FUNCTION(GetShiftFraction, (ME, REF, size_t n, fmi3UInt64 counters[], fmi3UInt64 resolutions[]),
            ((void)references, (void)n, (void)counters, (void)resolutions))
NO_FUNCTION(SetIntervalDecimal, (ME, REF, size_t n, const fmi3Float64 values[]),
            ((void)references, (void)n, (void)values))
NO_FUNCTION(SetIntervalFraction, (ME, REF, size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
            ((void)references, (void)n, (void)counters, (void)resolutions))
NO_FUNCTION(SetShiftDecimal, (ME, REF, size_t n, const fmi3Float64 values[]),
            ((void)references, (void)n, (void)values))
NO_FUNCTION(SetShiftFraction, (ME, REF, size_t n, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
            ((void)references, (void)n, (void)counters, (void)resolutions))
NO_FUNCTION(GetOutputDerivatives, (ME, REF, size_t n, const fmi3Int32 orders[], fmi3Float64 values[], size_t m),
            ((void)references, (void)n, (void)orders, (void)values, (void)m))
NO_FUNCTION(ActivateModelPartition, (ME, fmi3ValueReference clock, fmi3Float64 time), ((void)clock, (void)time))
