/* modelDescription.xml of an FMU, FMI 3.0: interfaces, units, variables and the structure of the model, in the order of
 * the standard's schema.
 *
 *     outputs: the columns of the scene           states: q, v, auxiliary states      derivatives of all states
 *     inputs: forces and torques of joints        parameters of the scene, fixed until the end of the initialization
 */
#include "subcommands/export_fmu.h"

#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include "../fmu/reference.h"

#include <stdio.h>
#include <string.h>

enum { KT_FMU_NAME = 256 };

/* ---- text -------------------------------------------------------------------------------------------------------- */

static void write_escaped(const char *text, FILE *to) {
    for (; *text != '\0'; text++) {
        switch (*text) {
        case '&':
            fputs("&amp;", to);
            break;
        case '<':
            fputs("&lt;", to);
            break;
        case '"':
            fputs("&quot;", to);
            break;
        default:
            if ((unsigned char)*text >= ' ')
                fputc(*text, to);
        }
    }
}

static void write_attribute(const char *name, const char *text, FILE *to) {
    fprintf(to, " %s=\"", name);
    write_escaped(text, to);
    fputc('"', to);
}

/* ---- units ------------------------------------------------------------------------------------------------------- */

/* Units of columns, their names in an FMU, and their exponents of kg, m, s and rad. */
typedef struct kt_fmu_unit {
    const char *unit, *name;
    int kg, m, s, rad;
} kt_fmu_unit;

static const kt_fmu_unit units[] = {
    {"s", "s", 0, 0, 1, 0},
    {"m", "m", 0, 1, 0, 0},
    {"m/s", "m/s", 0, 1, -1, 0},
    {"m/s\u00b2", "m/s2", 0, 1, -2, 0},
    {"rad", "rad", 0, 0, 0, 1},
    {"rad/s", "rad/s", 0, 0, -1, 1},
    {"rad/s\u00b2", "rad/s2", 0, 0, -2, 1},
    {"N", "N", 1, 1, -2, 0},
    {"N m", "N.m", 1, 2, -2, 0},
    {"J", "J", 1, 2, -2, 0},
    {"W", "W", 1, 2, -3, 0},
    {"kg m/s", "kg.m/s", 1, 1, -1, 0},
    {"kg m\u00b2/s", "kg.m2/s", 1, 2, -1, 0},
};

enum { KT_FMU_UNITS = sizeof units / sizeof units[0] };

static const kt_fmu_unit *find_unit(const char *unit) {
    for (int i = 0; unit != NULL && i < KT_FMU_UNITS; i++)
        if (strcmp(units[i].unit, unit) == 0)
            return &units[i];
    return NULL;
}

static void write_exponent(const char *name, int exponent, FILE *to) {
    if (exponent != 0)
        fprintf(to, " %s=\"%d\"", name, exponent);
}

static void write_units(FILE *to) {
    fputs("  <UnitDefinitions>\n", to);
    for (int i = 0; i < KT_FMU_UNITS; i++) {
        fprintf(to, "    <Unit name=\"%s\"><BaseUnit", units[i].name);
        write_exponent("kg", units[i].kg, to);
        write_exponent("m", units[i].m, to);
        write_exponent("s", units[i].s, to);
        write_exponent("rad", units[i].rad, to);
        fputs("/></Unit>\n", to);
    }
    fputs("  </UnitDefinitions>\n", to);
}

static void write_unit(const char *unit, FILE *to) {
    const kt_fmu_unit *known = find_unit(unit);
    if (known != NULL)
        fprintf(to, " unit=\"%s\"", known->name);
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* A coordinate of a joint: its name, and whether it is a length. */
typedef struct kt_fmu_coordinate {
    char name[KT_FMU_NAME];
    bool is_length, is_quaternion;
} kt_fmu_coordinate;

static kt_fmu_coordinate coordinate_at(const kt_model *model, int index, bool is_velocity) {
    kt_fmu_coordinate c = {.name = ""};
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        const int first = is_velocity ? at.v : at.q, count = is_velocity ? at.nv : at.nq;
        if (index < first || index >= first + count)
            continue;
        const kt_coordinate_kind kind = kt_joint_coordinate_kind(at.type, index - first);
        c.is_length = kind == KT_COORDINATE_LENGTH || kind == KT_COORDINATE_TRANSLATION;
        c.is_quaternion = kind == KT_COORDINATE_ROTATION && !is_velocity;
        if (count == 1)
            (void)snprintf(c.name, sizeof c.name, "%s", kt_joint_name(model, body));
        else
            (void)snprintf(c.name, sizeof c.name, "%s[%d]", kt_joint_name(model, body), index - first);
    }
    return c;
}

