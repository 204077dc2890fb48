/* A and B of a step: the tangents of its stages, all columns at once. A column holds dq (nq) and dv (nv) of one change of
 * the start, (xi, dv, dtau); the equations are in the public header. */
#include "dynamics/dynamics.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

kt_product_call *kt_product_of(const kt_model *model) {
#ifdef KT_ISAS
    if (model->level == KT_ISA_V4)
        return kt_product_v4;
    if (model->level == KT_ISA_V3)
        return kt_product_v3;
#endif
    (void)model;
    return kt_product_baseline;
}

/* The changes at the start: unit vectors of xi, dv and dtau. */
static void begin(kt_step_work *w, size_t columns) {
    const size_t nq = w->model->n.q, n = w->model->n.v, N = nq + n;
    memset(w->start, 0, N * columns * sizeof *w->start);
    for (size_t j = 0; j < n; j++) {
        memset(w->unit, 0, n * sizeof *w->unit);
        w->unit[j] = 1.0;
        kt_tangent_lift(w->model, w->y, w->unit, w->start + j * N);
        w->start[(n + j) * N + nq + j] = 1.0;
    }
}

kt_status kt_step_differentiate(kt_step_work *w, size_t i, bool inputs, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const kt_step *step = w->step;
    const double *q = w->stage + i * (model->n.q + model->n.v), *v = q + model->n.q;
    const double t = kt_step_time(step, i);
    double *by_tau = inputs ? w->by_tau : NULL;
    if (!model->n.group && !model->n.effect)
        return kt_forward_derivatives_fill(model, w->data, w->tree, kt_derivative_work_size(model), q, v, step->tau,
                                           step->external, a, w->by_q, w->by_v, by_tau, error);
    if (a) {
        const kt_status status = kt_acceleration_evaluate(model, w->data, t, q, v, step->tau, step->external, a, error);
        if (status != KT_OK)
            return status;
    }
    return kt_acceleration_derivatives(model, w->data, w->derivative, kt_acceleration_work_size(model), t, q, v,
                                       step->tau, step->external, w->by_q, w->by_v, by_tau, error);
}

/* dK_0: at the start the changes are unit vectors. */
static void push_first(kt_step_work *w, size_t columns) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n;
    for (size_t j = 0; j < columns; j++) {
        const double *by = j < n ? w->by_q : j < 2 * n ? w->by_v : w->by_tau, *dq = w->start + j * N;
        double *to = w->rate + j * N;
        if (kt_is_plain(model))
            memcpy(to, dq + nq, n * sizeof *to);
        else
            kt_tangent_rate(model, w->y, w->y + nq, dq, dq + nq, to);
        memcpy(to + nq, by + j % n * n, n * sizeof *to);
    }
}

/* dK_i from dX_i. */
static void push(kt_step_work *w, size_t i, size_t columns) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n;
    const double *q = w->stage + i * N, *v = q + nq;
    double *rate = w->rate + i * N * columns;
    for (size_t j = 0; j < columns; j++) {
        const double *dq = w->change + j * N, *dv = dq + nq;
        double *to = rate + j * N;
        if (j < 2 * n)
            memset(to + nq, 0, n * sizeof *to);
        else
            memcpy(to + nq, w->by_tau + (j - 2 * n) * n, n * sizeof *to);
        if (kt_is_plain(model)) {
            memcpy(to, dv, n * sizeof *to);
            continue;
        }
        kt_tangent_rate(model, q, v, dq, dv, to);
        kt_tangent_drop(model, q, dq, w->xi + j * N);
    }
    kt_product_of(model)(n, w->by_q, w->by_v, w->tiles, columns, N, kt_is_plain(model) ? w->change : w->xi,
                         w->change + nq, rate + nq);
}

/* From the state and the changes after the sum to those after the projection: w->next and w->end. */
static kt_status close(kt_step_work *w, size_t columns, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n;
    for (size_t j = 0; j < columns; j++) {
        const double *change = w->change + j * N;
        if (kt_is_plain(model))
            memcpy(w->end + 2 * n * j, change, n * sizeof *change);
        else
            kt_tangent_drop(model, w->next, change, w->end + 2 * n * j);
        memcpy(w->end + 2 * n * j + n, change + nq, n * sizeof *change);
    }
    if (KT_HAS_LOOPS && model->n.group && !w->step->unprojected)
        return kt_projection_columns(&w->projection, w->next, w->next + nq, columns, w->end, error);
    return kt_step_close(model, w->data, w->step, w->next, w->next + nq, error);
}

static kt_status differentiate_step(kt_step_work *w, const double *q, const double *v, bool inputs, kt_error *error) {
    const kt_step *step = w->step;
    const size_t n = w->model->n.v, N = w->model->n.q + n, columns = (inputs ? 3 : 2) * n;
    kt_status status = KT_OK;
    kt_step_start(w, q, v);
    begin(w, columns);
    for (size_t i = 0; i < w->stages; i++) {
        double *a;
        (void)kt_step_stage(w, i, &a);
        status = kt_step_differentiate(w, i, inputs, a, error);
        if (status != KT_OK)
            return status;
        if (i == 0) {
            push_first(w, columns);
            continue;
        }
        kt_step_combine(w->change, w->start, step->h, kt_step_row(step->method, i), i, w->rate, N * columns);
        push(w, i, columns);
    }
    kt_step_finish(w);
    kt_step_combine(w->change, w->start, step->h, step->method->b, w->stages, w->rate, N * columns);
    status = close(w, columns, error);
    if (status == KT_OK && !kt_all_finite(w->end, 2 * n * columns))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "derivatives",
                            "they overflow: look for a step that is far too long, or for a force that is huge");
    return status;
}

kt_status kt_step_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size, const kt_step *step,
                              const double *q, const double *v, double *next_q, double *next_v, double *A, double *B,
                              kt_error *error) {
    const size_t nq = model->n.q, n = model->n.v;
    kt_step_work w;
    kt_status status = kt_step_begin(&w, model, data, work, work_size, step, error);
    if (status == KT_OK)
        status = differentiate_step(&w, q, v, B != NULL, error);
    if (status != KT_OK)
        return status;
    if (next_q)
        memcpy(next_q, w.next, nq * sizeof *next_q);
    if (next_v)
        memcpy(next_v, w.next + nq, n * sizeof *next_v);
    if (A)
        memcpy(A, w.end, 4 * n * n * sizeof *A);
    if (B)
        memcpy(B, w.end + 4 * n * n, 2 * n * n * sizeof *B);
    return KT_OK;
}
