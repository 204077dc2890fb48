/* Steps of models with own states x by explicit methods, and their tangents: with y = (q, v, x)
 *
 *     Y_i = y + h sum_j a_ij K_j,   K_i = (E(q) v, a(q, v, x), f(q, v, x))
 *     dK_i = (d(E v), a_q xi + a_v dv + a_x dx, f_q xi + f_v dv + f_x dx)
 *
 * A column of changes has the numbers of y; the first 2 n + m are unit vectors of (xi, dv, dx) at the start, then come
 * those by tau. The own states are an input that data hold, which are given those of each stage in turn.
 */
#include "base/copy.h"
#include "derivative/stiffness.h"
#include "dynamics/dynamics.h"
#include "integrator/integrator.h"
#include "mechanism/evaluate.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_own_step, KT_OWN_STEP_FIELDS, size_t E, size_t n, size_t m, size_t s, size_t c)

size_t kt_own_step_place(kt_own_step *own, void *memory, const kt_model *model, size_t stages) {
    const size_t n = model->n.v, m = model->n.x;
    return m > 0 ? place_arrays(own, memory, model->n.q + n + m, n, m, stages, 3 * n + m) : 0;
}

static size_t size_of(const kt_model *model) { return model->n.q + model->n.v + model->n.x; }

/* ---- stages ------------------------------------------------------------------------------------------------------ */

/* The state of stage i and its slope. */
static kt_status evaluate(kt_step_work *w, size_t i, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, E = size_of(model);
    double *y = w->own.stage + i * E, *k = w->own.slope + i * E;
    const double t = kt_step_time(w->step, i);
    kt_step_combine(y, w->own.start, w->step->h, kt_step_row(w->step->method, i), i, w->own.slope, E);
    kt_copy(w->data->x, y + nq + n, model->n.x * sizeof *y);
    kt_position_rate(model, y, y + nq, k);
    const kt_status status =
        kt_acceleration_evaluate(model, w->data, t, y, y + nq, w->step->tau, w->step->external, k + nq, error);
    return status == KT_OK ? kt_own_state_rates_trusted(model, w->data, t, y, y + nq, k + nq + n, error) : status;
}

static void begin(kt_step_work *w, const double *q, const double *v) {
    const kt_model *model = w->model;
    kt_copy(w->own.start, q, model->n.q * sizeof *q);
    kt_copy(w->own.start + model->n.q, v, model->n.v * sizeof *v);
    kt_copy(w->own.start + model->n.q + model->n.v, w->data->x, model->n.x * sizeof *v);
}

static void finish(kt_step_work *w) {
    const size_t moving = w->model->n.q + w->model->n.v;
    kt_step_combine(w->own.next, w->own.start, w->step->h, w->step->method->b, w->stages, w->own.slope,
                    size_of(w->model));
    kt_copy(w->next, w->own.next, moving * sizeof *w->next);
}

/* Whatever has become of the step, data hold the states at its start, until kt_own_step_commit. */
static kt_status conclude(kt_step_work *w, kt_status status) {
    kt_copy(w->data->x, w->own.start + w->model->n.q + w->model->n.v, w->model->n.x * sizeof(double));
    return status;
}

void kt_own_step_commit(kt_step_work *w) {
    kt_copy(w->data->x, w->own.next + w->model->n.q + w->model->n.v, w->model->n.x * sizeof(double));
}

kt_status kt_own_step_stages(kt_step_work *w, const double *q, const double *v, kt_error *error) {
    kt_status status = KT_OK;
    begin(w, q, v);
    for (size_t i = 0; i < w->stages && status == KT_OK; i++)
        status = evaluate(w, i, error);
    if (status == KT_OK)
        finish(w);
    return conclude(w, status);
}

/* ---- tangents ---------------------------------------------------------------------------------------------------- */

static void begin_columns(kt_step_work *w) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, m = model->n.x, E = size_of(model);
    kt_clear(w->own.first, E * (3 * n + m) * sizeof(double));
    kt_clear(w->unit, n * sizeof(double));
    for (size_t j = 0; j < n; j++) {
        w->unit[j] = 1.0;
        kt_tangent_lift(model, w->own.start, w->unit, w->own.first + j * E);
        w->unit[j] = 0.0;
        w->own.first[(n + j) * E + nq + j] = 1.0;
    }
    for (size_t j = 0; j < m; j++)
        w->own.first[(2 * n + j) * E + nq + n + j] = 1.0;
}

