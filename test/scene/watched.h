/* Scenes with events that are run for their records, and for derivatives of their motion. */
#ifndef KT_TEST_SCENE_WATCHED_H
#define KT_TEST_SCENE_WATCHED_H

#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"

static kt_collected faults;

static bool parse(const char *text, kt_scene *scene) {
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    return kt_scene_parse("x", text, strlen(text), scene, kt_collect, &faults, &error) == KT_OK;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

enum { ROWS = 32, NUMBERS = 8 };

/* The records of events, and the end. */
typedef struct rows {
    int count, nq, nv;
    const char *name[ROWS];
    double time[ROWS], q[ROWS][NUMBERS], v[ROWS][NUMBERS], dissipated[ROWS], total[ROWS];
    uint64_t set[ROWS];
    kt_contact_counts counts; /* at the end */
} rows;

static int keep(const kt_record *record, void *user) {
    rows *r = user;
    if (record->event == NULL || r->count == ROWS)
        return 0;
    r->name[r->count] = record->event->name;
    r->time[r->count] = record->time;
    r->set[r->count] = kt_switch_set(record->model);
    memcpy(r->q[r->count], record->q, (size_t)r->nq * sizeof(double));
    memcpy(r->v[r->count], record->v, (size_t)r->nv * sizeof(double));
    r->dissipated[r->count] = record->work.dissipated;
    r->total[r->count++] = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    return 0;
}

/* A scene's simulation with its events. */
typedef struct watched {
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_scene_watch *watch;
    kt_error error;
} watched;

/* `integrator`: NULL, the scene's own. */
static kt_status watched_open(watched *w, const char *text, const char *integrator, unsigned record) {
    memset(w, 0, sizeof *w);
    if (!kt_check_true("it is read", parse(text, &w->scene))) {
        kt_note("%s", faults.text);
        return KT_ERROR_SCENE;
    }
    if (integrator != NULL)
        w->scene.run.integrator = integrator;
    kt_simulation_options options = kt_simulation_options_default();
    options.events = kt_scene_event_room(&w->scene);
    options.record = record;
    kt_status status = kt_model_compile(&w->scene.description, NULL, &w->model, &w->error);
    if (status == KT_OK)
        status = kt_simulation_create(w->model, &w->scene.run, &options, &w->simulation, &w->error);
    if (status == KT_OK)
        status = kt_scene_watch_create(&w->scene, w->model, w->simulation, NULL, 0, &w->watch, &w->error);
    return status;
}

static void watched_free(watched *w) {
    kt_simulation_free(w->simulation);
    kt_scene_watch_free(w->watch);
    kt_model_free(w->model);
    kt_scene_free(&w->scene);
}

/* Returns whether all went well, after a check of that. */
static bool watched_close(watched *w, kt_status status) {
    watched_free(w);
    if (!kt_check_true("it runs", status == KT_OK))
        kt_note("%s: %s", w->error.where, w->error.message);
    return status == KT_OK;
}

/* Reads and runs a scene; false after a failed check. */
static bool run_scene(const char *text, const char *integrator, rows *r) {
    watched w;
    memset(r, 0, sizeof *r);
    kt_status status = watched_open(&w, text, integrator, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    if (status == KT_OK) {
        r->nq = kt_model_nq(w.model);
        r->nv = kt_model_nv(w.model);
        status = kt_simulation_run(w.simulation, keep, r, &w.error);
        r->counts = kt_simulation_contacts(w.simulation);
    }
    return watched_close(&w, status);
}

/* Makes a scene's simulation. Gives the column of A at t_end for the velocity j, and the state there of a simulation
 * that begins with `speed`. */
static bool release_scene(const char *text, double t_end, int j, double speed, double *column, double *state) {
    double v[NUMBERS] = {0.0}, A[4 * NUMBERS * NUMBERS];
    watched w;
    kt_status status = watched_open(&w, text, NULL, 0);
    if (status != KT_OK)
        return watched_close(&w, status);
    const size_t nv = (size_t)kt_model_nv(w.model), size = kt_motion_work_size(w.simulation);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT) / KT_ALIGNMENT * KT_ALIGNMENT);
    v[j] = speed;
    status = kt_simulation_set_state(w.simulation, 0.0, kt_simulation_positions(w.simulation), v, &w.error);
    if (status == KT_OK)
        status = kt_motion_derivatives(w.simulation, work, size, t_end, A, NULL, &w.error);
    if (status == KT_OK) {
        memcpy(column, A + 2 * nv * (nv + (size_t)j), 2 * nv * sizeof *column);
        memcpy(state, kt_simulation_positions(w.simulation), nv * sizeof *state);
        memcpy(state + nv, kt_simulation_velocities(w.simulation), nv * sizeof *state);
    }
    free(work);
    return watched_close(&w, status);
}

/* A column of A at t_end against a central difference: how the end changes with the second speed at the start, which is
 * `speed`. */
static void check_derivatives(const char *text, double t_end, double speed) {
    const double s = 1e-4;
    double column[NUMBERS] = {0.0}, none[NUMBERS], early[NUMBERS] = {0.0}, late[NUMBERS] = {0.0}, worst = 0.0;
    if (!release_scene(text, t_end, 1, speed + s, none, late) ||
        !release_scene(text, t_end, 1, speed - s, none, early) || !release_scene(text, t_end, 1, speed, column, none))
        return;
    for (int i = 0; i < NUMBERS; i++)
        worst = fmax(worst, fabs(column[i] - 0.5 / s * (late[i] - early[i])));
    kt_note("%.6g %.6g", column[0], column[3]);
    kt_check_below("A, by differences of order two", worst, 1e-7);
}

#endif
