/* Scenes with events that are run for their records, and for derivatives of their motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_WATCHED_H
#define KT_TEST_SCENE_WATCHED_H

#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "running.h"

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
    r->time[r->count] = record->t;
    r->set[r->count] = kt_switch_set(record->model);
    memcpy(r->q[r->count], record->q, (size_t)r->nq * sizeof(double));
    memcpy(r->v[r->count], record->v, (size_t)r->nv * sizeof(double));
    r->dissipated[r->count] = record->work.dissipated;
    r->total[r->count++] = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    return 0;
}

/* Begins a scene with a method, or its own (NULL). */
static running begin_with(const char *text, const char *integrator, unsigned record) {
    kt_scene *scene = running_read(text, NULL);
    if (integrator != NULL)
        scene->run.integrator = integrator;
    return running_begin(scene, record);
}

/* Reads and runs a scene. */
static void run_scene(const char *text, const char *integrator, rows *r) {
    const running run = begin_with(text, integrator, KT_RECORD_BALANCE | KT_RECORD_ENERGY);
    kt_error error = {0};
    memset(r, 0, sizeof *r);
    r->nq = kt_model_nq(run.model);
    r->nv = kt_model_nv(run.model);
    kt_need_fine("run", kt_simulation_run(run.simulation, keep, r, &error), &error);
    r->counts = kt_simulation_contacts(run.simulation);
}

/* The memory for derivatives of a motion. */
static void *take_motion_work(const running *r, size_t *size) {
    *size = kt_motion_work_size(r->simulation);
    void *work = aligned_alloc(KT_ALIGNMENT, (*size + KT_ALIGNMENT) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_test_own(work, free);
    kt_need(work != NULL || kt_check_true("there is memory", false));
    return work;
}

/* Gives the column of A at t_end for the velocity j, and the state there of a simulation that begins with `speed`. */
static void release_at(const char *text, double t_end, int j, double speed, double *column, double *state) {
    double v[NUMBERS] = {0.0}, A[4 * NUMBERS * NUMBERS];
    const running w = begin_with(text, NULL, 0);
    const size_t nv = (size_t)kt_model_nv(w.model);
    kt_error error = {0};
    size_t size;
    void *work = take_motion_work(&w, &size);
    v[j] = speed;
    kt_need_fine("state", kt_simulation_set_state(w.simulation, 0.0, kt_simulation_positions(w.simulation), v, &error),
                 &error);
    kt_need_fine("A", kt_motion_derivatives(w.simulation, work, size, t_end, A, NULL, &error), &error);
    memcpy(column, A + 2 * nv * (nv + (size_t)j), 2 * nv * sizeof *column);
    memcpy(state, kt_simulation_positions(w.simulation), nv * sizeof *state);
    memcpy(state + nv, kt_simulation_velocities(w.simulation), nv * sizeof *state);
}

/* A column of A at t_end against a central difference: how the end changes with the second speed at the start, which is
 * `speed`. */
static void check_derivatives(const char *text, double t_end, double speed) {
    const double s = 1e-4;
    double column[NUMBERS] = {0.0}, none[NUMBERS], early[NUMBERS] = {0.0}, late[NUMBERS] = {0.0}, worst = 0.0;
    release_at(text, t_end, 1, speed + s, none, late);
    release_at(text, t_end, 1, speed - s, none, early);
    release_at(text, t_end, 1, speed, column, none);
    for (int i = 0; i < NUMBERS; i++)
        worst = fmax(worst, fabs(column[i] - 0.5 / s * (late[i] - early[i])));
    kt_note("%.6g %.6g", column[0], column[3]);
    kt_check_below("A, by differences of order two", worst, 1e-7);
}

#endif
