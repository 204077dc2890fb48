/* Tangents of steps of models with auxiliary states x, for any method. Columns have the numbers of y = (q, v, x)
 * (stage_states.c). The first columns belong to unit vectors of (xi, dv, dx) at the start. The others belong to held
 * inputs, tau or a parameter, on which the rates of auxiliary states do not depend. The data hold the auxiliary states
 * as an input, and get those of each stage in turn.
 */
#include "base/copy.h"
#include "sensitivity/implicit.h"

static void begin_columns(kt_step_work *w, size_t columns) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = kt_state_numbers(model);
    kt_clear(w->own.first, N * columns * sizeof(double));
    kt_clear(w->unit, n * sizeof(double));
    for (size_t j = 0; j < w->states; j++) {
        double *column = w->own.first + j * N;
        if (j >= n) {
            column[nq + j - n] = 1.0; /* dv, then dx */
            continue;
        }
        w->unit[j] = 1.0;
        kt_tangent_lift(model, w->y, w->unit, column);
        w->unit[j] = 0.0;
    }
}

/* Row i of the table, of `stages` numbers if the method is implicit. */
static const double *row_of(const kt_step_work *w, size_t i) {
    const kt_method *method = w->step->method;
    return w->coupled ? method->a + i * (size_t)method->stages : kt_step_row(method, i);
}

/* out = first + h sum_j row_j dK_j, for one of `columns` columns. */
static void combine(const kt_step_work *w, const double *row, size_t count, size_t column, size_t columns,
                    double *out) {
    const size_t N = kt_state_numbers(w->model);
    kt_copy(out, w->own.first + column * N, N * sizeof *out);
    for (size_t j = 0; j < count; j++)
        for (size_t l = 0; l < N && row[j] != 0.0; l++)
            out[l] += w->step->h * row[j] * w->own.rate[(j * columns + column) * N + l];
}

/* Adds a_tau or a_p of a column to the change of its slope. */
static void add_held(const kt_step_work *w, const double *by_held, size_t column, double *change) {
    const size_t n = w->model->n.v;
    for (size_t l = 0; l < n && column >= w->states; l++)
        change[w->model->n.q + l] += by_held[(column - w->states) * n + l];
}

/* Computes dK_i of the columns, and the slope itself. */
static kt_status change_stage(kt_step_work *w, size_t i, size_t held, kt_error *error) {
    const size_t N = kt_state_numbers(w->model), columns = w->states + held;
    const double t = kt_step_time(w->step, i);
    double *a, *change = w->own.outside;
    const double *y = kt_step_stage(w, i, &a);
    kt_status status = kt_step_rates(w, t, y, a, error);
    if (status == KT_OK)
        status = kt_step_differentiate_at(w, t, y, a, 0, held > 0, error);
    if (status == KT_OK && w->parameter)
        status = kt_parameter_stage(w, t, y, a, error);
    for (size_t k = 0; k < columns && status == KT_OK; k++) {
        double *rate = w->own.rate + (i * columns + k) * N;
        combine(w, row_of(w, i), i, k, columns, change);
        kt_slope_change(w, 0, y, change, w->own.xi, rate);
        add_held(w, w->parameter ? w->parameter->by_parameter : w->by_tau, k, rate);
    }
    return status;
}

static kt_status change_stages(kt_step_work *w, size_t held, kt_error *error) {
    kt_status status = KT_OK;
    for (size_t i = 0; i < w->stages && status == KT_OK; i++)
        status = change_stage(w, i, held, error);
    kt_step_finish(w);
    return status;
}

/* Solves for dK of a column at stages that are solved together (implicit.h). */
static void solve_column(kt_step_work *w, kt_coupled c, size_t column, size_t columns) {
    const size_t n = w->model->n.v, N = kt_state_numbers(w->model);
    for (size_t i = c.first; i < c.end; i++) {
        double *right = w->correction + (i - c.first) * N;
        combine(w, row_of(w, i), c.first, column, columns, w->own.outside);
        kt_slope_change(w, i - c.first, w->stage + i * N, w->own.outside, w->own.xi, right);
        add_held(w, w->by_held + (i - c.first) * n * w->held_most, column, right);
    }
    kt_coupled_solve(w, c, w->correction);
    for (size_t i = c.first; i < c.end; i++)
        kt_copy(w->own.rate + (i * columns + column) * N, w->correction + (i - c.first) * N, N * sizeof(double));
}

static void solve_columns(kt_step_work *w, kt_coupled c, size_t columns) {
    for (size_t k = 0; k < columns; k++)
        solve_column(w, c, k, columns);
}

/* Computes dy+, from the increments of a linearly implicit method or the slopes of another one. (dq, dv) go to the
 * arrays of the projection. */
static void conclude(kt_step_work *w, size_t columns) {
    const size_t nq = w->model->n.q, n = w->model->n.v, N = kt_state_numbers(w->model);
    for (size_t k = 0; k < columns; k++) {
        double *change = w->own.change + k * N;
        if (w->linear)
            kt_copy(change, w->changed + k * N, N * sizeof *change);
        else
            combine(w, w->step->method->b, w->stages, k, columns, change);
        kt_copy(w->change_q + k * kt_padded(nq), change, nq * sizeof *change);
        kt_copy(w->rate_v + k * kt_padded(n), change + nq, n * sizeof *change);
    }
}

kt_status kt_own_step_tangents(kt_step_work *w, const double *q, const double *v, size_t held, kt_error *error) {
    kt_step_start(w, q, v);
    begin_columns(w, w->states + held);
    const kt_status status = w->linear    ? kt_rosenbrock_tangents(w, q, v, held, error)
                             : w->coupled ? kt_coupled_change(w, q, v, held, solve_columns, error)
                                          : change_stages(w, held, error);
    if (status == KT_OK)
        conclude(w, w->states + held);
    kt_own_states_restore(w);
    return status;
}

void kt_own_step_copy(const kt_step_work *w, size_t first, size_t columns, double *to) {
    const size_t nq = w->model->n.q, n = w->model->n.v, m = w->model->n.x, N = kt_state_numbers(w->model);
    for (size_t j = first; j < first + columns; j++, to += 2 * n + m) {
        kt_copy(to, w->end + 2 * n * j, 2 * n * sizeof *to);
        kt_copy(to + 2 * n, w->own.change + j * N + nq + n, m * sizeof *to);
    }
}
