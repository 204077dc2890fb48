/* Takes the motion at the ends of steps (records/steps.h).
 *
 * Coordinates are taken at every step, because they cost next to nothing. Markers and energies need the kinematics.
 * After the first steps, the kinematics of one step in STRIDE are computed on average. The distances vary, so that they
 * do not fall in with a period of the motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/steps.h"

#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdlib.h>

enum { FIRST = 1000, STRIDE = 8 };

static double larger_size(double most, double x) { return fabs(x) > most ? fabs(x) : most; }

void kt_moved_take(kt_moved *moved, const kt_model *model, const double *start, const double *q, const double *v,
                   const double *x) {
    const int nq = kt_model_nq(model), states = x != NULL ? kt_auxiliary_state_count(model) : 0;
    for (int i = 0; i < nq; i++) {
        moved->position = larger_size(moved->position, q[i] - start[i]);
        moved->size = larger_size(moved->size, q[i]);
    }
    for (int i = 0; i < kt_model_nv(model); i++)
        moved->velocity = larger_size(moved->velocity, v[i]);
    for (int i = 0; i < states; i++)
        moved->state = larger_size(moved->state, x[i] - start[nq + i]);
}

bool kt_steps_start(kt_steps *steps) {
    const kt_columns *columns = steps->columns;
    const double *q = kt_simulated_positions(steps->of);
    const double *x = kt_simulation_auxiliary_states(steps->of.simulation);
    const size_t nq = (size_t)kt_model_nq(columns->model), states = (size_t)kt_auxiliary_state_count(columns->model);
    steps->start = malloc((nq + states + 1) * sizeof *steps->start);
    steps->is_used = calloc(columns->count + 1, sizeof *steps->is_used);
    if (steps->start == NULL || steps->is_used == NULL)
        return false;
    for (size_t i = 0; i < nq + states; i++)
        steps->start[i] = i < nq ? q[i] : x[i - nq];
    steps->needs_kinematics = steps->energy != NULL;
    for (size_t i = 0; i < columns->count; i++) {
        const kt_column_source source = columns->columns[i].source;
        steps->is_used[i] = kt_column_has_steps(source) && !kt_column_is_state(source);
        steps->needs_kinematics = steps->needs_kinematics || steps->is_used[i];
    }
    kt_moved_take(steps->moved, columns->model, steps->start, q, kt_simulated_velocities(steps->of), x);
    return true;
}

void kt_steps_free(kt_steps *steps) {
    free(steps->start);
    free(steps->is_used);
    kt_data_free(steps->data);
    *steps = (kt_steps){.start = NULL};
}

static void take_coordinates(kt_steps *steps, double time, const double *q, const double *v, const double *x) {
    const kt_columns *columns = steps->columns;
    for (size_t i = 0; i < columns->count; i++) {
        const kt_column *c = &columns->columns[i];
        if (kt_column_is_state(c->source))
            kt_extreme_step(&steps->extremes->column[i], time,
                            c->source == KT_COLUMN_POSITION   ? q[c->at]
                            : c->source == KT_COLUMN_VELOCITY ? v[c->at]
                                                              : x[c->at]);
    }
    kt_moved_take(steps->moved, columns->model, steps->start, q, v, x);
}

static bool update_kinematics(kt_steps *steps, double time, const double *q, const double *v) {
    return steps->shown != NULL && kt_masses_update(steps->shown, steps->data, time, NULL) == KT_OK &&
           kt_kinematics_update(steps->shown, steps->data, q, v, NULL, NULL) == KT_OK;
}

/* Creates data of the present model, which switches select and events change, unless there are such data. */
static bool use_present_model(kt_steps *steps, double time, const double *q, const double *v) {
    const kt_model *model =
        steps->of.motion != NULL ? steps->columns->model : kt_simulation_model(steps->of.simulation);
    if (model == steps->shown && update_kinematics(steps, time, q, v))
        return true;
    kt_data_free(steps->data);
    steps->data = NULL;
    steps->shown = kt_data_create(model, &steps->data, NULL) == KT_OK ? model : NULL;
    return update_kinematics(steps, time, q, v);
}

static void take_kinematics(kt_steps *steps, double time, const double *q, const double *v, const double *x) {
    kt_columns *columns = steps->columns;
    if (!use_present_model(steps, time, q, v))
        return;
    const double kinetic = kt_kinetic_energy(steps->shown, steps->data);
    const double potential =
        kt_potential_energy(steps->shown, steps->data) + kt_effect_energy(steps->shown, steps->data, time, q, v);
    const kt_record record = {.t = time,
                              .q = q,
                              .v = v,
                              .x = x,
                              .kinetic = kinetic,
                              .potential = potential,
                              .model = steps->shown,
                              .data = steps->data};
    if (steps->energy != NULL)
        kt_energy_watch_step(steps->energy, kinetic, potential);
    const bool *all = columns->is_used;
    columns->is_used = steps->is_used;
    kt_columns_fill(columns, &record);
    columns->is_used = all;
    for (size_t i = 0; i < columns->count; i++)
        if (steps->is_used[i])
            kt_extreme_step(&steps->extremes->column[i], time, columns->values[i]);
}

/* The distance to the next step whose kinematics are computed: 1 for the FIRST steps, then 1 to 2 STRIDE - 1, by a
 * multiplicative hash. */
static uint64_t stride_after(uint64_t steps) {
    const uint64_t hash = (steps * UINT64_C(0x9E3779B97F4A7C15)) >> 32;
    return steps < FIRST ? 1 : 1 + hash % (2 * STRIDE - 1);
}

void kt_steps_take(kt_steps *steps) {
    if (steps->start == NULL)
        return;
    const kt_simulation *simulation = steps->of.simulation;
    const double time = kt_simulation_time(simulation), *q = kt_simulated_positions(steps->of);
    const double *v = kt_simulated_velocities(steps->of), *x = kt_simulation_auxiliary_states(simulation);
    take_coordinates(steps, time, q, v, x);
    if (++steps->moved->steps < steps->moved->next || !steps->needs_kinematics)
        return;
    steps->moved->next = steps->moved->steps + stride_after(steps->moved->steps);
    take_kinematics(steps, time, q, v, x);
}

void kt_steps_take_jump(kt_steps *steps, const kt_record *record) {
    if (steps->start != NULL && record->x != NULL)
        take_coordinates(steps, record->t, record->q, record->v, record->x);
}
