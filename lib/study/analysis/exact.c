/* Derivatives of the acceleration along the manifold of states, without finite differences.
 *
 * Along (dq, dv)
 *
 *     da = a_q dq + a_v dv,                                                      [derivative/acceleration.c]
 *
 * and by auxiliary states a_x; of their rates likewise f_q dq + f_v dv, and f_x.
 *
 * For equilibria the derivative of the force M a at rest is enough, and needs no factor of M. With M a = tau + f - h, h
 * the gravity forces, and without the part of the multipliers that moves nothing along allowed directions,
 *
 *     d(M a) = -D_q dq                                           D_q at a = 0, [derivative/stiffness.c].
 *
 * Only the given state enters, and not, for example, a contact or a stop nearby.
 *
 * All derivatives are evaluated at two states a few rounding errors to either side of the given one. The result is
 * their mean. The first part of the estimated error is the difference of both values, which shows the conditioning of
 * the equations, and a kink at the state itself. The second part is a bound of the rounding errors of terms that may
 * cancel,
 *
 *     |a_tau| T + |da| + |a_q| |dq| + |a_v| |dv|,
 *     T_k = |M| |da| + (forces and |M_kk| times the accelerations at the state) |dq| + |M_kk| |v| |dv|,
 *
 * or |d(M a)_k| + (forces at the state) |dq|, times a few eps, since two samples may agree by chance.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"
#include "derivative/stiffness.h"
#include "kinetree/dynamics.h"
#include "kinetree/joint.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define DISTANCE DBL_EPSILON /* of a neighbouring state to each side, times the sizes in floor */
#define ROUNDING (8.0 * DBL_EPSILON)

bool kt_exact_is_possible(const kt_linearization *l) {
    for (size_t i = 0; i < l->model->n.effect; i++)
        if (kt_effect_is_differenced(&l->model->effect[i]))
            return false;
    return !l->differences && l->model->n.loaded == 0;
}

/* y += |matrix| |x|, rows x n. */
static void add_product_of_sizes(const double *matrix, size_t rows, size_t n, const double *x, double *y) {
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < rows && x[k] != 0.0; i++)
            y[i] += fabs(matrix[k * rows + i] * x[k]);
}

/* ---- neighbouring states ----------------------------------------------------------------------------------------- */

/* Writes a neighbouring state to q and v, a few rounding errors away on one side (side: -1 or 1). With `rates`,
 * velocities differ, too. Coordinates differ by two, three or four rounding errors in turn, so that errors of symmetric
 * mechanisms do not cancel. */
static void perturb_state(kt_linearization *l, double side, bool rates) {
    for (size_t i = 0; i < l->size.v; i++) {
        const double away = side * (double)(2 + i % 3) * DISTANCE;
        l->tau_moved[i] = away * l->floor[i];
        l->v[i] = l->v0[i] + (rates ? away * l->floor[l->size.v + i] : 0.0);
    }
    kt_position_add(l->model, l->q0, l->tau_moved, l->q);
}

/* Evaluates all matrices at the neighbouring state on one side. */
static kt_status evaluate_linearization(kt_linearization *l, double side, kt_error *error) {
    const bool is_bare = l->model->n.group == 0 && l->model->n.effect == 0 && l->size.x == 0;
    const kt_state_derivatives states = {l->by_state, l->rate_q, l->rate_v, l->rate_x};
    perturb_state(l, side, true);
    const kt_status status = kt_dynamics_mass(l->model, l->data, l->q, l->mass, error);
    if (status != KT_OK)
        return status;
    if (is_bare)
        return kt_dynamics_forward_derivatives(l->model, l->data, l->work, l->size.work, l->q, l->v, l->tau, NULL,
                                               l->by_position, l->by_velocity, l->by_force, error);
    const kt_dynamic_state at = {.t = l->t, .q = l->q, .v = l->v, .tau = l->tau};
    const kt_acceleration_matrices to = {.by = {l->by_position, l->by_velocity, l->by_force}, .states = &states};
    return kt_acceleration_derivatives_at(l->model, l->data, l->work, l->size.work, &at, NULL, &to, error);
}

