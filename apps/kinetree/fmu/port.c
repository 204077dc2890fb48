/* The variables of an FMU that a scene names (port.h). */
#include "fmu/description.h"

#include "base/names.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- variables --------------------------------------------------------------------------------------------------- */

static const char *const role_names[] = {"an input", "an output", "a parameter"};

static bool plays(const kt_fmi_variable *variable, kt_fmu_role role) {
    const char *causality = variable->causality;
    const bool is_local = strcmp(causality, "local") == 0, is_output = strcmp(causality, "output") == 0;
    switch (role) {
    case KT_FMU_INPUT:
        return strcmp(causality, "input") == 0;
    case KT_FMU_OUTPUT:
        return is_local || is_output;
    case KT_FMU_PARAMETER:
        break;
    }
    return strcmp(causality, "parameter") == 0 ||
           ((is_local || is_output) && variable->has_start && !variable->is_constant);
}

/* Lists the first variables that play a role. Returns how many do. */
static int list_players(const kt_fmi_description *description, kt_fmu_role role, char *text, size_t size) {
    enum { LISTED = 5 };
    size_t used = 0;
    int count = 0;
    text[0] = '\0';
    for (int i = 0; i < description->count; i++)
        if (plays(&description->variables[i], role) && count++ < LISTED && used < size)
            used += (size_t)snprintf(text + used, size - used, "%s'%.40s'", used > 0 ? ", " : "",
                                     description->variables[i].name);
    if (count > LISTED && used < size)
        (void)snprintf(text + used, size - used, " and %d more", count - LISTED);
    return count;
}

static void reject_port_name(const kt_fmi_description *description, const kt_scene_fmu *fmu, const kt_scene_port *port,
                             kt_fmu_role role, kt_error *error) {
    char names[280];
    if (list_players(description, role, names, sizeof names) == 0)
        (void)kt_error_set(error, KT_ERROR_SCENE, port->where,
                           "FMU '%.60s' has no variable '%.60s', and none that can be %s; remove it", fmu->name,
                           port->variable, role_names[role]);
    else
        (void)kt_error_set(error, KT_ERROR_SCENE, port->where,
                           "FMU '%.60s' has no variable '%.60s'; these can be %s: %s", fmu->name, port->variable,
                           role_names[role], names);
}

const kt_fmi_variable *kt_fmu_port_find(const kt_fmi_description *description, const kt_scene_fmu *fmu,
                                        const kt_scene_port *port, kt_fmu_role role, kt_error *error) {
    const kt_fmi_variable *variable = kt_fmi_variable_find(description, port->variable);
    int64_t effort = 1000000;
    kt_nearest near = kt_nearest_make(port->variable, &effort);
    for (int i = 0; variable == NULL && i < description->count; i++)
        if (plays(&description->variables[i], role))
            (void)kt_nearest_try(&near, description->variables[i].name);
    if (variable == NULL && near.best != NULL)
        (void)kt_error_set(error, KT_ERROR_SCENE, port->where,
                           "FMU '%.60s' has no variable '%.60s'; did you mean '%s'?", fmu->name, port->variable,
                           near.best);
    else if (variable == NULL)
        reject_port_name(description, fmu, port, role, error);
    else if (!plays(variable, role))
        (void)kt_error_set(error, KT_ERROR_SCENE, port->where,
                           "FMU '%.60s': '%.60s' is no variable that can be %s: its causality is '%.20s'%s", fmu->name,
                           port->variable, role_names[role], variable->causality,
                           role == KT_FMU_PARAMETER && !variable->has_start ? ", and it has no start value" : "");
    else if (variable->type == KT_FMI_OTHER || variable->is_array)
        (void)kt_error_set(error, KT_ERROR_UNSUPPORTED, port->where,
                           "FMU '%.60s': '%.60s' is %s%.20s; a scene couples single numbers and truth values",
                           fmu->name, port->variable, variable->is_array ? "an array of " : "a ", variable->type_name);
    else
        return variable;
    return NULL;
}

