/* Changes of the stages of an implicit method, by the implicit function theorem at the solved stages, and their
 * adjoint. Let c be the stages that are solved together. All sums but the first are over the stages c only.
 *
 *     dP_i = dy + h sum_{j before c} a_ij dK_j
 *     dK_i - h F_i sum_j a_ij dK_j = F_i dP_i + f_p dp          dY_i = dP_i + h sum_j a_ij dK_j
 *
 * and y+ = Y_s. For the adjoint, let y+ be a gradient with respect to the state after the step, and x_i that with
 * respect to Y_i:
 *
 *     s_i = h (b_i y+ + sum_{j after c} a_ji x_j)
 *     k_i - h sum_j a_ji F_j' k_j = s_i,   x_i = F_i' k_i,   y = y+ + sum x_i,   p = sum f_p' k_i
 *
 * If positions are plain numbers, dK of positions is dV, and k of positions is s^q_i + h sum_j a_ji x^q_j. The
 * equations for accelerations alone then have the transposed matrix of implicit.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/turn.h"
#include "sensitivity/implicit.h"

#include <string.h>

/* The arrays of one column: changes of the start, of the slopes of stage j, and of V_i. */
typedef struct column {
    const double *start_q, *start_v;
    double *rate_q, *rate_v, *change_v;
    size_t next_q, next_v; /* strides from one stage to the next */
} column;

/* The columns of derivatives by the initial number k: of the start, of the rates and of the positions' changes. */
static column change_column_of(const kt_step_work *w, size_t columns, size_t k) {
    const size_t Q = kt_padded_q(w->model), V = kt_padded_v(w->model);
    const bool plain = kt_is_plain(w->model);
    return (column){.start_q = w->start_q + k * Q,
                    .start_v = w->start_v + k * V,
                    .rate_q = (plain ? w->change_v : w->rate_q) + k * (plain ? V : Q),
                    .rate_v = w->rate_v + k * V,
                    .change_v = w->change_v + k * V,
                    .next_q = columns * Q,
                    .next_v = columns * V};
}

/* Computes dP_i: positions into w->outside, velocities and auxiliary states into change_v. */
static void gather_stage_changes(kt_step_work *w, kt_coupled c, size_t i, const column *k) {
    const size_t nq = w->model->n.q, e = kt_rate_numbers(w->model);
    const double h = w->step->h;
    double *dq = w->outside + (i - c.first) * nq, *dv = k->change_v + i * k->next_v;
    memcpy(dq, k->start_q, nq * sizeof *dq);
    memcpy(dv, k->start_v, e * sizeof *dv);
    for (size_t j = 0; j < c.first; j++) {
        const double a = h * kt_implicit_entry(w->step->method, i, j);
        kt_add_times(dq, a, k->rate_q + j * k->next_q, nq);
        kt_add_times(dv, a, k->rate_v + j * k->next_v, e);
    }
}

/* Forms the right-hand side F_i dP_i + f_p dp of stage i. For plain positions, their dP_i receives the known part
 * h sum_j a_ij dP_j of the velocities. */
static void form_right(kt_step_work *w, kt_coupled c, size_t i, const column *k, const double *held) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, e = kt_rate_numbers(model), at = i - c.first, rates = w->unknowns - e;
    const double *q = w->stage + i * (nq + e), *dv = k->change_v + i * k->next_v;
    const double *by_q = w->by_q + at * e * e, *by_v = w->by_v + at * e * e;
    double *dq = w->outside + at * nq, *right = w->correction + at * w->unknowns, *moved = w->unit_state, *xi = moved;
    if (rates) {
        kt_tangent_rate(model, q, q + nq, dq, dv, right);
        kt_tangent_drop(model, q, dq, xi);
    } else {
        memcpy(xi, dq, n * sizeof *xi);
        for (size_t j = c.first; j < c.end; j++)
            kt_add_times(xi, w->step->h * kt_implicit_entry(w->step->method, i, j), k->change_v + j * k->next_v, n);
    }
    memset(right + rates, 0, e * sizeof *right);
    for (size_t l = 0; l < e; l++) { /* most columns begin as unit vectors */
        if (l < n)
            kt_add_times(right + rates, xi[l], by_q + l * e, e);
        kt_add_times(right + rates, dv[l], by_v + l * e, e);
    }
    if (held)
        kt_add_times(right + rates, 1.0, held + at * n * w->held_most, n);
}

/* Whether only the start changes the stages from outside: by a unit vector of positions or of velocities. */
static bool only_start_changes(const kt_step_work *w, kt_coupled c) {
    bool others = !kt_is_plain(w->model);
    for (size_t i = c.first; i < c.end; i++)
        for (size_t j = 0; j < c.first; j++)
            others = others || kt_implicit_entry(w->step->method, i, j) != 0.0;
    return !others;
}