/* The derivative along (dq, dv). */
static void write_derivative(kt_linearization *l, const double *dq, const double *dv, double *derivative) {
    const size_t nv = l->size.v;
    memset(derivative, 0, nv * sizeof *derivative);
    kt_add_columns(l->by_position, nv, nv, 1.0, dq, derivative);
    if (dv)
        kt_add_columns(l->by_velocity, nv, nv, 1.0, dv, derivative);
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

/* T for a direction along which the probe has this derivative. */
static void write_direction_terms(const kt_linearization *l, const double *dq, const double *dv,
                                  const double *derivative, double *term) {
    const size_t nv = l->size.v;
    const double *speed = l->floor + nv, *pull = l->floor + 2 * nv;
    const double moved = kt_largest_in_units(l, dq), changed = dv ? kt_largest_in_units(l, dv) : 0.0;
    memset(term, 0, nv * sizeof *term);
    add_product_of_sizes(l->mass, nv, nv, derivative, term);
    for (size_t k = 0; k < nv; k++) {
        const double inertia = l->mass[k * nv + k];
        term[k] += fmax(fabs(l->weight[k]), inertia * pull[k]) * moved + inertia * speed[k] * changed;
    }
}

/* Adds the rounding errors of a column; term: the rounding errors of its forces. */
static void add_rounding(kt_linearization *l, const double *dq, const double *dv, const double *derivative,
                         double *term, double *error) {
    const size_t nv = l->size.v;
    double *sum = l->behind;
    write_direction_terms(l, dq, dv, derivative, term);
    memset(sum, 0, nv * sizeof *sum);
    add_product_of_sizes(l->by_force, nv, nv, term, sum);
    add_product_of_sizes(l->by_position, nv, nv, dq, sum);
    if (dv)
        add_product_of_sizes(l->by_velocity, nv, nv, dv, sum);
    for (size_t i = 0; i < nv; i++)
        error[i] += ROUNDING * (sum[i] + fabs(derivative[i]));
    for (size_t i = 0; i < nv; i++)
        term[i] *= ROUNDING;
}

/* ---- slopes ------------------------------------------------------------------------------------------------------ */

/* Derivatives are written for two sides of the state (top). For the first side, a function writes the derivative. For
 * the second side (is_second), the function replaces it by the mean of both sides, and writes the error. */

/* derivative <- mean of derivative and second, error <- their difference. */
static void average(const double *second, size_t n, double *derivative, double *error) {
    for (size_t i = 0; i < n; i++) {
        error[i] = fabs(second[i] - derivative[i]);
        derivative[i] = 0.5 * (derivative[i] + second[i]);
    }
}

/* The columns of a_tau that belong to inputs, averaged likewise. */
static void write_exact_inputs(kt_linearization *l, bool is_second) {
    const size_t nv = l->size.v;
    for (size_t k = 0; k < l->size.inputs; k++) {
        const double *column = l->by_force + (size_t)l->input_coordinate[k] * nv;
        if (!is_second) {
            memcpy(l->input_derivative + k * nv, column, nv * sizeof *column);
            continue;
        }
        average(column, nv, l->input_derivative + k * nv, l->input_derivative_error + k * nv);
        const double most = kt_largest_in_units(l, column);
        for (size_t i = 0; i < nv; i++)
            l->input_derivative_error[k * nv + i] += ROUNDING * most * l->unit[i];
    }
}

/* Writes the rows of the rates of auxiliary states in a column, along (dq, dv) or of auxiliary state k. On the first
 * side, the rows are the rates' derivatives; on the second side, the mean of both sides and its errors. */
static void write_auxiliary_rates(kt_linearization *l, const double *dq, const double *dv, size_t k, size_t column,
                                  bool is_second) {
    const size_t x = l->size.x, nv = l->size.v, first = column * l->size.f + kt_probe_rates(l);
    double *derivative = l->derivative + first, *error = l->derivative_error + first;
    double *sum = is_second ? l->behind : derivative;
    memset(sum, 0, x * sizeof *sum);
    if (dq)
        kt_add_columns(l->rate_q, x, nv, -1.0, dq, sum);
    if (dv)
        kt_add_columns(l->rate_v, x, nv, -1.0, dv, sum);
    for (size_t i = 0; i < x && !dq && !dv; i++)
        sum[i] = -l->rate_x[k * x + i];
    if (!is_second)
        return;
    average(sum, x, derivative, error);
    memset(sum, 0, x * sizeof *sum);
    if (dq)
        add_product_of_sizes(l->rate_q, x, nv, dq, sum);
    if (dv)
        add_product_of_sizes(l->rate_v, x, nv, dv, sum);
    for (size_t i = 0; i < x; i++)
        error[i] += ROUNDING * (dq || dv ? sum[i] : fabs(l->rate_x[k * x + i]));
}

/* Writes the rows of the accelerations in the column of auxiliary state k. */
static void write_state_column(kt_linearization *l, size_t k, size_t column, bool is_second) {
    const size_t nv = l->size.v;
    double *derivative = l->derivative + column * l->size.f + 2 * nv;
    double *error = l->derivative_error + column * l->size.f + 2 * nv;
    memcpy(is_second ? l->behind : derivative, l->by_state + k * nv, nv * sizeof *derivative);
    if (!is_second)
        return;
    average(l->behind, nv, derivative, error);
    for (size_t i = 0; i < nv; i++)
        error[i] += ROUNDING * fabs(derivative[i]);
}

/* Writes all that auxiliary states add, on one side. */
static void write_auxiliary_states(kt_linearization *l, size_t count, const double *dq, const double *dv,
                                   bool is_second) {
    const size_t nv = l->size.v;
    for (size_t j = 0; j < count; j++)
        write_auxiliary_rates(l, dq + j * nv, dv ? dv + j * nv : NULL, 0, j, is_second);
    for (size_t k = 0; k < l->size.x; k++) {
        write_state_column(l, k, count + k, is_second);
        write_auxiliary_rates(l, NULL, NULL, k, count + k, is_second);
    }
}

kt_status kt_exact_derivatives(kt_linearization *l, size_t count, const double *dq, const double *dv, kt_error *error) {
    const size_t nv = l->size.v, f = l->size.f;
    kt_status status = kt_dynamics_inverse(l->model, l->data, l->q0, l->v0, NULL, NULL, l->weight, error);
    for (int side = 0; side < 2; side++) {
        if (status == KT_OK)
            status = evaluate_linearization(l, side ? 1.0 : -1.0, error);
        if (status != KT_OK)
            return status;
        write_exact_inputs(l, side == 1);
        if (l->size.x > 0)
            write_auxiliary_states(l, count, dq, dv, side == 1);
        for (size_t j = 0; j < count; j++) {
            const double *step = dq + j * nv, *change = dv ? dv + j * nv : NULL;
            double *derivative = l->derivative + j * f + 2 * nv,
                   *derivative_error = l->derivative_error + j * f + 2 * nv;
            write_derivative(l, step, change, side ? l->behind : derivative);
            if (side == 0)
                continue;
            average(l->behind, nv, derivative, derivative_error);
            add_rounding(l, step, change, derivative, l->force_rounding + j * nv, derivative_error);
        }
    }
    return KT_OK;
}

/* ---- forces at rest ---------------------------------------------------------------------------------------------- */

/* Column j of -D_q times the directions, without terms below their rounding errors; on the second side the mean. */
static void write_force_derivative(kt_linearization *l, const double *d_q, const double *dq, bool is_second,
                                   double *derivative, double *derivative_error) {
    const size_t nv = l->size.v;
    const double *pull = l->floor + 2 * nv;
    double *to = is_second ? l->behind : derivative;
    memset(to, 0, nv * sizeof *to);
    kt_add_columns(d_q, nv, nv, -1.0, dq, to);
    if (!is_second)
        return;
    average(l->behind, nv, derivative, derivative_error);
    const double moved = kt_largest_in_units(l, dq);
    for (size_t i = 0; i < nv; i++)
        derivative_error[i] += ROUNDING * (fabs(derivative[i]) + pull[i] * moved);
}

kt_status kt_exact_force_derivatives(kt_linearization *l, size_t count, const double *dq, kt_error *error) {
    const size_t nv = l->size.v, f = l->size.f;
    kt_linearized w;
    (void)kt_linearized_init(&w, l->work, l->model, l->data, l->t, kt_linearized_is_dense(l->model));
    for (int side = 0; side < 2; side++) {
        perturb_state(l, side ? 1.0 : -1.0, false);
        const kt_dynamic_state at = {.t = l->t, .q = l->q, .v = l->v0, .tau = l->tau};
        const kt_status status = kt_linearized_fill(&w, &at, l->model->zero, error);
        if (status != KT_OK)
            return status;
        for (size_t j = 0; j < count; j++)
            write_force_derivative(l, w.d_q, dq + j * nv, side == 1, l->derivative + j * f + 2 * nv,
                                   l->derivative_error + j * f + 2 * nv);
    }
    memcpy(l->mass, w.mass, nv * nv * sizeof *l->mass);
    return KT_OK;
}
