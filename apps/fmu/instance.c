/* Instances of an FMU: resources, the compiled scene, derivatives and outputs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"

#include "present.h"

#include "records/gravity.h"

#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char no_memory[] = "there is not enough memory";

/* ---- resources --------------------------------------------------------------------------------------------------- */

/* Reads a whole file, with a zero behind it. */
static kt_status read_resource(const char *folder, const char *name, char **text, size_t *size, kt_error *error) {
    char path[4096];
    const size_t length = strlen(folder);
    const char *slash = length > 0 && folder[length - 1] == '/' ? "" : "/";
    if ((size_t)snprintf(path, sizeof path, "%s%s%s", folder, slash, name) >= sizeof path)
        return kt_error_set(error, KT_ERROR_FILE, NULL, "the path of the resources is too long");
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return kt_error_set(error, KT_ERROR_FILE, path, "it cannot be read: %s", strerror(errno));
    long end = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : -1;
    *text = end >= 0 ? malloc((size_t)end + 1) : NULL;
    bool fine = *text != NULL && fseek(file, 0, SEEK_SET) == 0;
    *size = fine ? fread(*text, 1, (size_t)end, file) : 0;
    fine = fine && *size == (size_t)end;
    if (fine)
        (*text)[*size] = '\0';
    (void)fclose(file);
    return fine ? KT_OK : kt_error_set(error, KT_ERROR_FILE, path, "it cannot be read as a whole");
}

/* ---- the compiled scene ------------------------------------------------------------------------------------------ */

static void forget_scene(kt_fmu *fmu) {
    fmu->scene = (kt_scene){0};
    fmu->columns = (kt_columns){0};
    fmu->tuning = NULL;
    fmu->simulation = NULL;
    fmu->watch = NULL;
    fmu->data = NULL;
    fmu->linear = NULL;
    fmu->model = NULL;
}

static void release_scene(kt_fmu *fmu) {
    kt_columns_free(&fmu->columns);
    kt_tuning_free(fmu->tuning);
    kt_simulation_free(fmu->simulation);
    kt_scene_watch_free(fmu->watch);
    kt_data_free(fmu->data);
    kt_fmu_linear_free(fmu->linear);
    kt_model_free(fmu->model);
    kt_scene_free(&fmu->scene);
}

/* Reads the scene with the given parameters. Those that are tunable are variables of the scene. */
static kt_status parse_scene(kt_fmu *fmu, kt_error *error) {
    kt_scene_options options = kt_scene_options_default();
    options.settings = fmu->settings;
    options.variables = fmu->tunables.names;
    options.values = fmu->tunables.values;
    options.variable_count = fmu->tunables.count;
    for (int i = 0; i < fmu->parameter_count; i++) {
        if (!fmu->is_given[i])
            continue;
        char *text = fmu->given_text[i]; /* "NAME=VALUE"; the name was written when the parameters were first read */
        (void)snprintf(strchr(text, '=') + 1, 32, "%.17g", fmu->given[i]);
        fmu->settings[options.setting_count++] = text;
    }
    return kt_scene_parse_with(KT_FMU_SCENE, fmu->scene_text, fmu->scene_size, &options, &fmu->scene, NULL, NULL,
                               error);
}

static kt_status list_fmu_outputs(kt_fmu *fmu, kt_error *error) {
    unsigned record = 0;
    if (!kt_columns_list(&fmu->columns, &fmu->scene, fmu->model, &fmu->scene.run,
                         kt_run_record(&fmu->scene.run, fmu->model)))
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, no_memory);
    return kt_columns_add_own(&fmu->columns, &fmu->scene, &record, error);
}

static kt_status create_fmu_simulation(kt_fmu *fmu, kt_error *error) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_status status = kt_columns_own_record(&fmu->scene, fmu->model, &options.record, error);
    if (status != KT_OK)
        return status;
    if (((kt_run_record(&fmu->scene.run, fmu->model) | options.record) & KT_RECORD_EFFECT) != 0 &&
        kt_quantities_need_reactions(&fmu->scene.description))
        options.record |= KT_RECORD_REACTION;
    options.events = kt_scene_event_room(&fmu->scene);
    status = kt_simulation_create(fmu->model, &fmu->scene.run, &options, &fmu->simulation, error);
    if (status == KT_OK && options.events > 0)
        status = kt_scene_watch_create(&fmu->scene, fmu->model, fmu->simulation, NULL, -1, &fmu->watch, error);
    return status;
}

static kt_status compile_scene(kt_fmu *fmu, kt_error *error) {
    kt_model_options options = kt_model_options_default();
    options.metric = fmu->scene.run.metric;
    options.plan = fmu->scene.run.plan;
    options.settable = kt_scene_needs_settable(&fmu->scene) || fmu->tunables.count > 0 || fmu->signals.count > 0;
    kt_status status = kt_model_compile(&fmu->scene.description, &options, &fmu->model, error);
    if (status == KT_OK)
        status = kt_fmu_bind_signals(fmu, 0.0, error);
    if (status == KT_OK)
        status = kt_data_create(fmu->model, &fmu->data, error);
    if (status == KT_OK)
        status = create_fmu_simulation(fmu, error);
    if (status == KT_OK && fmu->tunables.count > 0)
        status = kt_tuning_create(&fmu->scene, fmu->model, &fmu->tuning, error);
    if (status == KT_OK)
        status = list_fmu_outputs(fmu, error);
    return status;
}