/* Forms the right-hand sides of column j if `only_start_changes` holds. The right-hand sides are columns of F, in which
 * a velocity moves positions by h sum a_ij, or columns of held inputs. */
static void form_unit(kt_step_work *w, kt_coupled c, size_t j, const column *k, const double *held) {
    const size_t n = w->model->n.v, e = kt_rate_numbers(w->model);
    for (size_t i = c.first; i < c.end; i++) {
        const size_t at = ((i - c.first) * e + (j < n ? j : (j - n) % e)) * e;
        double *right = w->correction + (i - c.first) * e, reach = j < n ? 1.0 : 0.0;
        memcpy(k->change_v + i * k->next_v, k->start_v, e * sizeof *right);
        memcpy(right, w->by_v + at, e * sizeof *right);
        if (held) {
            memset(right, 0, e * sizeof *right);
            memcpy(right, held + (i - c.first) * n * w->held_most, n * sizeof *right);
        }
        for (size_t l = c.first; l < c.end && j >= n; l++)
            reach += w->step->h * kt_implicit_entry(w->step->method, i, l);
        for (size_t l = 0; l < e && !held; l++)
            right[l] = reach * w->by_q[at + l] + (j < n ? 0.0 : right[l]);
    }
}

/* Forms the right-hand sides of a column. */
static void form_change_column(kt_step_work *w, kt_coupled c, const column *k, const double *held) {
    for (size_t i = c.first; i < c.end; i++)
        gather_stage_changes(w, c, i, k);
    for (size_t i = c.first; i < c.end; i++)
        form_right(w, c, i, k, held);
}

/* Copies dK of a column from the solution. If positions are plain numbers, adds dV. */
static void store_column(kt_step_work *w, kt_coupled c, const column *k) {
    const size_t e = kt_rate_numbers(w->model), rates = w->unknowns - e;
    for (size_t i = c.first; i < c.end; i++) {
        const double *x = w->correction + (i - c.first) * w->unknowns;
        if (rates)
            memcpy(k->rate_q + i * k->next_q, x, rates * sizeof *x);
        memcpy(k->rate_v + i * k->next_v, x + rates, e * sizeof *x);
    }
    for (size_t i = c.first; i < c.end && !rates; i++)
        for (size_t j = c.first; j < c.end; j++)
            kt_add_times(k->change_v + i * k->next_v, w->step->h * kt_implicit_entry(w->step->method, i, j),
                         k->rate_v + j * k->next_v, e);
}

/* Solves for dK of the columns first .. end - 1, at most KT_LANES. */
static void solve_lanes(kt_step_work *w, kt_coupled c, size_t columns, size_t first, size_t end) {
    const size_t u = (c.end - c.first) * w->unknowns, n = w->model->n.v;
    const bool begin = only_start_changes(w, c);
    for (size_t j = first; j < end; j++) {
        const column k = change_column_of(w, columns, j);
        const double *held = j < w->states ? NULL : w->by_held + (j - w->states) * n;
        if (begin)
            form_unit(w, c, j, &k, held);
        else
            form_change_column(w, c, &k, held);
        for (size_t l = 0; l < u; l++)
            w->lanes[l][j - first] = w->correction[l];
    }
    KT_BY_ISA(w->model->isa, , kt_solve_lanes, (w->matrix, u, w->pivot, w->lanes));
    for (size_t j = first; j < end; j++) {
        const column k = change_column_of(w, columns, j);
        for (size_t l = 0; l < u; l++)
            w->correction[l] = w->lanes[l][j - first];
        store_column(w, c, &k);
    }
}

static void solve_change_columns(kt_step_work *w, kt_coupled c, size_t columns) {
    for (size_t j = 0; j < columns; j += KT_LANES)
        solve_lanes(w, c, columns, j, j + KT_LANES < columns ? j + KT_LANES : columns);
}

kt_status kt_coupled_tangents(kt_step_work *w, const double *q, const double *v, size_t held, kt_error *error) {
    const kt_method *method = w->step->method;
    kt_status status = kt_coupled_stages(w, q, v, error);
    for (kt_coupled c = {0, 0}; c.end < w->stages && status == KT_OK;) {
        c = kt_coupled_at(method, c.end);
        if (!kt_coupled_counts(method, c))
            continue;
        status = kt_coupled_differentiate(w, c, held, error);
        if (status == KT_OK)
            solve_change_columns(w, c, w->states + held);
    }
    return status;
}

