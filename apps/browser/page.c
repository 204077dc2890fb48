/* Runs of a live page, and what its controls show. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "page.h"

#include "host.h"

#include "instance.h"

#include "advice/excess.h"
#include "open/play.h"
#include "subcommands/run.h"
#include "view/view.h"

#include "kinetree/joint.h"
#include "kinetree/loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SETTINGS_MAX = 256 };

const kt_reduction_method *kt_page_partition(void); /* partition.c */

/* The method and its numbers that the controls choose. NaN and "" stand for those of the scene. */
typedef struct kt_page_choice {
    char integrator[64];
    double step, tolerance, duration;
    bool unprojected, partition;
} kt_page_choice;

struct kt_page {
    kt_bytes scene; /* the resource of the FMU: the scene with its settings */
    kt_page_choice choice;
    kt_fmu *fmu;
    kt_run run;           /* of the last call of kt_page_run, as all below */
    kt_model *own;        /* with another reduction than the FMU's model; NULL: none */
    kt_outcome outcome;   /* with the simulation and its warnings */
    kt_mode_watch *modes; /* of fixed steps; NULL: none */
    double *start;        /* the first positions and auxiliary states */
    kt_columns columns;
    kt_motion *motion;
    kt_json_writer json, state;
    kt_bytes frames;
};

/* ---- the instance ------------------------------------------------------------------------------------------------ */

static void print_fault(void *user, const kt_error *fault) {
    (void)user;
    kt_host_print(KT_HOST_FAULT, kt_words_of(fault).text);
}

static void print_fmi_message(void *environment, kt_fmi_status status, const char *category, const char *message) {
    (void)environment, (void)category;
    kt_host_print(status == KT_FMI_OK || status == KT_FMI_WARNING ? KT_HOST_NOTE : KT_HOST_FAULT, message);
}

/* Splits lines in place. */
static int list_settings(char *lines, const char **list) {
    int count = 0;
    for (char *line = strtok(lines, "\n"); line != NULL && count < SETTINGS_MAX; line = strtok(NULL, "\n"))
        list[count++] = line;
    return count;
}