/* out = first + h sum_j row_j dK_j, of all columns. */
static void combine(kt_step_work *w, const double *row, size_t count, size_t columns, double *out) {
    const size_t all = size_of(w->model) * columns, stride = size_of(w->model) * (3 * w->model->n.v + w->model->n.x);
    kt_copy(out, w->own.first, all * sizeof *out);
    for (size_t j = 0; j < count; j++)
        for (size_t l = 0; l < all && row[j] != 0.0; l++)
            out[l] += w->step->h * row[j] * w->own.rate[j * stride + l];
}

/* y -= A x, with `rows` rows. */
static void subtract_product(double *y, const double *a, const double *x, size_t rows, size_t columns) {
    for (size_t j = 0; j < columns; j++)
        for (size_t i = 0; i < rows && x[j] != 0.0; i++)
            y[i] -= a[j * rows + i] * x[j];
}

/* dK of a column dx at stage i; kt_state_derivatives have -f_q, -f_v, -f_x and a_x. */
static void change_slope(kt_step_work *w, const double *y, const double *dx, double *out) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, m = model->n.x;
    const double *states = dx + nq + n;
    kt_slope_change(model, y, w->by_q, w->by_v, dx, w->own.xi, out);
    for (size_t j = 0; j < m; j++)
        for (size_t i = 0; i < n; i++)
            out[nq + i] += w->own.force[j * n + i] * states[j];
    kt_clear(out + nq + n, m * sizeof *out);
    subtract_product(out + nq + n, w->own.rate_q, w->own.xi, m, n);
    subtract_product(out + nq + n, w->own.rate_v, dx + nq, m, n);
    subtract_product(out + nq + n, w->own.rate_x, states, m, m);
}

static kt_status differentiate(kt_step_work *w, size_t i, size_t held, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, m = model->n.x, E = size_of(model), columns = 2 * n + m + held;
    const double *y = w->own.stage + i * E, *k = w->own.slope + i * E;
    const kt_dynamic_state at = {kt_step_time(w->step, i), y, y + nq, w->step->tau, w->step->external};
    const kt_state_derivatives states = {w->own.force, w->own.rate_q, w->own.rate_v, w->own.rate_x};
    const kt_acceleration_matrices to = {.by = {w->by_q, w->by_v, held ? w->by_tau : NULL}, .states = &states};
    const kt_status status = kt_acceleration_derivatives_at(model, w->data, w->derivative,
                                                            kt_acceleration_work_size(model), &at, k + nq, &to, error);
    if (status != KT_OK)
        return status;
    combine(w, kt_step_row(w->step->method, i), i, columns, w->own.change);
    double *rate = w->own.rate + i * E * (3 * n + m);
    for (size_t j = 0; j < columns; j++)
        change_slope(w, y, w->own.change + j * E, rate + j * E);
    for (size_t j = 0; j < held; j++)
        for (size_t l = 0; l < n; l++)
            rate[(2 * n + m + j) * E + nq + l] += w->by_tau[j * n + l];
    return KT_OK;
}

kt_status kt_own_step_tangents(kt_step_work *w, const double *q, const double *v, size_t held, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, E = size_of(model), columns = 2 * n + model->n.x + held;
    kt_status status = KT_OK;
    begin(w, q, v);
    begin_columns(w);
    for (size_t i = 0; i < w->stages && status == KT_OK; i++) {
        status = evaluate(w, i, error);
        if (status == KT_OK)
            status = differentiate(w, i, held, error);
    }
    if (status != KT_OK)
        return conclude(w, status);
    finish(w);
    combine(w, w->step->method->b, w->stages, columns, w->own.change);
    for (size_t j = 0; j < columns; j++) {
        kt_copy(w->change_q + j * kt_padded(nq), w->own.change + j * E, nq * sizeof(double));
        kt_copy(w->rate_v + j * kt_padded(n), w->own.change + j * E + nq, n * sizeof(double));
    }
    return conclude(w, status);
}

void kt_own_step_copy(const kt_step_work *w, size_t first, size_t columns, double *to) {
    const size_t nq = w->model->n.q, n = w->model->n.v, m = w->model->n.x, E = size_of(w->model);
    for (size_t j = first; j < first + columns; j++, to += 2 * n + m) {
        kt_copy(to, w->end + 2 * n * j, 2 * n * sizeof *to);
        kt_copy(to + 2 * n, w->own.change + j * E + nq + n, m * sizeof *to);
    }
}