/* ---- the adjoint ------------------------------------------------------------------------------------------------- */

/* Computes s_i, the gradient with respect to the slope of stage i, from the end of the step and from later stages. */
static void gather_adjoint(const kt_step_work *w, kt_coupled c, size_t i, double *s) {
    const kt_method *method = w->step->method;
    const size_t N = w->model->n.q + w->model->n.v;
    const double h = w->step->h;
    memset(s, 0, N * sizeof *s);
    kt_add_times(s, h * kt_implicit_entry(method, w->stages - 1, i), w->by_end, N);
    for (size_t j = c.end; j < w->stages; j++)
        kt_add_times(s, h * kt_implicit_entry(method, j, i), w->by_stage + j * N, N);
}

/* y += A' x */
static void add_transposed(const double *a, size_t n, const double *x, double *y) {
    for (size_t j = 0; j < n; j++)
        y[j] += kt_dense_dot(a + j * n, x, (int)n);
}

/* The solution for plain positions: x^q_i is a part of the right-hand side and of the result. */
static void solve_plain(kt_step_work *w, kt_coupled c, const double *s) {
    const kt_method *method = w->step->method;
    const size_t n = w->model->n.v, N = 2 * n;
    const double h = w->step->h;
    double *x = w->correction;
    for (size_t i = c.first; i < c.end; i++) {
        double *right = x + (i - c.first) * n;
        memcpy(right, s + (i - c.first) * N + n, n * sizeof *right);
        for (size_t j = c.first; j < c.end; j++)
            kt_add_times(right, h * kt_implicit_entry(method, j, i), s + (j - c.first) * N, n);
    }
    kt_coupled_solve_transposed(w, c, x);
    for (size_t i = c.first; i < c.end; i++)
        add_transposed(w->by_q + (i - c.first) * n * n, n, x + (i - c.first) * n, w->by_stage + i * N);
    for (size_t i = c.first; i < c.end; i++) {
        double *by_v = w->by_stage + i * N + n;
        memcpy(by_v, s + (i - c.first) * N, n * sizeof *by_v);
        for (size_t j = c.first; j < c.end; j++)
            kt_add_times(by_v, h * kt_implicit_entry(method, j, i), w->by_stage + j * N, n);
        add_transposed(w->by_v + (i - c.first) * n * n, n, x + (i - c.first) * n, by_v);
    }
}

/* Solves the transposed equations of the coupled stages for the gradient s with respect to their slopes, and stores
 * its parts by positions and velocities of each stage in by_stage. */
static void solve_whole(kt_step_work *w, kt_coupled c, const double *s) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n, count = c.end - c.first;
    double *x = w->correction;
    memcpy(x, s, count * N * sizeof *x);
    kt_coupled_solve_transposed(w, c, x);
    for (size_t i = c.first; i < c.end; i++) {
        const double *q = w->stage + i * N, *k = x + (i - c.first) * N;
        double *by_q = w->by_stage + i * N, *xi = w->unit_state;
        memset(xi, 0, n * sizeof *xi);
        add_transposed(w->by_q + (i - c.first) * n * n, n, k + nq, xi);
        add_transposed(w->by_v + (i - c.first) * n * n, n, k + nq, by_q + nq);
        kt_turns_drop_transposed(model, q, xi, by_q);
        kt_turns_rate_transposed(model, q, q + nq, k, by_q, by_q + nq);
    }
}

kt_status kt_coupled_adjoint(kt_step_work *w, kt_error *error) {
    const kt_method *method = w->step->method;
    const size_t n = w->model->n.v, N = w->model->n.q + n;
    kt_coupled c[KT_METHOD_STAGES_MAX];
    size_t count = 0;
    for (size_t end = 0; end < w->stages; end = c[count++].end)
        c[count] = kt_coupled_at(method, end);
    memset(w->by_stage, 0, w->stages * N * sizeof *w->by_stage);
    while (count-- > 0) {
        if (!kt_coupled_counts(method, c[count]))
            continue;
        const kt_status status = kt_coupled_differentiate(w, c[count], n, error);
        if (status != KT_OK)
            return status;
        for (size_t i = c[count].first; i < c[count].end; i++)
            gather_adjoint(w, c[count], i, w->seed + (i - c[count].first) * N);
        if (kt_is_plain(w->model))
            solve_plain(w, c[count], w->seed);
        else
            solve_whole(w, c[count], w->seed);
        for (size_t i = 0; i < c[count].end - c[count].first; i++) /* the last n unknowns are accelerations */
            add_transposed(w->by_held + i * n * w->held_most, n, w->correction + (i + 1) * w->unknowns - n,
                           w->by_force);
    }
    return KT_OK;
}
