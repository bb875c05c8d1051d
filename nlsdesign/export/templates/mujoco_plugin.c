/* @title@, as an engine plug-in of MuJoCo
@origin@
   Written by nlsdesign @version@; do not edit. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <mujoco/mujoco.h>
#include "@name@.h"

/* Names in the MJCF; the attribute `prefix` of an instance stands before each. */
static const char *const joints[] = {
    @joint_rows@
    ""};
static const char *const actuators[] = {
    @actuator_rows@
    ""};
static const char *const inner = "@holder@";
/* Attributes of an instance: the prefix, then every parameter of the deck by its name, in SI units. */
static const char *const attributes[] = {
    "prefix",
    @attributes@
};

struct law {
    int position[@name@_BODIES + 1], freedom[@name@_BODIES + 1], actuator[@name@_INPUTS + 1], activation;
    double p[@name@_PARAMETERS + 1];
};

struct result {
    double u[@name@_INPUTS + 1], effort[@name@_BODIES + 1], rate[@name@_INNER + 1], y[@name@_OUTPUTS + 1];
};

static int find(const mjModel *m, int kind, const char *prefix, const char *name)
{
    char text[1024];
    (void)snprintf(text, sizeof text, "%s%s", prefix, name);
    const int id = mj_name2id(m, kind, text);
    if (id < 0) {
        mju_warning("@name@: the model has no %s named '%s'; name it so, or set the attribute prefix",
                    kind == mjOBJ_JOINT ? "joint" : "actuator", text);
    }
    return id;
}

static int set_values(const mjModel *m, int instance, struct law *law)
{
    for (int i = 0; i < @name@_PARAMETERS; ++i) {
        const char *given = mj_getPluginConfig(m, instance, attributes[i + 1]);
        char *end = NULL;
        law->p[i] = given && *given ? strtod(given, &end) : @name@_values[i];
        if (end && (*end || end == given)) {
            mju_warning("@name@: %s = '%s' is no number", attributes[i + 1], given);
            return -1;
        }
    }
    return 0;
}

static int init(const mjModel *m, mjData *d, int instance)
{
    struct law *law = calloc(1, sizeof *law);
    const char *given = mj_getPluginConfig(m, instance, "prefix"), *prefix = given ? given : "";
    int missing = law == NULL || set_values(m, instance, law) != 0;
    for (int i = 0; !missing && i < @name@_BODIES; ++i) {
        const int joint = find(m, mjOBJ_JOINT, prefix, joints[i]);
        missing = joint < 0;
        law->position[i] = missing ? 0 : m->jnt_qposadr[joint];
        law->freedom[i] = missing ? 0 : m->jnt_dofadr[joint];
    }
    for (int i = 0; !missing && i < @name@_INPUTS; ++i) {
        law->actuator[i] = find(m, mjOBJ_ACTUATOR, prefix, actuators[i]);
        missing = law->actuator[i] < 0;
    }
    if (!missing && @name@_INNER) {
        const int actuator = find(m, mjOBJ_ACTUATOR, prefix, inner);
        missing = actuator < 0 || m->actuator_actnum[actuator] != @name@_INNER;
        law->activation = missing ? 0 : m->actuator_actadr[actuator];
    }
    if (missing) {
        free(law);
        return -1;
    }
    d->plugin_data[instance] = (uintptr_t)law;
    return 0;
}

static void destroy(mjData *d, int instance)
{
    free((void *)d->plugin_data[instance]);
    d->plugin_data[instance] = 0;
}

static void copy(mjData *to, const mjModel *m, const mjData *from, int instance)
{
    (void)m;
    const struct law *given = (const struct law *)from->plugin_data[instance];
    struct law *law = (struct law *)to->plugin_data[instance];
    if (given && law) {
        *law = *given;
    }
}

static void evaluate(const mjData *d, const struct law *law, struct result *r)
{
    double x[@name@_STATES + 1];
    for (int i = 0; i < @name@_BODIES; ++i) {
        x[2 * i] = d->qpos[law->position[i]];
        x[2 * i + 1] = d->qvel[law->freedom[i]];
    }
    for (int i = 0; i < @name@_INNER; ++i) {
        x[2 * @name@_BODIES + i] = d->act[law->activation + i];
    }
    for (int i = 0; i < @name@_INPUTS; ++i) {
        r->u[i] = d->ctrl[law->actuator[i]];
    }
    @name@_evaluate(d->time, x, r->u, law->p, r->effort, r->rate, r->y);
}

/* What the actuators of the MJCF do themselves: gear times gain times control within its range. */
static double own_effort(const mjModel *m, int actuator, double control)
{
    const mjtNum *range = m->actuator_ctrlrange + 2 * actuator;
    const int limited = m->actuator_ctrllimited[actuator];
    const double held = limited ? mju_clip(control, range[0], range[1]) : control;
    return m->actuator_gear[6 * actuator] * m->actuator_gainprm[mjNGAIN * actuator] * held;
}

static void compute(const mjModel *m, mjData *d, int instance, int capability)
{
    const struct law *law = (const struct law *)d->plugin_data[instance];
    struct result r;
    if (!law || capability != mjPLUGIN_PASSIVE) {
        return;
    }
    evaluate(d, law, &r);
    for (int i = 0; i < @name@_BODIES; ++i) {
        d->qfrc_passive[law->freedom[i]] += r.effort[i];
    }
    for (int i = 0; i < @name@_INPUTS; ++i) {
        const int joint = m->actuator_trnid[2 * law->actuator[i]];
        d->qfrc_passive[m->jnt_dofadr[joint]] -= own_effort(m, law->actuator[i], r.u[i]);
    }
}

static void act_dot(const mjModel *m, mjData *d, int instance)
{
    const struct law *law = (const struct law *)d->plugin_data[instance];
    struct result r;
    (void)m;
    if (!law || !@name@_INNER) {
        return;
    }
    evaluate(d, law, &r);
    memcpy(d->act_dot + law->activation, r.rate, @name@_INNER * sizeof(double));
}

static int nstate(const mjModel *m, int instance)
{
    (void)m;
    (void)instance;
    return 0;
}

static void reset(const mjModel *m, mjtNum *state, void *data, int instance)
{
    (void)m;
    (void)state;
    (void)data;
    (void)instance;
}

mjPLUGIN_LIB_INIT(@name@)
{
    mjpPlugin plugin;
    /* An error of MuJoCo within a constructor would leave the loader of the system locked. */
    if (mjp_getPlugin("nlsdesign.@name@", NULL)) {
        mju_warning("nlsdesign.@name@ is loaded already; the laws that were loaded first stay");
        return;
    }
    mjp_defaultPlugin(&plugin);
    plugin.name = "nlsdesign.@name@";
    plugin.capabilityflags = mjPLUGIN_PASSIVE | mjPLUGIN_ACTUATOR;
    plugin.nattribute = @name@_PARAMETERS + 1;
    plugin.attributes = attributes;
    plugin.nstate = nstate;
    plugin.init = init;
    plugin.destroy = destroy;
    plugin.copy = copy;
    plugin.reset = reset;
    plugin.compute = compute;
    plugin.actuator_act_dot = act_dot;
    mjp_registerPlugin(&plugin);
}