bool kt_fmu_value_fits(const kt_fmi_variable *variable, double value, kt_error *error) {
    static const struct {
        double least, beyond;
    } ranges[] = {[KT_FMI_INT8] = {-128.0, 128.0},
                  [KT_FMI_UINT8] = {0.0, 256.0},
                  [KT_FMI_INT16] = {-32768.0, 32768.0},
                  [KT_FMI_UINT16] = {0.0, 65536.0},
                  [KT_FMI_INT32] = {-2147483648.0, 2147483648.0},
                  [KT_FMI_UINT32] = {0.0, 4294967296.0},
                  [KT_FMI_INT64] = {-0x1p63, 0x1p63},
                  [KT_FMI_UINT64] = {0.0, 0x1p64}};
    const bool is_whole = variable->type >= KT_FMI_INT8 && variable->type <= KT_FMI_UINT64;
    if (isfinite(value) && (!is_whole || (value == rint(value) && value >= ranges[variable->type].least &&
                                          value < ranges[variable->type].beyond)))
        return true;
    (void)kt_error_set(error, KT_ERROR_SCENE, NULL, "%.17g is no value of its variable '%.60s', which is %.20s", value,
                       variable->name, variable->type_name);
    return false;
}

/* ---- units ------------------------------------------------------------------------------------------------------- */

/* Exponents of kg, m, s, and rad. */
typedef struct kt_column_unit {
    const char *name;
    int kg, m, s, rad;
} kt_column_unit;

static const kt_column_unit second = {"s", 0, 0, 1, 0}, metre = {"m", 0, 1, 0, 0}, radian = {"rad", 0, 0, 0, 1};
static const kt_column_unit speed = {"m/s", 0, 1, -1, 0}, rate = {"rad/s", 0, 0, -1, 1};
static const kt_column_unit newton = {"N", 1, 1, -2, 0}, moment = {"N m", 1, 2, -2, 0};

/* The unit of a coordinate of a joint, or that of a force along it; NULL: not known (quaternions). */
static const kt_column_unit *unit_of_joint(const kt_description *d, const kt_variable *v, bool is_force) {
    const kt_coordinate_kind kind = kt_joint_coordinate_kind(d->bodies[v->body].joint.type, v->component);
    const bool is_length = kind == KT_COORDINATE_LENGTH || kind == KT_COORDINATE_TRANSLATION;
    if (is_force)
        return is_length ? &newton : &moment;
    if (v->type == KT_VARIABLE_VELOCITY)
        return is_length ? &speed : &rate;
    return is_length ? &metre : kind == KT_COORDINATE_ANGLE ? &radian : NULL;
}

static const kt_column_unit *unit_of_name(const kt_description *d, const char *name, bool is_force) {
    kt_variable v;
    if (!kt_variable_find(d, name, &v))
        return NULL;
    switch (v.type) {
    case KT_VARIABLE_TIME:
        return &second;
    case KT_VARIABLE_POSITION:
    case KT_VARIABLE_VELOCITY:
        return unit_of_joint(d, &v, is_force);
    case KT_VARIABLE_GRAVITY:
        return unit_of_joint(d, &v, true);
    case KT_VARIABLE_MARKER:
        return &metre;
    case KT_VARIABLE_MARKER_VELOCITY:
        return &speed;
    case KT_VARIABLE_STATE:
        break;
    }
    return NULL;
}

/* The unit of the scene's side of a port; NULL: not known. */
static const kt_column_unit *unit_of_port(const kt_description *d, const kt_scene_port *port, kt_fmu_role role) {
    char name[KT_WHERE_SIZE];
    if (role == KT_FMU_INPUT)
        return unit_of_name(d, port->text, false);
    if (role == KT_FMU_PARAMETER || strcmp(port->text, port->target) == 0)
        return NULL;
    (void)snprintf(name, sizeof name, "velocity.%.100s", port->target);
    return unit_of_name(d, name, true);
}

bool kt_fmu_units_differ(const kt_description *scene, const kt_fmi_description *description, const kt_scene_port *port,
                         kt_fmu_role role, char *text, size_t size) {
    const kt_fmi_variable *variable = kt_fmi_variable_find(description, port->variable);
    const kt_column_unit *own = unit_of_port(scene, port, role);
    kt_fmi_unit unit;
    if (own == NULL || variable == NULL || variable->unit == NULL ||
        !kt_fmi_unit_find(description, variable->unit, &unit))
        return false;
    const int exponent[8] = {own->kg, own->m, own->s, 0, 0, 0, 0, own->rad};
    if (memcmp(exponent, unit.exponent, sizeof exponent) == 0 && unit.factor == 1.0 && unit.offset == 0.0)
        return false;
    (void)snprintf(text, size, "'%.60s' is in %.20s, and the scene has %s here; %s", variable->name, variable->unit,
                   own->name,
                   role == KT_FMU_INPUT ? "convert it in a formula"
                                        : "make the output a parameter, and convert that in the formulas that use it");
    return true;
}
