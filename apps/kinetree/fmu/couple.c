/* FMUs in a simulation (couple.h). The times of communication points are those of lib/scene/couple.c. */
#include "fmu/couple.h"

#include "command.h"
#include "fmu/description.h"
#include "fmu/instance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* An FMU with its variables. */
typedef struct kt_fmu_partner {
    const kt_scene_fmu *of;
    kt_fmi_instance fmi;
    const kt_fmi_variable **variables[KT_FMU_ROLES]; /* of the ports of each role */
    bool has_started;
    kt_fmu_clock *clock; /* of the first FMU: that of the simulation */
} kt_fmu_partner;

struct kt_fmu_clock {
    int count;
    double step[]; /* of each FMU, s. A sweep may vary those of the scene before the simulation ends */
};

/* ---- checks ------------------------------------------------------------------------------------------------------ */

/* The ports of a role. */
typedef struct kt_fmu_ports {
    const kt_scene_port *ports;
    int count;
} kt_fmu_ports;

static kt_fmu_ports ports_of(const kt_scene_fmu *fmu, kt_fmu_role role) {
    return role == KT_FMU_INPUT    ? (kt_fmu_ports){fmu->inputs, fmu->input_count}
           : role == KT_FMU_OUTPUT ? (kt_fmu_ports){fmu->outputs, fmu->output_count}
                                   : (kt_fmu_ports){fmu->parameters, fmu->parameter_count};
}

/* Sets the place of an error of a file or its description. */
static void place_error(const kt_scene_fmu *fmu, kt_error *error) {
    const kt_error plain = *error;
    if (plain.where[0] == '\0')
        (void)kt_error_set(error, plain.code, fmu->where, "effect '%.60s': %s", fmu->name, plain.message);
}

static void print_at(const char *where, const char *kind, const char *message) {
    fprintf(stderr, "%s: %s%s\n", where, kind, message);
}

/* Prints the error of a file or its description. Returns the number of faults. */
static int print_fault(const kt_scene_fmu *fmu, kt_status status, kt_error *error) {
    if (status == KT_OK)
        return 0;
    place_error(fmu, error);
    print_at(error->where, "", error->message);
    return 1;
}

/* Prints the inputs of the FMU that the scene does not set. */
static void print_unset(const kt_scene_fmu *fmu, const kt_fmi_description *description) {
    char text[KT_MESSAGE_SIZE];
    int unset = 0;
    const char *first = NULL;
    for (int i = 0; i < description->count; i++) {
        bool is_set = strcmp(description->variables[i].causality, "input") != 0;
        for (int k = 0; k < fmu->input_count; k++)
            is_set = is_set || strcmp(fmu->inputs[k].variable, description->variables[i].name) == 0;
        first = is_set || first != NULL ? first : description->variables[i].name;
        unset += !is_set;
    }
    (void)snprintf(text, sizeof text, "FMU '%.60s': %d input%s, '%.60s'%s, keep%s the start value; name it in `inputs`",
                   fmu->name, unset, unset == 1 ? "" : "s", first != NULL ? first : "", unset > 1 ? " first" : "",
                   unset == 1 ? "s" : "");
    if (unset > 0)
        print_at(fmu->where, "warning: ", text);
}

/* Checks the variables of a role. Returns the number of faults. */
static int check_ports(const kt_scene *scene, const kt_scene_fmu *fmu, const kt_fmi_description *description,
                       kt_fmu_role role, bool is_quiet) {
    const kt_fmu_ports list = ports_of(fmu, role);
    char text[KT_MESSAGE_SIZE];
    int faults = 0;
    for (int k = 0; k < list.count; k++) {
        const kt_scene_port *port = &list.ports[k];
        kt_error error = {0};
        const kt_fmi_variable *variable = kt_fmu_port_find(description, fmu, port, role, &error);
        const bool is_wrong =
            variable == NULL || (role == KT_FMU_PARAMETER && !kt_fmu_value_fits(variable, port->value, &error));
        faults += is_wrong;
        if (is_wrong)
            print_at(port->where, "", error.message);
        else if (!is_quiet && kt_fmu_units_differ(&scene->description, description, port, role, text, sizeof text))
            print_at(port->where, "warning: units differ: ", text);
    }
    return faults;
}

int kt_fmus_check(const kt_scene *scene, bool is_quiet) {
    int faults = 0;
    for (int i = 0; i < scene->fmu_count; i++) {
        const kt_scene_fmu *fmu = &scene->fmus[i];
        kt_fmi_description description;
        kt_error error = {0};
        const kt_status status = kt_fmi_description_read(fmu->file, &description, &error);
        faults += print_fault(fmu, status, &error);
        for (int role = 0; role < KT_FMU_ROLES && status == KT_OK; role++)
            faults += check_ports(scene, fmu, &description, (kt_fmu_role)role, is_quiet);
        if (status == KT_OK && !is_quiet)
            print_unset(fmu, &description);
        kt_fmi_description_free(&description);
    }
    return faults > 0 ? KT_EXIT_SCENE : KT_EXIT_DONE;
}

