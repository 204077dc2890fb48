/* Steps of Rosenbrock methods, which are linearly implicit, and their tangents. With y = (q, v), J = f_y(t0, y0) and g
 * = h gamma, a step is (integrator/rosenbrock.c)
 *
 *     (1 - g J) U_i = g R_i,   R_i = f(t_i, Y_i) + sum_j C_ij U_j / h + gamma_i h f_t,   Y_i = y0 + sum_j a_ij U_j
 *     y1 = y0 + sum_i m_i U_i
 *
 * J depends on the state, so that the tangents contain its derivative along U_i. For changes dy of the start and dp of
 * held inputs
 *
 *     (1 - g J) dU_i = g (F_i dY_i + f_p(t_i, Y_i) dp + sum_j C_ij dU_j / h + H_i),   F_i = f_y(t_i, Y_i)
 *     H_i = d/de [ f_y(t0 + e gamma_i h, y0 + e U_i) dy + f_p(t0 + e gamma_i h, y0 + e U_i) dp ] at e = 0
 *
 * H_i also contains the derivative of f_t. The derivative of f_t is a difference of exact derivatives, of order four,
 * over the small part `REACH` of the stage's own increment,
 *
 *     F' = (48 (F(e) - F(0)) - 36 (F(2e) - F(0)) + 16 (F(3e) - F(0)) - 3 (F(4e) - F(0))) / (12 e)
 *
 * The difference uses later times only, since a function of time may have a breakpoint at the beginning of the step.
 * The error of this difference is e^4 / 5 of the fifth derivative over the step, some 3e-12. Rounding adds 10 / e
 * roundings of J, some 1e-12.
 *
 * If positions are plain numbers,
 *
 *     (1 - g J_v - g^2 J_q) U_v = g R_v + g^2 J_q R_q,   U_q = g (R_q + U_v)
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.7. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lu.h"
#include "derivative/effect_derivatives.h"
#include "evaluate/evaluate.h"
#include "integrator/rosenbrock.h"
#include "kinetree/joint.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

#define REACH 0x1p-9

static const kt_rosenbrock *differentiated_table_of(const kt_step_work *w) { return w->step->method->transformed; }

/* g = gamma h */
static double g_of(const kt_step_work *w) { return w->step->h * w->step->method->gamma[0]; }

/* ---- the linear equations ---------------------------------------------------------------------------------------- */

/* 1 - g J, for all numbers of the state. */
static void form_whole(kt_step_work *w) {
    const size_t N = kt_state_numbers(w->model);
    memset(w->matrix, 0, N * N * sizeof *w->matrix);
    for (size_t j = 0; j < N; j++)
        w->matrix[j * (N + 1)] = 1.0;
    kt_slope_add(w, 0, w->y, -g_of(w), N, w->matrix);
}

/* 1 - g J with the rows of positions inserted, x_q = g (r_q + x_v): 1 - g F^v - g^2 F^q. */
static void form_plain(kt_step_work *w) {
    const size_t e = kt_rate_numbers(w->model);
    const double g = g_of(w);
    for (size_t l = 0; l < e * e; l++)
        w->matrix[l] = (l % (e + 1) == 0 ? 1.0 : 0.0) - g * (w->by_v[l] + g * w->by_q[l]);
}

/* Factors the matrix that all stages of a step share, 1 / g - J times g. */
static kt_status factor_shifted(kt_step_work *w, kt_error *error) {
    if (kt_is_plain(w->model))
        form_plain(w);
    else
        form_whole(w);
    if (kt_lu_factor(w->matrix, w->unknowns, w->pivot))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_STEP, "step",
                        "the matrix of the linearly implicit stages is singular at h = %g s; take a smaller step",
                        w->step->h);
}

/* Solves (1 / (gamma h) - J) U = R for one column, in place. */
static void solve_stage_matrix(const kt_step_work *w, double *r) {
    const size_t n = w->model->n.v, e = kt_rate_numbers(w->model), N = kt_state_numbers(w->model);
    const double g = g_of(w);
    for (size_t l = 0; l < N; l++)
        r[l] *= g;
    for (size_t l = 0; l < n && kt_is_plain(w->model); l++)
        kt_add_times(r + n, g * r[l], w->by_q + l * e, e);
    kt_lu_solve(w->matrix, w->unknowns, w->pivot, r + N - w->unknowns);
    for (size_t l = 0; l < n && kt_is_plain(w->model); l++)
        r[l] += g * r[n + l];
}

/* ---- the step ---------------------------------------------------------------------------------------------------- */

/* Computes the derivatives by time of the rates of auxiliary states. Returns true if a law has none: then differences
 * are used. */
static bool differs_in_time(kt_step_work *w, double *rates) {
    const size_t nq = w->model->n.q;
    return kt_has_auxiliary_states(w->model) &&
           kt_auxiliary_state_time_derivatives(w->model, w->data, w->step->t, w->y, w->y + nq, rates) != 0;
}

/* Computes h f_t like a simulation. The result is exact, or a difference if loops or a caller's own effects depend on
 * time. */