/* Writes the scene with its settings, and reports all faults of both. */
static kt_status write_page_scene(kt_page *page, const char *text, size_t size, const kt_scene_options *options) {
    kt_error error = {0};
    kt_scene scene;
    kt_status status = kt_scene_parse_with(KT_FMU_SCENE, text, size, options, &scene, print_fault, NULL, &error);
    if (status != KT_OK)
        return status;
    for (int i = 0; i < scene.note_count; i++)
        kt_host_print(KT_HOST_NOTE, scene.notes[i].what);
    kt_scene_free(&scene);
    FILE *stream = open_memstream(&page->scene.text, &page->scene.used);
    if (stream == NULL)
        status = kt_error_set(&error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the scene");
    else
        status = kt_scene_write_flow(KT_FMU_SCENE, text, size, options, stream, &error);
    if (stream != NULL && fclose(stream) != 0 && status == KT_OK)
        status = kt_error_set(&error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the scene");
    if (status != KT_OK)
        kt_say_error(&error);
    return status;
}

static void *instantiate_page_fmu(const kt_bytes *scene) {
    const kt_fmu_token token = kt_fmu_token_of(scene->text, scene->used);
    kt_host_offer(scene);
    void *fmu = fmi3InstantiateCoSimulation("page", token.text, "", false, true, false, false, NULL, 0, NULL,
                                            print_fmi_message, NULL);
    kt_host_offer(NULL);
    return fmu;
}

static void end_page_run(kt_page *page) {
    kt_motion_free(page->motion);
    kt_columns_free(&page->columns);
    kt_mode_watch_free(page->modes);
    kt_shares_free(&page->outcome.shares);
    kt_simulation_free(page->outcome.simulation);
    kt_scene_watch_free(page->outcome.events);
    kt_model_free(page->own);
    free(page->start);
    page->motion = NULL;
    page->columns = (kt_columns){0};
    page->modes = NULL;
    page->outcome = (kt_outcome){0};
    page->own = NULL;
    page->start = NULL;
}

/* Releases a page. */
KT_PAGE(void kt_page_close(kt_page *page)) {
    if (page == NULL)
        return;
    end_page_run(page);
    fmi3FreeInstance(page->fmu);
    free(page->scene.text);
    free(page->json.text);
    free(page->state.text);
    free(page->frames.text);
    free(page);
}

/* Chooses a method by its name, a fixed step or a tolerance, and the duration; NaN and "": the scene's. unprojected:
 * loops drift open. partition: coordinate partitioning in place of QR. */
KT_PAGE(void kt_page_choose(kt_page *page, const char *integrator, double step, double tolerance, double duration,
                            bool unprojected, bool partition)) {
    page->choice = (kt_page_choice){
        .step = step, .tolerance = tolerance, .duration = duration, .unprojected = unprojected, .partition = partition};
    (void)snprintf(page->choice.integrator, sizeof page->choice.integrator, "%s", integrator);
}

/* Opens a scene in flow style with settings (lines "PATH=VALUE", as of `--set`). Returns NULL after messages. */
KT_PAGE(kt_page *kt_page_open(const char *text, size_t size, const char *settings)) {
    const char *list[SETTINGS_MAX];
    kt_page *page = calloc(1, sizeof *page);
    char *lines = strdup(settings);
    if (page != NULL)
        kt_page_choose(page, "", (double)NAN, (double)NAN, (double)NAN, false, false);
    if (page == NULL || lines == NULL) {
        kt_say("there is not enough memory for the page");
    } else {
        kt_scene_options options = kt_scene_options_default();
        options.settings = list;
        options.setting_count = list_settings(lines, list);
        options.is_alone = true;
        if (write_page_scene(page, text, size, &options) == KT_OK)
            page->fmu = instantiate_page_fmu(&page->scene);
    }
    free(lines);
    if (page == NULL || page->fmu != NULL)
        return page;
    kt_page_close(page);
    return NULL;
}

/* Returns the instance of the FMU, for functions of FMI 3.0. */
KT_PAGE(void *kt_page_instance(kt_page *page)) { return page->fmu; }

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* Records have what the page shows besides the scene's columns: reactions as arrows, the energy and the gaps. If forces
 * dissipate or supply energy, works complete the energy to a balance, whose change is an error (kt_shown_energy_of). */
static kt_simulation_options choose_page_options(const kt_page *page) {
    kt_simulation_options options = kt_simulation_options_default();
    options.unprojected = page->choice.unprojected;
    options.record_contacts = options.kinematics = true;
    options.record = KT_RECORD_REACTION | KT_RECORD_ENERGY | KT_RECORD_CONSTRAINT;
    options.contact = page->fmu->scene.contact;
    if (kt_energy_watch_start(page->fmu->model).energetics != KT_ENERGY_CONSERVED &&
        options.contact != KT_CONTACT_STEPS)
        options.record |= KT_RECORD_BALANCE;
    options.events = kt_scene_event_room(&page->fmu->scene);
    return options;
}

static kt_run choose_page_run(const kt_page *page) {
    const kt_page_choice *choice = &page->choice;
    kt_run run = page->fmu->scene.run;
    if (choice->integrator[0] != '\0')
        run.integrator = choice->integrator;
    if (!isnan(choice->duration))
        run.duration = choice->duration;
    if (!isnan(choice->step))
        run.step = choice->step;
    if (!isnan(choice->tolerance)) {
        run.step = 0.0;
        run.relative = run.absolute = choice->tolerance;
    }
    if (run.interval == 0.0)
        run.interval = kt_frame_interval(run.duration);
    return run;
}

/* Returns the model of the run: that of the FMU, or one that is compiled for the reduction of the choice. */
static kt_status choose_page_model(kt_page *page, const kt_model **model, kt_error *error) {
    const kt_fmu *fmu = page->fmu;
    *model = fmu->model;
    if (!page->choice.partition || kt_loop_count(fmu->model) == 0)
        return KT_OK;
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_page_partition();
    options.metric = fmu->scene.run.metric;
    options.plan = fmu->scene.run.plan;
    options.settable = kt_scene_needs_settable(&fmu->scene);
    const kt_status status = kt_model_compile(&fmu->scene.description, &options, &page->own, error);
    *model = page->own;
    return status;
}

/* Creates the simulation with its events. The warnings of the start follow. */
static kt_status create_page_simulation(kt_page *page, const kt_model *model, kt_error *error) {
    const kt_scene *scene = &page->fmu->scene;
    kt_outcome *outcome = &page->outcome;
    unsigned record = 0;
    kt_simulation_options options = choose_page_options(page);
    kt_status status = kt_columns_own_record(scene, model, &record, error);
    options.record |= record;
    *outcome = (kt_outcome){.scene = scene,
                            .model = model,
                            .run = &page->run,
                            .unprojected = page->choice.unprojected,
                            .so_far.energy = kt_energy_watch_of(scene, model),
                            .so_far.corrected_since = (double)NAN};
    if (status == KT_OK)
        status = kt_simulation_create(model, &page->run, &options, &outcome->simulation, error);
    if (status == KT_OK && options.events > 0)
        status = kt_scene_watch_create(scene, model, outcome->simulation, NULL, -1, &outcome->events, error);
    return status;
}

static kt_status reject_short_memory(const char *what, kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the %s", what);
}

/* Begins the watches of the motion with its first state. */
static kt_status start_page_watches(kt_page *page, kt_error *error) {
    kt_outcome *outcome = &page->outcome;
    const kt_simulation *simulation = outcome->simulation;
    const size_t nq = (size_t)kt_model_nq(outcome->model), nx = (size_t)kt_auxiliary_state_count(outcome->model);
    page->start = calloc(nq + nx + 1, sizeof *page->start);
    if (page->start == NULL || !kt_shares_begin(&outcome->shares, outcome->model))
        return reject_short_memory("watches", error);
    memcpy(page->start, kt_simulation_positions(simulation), nq * sizeof *page->start);
    if (nx > 0)
        memcpy(page->start + nq, kt_simulation_auxiliary_states(simulation), nx * sizeof *page->start);
    kt_warn_of_start(outcome);
    page->modes = kt_watch_steps(outcome);
    return KT_OK;
}

static kt_status start_page_run(kt_page *page, kt_error *error) {
    const kt_scene *scene = &page->fmu->scene;
    const kt_model *model;
    kt_method storage;
    page->run = choose_page_run(page);
    kt_status status = choose_page_model(page, &model, error);
    if (status != KT_OK)
        return status;
    page->run.integrator =
        scene->contact == KT_CONTACT_STEPS ? "time stepping" : kt_run_method(&page->run, model, &storage)->name;
    status = create_page_simulation(page, model, error);
    if (status == KT_OK)
        status = start_page_watches(page, error);
    if (status != KT_OK)
        return status;
    unsigned record = kt_run_record(&page->run, model) | KT_RECORD_ENERGY;
    if (kt_loop_count(model) > 0)
        record |= KT_RECORD_CONSTRAINT;
    if (!kt_columns_list(&page->columns, scene, model, &page->run, record))
        return reject_short_memory("columns", error);
    status = kt_columns_add_own(&page->columns, scene, &record, error);
    if (status != KT_OK)
        return status;
    page->motion = kt_motion_start(scene, &page->columns, kt_simulation_record_count(page->outcome.simulation), true);
    if (page->motion == NULL)
        return reject_short_memory("motion", error);
    page->motion->simulation = page->outcome.simulation;
    return KT_OK;
}

static double larger_gap(double a, double b) { return b > a ? b : a; } /* b may be NaN */

/* Takes a record, as kt_take_record of the command does. Returns 0 to continue. */
static int take_page_record(const kt_record *record, void *user) {
    kt_page *page = user;
    kt_outcome *outcome = &page->outcome;
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    if (kt_find_excess(record, &outcome->excess))
        return -1;
    if (record->index == KT_INDEX_CONTACT) {
        kt_marks_add_contact(&outcome->marks, record, &seen);
        return 0;
    }
    kt_marks_sync_contacts(&outcome->marks, record, &seen);
    kt_marks_add(&outcome->marks, record);
    kt_residual *gap = &outcome->so_far.constraint;
    gap->position = larger_gap(gap->position, record->constraint.position);
    gap->velocity = larger_gap(gap->velocity, record->constraint.velocity);
    kt_watch_motion(outcome, page->modes, record);
    kt_watch_event_jump(outcome, record);
    kt_watch_shares(outcome, record);
    kt_moved_take(&outcome->so_far.moved, outcome->model, page->start, record->q, record->v, record->x);
    kt_host_progress(record->t);
    if (record->event != NULL && !record->event->stop)
        return 0;
    return kt_motion_take(page->motion, record, kt_columns_evaluate(&page->columns, record));
}

/* Sends the warnings of `run` at the end of a run to the page. */
static void warn_of_page_run(kt_page *page) {
    kt_outcome *outcome = &page->outcome;
    outcome->so_far.moved.steps = kt_simulation_counts_of(outcome->simulation).steps;
    kt_warn_of_rest(outcome);
    kt_warn_of_motion(outcome, page->modes);
    kt_warn_of_shares(outcome);
    kt_warn_of_frames(outcome, page->motion);
}

static void put_frame_bytes(void *user, const void *numbers, size_t count, size_t size) {
    kt_bytes_add(user, numbers, count * size);
}

/* Writes what the page reads. */
static bool describe_page_run(kt_page *page) {
    page->json.used = page->frames.used = 0;
    const kt_method_words words = kt_describe_method(&page->run);
    const kt_view view = {.name = page->fmu->scene.description.name,
                          .method = words.text,
                          .run = &page->run,
                          .marks = &page->outcome.marks,
                          .failed = page->outcome.failed.code != KT_OK ? &page->outcome.failed : NULL};
    kt_view_describe(&page->json, page->motion, &view);
    kt_motion_write_frames(page->motion, put_frame_bytes, &page->frames);
    return !page->json.is_short && !page->frames.is_short;
}

/* Simulates to the end or to the first failure, which is kept with the last state. */
static void simulate_page(kt_page *page) {
    kt_outcome *outcome = &page->outcome;
    const kt_simulation *simulation = outcome->simulation;
    kt_error error = {0};
    if (kt_simulation_run(outcome->simulation, take_page_record, page, &error) == KT_OK)
        return;
    outcome->is_blown_up = outcome->excess.code != KT_OK;
    outcome->failed = outcome->is_blown_up ? outcome->excess : error;
    (void)kt_motion_take_state(page->motion, kt_simulation_time(simulation), kt_simulation_positions(simulation),
                               kt_simulation_velocities(simulation));
}

/* Runs the scene from its start to its end, or to the first failure, which the page shows. Returns whether there are
 * frames; if not, the reason was reported. */
KT_PAGE(bool kt_page_run(kt_page *page)) {
    kt_error error = {0};
    end_page_run(page);
    if (kt_fmu_settle(page->fmu) != KT_FMI_OK)
        return false;
    if (start_page_run(page, &error) != KT_OK) {
        kt_say_error(&error);
        return false;
    }
    simulate_page(page);
    if (page->motion->count == 0) {
        kt_say_error(&page->outcome.failed);
        return false;
    }
    warn_of_page_run(page);
    if (describe_page_run(page))
        return true;
    kt_say("there is not enough memory for the page");
    return false;
}

/* Return the mechanism as JSON and the frames of the last run. */
KT_PAGE(const char *kt_page_json(const kt_page *page)) { return page->json.text; }
KT_PAGE(size_t kt_page_json_size(const kt_page *page)) { return page->json.used; }
KT_PAGE(const char *kt_page_frames(const kt_page *page)) { return page->frames.text; }
KT_PAGE(size_t kt_page_frames_size(const kt_page *page)) { return page->frames.used; }

/* ---- controls ---------------------------------------------------------------------------------------------------- */

/* Parameters that do not follow from others, by their index for FMI. */
static void put_page_parameters(kt_json_writer *out, const kt_fmu *fmu) {
    kt_put_open(out, "parameters", '[');
    for (int i = 0; i < fmu->parameter_count; i++) {
        if (kt_fmu_role_follows(fmu->roles[i]))
            continue;
        kt_put_open(out, NULL, '{');
        kt_put_text(out, "name", fmu->scene.parameters[i].name);
        kt_put_exact(out, "value", fmu->scene.parameters[i].value);
        kt_put_integer(out, "reference", KT_FMU_PARAMETER + i);
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
}

/* Positions of joints with one coordinate at the start of the scene, after assembly. */
static void put_page_joints(kt_json_writer *out, const kt_fmu *fmu) {
    const double *q = kt_simulation_positions(fmu->simulation);
    kt_put_open(out, "joints", '[');
    for (int body = 1; body < kt_model_body_count(fmu->model); body++) {
        const kt_coordinates at = kt_body_coordinates(fmu->model, body);
        if (at.nq != 1)
            continue;
        kt_put_open(out, NULL, '{');
        kt_put_integer(out, "body", body);
        kt_put_text(out, "name", kt_body_name(fmu->model, body));
        kt_put_boolean(out, "slides", kt_joint_coordinate_kind(at.type, 0) == KT_COORDINATE_LENGTH);
        kt_put_exact(out, "value", q[at.q]);
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
}

static void put_page_method(kt_json_writer *out, const kt_fmu *fmu) {
    const kt_run *run = &fmu->scene.run;
    kt_method storage;
    kt_put_text(out, "method", kt_run_method(run, fmu->model, &storage)->name);
    kt_put_exact(out, "duration", run->duration);
    kt_put_exact(out, "step", run->step);
    kt_put_exact(out, "tolerance", run->relative);
    kt_put_exact(out, "least", run->absolute);
    kt_put_open(out, "methods", '[');
    for (int i = 0; i < kt_method_count(); i++) {
        kt_put_open(out, NULL, '{');
        kt_put_text(out, "name", kt_method_at(i)->name);
        kt_put_text(out, "title", kt_method_at(i)->title);
        kt_put_integer(out, "order", kt_method_at(i)->order);
        kt_put_boolean(out, "adaptive", kt_method_is_adaptive(kt_method_at(i)));
        kt_put_close(out, '}');
    }
    kt_put_close(out, ']');
}

static void put_page_cost(kt_json_writer *out, const kt_page *page) {
    const kt_simulation_counts counts = kt_simulation_counts_of(page->outcome.simulation);
    kt_put_integer(out, "steps", (long long)counts.steps);
    kt_put_integer(out, "rejected", (long long)counts.rejected);
    kt_put_integer(out, "evaluations", (long long)counts.evaluations);
    kt_put_exact(out, "gap", page->outcome.so_far.constraint.position);
    kt_put_exact(out, "end", kt_simulation_time(page->outcome.simulation));
    kt_put_text(out, "used", page->run.integrator);
    kt_put_boolean(out, "partition", page->own != NULL);
}

/* Returns the values of the controls, and the cost of the last run, as JSON; NULL: there is not enough memory. */
KT_PAGE(const char *kt_page_state(kt_page *page)) {
    kt_json_writer *out = &page->state;
    const kt_fmu *fmu = page->fmu;
    const kt_vec3 gravity = fmu->scene.description.gravity;
    const double g[] = {gravity.x, gravity.y, gravity.z};
    out->used = 0;
    kt_put_open(out, NULL, '{');
    kt_put_open(out, "gravity", '[');
    for (int k = 0; k < 3; k++)
        kt_put_exact(out, NULL, g[k]);
    kt_put_close(out, ']');
    put_page_parameters(out, fmu);
    put_page_joints(out, fmu);
    put_page_method(out, fmu);
    kt_put_integer(out, "loops", fmu->scene.description.loop_count);
    if (page->outcome.simulation != NULL)
        put_page_cost(out, page);
    kt_put_close(out, '}');
    return out->is_short ? NULL : out->text;
}
