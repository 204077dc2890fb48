/* modelDescription.xml of an FMU, FMI 3.0 or 2.0: interfaces, units, variables and the structure of the model, in the
 * order of the schema of the standard.
 *
 *     outputs: the columns of the scene           states: q, v, auxiliary states      derivatives of all states
 *     inputs: forces and torques of joints, functions of time (signal.h)
 *     parameters of the scene, fixed or tunable (roles.h)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/export_fmu.h"

#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include "../fmu/reference.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum { KT_FMU_NAME = 256 };

/* ---- text -------------------------------------------------------------------------------------------------------- */

static void write_xml_escaped(const char *text, FILE *to) {
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

static void write_xml_attribute(const char *name, const char *text, FILE *to) {
    fprintf(to, " %s=\"", name);
    write_xml_escaped(text, to);
    fputc('"', to);
}

/* Writes a name in the structured convention: quotes surround a part that has a hyphen. */
static void write_name_parts(const char *name, FILE *to) {
    while (*name != '\0') {
        const size_t length = strcspn(name, ".()[]");
        const char *quote = memchr(name, '-', length) != NULL ? "'" : "";
        fprintf(to, "%s%.*s%s", quote, (int)length, name, quote);
        name += length;
        if (*name != '\0')
            fputc(*name++, to);
    }
}

/* Whether all parts of a name between dots begin with a letter or _, and go on with letters, digits, _ and -. */
static bool has_plain_parts(const char *name) {
    bool begins = true;
    for (; *name != '\0'; name++) {
        const unsigned char c = (unsigned char)*name;
        const bool is_letter = (c < 128 && isalpha(c)) || c == '_', goes_on = is_letter || isdigit(c) || c == '-';
        if (begins ? !is_letter : !goes_on && c != '.')
            return false;
        begins = c == '.';
    }
    return !begins;
}

/* Writes the name of an event, which may have any characters. Quotes surround a name that has others than the
 * structured convention. Quotes and backslashes in it have a backslash. Bytes that are no printable ASCII have their
 * number behind a percent sign, and so has this sign. */
static void write_event_identifier(const char *name, FILE *to) {
    if (has_plain_parts(name)) {
        write_name_parts(name, to);
        return;
    }
    fputc('\'', to);
    for (; *name != '\0'; name++) {
        const unsigned char c = (unsigned char)*name;
        if (c < ' ' || c > '~' || c == '%') {
            fprintf(to, "%%%02X", c);
            continue;
        }
        if (strchr("'\"\\", c) != NULL)
            fputc('\\', to);
        write_xml_escaped((const char[]){*name, '\0'}, to);
    }
    fputc('\'', to);
}

/* ---- units ------------------------------------------------------------------------------------------------------- */

static const char *const bases[] = {"kg", "m", "s", "rad"};
enum { BASES = sizeof bases / sizeof bases[0] };

/* Units of columns, their names in an FMU, and their exponents of the bases. */
typedef struct kt_fmu_unit {
    const char *unit, *name;
    int exponent[BASES];
} kt_fmu_unit;

static const kt_fmu_unit units[] = {
    {"s", "s", {0, 0, 1, 0}},
    {"m", "m", {0, 1, 0, 0}},
    {"m/s", "m/s", {0, 1, -1, 0}},
    {"m/s\u00b2", "m/s2", {0, 1, -2, 0}},
    {"rad", "rad", {0, 0, 0, 1}},
    {"rad/s", "rad/s", {0, 0, -1, 1}},
    {"rad/s\u00b2", "rad/s2", {0, 0, -2, 1}},
    {"N", "N", {1, 1, -2, 0}},
    {"N m", "N.m", {1, 2, -2, 0}},
    {"J", "J", {1, 2, -2, 0}},
    {"W", "W", {1, 2, -3, 0}},
    {"kg m/s", "kg.m/s", {1, 1, -1, 0}},
    {"kg m\u00b2/s", "kg.m2/s", {1, 2, -1, 0}},
    /* of parameters, as keys of scenes have them */
    {"kg", "kg", {1, 0, 0, 0}},
    {"kg m^2", "kg.m2", {1, 2, 0, 0}},
    {"m/s^2", "m/s2", {0, 1, -2, 0}},
    {"m/rad", "m/rad", {0, 1, 0, -1}},
    {"Hz", "Hz", {0, 0, -1, 0}},
    {"N/m", "N/m", {1, 0, -2, 0}},
    {"N s/m", "N.s/m", {1, 0, -1, 0}},
    {"N m/rad", "N.m/rad", {1, 2, -2, -1}},
    {"N m s/rad", "N.m.s/rad", {1, 2, -1, -1}},
    {"N s^2/m^2", "N.s2/m2", {1, -1, 0, 0}},
    {"N m^2", "N.m2", {1, 3, -2, 0}},
};

enum { KT_FMU_UNITS = sizeof units / sizeof units[0] };

static const kt_fmu_unit *find_fmu_unit(const char *unit) {
    for (int i = 0; unit != NULL && i < KT_FMU_UNITS; i++)
        if (strcmp(units[i].unit, unit) == 0)
            return &units[i];
    return NULL;
}

/* Whether an earlier unit has this name. */
static bool is_second_of_name(int i) {
    for (int k = 0; k < i; k++)
        if (strcmp(units[k].name, units[i].name) == 0)
            return true;
    return false;
}

static void write_units(FILE *to) {
    fputs("  <UnitDefinitions>\n", to);
    for (int i = 0; i < KT_FMU_UNITS; i++) {
        if (is_second_of_name(i))
            continue;
        fprintf(to, "    <Unit name=\"%s\"><BaseUnit", units[i].name);
        for (int k = 0; k < BASES; k++)
            if (units[i].exponent[k] != 0)
                fprintf(to, " %s=\"%d\"", bases[k], units[i].exponent[k]);
        fputs("/></Unit>\n", to);
    }
    fputs("  </UnitDefinitions>\n", to);
}

static void write_unit(const char *unit, FILE *to) {
    const kt_fmu_unit *known = find_fmu_unit(unit);
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

static int state_count(const kt_model *model) {
    return kt_model_nq(model) + kt_model_nv(model) + kt_auxiliary_state_count(model);
}

/* ---- variables --------------------------------------------------------------------------------------------------- */

/* A variable. NULL: it does not have this attribute; its variability is continuous. */
typedef struct kt_fmu_variable {
    const char *name, *description, *causality, *variability, *initial, *unit;
    const char *event; /* NULL, or the name of an event, which follows `name` */
    const double *start;
    int reference, derivative; /* derivative: the reference of its state; 0: it is not a derivative */
    bool may_jump;             /* it is a state that events and projections set in model exchange */
    bool is_output;            /* intermediate updates read it */
} kt_fmu_variable;

static int input_count(const kt_fmu_model *fmu) {
    int count = 0;
    for (int i = 0; i < kt_model_nv(fmu->model); i++)
        count += fmu->is_input[i];
    for (int k = 0; k < fmu->inputs->count; k++)
        count += fmu->inputs->items[k].size;
    return count;
}

/* Returns the place of a variable in the list of variables, from 1: time, outputs, inputs, parameters, states,
 * derivatives. Inputs are never looked for. */
static int variable_place_of(const kt_fmu_model *fmu, int reference) {
    const int parameters = (int)fmu->columns->count + input_count(fmu) + 1;
    const int states = parameters + fmu->scene->parameter_count;
    return reference >= KT_FMU_DERIVATIVE  ? states + state_count(fmu->model) + reference - KT_FMU_DERIVATIVE
           : reference >= KT_FMU_STATE     ? states + reference - KT_FMU_STATE
           : reference >= KT_FMU_PARAMETER ? parameters + reference - KT_FMU_PARAMETER
                                           : reference + 1;
}

static void write_variable(const kt_fmu_model *fmu, const kt_fmu_variable *v, FILE *to) {
    const bool is_second = fmu->version == KT_FMU_SECOND;
    const char *const attributes[][2] = {{"description", v->description},
                                         {"causality", v->causality},
                                         {"variability", v->variability != NULL ? v->variability : "continuous"},
                                         {"initial", v->initial}};
    fputs(is_second ? "    <ScalarVariable" : "    <Float64", to);
    fputs(" name=\"", to);
    write_name_parts(v->name, to);
    if (v->event != NULL)
        write_event_identifier(v->event, to);
    fprintf(to, "\" valueReference=\"%d\"", v->reference);
    for (size_t i = 0; i < sizeof attributes / sizeof attributes[0]; i++)
        if (attributes[i][1] != NULL)
            write_xml_attribute(attributes[i][0], attributes[i][1], to);
    if (is_second)
        fputs("><Real", to);
    else if (v->is_output)
        fputs(" intermediateUpdate=\"true\"", to);
    write_unit(v->unit, to);
    if (v->start != NULL)
        fprintf(to, " start=\"%.17g\"", *v->start);
    if (v->derivative != 0)
        fprintf(to, " derivative=\"%d\"", is_second ? variable_place_of(fmu, v->derivative) : v->derivative);
    if (v->may_jump)
        fputs(" reinit=\"true\"", to);
    fputs(is_second ? "/></ScalarVariable>\n" : "/>\n", to);
}

static void write_outputs(const kt_fmu_model *fmu, FILE *to) {
    char name[KT_FMU_NAME];
    for (size_t i = 1; i < fmu->columns->count; i++) {
        const kt_measure quantity = kt_column_quantity(fmu->columns, i);
        (void)kt_column_name(fmu->columns, i, name, sizeof name);
        write_variable(fmu,
                       &(kt_fmu_variable){.name = name,
                                          .description = quantity.title,
                                          .causality = "output",
                                          .initial = "calculated",
                                          .unit = quantity.unit,
                                          .reference = (int)i,
                                          .is_output = true},
                       to);
    }
}

static void write_fmu_inputs(const kt_fmu_model *fmu, FILE *to) {
    static const double start = 0.0;
    char name[KT_FMU_NAME + 32];
    for (int i = 0; i < kt_model_nv(fmu->model); i++) {
        if (!fmu->is_input[i])
            continue;
        const kt_fmu_coordinate c = coordinate_at(fmu->model, i, true);
        (void)snprintf(name, sizeof name, "input.%s", c.name);
        write_variable(fmu,
                       &(kt_fmu_variable){.name = name,
                                          .description = c.is_length ? "Force in a joint" : "Torque in a joint",
                                          .causality = "input",
                                          .unit = c.is_length ? "N" : "N m",
                                          .start = &start,
                                          .reference = KT_FMU_INPUT + i},
                       to);
    }
}

/* Returns the unit of the rate of a quantity; NULL: it has none. */
static const char *rate_unit(const char *unit) {
    const kt_fmu_unit *u = find_fmu_unit(unit);
    for (int i = 0; u != NULL && i < KT_FMU_UNITS; i++) {
        const int rate[BASES] = {u->exponent[0], u->exponent[1], u->exponent[2] - 1, u->exponent[3]};
        if (memcmp(units[i].exponent, rate, sizeof rate) == 0)
            return units[i].unit;
    }
    return NULL;
}

/* Writes a function that is an input: its components, or its value and derivatives. */
static void write_signal(const kt_fmu_model *fmu, const kt_fmu_input *input, int signal, FILE *to) {
    static const char *const endings[] = {"", ".rate", ".acceleration"};
    static const char *const orders[] = {"", ", its first derivative", ", its second derivative"};
    const char *key = strrchr(input->name, '.') + 1;
    const bool is_vector = input->key->kind == KT_KEY_FUNCTIONS;
    char name[sizeof input->name + 32], description[2 * sizeof input->name], first[KT_FMU_UNIT];
    kt_fmu_copy_unit(input->key->unit, input->slides, 0, first);
    const char *unit = first;
    for (int i = 0; i < input->size; i++) {
        if (is_vector)
            (void)snprintf(name, sizeof name, "input.%s[%d]", input->name, i);
        else
            (void)snprintf(name, sizeof name, "input.%s%s", input->name, endings[i]);
        (void)snprintf(description, sizeof description, "%s of %s%s", key, input->of, is_vector ? "" : orders[i]);
        write_variable(fmu,
                       &(kt_fmu_variable){.name = name,
                                          .description = description,
                                          .causality = "input",
                                          .unit = unit,
                                          .start = &input->start[i],
                                          .reference = KT_FMU_SIGNAL + KT_FMU_SIGNAL_MOST * signal + i},
                       to);
        unit = is_vector ? unit : rate_unit(unit);
    }
}

static void write_signals(const kt_fmu_model *fmu, FILE *to) {
    int signal = 0;
    for (int k = 0; k < fmu->inputs->count; k++)
        if (fmu->inputs->items[k].key != NULL)
            write_signal(fmu, &fmu->inputs->items[k], signal++, to);
}

/* Writes the name of a parameter. One with the name of a column, such as the time, has its section before the name. */
static void write_parameter_name(const kt_fmu_model *fmu, const char *parameter, char *name, size_t size) {
    bool is_column = false;
    for (size_t i = 0; i < fmu->columns->count && !is_column; i++)
        is_column = kt_column_name(fmu->columns, i, name, size) > 0 && strcmp(name, parameter) == 0;
    (void)snprintf(name, size, "%s%s", is_column ? "parameters." : "", parameter);
}

static void write_parameters(const kt_fmu_model *fmu, FILE *to) {
    char name[KT_FMU_NAME];
    for (int i = 0; i < fmu->scene->parameter_count; i++) {
        const bool follows = kt_fmu_role_follows(fmu->roles[i]);
        const kt_fmu_use *use = &fmu->uses[i];
        write_parameter_name(fmu, fmu->scene->parameters[i].name, name, sizeof name);
        write_variable(fmu,
                       &(kt_fmu_variable){.name = name,
                                          .description = use->text[0] != '\0' ? use->text : "used in formulas",
                                          .unit = use->unit[0] != '\0' ? use->unit : NULL,
                                          .causality = follows ? "calculatedParameter" : "parameter",
                                          .variability = kt_fmu_role_is_tunable(fmu->roles[i]) ? "tunable" : "fixed",
                                          .initial = follows ? "calculated" : "exact",
                                          .start = follows ? NULL : &fmu->scene->parameters[i].value,
                                          .reference = KT_FMU_PARAMETER + i},
                       to);
    }
}

/* Writes the variable of a state (order 0) or its derivative (order 1). */
static void write_fmu_state(const kt_fmu_model *fmu, int index, int order, FILE *to) {
    static const char *const lengths[] = {"m", "m/s", "m/s\u00b2"}, *const angles[] = {"rad", "rad/s", "rad/s\u00b2"};
    const int nq = kt_model_nq(fmu->model), nv = kt_model_nv(fmu->model);
    char state[KT_FMU_NAME + 32], name[KT_FMU_NAME + 64];
    const char *unit = NULL;
    if (index >= nq + nv) {
        (void)snprintf(state, sizeof state, "x.%s", kt_auxiliary_state_name(fmu->model, index - nq - nv));
    } else {
        const bool is_velocity = index >= nq;
        const kt_fmu_coordinate c = coordinate_at(fmu->model, is_velocity ? index - nq : index, is_velocity);
        (void)snprintf(state, sizeof state, "%s.%s", is_velocity ? "v" : "q", c.name);
        unit = c.is_quaternion ? NULL : (c.is_length ? lengths : angles)[is_velocity + order];
    }
    (void)snprintf(name, sizeof name, order == 0 ? "%s" : "der(%s)", state);
    write_variable(fmu,
                   &(kt_fmu_variable){.name = name,
                                      .causality = "local",
                                      .initial = "calculated",
                                      .unit = unit,
                                      .reference = (order == 0 ? KT_FMU_STATE : KT_FMU_DERIVATIVE) + index,
                                      .derivative = order == 0 ? 0 : KT_FMU_STATE + index,
                                      .may_jump = order == 0 && fmu->has_exchange},
                   to);
}

/* The events of model exchange: those of the scene, then `until`. */
static int indicator_count(const kt_fmu_model *fmu) { return fmu->has_exchange ? kt_scene_event_room(fmu->scene) : 0; }

static void write_indicators(const kt_fmu_model *fmu, FILE *to) {
    for (int i = 0; i < indicator_count(fmu); i++) {
        const bool is_until = i >= fmu->scene->event_count;
        write_variable(fmu,
                       &(kt_fmu_variable){.name = "event.",
                                          .event = is_until ? "until" : fmu->scene->events[i].name,
                                          .description = "Event indicator",
                                          .causality = "local",
                                          .initial = "calculated",
                                          .reference = KT_FMU_INDICATOR + i},
                       to);
    }
}

static void write_variables(const kt_fmu_model *fmu, FILE *to) {
    static const kt_fmu_variable time = {.name = "time", .causality = "independent", .unit = "s"};
    fputs("  <ModelVariables>\n", to);
    write_variable(fmu, &time, to);
    write_outputs(fmu, to);
    write_fmu_inputs(fmu, to);
    write_signals(fmu, to);
    write_parameters(fmu, to);
    for (int order = 0; order < 2; order++)
        for (int i = 0; i < state_count(fmu->model); i++)
            write_fmu_state(fmu, i, order, to);
    write_indicators(fmu, to);
    fputs("  </ModelVariables>\n", to);
}

/* ---- the structure ----------------------------------------------------------------------------------------------- */

/* Returns the only state on which the rate of a state depends: q' = v in joints without quaternions; -1: it is none. */
static int velocity_of(const kt_fmu_model *fmu, int state) {
    for (int body = 1; body < kt_model_body_count(fmu->model); body++) {
        const kt_coordinates at = kt_body_coordinates(fmu->model, body);
        if (state >= at.q && state < at.q + at.nq)
            return at.nq == at.nv ? kt_model_nq(fmu->model) + at.v + state - at.q : -1;
    }
    return -1;
}

/* Writes unknowns with successive references. FMI 3.0 names the kind of an unknown; FMI 2.0 has a group for each kind
 * (write_fmu_group). Without dependencies, an unknown depends on all knowns. With `is_rate`, derivatives of positions
 * depend on velocities. */
static void write_unknowns(const kt_fmu_model *fmu, const char *kind, int first, int count, bool is_rate, FILE *to) {
    const bool is_second = fmu->version == KT_FMU_SECOND;
    for (int i = first; i < first + count; i++) {
        const int known = is_rate ? velocity_of(fmu, i - first) : -1, reference = KT_FMU_STATE + known;
        if (is_second)
            fprintf(to, "      <Unknown index=\"%d\"", variable_place_of(fmu, i));
        else
            fprintf(to, "    <%s valueReference=\"%d\"", kind, i);
        if (known >= 0)
            fprintf(to, " dependencies=\"%d\" dependenciesKind=\"constant\"",
                    is_second ? variable_place_of(fmu, reference) : reference);
        fputs("/>\n", to);
    }
}

static void write_fmu_group(const kt_fmu_model *fmu, const char *line, FILE *to) {
    if (fmu->version == KT_FMU_SECOND)
        fprintf(to, "    %s\n", line);
}

static void write_structure(const kt_fmu_model *fmu, FILE *to) {
    const int states = state_count(fmu->model), outputs = (int)fmu->columns->count - 1;
    static const char initial[] = "InitialUnknown";
    bool has_initial = outputs + states > 0;
    for (int i = 0; i < fmu->scene->parameter_count; i++)
        has_initial |= kt_fmu_role_follows(fmu->roles[i]);
    fputs("  <ModelStructure>\n", to);
    if (outputs > 0) {
        write_fmu_group(fmu, "<Outputs>", to);
        write_unknowns(fmu, "Output", 1, outputs, false, to);
        write_fmu_group(fmu, "</Outputs>", to);
    }
    if (states > 0) {
        write_fmu_group(fmu, "<Derivatives>", to);
        write_unknowns(fmu, "ContinuousStateDerivative", KT_FMU_DERIVATIVE, states, true, to);
        write_fmu_group(fmu, "</Derivatives>", to);
    }
    if (has_initial)
        write_fmu_group(fmu, "<InitialUnknowns>", to);
    write_unknowns(fmu, initial, 1, outputs, false, to);
    for (int i = 0; i < fmu->scene->parameter_count; i++)
        if (kt_fmu_role_follows(fmu->roles[i]))
            write_unknowns(fmu, initial, KT_FMU_PARAMETER + i, 1, false, to);
    write_unknowns(fmu, initial, KT_FMU_STATE, states, false, to);
    write_unknowns(fmu, initial, KT_FMU_DERIVATIVE, states, false, to);
    if (has_initial)
        write_fmu_group(fmu, "</InitialUnknowns>", to);
    if (fmu->version == KT_FMU_THIRD)
        write_unknowns(fmu, "EventIndicator", KT_FMU_INDICATOR, indicator_count(fmu), false, to);
    fputs("  </ModelStructure>\n", to);
}

/* Writes an interface. FMI 2.0 lists sources in it, and FMI 3.0 in the description of the build alone. */
static void write_interface(const kt_fmu_model *fmu, const char *kind, const char *capabilities, const char *further,
                            FILE *to) {
    const bool has_list = fmu->version == KT_FMU_SECOND && fmu->has_sources;
    fprintf(to, "  <%s", kind);
    write_xml_attribute("modelIdentifier", fmu->name, to);
    fprintf(to, " %s%s%s>\n", capabilities, further, has_list ? "" : "/");
    if (has_list)
        fprintf(to, "    <SourceFiles><File name=\"" KT_FMU_SOURCE "\"/></SourceFiles>\n  </%s>\n", kind);
}

#define KT_FMU_STEP_FLAGS                                                                                              \
    " canHandleVariableCommunicationStepSize=\"true\" hasEventMode=\"true\" providesIntermediateUpdate=\"true\" "      \
    "canReturnEarlyAfterIntermediateUpdate=\"true\""

/* Whether a step of co-simulation may meet an event: of the scene, or of a contact or friction. */
static bool has_events(const kt_fmu_model *fmu) {
    return kt_scene_event_room(fmu->scene) > 0 || kt_switch_count(fmu->model) > 0;
}

static void write_interfaces(const kt_fmu_model *fmu, FILE *to) {
    const bool is_second = fmu->version == KT_FMU_SECOND;
    const char *capabilities =
        is_second ? "canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\" providesDirectionalDerivative=\"true\""
                  : "canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" "
                    "providesDirectionalDerivatives=\"true\" providesAdjointDerivatives=\"true\"";
    if (fmu->has_exchange)
        write_interface(fmu, "ModelExchange", capabilities, is_second ? "" : " needsCompletedIntegratorStep=\"true\"",
                        to);
    write_interface(fmu, "CoSimulation", capabilities,
                    is_second         ? " canHandleVariableCommunicationStepSize=\"true\""
                    : has_events(fmu) ? KT_FMU_STEP_FLAGS " mightReturnEarlyFromDoStep=\"true\""
                                      : KT_FMU_STEP_FLAGS,
                    to);
}

void kt_fmu_describe(const kt_fmu_model *fmu, FILE *stream) {
    const kt_run *run = &fmu->scene->run;
    const bool is_second = fmu->version == KT_FMU_SECOND;
    fprintf(stream, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"%s\"",
            is_second ? "2.0" : "3.0");
    const char *title = fmu->scene->description.name;
    write_xml_attribute("modelName", title != NULL && *title != '\0' ? title : fmu->name, stream);
    write_xml_attribute(is_second ? "guid" : "instantiationToken", fmu->token, stream);
    fprintf(stream, " generationTool=\"Kinetree %s\" variableNamingConvention=\"structured\"", KT_VERSION);
    if (is_second)
        fprintf(stream, " numberOfEventIndicators=\"%d\"", indicator_count(fmu));
    fputs(">\n", stream);
    write_interfaces(fmu, stream);
    write_units(stream);
    fputs("  <LogCategories>\n    <Category name=\"error\" description=\"failures, with the reason\"/>\n"
          "  </LogCategories>\n",
          stream);
    fputs("  <DefaultExperiment startTime=\"0\"", stream);
    if (run->duration > 0.0)
        fprintf(stream, " stopTime=\"%.17g\" stepSize=\"%.17g\"", run->duration,
                run->interval > 0.0 ? run->interval : run->duration / 1000.0);
    fputs("/>\n", stream);
    write_variables(fmu, stream);
    write_structure(fmu, stream);
    fputs("</fmiModelDescription>\n", stream);
}

void kt_fmu_describe_build(const kt_fmu_model *fmu, FILE *stream) {
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n"
          "  <BuildConfiguration",
          stream);
    write_xml_attribute("modelIdentifier", fmu->name, stream);
    fputs(" description=\"gcc or clang, on systems with the functions of POSIX\">\n"
          "    <SourceFileSet language=\"C17\" compilerOptions=\"-std=c17 -O2 -ffp-contract=off -fno-math-errno "
          "-Wno-psabi\">\n"
          "      <SourceFile name=\"" KT_FMU_SOURCE "\"/>\n    </SourceFileSet>\n"
          "    <Library name=\"m\" external=\"true\" description=\"the library of mathematical functions of C\"/>\n"
          "  </BuildConfiguration>\n</fmiBuildDescription>\n",
          stream);
}