/* Begins at another time than 0. Drives then have their values of that time. */
static kt_status shift_start(kt_fmu *fmu, kt_error *error) {
    if (fmu->start == kt_simulation_time(fmu->simulation))
        return KT_OK;
    memcpy(fmu->y, kt_simulation_positions(fmu->simulation), (size_t)kt_fmu_size(fmu) * sizeof *fmu->y);
    kt_status status = kt_fmu_bind_signals(fmu, fmu->start, error);
    if (status == KT_OK)
        status = kt_simulation_set_state(fmu->simulation, fmu->start, fmu->y, fmu->y + fmu->nq, error);
    if (status == KT_OK && fmu->watch != NULL)
        status = kt_scene_watch_sync(fmu->watch, fmu->simulation, error);
    return status;
}

/* Compiles the scene in the place of another one, which is not released. */
static kt_status compile_anew(kt_fmu *fmu, kt_error *error) {
    forget_scene(fmu);
    kt_fmu_copy_tunables(fmu, fmu->tunables.wanted, fmu->tunables.compiled);
    kt_fmu_copy_tunables(fmu, fmu->tunables.wanted, fmu->tunables.values);
    kt_status status = parse_scene(fmu, error);
    if (status == KT_OK)
        status = compile_scene(fmu, error);
    if (status != KT_OK)
        return status;
    fmu->nq = kt_model_nq(fmu->model);
    fmu->nv = kt_model_nv(fmu->model);
    fmu->nx = kt_auxiliary_state_count(fmu->model);
    return shift_start(fmu, error);
}

kt_status kt_fmu_compile(kt_fmu *fmu, kt_error *error) {
    kt_fmu_change(fmu);
    fmu->is_stale = true;
    kt_fmu before = *fmu;
    const kt_status status = compile_anew(fmu, error);
    if (status != KT_OK) {
        release_scene(fmu);
        *fmu = before;
        return status;
    }
    release_scene(&before);
    fmu->is_stale = false;
    fmu->time = kt_simulation_time(fmu->simulation);
    fmu->is_over = false;
    kt_fmu_forget_events(fmu);
    if (fmu->y != NULL)
        memcpy(fmu->y, kt_simulation_positions(fmu->simulation), (size_t)kt_fmu_size(fmu) * sizeof *fmu->y);
    return KT_OK;
}

/* Allocates what depends on the sizes of the model. */
static kt_status take_fmu_memory(kt_fmu *fmu, kt_error *error) {
    const size_t size = (size_t)kt_fmu_size(fmu) + 1;
    fmu->y = calloc(size, sizeof *fmu->y);
    fmu->rates = calloc(size, sizeof *fmu->rates);
    fmu->moved = calloc(size, sizeof *fmu->moved);
    fmu->torque = calloc((size_t)fmu->nv + 1, sizeof *fmu->torque);
    if (fmu->y == NULL || fmu->rates == NULL || fmu->moved == NULL || fmu->torque == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, no_memory);
    memcpy(fmu->y, kt_simulation_positions(fmu->simulation), (size_t)kt_fmu_size(fmu) * sizeof *fmu->y);
    return kt_fmu_take_events(fmu, error);
}

/* Lists the parameters of the scene, which is read for this purpose alone. */
static kt_status list_fmu_parameters(kt_fmu *fmu, kt_error *error) {
    kt_status status = parse_scene(fmu, error);
    if (status != KT_OK)
        return status;
    const size_t count = (size_t)fmu->scene.parameter_count + 1;
    fmu->given = calloc(count, sizeof *fmu->given);
    fmu->is_given = calloc(count, sizeof *fmu->is_given);
    fmu->given_text = calloc(count, sizeof *fmu->given_text);
    fmu->settings = calloc(count, sizeof *fmu->settings);
    fmu->roles = calloc(count, sizeof *fmu->roles);
    if (fmu->given == NULL || fmu->is_given == NULL || fmu->given_text == NULL || fmu->settings == NULL ||
        fmu->roles == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, no_memory);
    for (int i = 0; i < fmu->scene.parameter_count; i++)
        if (snprintf(fmu->given_text[i], sizeof fmu->given_text[i] - 32, "%s=", fmu->scene.parameters[i].name) >=
            (int)sizeof fmu->given_text[i] - 32)
            return kt_error_set(error, KT_ERROR_SCENE, NULL, "the name of a parameter has more than 158 characters");
    fmu->parameter_count = fmu->scene.parameter_count;
    status = kt_fmu_list_signals(fmu, error);
    return status == KT_OK ? kt_fmu_find_tunables(fmu, error) : status;
}

kt_status kt_fmu_open(kt_fmu *fmu, const char *folder, kt_error *error) {
    const kt_status status = read_resource(folder, KT_FMU_SCENE, &fmu->scene_text, &fmu->scene_size, error);
    if (status == KT_OK)
        fmu->token = kt_fmu_token_of(fmu->scene_text, fmu->scene_size);
    return status;
}