/* Writes the variable of a state (order 0) or its derivative (order 1). */
static void write_state(const kt_model *model, int index, int order, FILE *to) {
    static const char *const lengths[] = {"m", "m/s", "m/s\u00b2"}, *const angles[] = {"rad", "rad/s", "rad/s\u00b2"};
    const int nq = kt_model_nq(model), nv = kt_model_nv(model);
    char name[KT_FMU_NAME + 32];
    const char *unit = NULL;
    if (index >= nq + nv) {
        (void)snprintf(name, sizeof name, "x.%s", kt_own_state_name(model, index - nq - nv));
    } else {
        const bool is_velocity = index >= nq;
        const kt_fmu_coordinate c = coordinate_at(model, is_velocity ? index - nq : index, is_velocity);
        (void)snprintf(name, sizeof name, "%s.%s", is_velocity ? "v" : "q", c.name);
        unit = c.is_quaternion ? NULL : (c.is_length ? lengths : angles)[is_velocity + order];
    }
    fprintf(to, "    <Float64 name=\"%s", order == 0 ? "" : "der(");
    write_escaped(name, to);
    fprintf(to, "%s\" valueReference=\"%d\" causality=\"local\" variability=\"continuous\" initial=\"calculated\"",
            order == 0 ? "" : ")", (order == 0 ? KT_FMU_STATE : KT_FMU_DERIVATIVE) + index);
    write_unit(unit, to);
    if (order == 1)
        fprintf(to, " derivative=\"%d\"", KT_FMU_STATE + index);
    fputs("/>\n", to);
}

static int state_count(const kt_model *model) {
    return kt_model_nq(model) + kt_model_nv(model) + kt_own_state_count(model);
}

/* ---- variables --------------------------------------------------------------------------------------------------- */

static void write_outputs(const kt_fmu_model *fmu, FILE *to) {
    char name[KT_FMU_NAME];
    for (size_t i = 1; i < fmu->columns->count; i++) {
        (void)kt_column_name(fmu->columns, i, name, sizeof name);
        fputs("    <Float64", to);
        write_attribute("name", name, to);
        fprintf(to, " valueReference=\"%zu\"", i);
        write_attribute("description", kt_column_quantity(fmu->columns, i).title, to);
        fputs(" causality=\"output\" variability=\"continuous\" initial=\"calculated\"", to);
        write_unit(kt_column_quantity(fmu->columns, i).unit, to);
        fputs("/>\n", to);
    }
}

static void write_inputs(const kt_fmu_model *fmu, FILE *to) {
    for (int i = 0; i < kt_model_nv(fmu->model); i++) {
        if (!fmu->is_input[i])
            continue;
        const kt_fmu_coordinate c = coordinate_at(fmu->model, i, true);
        fputs("    <Float64 name=\"input.", to);
        write_escaped(c.name, to);
        fprintf(to,
                "\" valueReference=\"%d\" description=\"%s in a joint\" causality=\"input\" variability=\"continuous\""
                " unit=\"%s\" start=\"0\"/>\n",
                KT_FMU_INPUT + i, c.is_length ? "Force" : "Torque", c.is_length ? "N" : "N.m");
    }
}