int kt_fmus_inspect(const kt_scene *scene) {
    int faults = 0;
    for (int i = 0; i < scene->fmu_count; i++) {
        kt_error error = {0};
        faults += print_fault(&scene->fmus[i], kt_fmi_inspect(scene->fmus[i].file, &error), &error);
    }
    return faults > 0 ? KT_EXIT_SCENE : KT_EXIT_DONE;
}

/* ---- samples ----------------------------------------------------------------------------------------------------- */

static kt_status set_partner_value(kt_fmu_partner *p, const kt_fmi_variable *variable, double value, kt_error *error) {
    kt_error fault = {0};
    char what[KT_FMI_TEXT];
    if (!kt_fmu_value_fits(variable, value, &fault))
        return kt_error_set(error, KT_ERROR_CALLBACK, NULL, "FMU '%.60s' at t = %.9g s: %s", p->fmi.name, p->fmi.time,
                            fault.message);
    (void)snprintf(what, sizeof what, "Set%.20s of '%.60s'", variable->type_name, variable->name);
    return kt_fmi_check(&p->fmi, p->fmi.calls->set(&p->fmi, variable, value), what, error);
}

static kt_status set_inputs(kt_fmu_partner *p, const double *inputs, kt_error *error) {
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK && i < p->of->input_count; i++)
        status = set_partner_value(p, p->variables[KT_FMU_INPUT][i], inputs[i], error);
    return status;
}

static kt_status get_outputs(kt_fmu_partner *p, double *outputs, kt_error *error) {
    kt_status status = KT_OK;
    char what[KT_FMI_TEXT];
    for (int i = 0; status == KT_OK && i < p->of->output_count; i++) {
        const kt_fmi_variable *variable = p->variables[KT_FMU_OUTPUT][i];
        (void)snprintf(what, sizeof what, "Get%.20s of '%.60s'", variable->type_name, variable->name);
        status = kt_fmi_check(&p->fmi, p->fmi.calls->get(&p->fmi, variable, &outputs[i]), what, error);
    }
    return status;
}

/* Begins at point 0, with a new instance if there has been a motion before. */
static kt_status start_fmu(kt_fmu_partner *p, const kt_scene_sample *sample, kt_error *error) {
    kt_fmi_instance *f = &p->fmi;
    kt_status status = p->has_started ? kt_fmi_renew(f, error) : KT_OK;
    p->has_started = true;
    f->time = sample->time;
    for (int i = 0; status == KT_OK && i < p->of->parameter_count; i++)
        status = set_partner_value(p, p->variables[KT_FMU_PARAMETER][i], p->of->parameters[i].value, error);
    if (status == KT_OK)
        status = kt_fmi_check(f, f->calls->begin(f, sample->time), "EnterInitializationMode", error);
    if (status == KT_OK)
        status = set_inputs(p, sample->inputs, error);
    if (status == KT_OK)
        status = kt_fmi_check(f, f->call.end(f->instance), "ExitInitializationMode", error);
    if (status != KT_OK && f->worst < KT_FMI_ERROR)
        f->worst = KT_FMI_ERROR; /* an instance that has not started is not terminated */
    return status;
}