kt_status kt_fmu_start(kt_fmu *fmu, kt_error *error) {
    kt_status status = list_fmu_parameters(fmu, error);
    if (status == KT_OK)
        status = kt_fmu_compile(fmu, error);
    return status == KT_OK ? take_fmu_memory(fmu, error) : status;
}

void kt_fmu_close(kt_fmu *fmu) {
    release_scene(fmu);
    free(fmu->scene_text);
    free(fmu->settings);
    free(fmu->given_text);
    free(fmu->given);
    free(fmu->is_given);
    free(fmu->roles);
    kt_fmu_free_tunables(fmu);
    kt_fmu_free_signals(fmu);
    free(fmu->torque);
    free(fmu->y);
    free(fmu->rates);
    free(fmu->moved);
    free(fmu->events);
}

/* ---- derivatives and outputs ------------------------------------------------------------------------------------- */

/* Computes v' and x' in the state of the importer, with the model of the start. */
static kt_status derive_exchanged(kt_fmu *fmu, const double *y, const double *v, kt_error *error) {
    double *a = fmu->rates + fmu->nq;
    if (fmu->nx > 0)
        memcpy(kt_auxiliary_states(fmu->model, fmu->data), v + fmu->nv, (size_t)fmu->nx * sizeof *v);
    const kt_status status =
        kt_acceleration_evaluate(fmu->model, fmu->data, fmu->time, y, v, fmu->torque, NULL, a, error);
    if (status != KT_OK || fmu->nx == 0)
        return status;
    return kt_auxiliary_state_rates(fmu->model, fmu->data, fmu->time, y, v, a + fmu->nv, error);
}

/* Computes v' and x' in the state of the simulation, with its contacts and with the parameters that its events set. */
static kt_status derive_simulated(kt_fmu *fmu, kt_error *error) {
    double *a = fmu->rates + fmu->nq;
    kt_status status = kt_simulation_set_torque(fmu->simulation, fmu->torque, error);
    if (status == KT_OK)
        status = kt_simulation_acceleration(fmu->simulation, a, error);
    return status == KT_OK ? kt_fmu_own_rates(fmu->simulation, a + fmu->nv, error) : status;
}

/* q' = position rate of v, v' = accelerations, x' = rates of the auxiliary states. */
kt_status kt_fmu_derive(kt_fmu *fmu, kt_error *error) {
    if (fmu->has_rates)
        return KT_OK;
    const double *y = kt_fmu_state(fmu), *v = y + fmu->nq;
    kt_status status = kt_fmu_show_signals(fmu, error);
    if (status == KT_OK)
        status = fmu->is_exchange ? derive_exchanged(fmu, y, v, error) : derive_simulated(fmu, error);
    if (status != KT_OK)
        return status;
    kt_position_rate(fmu->model, y, v, fmu->rates);
    fmu->has_rates = true;
    return KT_OK;
}

kt_status kt_fmu_take_over(kt_fmu *fmu, kt_error *error) {
    const double *y = fmu->y;
    kt_status status = kt_fmu_take_signals(fmu, error);
    if (status == KT_OK)
        status = kt_simulation_set_state(fmu->simulation, fmu->time, y, y + fmu->nq, error);
    if (status == KT_OK && fmu->nx > 0)
        status = kt_simulation_set_auxiliary_states(fmu->simulation, y + fmu->nq + fmu->nv, error);
    return status;
}

kt_status kt_fmu_evaluate(kt_fmu *fmu, kt_error *error) {
    kt_record record;
    if (fmu->values != NULL)
        return KT_OK;
    kt_status status = fmu->is_exchange ? kt_fmu_take_over(fmu, error) : kt_fmu_show_signals(fmu, error);
    if (status == KT_OK)
        status = kt_simulation_set_torque(fmu->simulation, fmu->torque, error);
    if (status == KT_OK)
        status = kt_simulation_sense(fmu->simulation, &record, error);
    if (status != KT_OK)
        return status;
    if (fmu->is_exchange) /* works are integrals along the motion, which the importer has */
        record.work.dissipated = record.work.supplied = (double)NAN;
    fmu->values = kt_columns_evaluate(&fmu->columns, &record);
    return KT_OK;
}

kt_status kt_fmu_project(kt_fmu *fmu, bool *moves, kt_error *error) {
    static const double least = 1e-10;
    const int size = kt_fmu_size(fmu);
    memcpy(fmu->moved, fmu->y, (size_t)size * sizeof *fmu->moved);
    kt_status status = kt_fmu_take_signals(fmu, error);
    if (status == KT_OK)
        status = kt_state_project(fmu->model, fmu->data, fmu->time, fmu->moved, fmu->moved + fmu->nq, NULL, error);
    *moves = false;
    for (int i = 0; i < size && status == KT_OK; i++)
        *moves |= fabs(fmu->moved[i] - fmu->y[i]) > least * fmax(1.0, fabs(fmu->y[i]));
    return status;
}