static void write_parameters(const kt_fmu_model *fmu, FILE *to) {
    for (int i = 0; i < fmu->scene->parameter_count; i++) {
        fputs("    <Float64", to);
        write_attribute("name", fmu->scene->parameters[i].name, to);
        fprintf(to, " valueReference=\"%d\" causality=\"%s\" variability=\"fixed\" initial=\"%s\"",
                KT_FMU_PARAMETER + i, fmu->follows[i] ? "calculatedParameter" : "parameter",
                fmu->follows[i] ? "calculated" : "exact");
        if (!fmu->follows[i])
            fprintf(to, " start=\"%.17g\"", fmu->scene->parameters[i].value);
        fputs("/>\n", to);
    }
}

static void write_variables(const kt_fmu_model *fmu, FILE *to) {
    fputs("  <ModelVariables>\n    <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" "
          "variability=\"continuous\" unit=\"s\"/>\n",
          to);
    write_outputs(fmu, to);
    write_inputs(fmu, to);
    write_parameters(fmu, to);
    for (int order = 0; order < 2; order++)
        for (int i = 0; i < state_count(fmu->model); i++)
            write_state(fmu->model, i, order, to);
    fputs("  </ModelVariables>\n", to);
}

/* ---- the structure ----------------------------------------------------------------------------------------------- */

/* Without dependencies, an unknown depends on all knowns. */
static void write_structure(const kt_fmu_model *fmu, FILE *to) {
    const int states = state_count(fmu->model);
    fputs("  <ModelStructure>\n", to);
    for (size_t i = 1; i < fmu->columns->count; i++)
        fprintf(to, "    <Output valueReference=\"%zu\"/>\n", i);
    for (int i = 0; i < states; i++)
        fprintf(to, "    <ContinuousStateDerivative valueReference=\"%d\"/>\n", KT_FMU_DERIVATIVE + i);
    for (size_t i = 1; i < fmu->columns->count; i++)
        fprintf(to, "    <InitialUnknown valueReference=\"%zu\"/>\n", i);
    for (int i = 0; i < fmu->scene->parameter_count; i++)
        if (fmu->follows[i])
            fprintf(to, "    <InitialUnknown valueReference=\"%d\"/>\n", KT_FMU_PARAMETER + i);
    for (int i = 0; i < states; i++)
        fprintf(to, "    <InitialUnknown valueReference=\"%d\"/>\n", KT_FMU_STATE + i);
    for (int i = 0; i < states; i++)
        fprintf(to, "    <InitialUnknown valueReference=\"%d\"/>\n", KT_FMU_DERIVATIVE + i);
    fputs("  </ModelStructure>\n", to);
}

static void write_interfaces(const kt_fmu_model *fmu, FILE *to) {
    static const char capabilities[] = "canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" "
                                       "providesDirectionalDerivatives=\"true\" providesAdjointDerivatives=\"true\"";
    if (fmu->has_exchange) {
        fputs("  <ModelExchange", to);
        write_attribute("modelIdentifier", fmu->name, to);
        fprintf(to, " %s needsCompletedIntegratorStep=\"true\"/>\n", capabilities);
    }
    fputs("  <CoSimulation", to);
    write_attribute("modelIdentifier", fmu->name, to);
    fprintf(to, " %s canHandleVariableCommunicationStepSize=\"true\"/>\n", capabilities);
}

void kt_fmu_describe(const kt_fmu_model *fmu, FILE *stream) {
    const kt_run *run = &fmu->scene->run;
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\"", stream);
    write_attribute("modelName", fmu->name, stream);
    write_attribute("instantiationToken", fmu->token, stream);
    fprintf(stream, " generationTool=\"Kinetree %s\" variableNamingConvention=\"flat\">\n", KT_VERSION);
    write_interfaces(fmu, stream);
    write_units(stream);
    fputs("  <LogCategories>\n    <Category name=\"error\" description=\"failures, with the reason\"/>\n"
          "  </LogCategories>\n",
          stream);
    fprintf(stream, "  <DefaultExperiment startTime=\"0\" stopTime=\"%.17g\" stepSize=\"%.17g\"/>\n", run->duration,
            run->interval > 0.0 ? run->interval : run->duration / 1000.0);
    write_variables(fmu, stream);
    write_structure(fmu, stream);
    fputs("</fmiModelDescription>\n", stream);
}
