/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void kt_lone_make(kt_lone *lone, kt_joint_type type, double mass) {
    lone->body = kt_body_of("block", NULL, type, 0.0);
    if (type == KT_JOINT_PRISMATIC)
        lone->body.joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    lone->body.mass = mass;
    lone->body.inertia.xx = 1.0;
    lone->body.inertia.yy = 2.0;
    lone->body.inertia.zz = 3.0;
    lone->description = kt_description_of(&lone->body, 1, NULL, 0, NULL, 0);
}

void kt_pendulum_make(kt_lone *lone, double angle, double velocity) {
    kt_lone_make(lone, KT_JOINT_REVOLUTE, 1.0);
    lone->body.name = "bob";
    lone->body.inertia = (kt_sym3){0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    lone->body.com = kt_vec3_make(0.0, -1.0, 0.0);
    lone->body.joint.position[0] = angle;
    lone->body.joint.velocity[0] = velocity;
    lone->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
}

kt_model *kt_scene_compile(const kt_description *description) { return kt_test_model(description, NULL); }

void kt_scene_check_rejected(const char *what, const kt_description *description, const char *words) {
    kt_model *model = NULL;
    kt_error error = {0};
    kt_check_true(what, kt_model_compile(description, NULL, &model, &error) != KT_OK);
    kt_check_contains("words", error.message, words);
    kt_model_free(model);
}

double kt_scene_tolerance_of(const char *method) {
    return method != NULL && strcmp(method, "dop853") == 0 ? 1e-13 : 1e-10;
}

kt_simulation *kt_scene_start_within(const kt_model *model, const char *method, double step, double tolerance,
                                     unsigned record) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = method;
    run.step = step;
    run.duration = 100.0;
    run.relative = run.absolute = tolerance;
    options.record = record;
    return kt_test_simulation(model, &run, &options);
}

kt_simulation *kt_scene_start(const kt_model *model, const char *method, double step, unsigned record) {
    return kt_scene_start_within(model, method, step, kt_scene_tolerance_of(method), record);
}

int kt_ledger_enter(const kt_record *record, void *user) {
    kt_ledger *ledger = user;
    const double balance = record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
    if (ledger->count++ == 0)
        ledger->start = balance;
    ledger->drift = fmax(ledger->drift, fabs(balance - ledger->start));
    ledger->last = record->work;
    return isnan(balance) ? -1 : 0;
}

double kt_scene_balance(kt_simulation *simulation) {
    kt_record record = {0};
    kt_error error = {0};
    kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
    return record.kinetic + record.potential + record.work.dissipated - record.work.supplied;
}

kt_run kt_run_fixed(const char *integrator, double step, double duration) {
    kt_run run = kt_run_default();
    run.integrator = integrator;
    run.step = step;
    run.duration = duration;
    return run;
}

kt_run kt_run_within(const char *integrator, double tolerance, double duration) {
    kt_run run = kt_run_default();
    run.integrator = integrator;
    run.relative = run.absolute = tolerance;
    run.duration = duration;
    return run;
}

kt_kept *kt_kept_empty(const kt_model *model) {
    static kt_kept kept;
    memset(&kept, 0, sizeof kept);
    kept.stop_at = -1;
    kept.nq = kt_model_nq(model);
    kept.nv = kt_model_nv(model);
    kept.nx = kt_auxiliary_state_count(model);
    return &kept;
}

int kt_keep(const kt_record *record, void *user) {
    kt_kept *kept = user;
    int nq = kept->nq, nv = kept->nv, nx = kept->nx;
    if (kept->count == KT_KEPT_RECORDS || nq + 2 * nv + nx > KT_KEPT_NUMBERS)
        return -1;
    double *state = kept->state[kept->count];
    memcpy(state, record->q, (size_t)nq * sizeof(double));
    memcpy(state + nq, record->v, (size_t)nv * sizeof(double));
    if (record->a != NULL)
        memcpy(state + nq + nv, record->a, (size_t)nv * sizeof(double));
    if (nx > 0)
        memcpy(state + nq + 2 * nv, record->x, (size_t)nx * sizeof(double));
    kept->time[kept->count] = record->t;
    kept->index[kept->count] = record->index;
    kept->energy[kept->count] = record->kinetic + record->potential;
    kept->count++;
    return record->index == kept->stop_at ? -1 : 0;
}

bool kt_scene_check_equal(const char *what, const kt_simulation *observed, const kt_simulation *expected) {
    const kt_model *model = kt_simulation_model(expected);
    const int count = kt_model_nq(model) + kt_model_nv(model) + kt_auxiliary_state_count(model);
    /* velocities stand behind positions, and auxiliary states behind velocities */
    return kt_check_equal_bits(what, kt_simulation_positions(observed), kt_simulation_positions(expected),
                               (size_t)count);
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

bool kt_scene_hand_over(const kt_simulation *from, kt_simulation *to) {
    kt_error error = {0};
    kt_need(kt_check_true("two simulations", from != NULL && to != NULL));
    const size_t size = kt_simulation_state_size(from);
    void *block = malloc(size), *again = malloc(size);
    bool fine = kt_check_true("memory", block != NULL && again != NULL) &&
                kt_check_true("size", kt_simulation_state_size(to) == size);
    if (fine) {
        kt_simulation_save(from, block);
        fine = kt_fine("restore", kt_simulation_restore(to, block, &error), &error);
        memset(again, 0xA5, size);
        kt_simulation_save(to, again);
        fine = fine &&
               kt_check_true("a checkpoint of the restored state is the same block", memcmp(block, again, size) == 0);
    }
    free(block);
    free(again);
    return fine;
}

kt_simulation *kt_resumption_start(const kt_resumption *r) {
    kt_error error = {0};
    kt_simulation *simulation = kt_test_simulation(r->model, r->run, r->options);
    if (r->q != NULL)
        kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, r->q, r->v, &error), &error);
    if (r->torque != NULL)
        kt_need_fine("torque", kt_simulation_set_torque(simulation, r->torque, &error), &error);
    if (r->external != NULL)
        kt_need_fine("wrenches", kt_simulation_set_wrenches(simulation, r->external, &error), &error);
    return simulation;
}

int kt_resumption_check(const kt_resumption *r, int stop) {
    static kt_kept whole;
    kt_error error = {0};
    kt_simulation *alone = kt_resumption_start(r), *first = kt_resumption_start(r);
    kt_simulation *second = kt_test_simulation(r->model, r->run, r->options);
    kt_kept *kept = kt_kept_empty(r->model);
    kt_test_run(alone, kt_keep, kept);
    whole = *kept;
    kept = kt_kept_empty(r->model);
    kept->stop_at = stop;
    kt_check_equal_int("first part", kt_simulation_run(first, kt_keep, kept, &error), KT_ERROR_CALLBACK);
    kt_need(kt_scene_hand_over(first, second));
    kt_test_run(second, kt_keep, kept);
    kt_check_equal_int("records", kept->count, whole.count);
    kt_check_equal_bits("times", kept->time, whole.time, (size_t)whole.count);
    kt_check_equal_bits("states", kept->state[0], whole.state[0], (size_t)whole.count * KT_KEPT_NUMBERS);
    kt_check_equal_bits("energies", kept->energy, whole.energy, (size_t)whole.count);
    kt_scene_check_equal("state at the end", second, alone);
    return whole.count;
}
