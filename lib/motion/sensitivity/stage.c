/* The start of a step, and the derivatives of the accelerations of a stage. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "derivative/stiffness.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "kinetree/joint.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

void kt_step_start(kt_step_work *w, const double *q, const double *v) {
    kt_copy(w->y, q, w->model->n.q * sizeof *q);
    memcpy(w->y + w->model->n.q, v, w->model->n.v * sizeof *v);
    if (kt_has_auxiliary_states(w->model))
        kt_copy(w->y + w->model->n.q + w->model->n.v, w->step->x ? w->step->x : w->before, w->model->n.x * sizeof *v);
}

kt_status kt_step_rates(const kt_step_work *w, double t, const double *y, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const double *q = y, *v = y + model->n.q;
    kt_auxiliary_states_put(model, w->data, y);
    const kt_dynamic_state at = {t, q, v, w->step->tau, w->step->external};
    const kt_status status = kt_acceleration_trusted(model, w->data, &at, a, error);
    return status == KT_OK && kt_has_auxiliary_states(model)
               ? kt_auxiliary_state_rates_trusted(model, w->data, t, q, v, a + model->n.v, error)
               : status;
}

kt_status kt_step_slope(const kt_step_work *w, double t, const double *y, double *slope, kt_error *error) {
    const size_t nq = w->model->n.q;
    kt_position_rate(w->model, y, y + nq, slope);
    return kt_step_rates(w, t, y, slope + nq, error);
}

/* For a tree without effects, the accelerations are written to `a` unless that is NULL. Otherwise `known` holds
 * them. */
static kt_status differentiate_stage(kt_step_work *w, const kt_dynamic_state *at, double *a, const double *known,
                                     const kt_forward_matrices *by, kt_error *error) {
    const kt_model *model = w->model;
    if (!model->n.group && !model->n.effect)
        return kt_forward_derivatives_fill(model, w->data, w->tree, kt_dynamics_work_size(model), at, a, by, error);
    return kt_acceleration_derivatives_at(model, w->data, w->derivative, kt_acceleration_work_size(model), at, known,
                                          &(kt_acceleration_matrices){.by = *by}, error);
}

/* Widens a matrix of n columns of n numbers to n + m columns of n + m. The m new rows are -`below` (m x n). The m new
 * columns are `above` (n x m) over -`right` (m x m). NULL: zeros. */
static void join_state_blocks(double *matrix, size_t n, size_t m, const double *below, const double *above,
                              const double *right) {
    const size_t e = n + m;
    for (size_t j = e; j-- > 0;) {
        double *column = matrix + j * e;
        const double *lower = j < n ? below + j * m : right ? right + (j - n) * m : NULL;
        if (j < n)
            memmove(column, matrix + j * n, n * sizeof *column);
        else
            for (size_t i = 0; i < n; i++)
                column[i] = above ? above[(j - n) * n + i] : 0.0;
        for (size_t i = 0; i < m; i++)
            column[n + i] = lower ? -lower[i] : 0.0;
    }
}

/* kt_step_differentiate_at, which also writes accelerations that are not known to `made` (differentiate_stage). */
static kt_status differentiate_state_at(kt_step_work *w, double t, const double *y, const double *a, double *made,
                                        size_t block, bool inputs, kt_error *error) {
    const kt_model *model = w->model;
    const size_t n = model->n.v, m = model->n.x, e = n + m;
    const kt_dynamic_state at = {t, y, y + model->n.q, w->step->tau, w->step->external};
    const kt_forward_matrices by = {w->by_q + block * e * e, w->by_v + block * e * e, inputs ? w->by_tau : NULL};
    if (!(m > 0))
        return differentiate_stage(w, &at, made, a, &by, error);
    const kt_state_derivatives states = {w->by_states, w->by_states + n * m, w->by_states + 2 * n * m,
                                         w->by_states + 3 * n * m};
    kt_auxiliary_states_put(model, w->data, y);
    const kt_status status =
        kt_acceleration_derivatives_at(model, w->data, w->derivative, kt_acceleration_work_size(model), &at, a,
                                       &(kt_acceleration_matrices){.by = by, .states = &states}, error);
    if (status == KT_OK) {
        join_state_blocks(by.q, n, m, states.rate_q, NULL, NULL);
        join_state_blocks(by.v, n, m, states.rate_v, states.force, states.rate_x);
    }
    return status;
}

kt_status kt_step_differentiate_at(kt_step_work *w, double t, const double *y, const double *a, size_t block,
                                   bool inputs, kt_error *error) {
    return differentiate_state_at(w, t, y, a, NULL, block, inputs, error);
}

void kt_slope_change(const kt_step_work *w, size_t block, const double *y, const double *dy, double *xi, double *out) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, e = kt_rate_numbers(model);
    const double *by_q = w->by_q + block * e * e, *by_v = w->by_v + block * e * e;
    kt_tangent_rate(model, y, y + nq, dy, dy + nq, out);
    kt_tangent_drop(model, y, dy, xi);
    memset(out + nq, 0, e * sizeof *out);
    for (size_t l = 0; l < e; l++) { /* most changes are unit vectors */
        if (l < n)
            kt_add_times(out + nq, xi[l], by_q + l * e, e);
        kt_add_times(out + nq, dy[nq + l], by_v + l * e, e);
    }
}

void kt_slope_add(const kt_step_work *w, size_t block, const double *y, double factor, size_t m, double *to) {
    const size_t N = kt_state_numbers(w->model);
    double *unit = w->unit_state, *change = unit + N, *xi = change + N;
    memset(unit, 0, N * sizeof *unit);
    for (size_t j = 0; j < N; j++) {
        unit[j] = 1.0;
        kt_slope_change(w, block, y, unit, xi, change);
        kt_add_times(to + j * m, factor, change, N);
        unit[j] = 0.0;
    }
}

kt_status kt_step_differentiate(kt_step_work *w, size_t i, bool inputs, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const size_t n = kt_state_numbers(model);
    const double *y = w->stage + i * n, *known = w->slope + i * n + model->n.q, t = kt_step_time(w->step, i);
    const bool finds = a && (model->n.group || model->n.effect || kt_has_auxiliary_states(model));
    const kt_status status = finds ? kt_step_rates(w, t, y, a, error) : KT_OK;
    return status == KT_OK ? differentiate_state_at(w, t, y, known, a, 0, inputs, error) : status;
}