static int sample_fmu(const kt_scene_sample *sample, kt_error *error, void *user) {
    kt_fmu_partner *p = user;
    kt_fmi_instance *f = &p->fmi;
    bool terminates = false;
    kt_status status;
    if (sample->number == 0) {
        status = start_fmu(p, sample, error);
    } else {
        f->time = (double)(sample->number - 1) * sample->step;
        status = kt_fmi_check(f, f->calls->step(f, f->time, sample->step, &terminates), "DoStep", error);
        f->time = sample->time;
        if (status == KT_OK && !terminates)
            status = set_inputs(p, sample->inputs, error);
    }
    if (status == KT_OK)
        status = get_outputs(p, sample->outputs, error);
    if (status != KT_OK)
        return -1;
    if (terminates)
        kt_say("FMU '%s' ended the simulation at t = %.9g s", f->name, f->time);
    return terminates ? 1 : 0;
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static void release_fmu(void *user) {
    kt_fmu_partner *p = user;
    if (p->has_started)
        kt_fmi_terminate(&p->fmi);
    kt_fmi_close(&p->fmi);
    for (int role = 0; role < KT_FMU_ROLES; role++)
        free(p->variables[role]);
    free(p->clock);
    free(p);
}

/* Finds the variables of a role. */
static kt_status find_ports(kt_fmu_partner *p, kt_fmu_role role, kt_error *error) {
    const kt_fmu_ports list = ports_of(p->of, role);
    const kt_fmi_variable **found = p->variables[role] = calloc((size_t)list.count + 1, sizeof *found);
    if (found == NULL)
        return kt_reject_memory(error);
    for (int i = 0; i < list.count; i++)
        if ((found[i] = kt_fmu_port_find(&p->fmi.description, p->of, &list.ports[i], role, error)) == NULL)
            return error->code;
    return KT_OK;
}

static kt_status open_fmu(const kt_scene_fmu *fmu, kt_fmu_partner *p, kt_error *error) {
    kt_status status = kt_fmi_open(&p->fmi, fmu->name, fmu->file, error);
    p->of = fmu;
    if (status != KT_OK)
        place_error(fmu, error);
    for (int role = 0; role < KT_FMU_ROLES && status == KT_OK; role++)
        status = find_ports(p, (kt_fmu_role)role, error);
    return status;
}

static double next_sample(void *user, double t) {
    const kt_fmu_clock *clock = user;
    double next = HUGE_VAL;
    for (int i = 0; i < clock->count; i++)
        next = fmin(next, kt_scene_next_sample(clock->step[i], t));
    return next;
}

kt_status kt_fmus_begin(const kt_scene *scene, kt_simulation_options *options, kt_fmu_clock **clock, kt_error *error) {
    const size_t count = (size_t)scene->fmu_count;
    *clock = NULL;
    if (count == 0)
        return KT_OK;
    kt_fmu_clock *made = malloc(sizeof *made + count * sizeof made->step[0]);
    if (made == NULL)
        return kt_reject_memory(error);
    made->count = scene->fmu_count;
    for (size_t i = 0; i < count; i++)
        made->step[i] = scene->fmus[i].step;
    options->corner = next_sample;
    options->user = made;
    *clock = made;
    return KT_OK;
}

void kt_fmus_end(kt_fmu_clock *clock) { free(clock); }

kt_status kt_fmus_couple(const kt_scene *scene, kt_scene_watch *watch, kt_simulation *simulation, kt_fmu_clock *clock,
                         kt_error *error) {
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK && i < scene->fmu_count; i++) {
        kt_fmu_partner *p = calloc(1, sizeof *p);
        if (p == NULL) {
            free(i == 0 ? clock : NULL);
            return kt_reject_memory(error);
        }
        p->clock = i == 0 ? clock : NULL;
        status = open_fmu(&scene->fmus[i], p, error);
        const kt_scene_coupling coupling = {.sample = sample_fmu, .release = release_fmu, .user = p};
        if (status == KT_OK)
            status = kt_scene_watch_couple(watch, i, simulation, &coupling, error);
        else
            release_fmu(p);
    }
    return status;
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

kt_status kt_fmus_can_resume(const kt_scene *scene, const kt_scene_watch *watch, kt_error *error) {
    json_t *states = kt_fmus_save(scene, watch, error);
    const bool can = states != NULL;
    json_decref(states);
    return can ? KT_OK : error->code;
}

/* Two characters for each byte. */
static json_t *text_of(const unsigned char *bytes, size_t size) {
    char *text = malloc(2 * size + 1);
    for (size_t i = 0; text != NULL && i < size; i++)
        (void)snprintf(text + 2 * i, 3, "%02x", bytes[i]);
    if (text != NULL)
        text[2 * size] = '\0';
    json_t *string = text != NULL ? json_string(text) : NULL;
    free(text);
    return string;
}

json_t *kt_fmus_save(const kt_scene *scene, const kt_scene_watch *watch, kt_error *error) {
    json_t *states = json_object();
    for (int i = 0; states != NULL && i < scene->fmu_count; i++) {
        kt_fmu_partner *p = kt_scene_watch_coupled(watch, i);
        unsigned char *bytes = NULL;
        size_t size = 0;
        const kt_status status = kt_fmi_save(&p->fmi, &bytes, &size, error);
        if (status != KT_OK || json_object_set_new(states, scene->fmus[i].name, text_of(bytes, size)) != 0) {
            if (status == KT_OK)
                (void)kt_reject_memory(error);
            json_decref(states);
            states = NULL;
        }
        free(bytes);
    }
    return states;
}

static kt_status restore_fmu(kt_fmu_partner *p, const char *text, kt_error *error) {
    const size_t size = strlen(text) / 2;
    unsigned char *bytes = malloc(size + 1);
    if (bytes == NULL)
        return kt_reject_memory(error);
    for (size_t i = 0; i < size; i++)
        bytes[i] = (unsigned char)strtoul((const char[]){text[2 * i], text[2 * i + 1], '\0'}, NULL, 16);
    const kt_status status = kt_fmi_restore(&p->fmi, bytes, size, error);
    free(bytes);
    return status;
}

kt_status kt_fmus_restore(const kt_scene *scene, const kt_scene_watch *watch, const json_t *states, kt_error *error) {
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK && i < scene->fmu_count; i++) {
        const char *text = json_string_value(json_object_get(states, scene->fmus[i].name));
        status = text != NULL ? restore_fmu(kt_scene_watch_coupled(watch, i), text, error)
                              : kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "it has no state of FMU '%.60s'",
                                             scene->fmus[i].name);
    }
    return status;
}
