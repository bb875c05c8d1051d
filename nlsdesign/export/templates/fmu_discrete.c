#include "@name@.c"

@tables@
typedef @name@_state model_memory;

static void model_tune(model_memory *memory, const double p[])
{
    @name@_parameters parameters;

    @name@_defaults(&parameters);
    @parameters@
    (void)@name@_set_parameters(memory, &parameters);
    (void)p;
}

static void model_start(model_memory *memory, const double x[], const double p[])
{
    (void)@name@_init(memory, NULL);
    @start@
    model_tune(memory, p);
    for (int i = 0; i < MODEL_STATES; ++i) { /* states that were set are not taken from the first readings */
        if (x[i] < model_variable[MODEL_X + i].start || x[i] > model_variable[MODEL_X + i].start) {
            memory->begun = 1u;
        }
    }
    (void)x;
}

/* One sample. The states that are shown are those that its outputs came from. */
static int32_t model_sample(model_memory *memory, const double u[], double x[], double y[],
                            double s[])
{
    @name@_inputs inputs = {0};
    @name@_outputs outputs = {0};

    @inputs@
    uint32_t status = @name@_take(memory, &inputs);
    const @name@_states before = memory->states;
    if (memory->begun == 0u) {
        outputs = memory->outputs;
        status |= @NAME@_WAITING;
    } else {
        status |= @name@_advance(memory, &outputs);
    }
    @states@
    @outputs@
    @signals@
    (void)before, (void)u, (void)x, (void)y, (void)s;
    return (int32_t)status;
}

/* How outputs and signals of the last sample change with the states before it, the inputs that it took and the
   parameters. Gives 0 where guards have put something else in the place of an input or output. */
static int model_directional(const model_memory *memory, int32_t status, const double x[], const double dx[],
                             const double du[], const double dp[], double dy[], double ds[])
{
    if (((uint32_t)status & ~(@NAME@_OUT_OF_TABLE | @NAME@_INNOVATION_LARGE)) != 0u) {
        return 0;
    }
    @directional@
    (void)memory, (void)x, (void)dx, (void)du, (void)dp, (void)dy, (void)ds;
    return 1;
}

