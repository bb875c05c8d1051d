/* Calls an FMI 3.0 FMU at random, half with odd values; built with the sanitizers of the compiler.
   Ends with 1 where a value is not finite though the status is OK, or a damaged state is taken. */
#include "fmi3.c"

static uint64_t seed;

static uint32_t drawn(uint32_t below)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(seed >> 33) % below;
}

static double share(void)
{
    return (double)drawn(1000001) / 1e6;
}

static double odd(uint32_t reference)
{
    static const double strange[] = {0.0, -0.0, 1e-300, -1e-9, 1.0, 1e9, -1e300, INFINITY, -INFINITY, NAN};
    const double start = model_variable[reference].start;
    return drawn(2) == 0 ? start + (share() - 0.5) * (fabs(start) + 1.0) : strange[drawn(10)];
}

static void silent(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    (void)e, (void)status, (void)category, (void)text;
}

static fmi3Instance fresh(int purpose)
{
    return purpose == MODEL_EXCHANGE
               ? fmi3InstantiateModelExchange("one", MODEL_TOKEN, NULL, false, true, NULL, silent)
               : fmi3InstantiateCoSimulation("one", MODEL_TOKEN, NULL, false, true,
                                             purpose == CO_SIMULATION_WITH_EVENTS, drawn(2) == 0, NULL, 0, NULL,
                                             silent, NULL);
}

static int values_are_finite(fmi3Instance me)
{
    for (uint32_t r = 0; r < MODEL_VALUES; ++r) {
        double value = 0.0;
        if (fmi3GetFloat64(me, &r, 1, &value, 1) == fmi3OK && !within(r, MODEL_U, MODEL_INPUTS) && !isfinite(value)) {
            return 0;
        }
    }
    return 1;
}

static int damaged_state_is_refused(fmi3Instance me, fmi3FMUState state)
{
    unsigned char bytes[WRITTEN_SIZE];
    fmi3FMUState read = NULL;
    size_t size = 0;
    if (fmi3SerializedFMUStateSize(me, state, &size) != fmi3OK || size != sizeof bytes ||
        fmi3SerializeFMUState(me, state, bytes, size) != fmi3OK) {
        return 0;
    }
    bytes[drawn(sizeof bytes)] ^= (unsigned char)(1u << drawn(8));
    return fmi3DeserializeFMUState(me, bytes, size, &read) == fmi3Error && read == NULL;
}

static void call(fmi3Instance me, int purpose)
{
    double row[MODEL_VALUES + 1] = {0.0}, time = 0.0;
    const uint32_t reference = drawn(MODEL_VALUES), input = MODEL_U + drawn(MODEL_INPUTS > 0 ? MODEL_INPUTS : 1);
    fmi3Boolean a, b, c, d, e;
    const double now = ((instance *)me)->now.time;

    switch (drawn(16)) {
    case 0:
        row[0] = odd(reference);
        (void)fmi3SetFloat64(me, &reference, 1, row, 1);
        break;
    case 1:
    case 2:
        row[0] = drawn(8) == 0 ? odd(input) : 2.0 * share() - 1.0;
        (void)fmi3SetFloat64(me, &input, 1, row, 1);
        break;
    case 3:
        (void)fmi3EnterInitializationMode(me, drawn(2) == 0, 1e-6, drawn(9) == 0 ? odd(0) : 0.0, false, 0.0);
        break;
    case 4:
        (void)fmi3ExitInitializationMode(me);
        break;
    case 5:
        (void)fmi3EnterEventMode(me);
        break;
    case 6:
        (void)fmi3UpdateDiscreteStates(me, &a, &b, &c, &d, &e, &time);
        break;
    case 7:
        (void)(purpose == MODEL_EXCHANGE ? fmi3EnterContinuousTimeMode(me) : fmi3EnterStepMode(me));
        break;
    case 8:
        (void)fmi3CompletedIntegratorStep(me, true, &a, &b);
        break;
    case 9:
        (void)fmi3SetTime(me, drawn(20) == 0 ? odd(0) : now + 1e-3 * share());
        break;
    case 10:
        (void)fmi3GetContinuousStates(me, row, MODEL_STATES);
        for (uint32_t i = 0; i < MODEL_STATES; ++i) {
            row[i] = drawn(50) == 0 ? odd(MODEL_X + i) : row[i] + 0.02 * (share() - 0.5);
        }
        (void)fmi3SetContinuousStates(me, row, MODEL_STATES);
        break;
    case 11:
        (void)fmi3GetContinuousStateDerivatives(me, row, MODEL_STATES);
        (void)fmi3GetEventIndicators(me, row, MODEL_SWITCHES);
        (void)fmi3GetNominalsOfContinuousStates(me, row, MODEL_STATES);
        break;
    case 12:
        if (drawn(400) == 0) {
            (void)fmi3Reset(me);
        }
        break;
    default:
        (void)fmi3DoStep(me, now, drawn(600) == 0 ? odd(0) : 1e-2 * share(), true, &a, &b, &c, &time);
        break;
    }
}

int main(int count, char *words[])
{
    if (count != 4) {
        return 2;
    }
    const int purpose = atoi(words[1]), calls = atoi(words[2]);
    seed = (uint64_t)atoi(words[3]);
    for (int k = 0; k < calls;) {
        fmi3Instance me = fresh(purpose);
        fmi3FMUState state = NULL;
        for (int end = k + 400; me != NULL && k < end; ++k) {
            call(me, purpose);
            if (drawn(20) == 0) {
                if (fmi3GetFMUState(me, &state) != fmi3OK || !damaged_state_is_refused(me, state)) {
                    return 1;
                }
            } else if (state != NULL && drawn(20) == 0) {
                (void)fmi3SetFMUState(me, state);
            }
            if (!values_are_finite(me)) {
                return 1;
            }
        }
        if (me == NULL) {
            return 2;
        }
        (void)fmi3FreeFMUState(me, &state);
        fmi3FreeInstance(me);
    }
    return 0;
}