static kt_status find_step_time_derivative(kt_step_work *w, kt_error *error) {
    const kt_step *step = w->step;
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = kt_state_numbers(w->model);
    double *slope = w->time_derivative, *other = w->neighbour, *f = w->slope;
    kt_status status = KT_OK;
    memset(slope, 0, N * sizeof *slope);
    if (!model->driven && !kt_model_is_differenced(model) && !(differs_in_time(w, slope + nq + n))) {
        const kt_dynamic_state at = {step->t, w->y, w->y + nq, step->tau, step->external};
        status = kt_acceleration_time_derivative(model, w->data, &at, f + nq, slope + nq, error);
        for (size_t l = nq; l < N; l++)
            slope[l] *= step->h;
        return status;
    }
    for (int k = 1; k <= 2 && status == KT_OK; k++) {
        const double weight = k == 1 ? 2048.0 : -512.0;
        status = kt_step_slope(w, step->t + k / 1024.0 * step->h, w->y, other, error);
        for (size_t l = nq; l < N; l++)
            slope[l] += weight * (other[l] - f[l]);
    }
    return status;
}

/* out = y0 + sum_j weight_j U_j */
static void combine_stage_solutions(const kt_step_work *w, const double *weights, size_t count, double *out) {
    const size_t N = kt_state_numbers(w->model);
    memcpy(out, w->y, N * sizeof *out);
    for (size_t j = 0; j < count; j++)
        kt_add_times(out, weights[j], w->increment + j * N, N);
}

/* Solves stage i: (1 / (gamma h) - J) u_i = f(y_i) + sum_j c_ij u_j / h + gamma_i f_t. */
static kt_status solve_stage(kt_step_work *w, size_t i, kt_error *error) {
    const kt_rosenbrock *table = differentiated_table_of(w);
    const size_t N = kt_state_numbers(w->model);
    double *y = w->stage + i * N, *f = w->slope + i * N, *u = w->increment + i * N;
    combine_stage_solutions(w, table->a[i], i, y);
    const kt_status status =
        i ? kt_step_slope(w, kt_step_time(w->step, i), y, f, error) : KT_OK; /* the slope at the start is available */
    if (status != KT_OK)
        return status;
    memcpy(u, f, N * sizeof *u);
    for (size_t j = 0; j < i; j++)
        kt_add_times(u, table->coupling[i][j] / w->step->h, w->increment + j * N, N);
    kt_add_times(u, table->gamma_sum[i], w->time_derivative, N);
    solve_stage_matrix(w, u);
    return KT_OK;
}

/* Computes f_y at a state into a block of by_q and by_v (0: the block of J), and with `held` columns f_p. */
static kt_status differentiate_at_state(kt_step_work *w, size_t block, double t, const double *y, const double *a,
                                        size_t held, kt_error *error) {
    kt_status status = kt_step_differentiate_at(w, t, y, a, block, held > 0, error);
    if (status == KT_OK && held && w->parameter)
        status = kt_parameter_stage(w, t, y, a, error);
    return status;
}

/* Computes the stages. With `held` columns, f_p at the start stays in its block. */
static kt_status run_rosenbrock_stages(kt_step_work *w, const double *q, const double *v, size_t held,
                                       kt_error *error) {
    kt_step_start(w, q, v);
    kt_status status = kt_step_slope(w, w->step->t, w->y, w->slope, error);
    if (status == KT_OK)
        status = find_step_time_derivative(w, error);
    if (status == KT_OK)
        status = differentiate_at_state(w, 0, w->step->t, w->y, w->slope + w->model->n.q, held, error);
    if (status == KT_OK)
        status = factor_shifted(w, error);
    for (size_t i = 0; i < w->stages && status == KT_OK; i++)
        status = solve_stage(w, i, error);
    if (status == KT_OK)
        combine_stage_solutions(w, differentiated_table_of(w)->m, w->stages, w->next);
    return status;
}

kt_status kt_rosenbrock_stages(kt_step_work *w, const double *q, const double *v, kt_error *error) {
    return run_rosenbrock_stages(w, q, v, 0, error);
}

/* ---- its tangents ------------------------------------------------------------------------------------------------ */

/* Writes dy_k, the change of the state at the start in column k. */
static void start_change_of(const kt_step_work *w, size_t k, double *dy) {
    const size_t nq = w->model->n.q;
    memcpy(dy, w->start_q + k * kt_padded_q(w->model), nq * sizeof *dy);
    memcpy(dy + nq, w->start_v + k * kt_padded_v(w->model), kt_rate_numbers(w->model) * sizeof *dy);
}

/* to_k += factor (f_y dy_k + f_p dp_k - less_k) for all columns, with the derivatives of a block. The change dy_k of
 * column k is at dy + k N, or at the start if dy is NULL. less may be NULL, too. */
static void add_changes(kt_step_work *w, double factor, size_t block, const double *y, const double *dy,
                        const double *less, size_t held, double *to) {
    const size_t nq = w->model->n.q, n = w->model->n.v, N = kt_state_numbers(w->model);
    const double *by_held = w->parameter ? w->parameter->by_parameter : w->by_tau;
    double *start = w->unit_state, *change = start + N, *xi = change + N;
    for (size_t k = 0; k < w->states + held; k++) {
        start_change_of(w, k, start);
        kt_slope_change(w, block, y, dy ? dy + k * N : start, xi, change);
        if (k >= w->states)
            kt_add_times(change + nq, 1.0, by_held + (k - w->states) * n, n);
        if (less)
            kt_add_times(change, -1.0, less + k * N, N);
        kt_add_times(to + k * N, factor, change, N);
    }
}

/* Adds H_i to the right-hand sides. */
static kt_status add_differences(kt_step_work *w, size_t i, size_t held, kt_error *error) {
    static const double weight[] = {0.0, 4.0, -3.0, 4.0 / 3.0, -0.25};
    const size_t nq = w->model->n.q, N = kt_state_numbers(w->model);
    const double ahead = differentiated_table_of(w)->gamma_sum[i], e = ahead < 0.0 ? -REACH : REACH;
    kt_status status = KT_OK;
    for (int k = 1; k <= 4 && status == KT_OK; k++) {
        const double t = w->step->t + k * e * ahead * w->step->h;
        double *y = w->neighbour, *slope = w->neighbour_slope;
        memcpy(y, w->y, N * sizeof *y);
        kt_add_times(y, k * e, w->increment + i * N, N);
        status = kt_step_slope(w, t, y, slope, error);
        if (status == KT_OK)
            status = differentiate_at_state(w, 1, t, y, slope + nq, held, error);
        if (status == KT_OK)
            add_changes(w, weight[k] / e, 1, y, NULL, w->first, held, w->right);
    }
    return status;
}

/* Computes the changes of y0 + sum_j weight_j U_j. */
static void combine_changes(kt_step_work *w, const double *weights, size_t count, size_t columns) {
    const size_t N = kt_state_numbers(w->model);
    for (size_t k = 0; k < columns; k++) {
        double *dy = w->changed + k * N;
        start_change_of(w, k, dy);
        for (size_t j = 0; j < count; j++)
            kt_add_times(dy, weights[j], w->moved + (j * columns + k) * N, N);
    }
}

/* Adds F_i dY_i + f_p dp to the right-hand sides. */
static kt_status add_stage(kt_step_work *w, size_t i, size_t held, kt_error *error) {
    const size_t nq = w->model->n.q, N = kt_state_numbers(w->model), columns = w->states + held;
    const double *y = w->stage + i * N;
    if (i == 0) {
        kt_add_times(w->right, 1.0, w->first, columns * N);
        return KT_OK;
    }
    const kt_status status =
        differentiate_at_state(w, 1, kt_step_time(w->step, i), y, w->slope + i * N + nq, held, error);
    if (status != KT_OK)
        return status;
    combine_changes(w, differentiated_table_of(w)->a[i], i, columns);
    add_changes(w, 1.0, 1, y, w->changed, NULL, held, w->right);
    return KT_OK;
}

/* Differentiates the equation of stage i by the columns: the same matrix, and the derivatives of its right-hand
 * side. */
static kt_status change_stage(kt_step_work *w, size_t i, size_t held, kt_error *error) {
    const size_t columns = w->states + held, N = kt_state_numbers(w->model);
    memset(w->right, 0, columns * N * sizeof *w->right);
    kt_status status = add_stage(w, i, held, error);
    if (status == KT_OK)
        status = add_differences(w, i, held, error);
    for (size_t k = 0; k < columns && status == KT_OK; k++) {
        double *u = w->moved + (i * columns + k) * N;
        memcpy(u, w->right + k * N, N * sizeof *u);
        for (size_t j = 0; j < i; j++)
            kt_add_times(u, differentiated_table_of(w)->coupling[i][j] / w->step->h, w->moved + (j * columns + k) * N,
                         N);
        solve_stage_matrix(w, u);
    }
    return status;
}

kt_status kt_rosenbrock_tangents(kt_step_work *w, const double *q, const double *v, size_t held, kt_error *error) {
    const size_t columns = w->states + held, nq = w->model->n.q, N = kt_state_numbers(w->model);
    kt_status status = run_rosenbrock_stages(w, q, v, held, error);
    if (status != KT_OK)
        return status;
    memset(w->first, 0, columns * N * sizeof *w->first);
    add_changes(w, 1.0, 0, w->y, NULL, NULL, held, w->first);
    for (size_t i = 0; i < w->stages && status == KT_OK; i++)
        status = change_stage(w, i, held, error);
    if (status == KT_OK)
        combine_changes(w, differentiated_table_of(w)->m, w->stages, columns);
    for (size_t k = 0; k < columns && status == KT_OK; k++) {
        memcpy(w->change_q + k * kt_padded_q(w->model), w->changed + k * N, nq * sizeof *w->change_q);
        memcpy(w->rate_v + k * kt_padded_v(w->model), w->changed + k * N + nq, (N - nq) * sizeof *w->rate_v);
    }
    return status;
}
