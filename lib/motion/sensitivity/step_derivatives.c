/* A, B and C of a step: the tangents of its stages, all columns at once. A column holds dq (nq) and dv (nv) of one
 * change. The change is a change of the start (xi, dv) or of a held input (dtau, dp). The equations are in the public
 * header. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "kinetree/joint.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* Sets the changes at the start: unit vectors of xi and dv, zero for held inputs. The padding of the columns remains
 * zero in all later calls. */
static void begin_changes(kt_step_work *w, size_t columns) {
    const size_t n = w->model->n.v, Q = kt_padded_q(w->model), V = kt_padded_v(w->model);
    memset(w->start_q, 0, Q * columns * sizeof *w->start_q);
    memset(w->start_v, 0, V * columns * sizeof *w->start_v);
    memset(w->rate_v, 0, w->stages * V * columns * sizeof *w->rate_v);
    if (!kt_is_plain(w->model)) {
        memset(w->rate_q, 0, w->stages * Q * columns * sizeof *w->rate_q);
        memset(w->xi, 0, V * columns * sizeof *w->xi);
    }
    for (size_t j = 0; j < n && w->states > 0; j++) {
        if (kt_is_plain(w->model)) {
            w->start_q[j * Q + j] = 1.0;
        } else {
            memset(w->unit, 0, n * sizeof *w->unit);
            w->unit[j] = 1.0;
            kt_position_rate(w->model, w->y, w->unit, w->start_q + j * Q); /* dp = p o (0, xi) / 2 */
        }
    }
    for (size_t j = n; j < w->states; j++)
        w->start_v[j * V + j - n] = 1.0;
}

/* Forms dK_i: the derivatives by held inputs, the rates of positions, and a_q xi + a_v dv unless i is 0. At the start,
 * xi and dv are unit vectors or zero, so that the derivatives themselves are copied. */
static void propagate_stage(kt_step_work *w, size_t i, size_t columns) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, e = kt_rate_numbers(model), Q = kt_padded_q(model), V = kt_padded(e);
    const double *q = w->stage + i * (nq + e), *dq = w->change_q, *dv = w->change_v + i * V * columns;
    double *rate = w->rate_v + i * V * columns;
    const double *by_held = w->parameter ? w->parameter->by_parameter : w->by_tau;
    for (size_t j = i ? w->states : 0; j < columns; j++) {
        if (j >= w->states)
            memcpy(rate + j * V, by_held + (j - w->states) * n, n * sizeof *rate);
        else
            memcpy(rate + j * V, j < n ? w->by_q + j * e : w->by_v + (j - n) * e, e * sizeof *rate);
    }
    for (size_t j = 0; j < columns && !kt_is_plain(model); j++) {
        kt_tangent_rate(model, q, q + nq, dq + j * Q, dv + j * V, w->rate_q + (i * columns + j) * Q);
        kt_tangent_drop(model, q, dq + j * Q, w->xi + j * V);
    }
    if (i)
        KT_BY_ISA(model->isa, , kt_product,
                  (e, w->by_q, w->by_v, w->tiles, columns, kt_is_plain(model) ? dq : w->xi, dv, rate));
}

/* Forms dX_i (or, after the last stage, the changes at the end) from the rates: into change_q and *dv. */
static void combine_rate_changes(kt_step_work *w, const double *row, size_t count, size_t columns, double *dv) {
    const size_t Q = kt_padded_q(w->model) * columns, V = kt_padded_v(w->model) * columns;
    const double *rate_q = kt_is_plain(w->model) ? w->change_v : w->rate_q;
    KT_BY_ISA(w->model->isa, , kt_sum, (w->change_q, w->start_q, w->step->h, row, count, rate_q, Q));
    KT_BY_ISA(w->model->isa, , kt_sum, (dv, w->start_v, w->step->h, row, count, w->rate_v, V));
}

/* Rejects derivatives that are too uncertain next to a singular position after the step. The derivatives are the
 * columns of states or, without these, of held inputs. A unit of a held input moves positions and velocities little or
 * not at all. Its velocities are therefore compared with its positions. */
static kt_status reject_unknown_step(const kt_step_work *w, size_t columns, kt_error *error) {
    const kt_model *model = w->model;
    const size_t n = model->n.v, count = w->states > 0 ? model->n.group_v : columns;
    double by = 0.0, v_by = 0.0;
    if (w->projection.smallest >= 1.0)
        return KT_OK;
    for (size_t i = 0; i < model->n.group_v; i++)
        for (size_t j = 0; j < count; j++) {
            const size_t at = w->states > 0 ? (size_t)model->group_v[j] : j;
            const double *column = w->end + 2 * n * at, unit = (w->states > 0 ? model->unit[j] : 1.0) / model->unit[i];
            by = fmax(by, fabs(column[model->group_v[i]]) * unit);
            v_by = fmax(v_by, fabs(column[n + (size_t)model->group_v[i]]) * unit);
        }
    if (w->states == 0) {
        v_by = by > 0.0 ? v_by / by : HUGE_VAL;
        by = 1.0;
    }
    return kt_projection_reject_unknown(&w->projection, w->next + model->n.q, by, v_by, error);
}

/* Projects the state and the changes after the sum of the stages; results: w->next and w->end. */
static kt_status close(kt_step_work *w, const double *change_v, size_t columns, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, Q = kt_padded_q(model), V = kt_padded_v(model);
    const bool checked = !w->watched;
    const kt_status rejected = checked ? kt_step_reject_contacts(w, w->next, error) : KT_OK;
    if (rejected != KT_OK)
        return rejected;
    for (size_t j = 0; j < columns; j++) {
        double *end = w->end + 2 * n * j;
        if (kt_is_plain(model))
            memcpy(end, w->change_q + j * Q, n * sizeof *end);
        else
            kt_tangent_drop(model, w->next, w->change_q + j * Q, end);
        memcpy(end + n, change_v + j * V, n * sizeof *end);
    }
    if (model->n.row && !w->step->unprojected) { /* groups may have no equations */
        const kt_status status =
            kt_projection_columns(&w->projection, w->next, w->next + nq, columns, w->end, w->parameter, error);
        return status == KT_OK ? reject_unknown_step(w, columns, error) : status;
    }
    return kt_step_close(model, w->data, w->step, w->next, w->next + nq, error);
}

/* Stages and their tangents, one after the other. */
static kt_status differentiate_stages(kt_step_work *w, size_t held, size_t columns, kt_error *error) {
    const size_t V = kt_padded_v(w->model) * columns;
    for (size_t i = 0; i < w->stages; i++) {
        double *a;
        const double *y = kt_step_stage(w, i, &a);
        kt_status status = kt_step_differentiate(w, i, held > 0, a, error);
        if (status == KT_OK && w->parameter)
            status = kt_parameter_stage(w, kt_step_time(w->step, i), y, a, error);
        if (status != KT_OK)
            return status;
        const double *row = kt_step_row(w->step->method, i);
        combine_rate_changes(w, row, i, columns, w->change_v + i * V);
        propagate_stage(w, i, columns);
    }
    kt_step_finish(w);
    return KT_OK;
}

kt_status kt_step_tangents(kt_step_work *w, const double *q, const double *v, size_t held, kt_error *error) {
    const kt_method *method = w->step->method;
    const size_t n = w->model->n.v, columns = w->states + held;
    kt_step_start(w, q, v);
    begin_changes(w, columns);
    kt_status status = w->linear    ? kt_rosenbrock_tangents(w, q, v, held, error)
                       : w->coupled ? kt_coupled_tangents(w, q, v, held, error)
                                    : differentiate_stages(w, held, columns, error);
    kt_auxiliary_states_restore(w);
    if (status != KT_OK)
        return status;
    if (!w->linear)
        combine_rate_changes(w, method->b, w->stages, columns,
                             w->rate_v); /* in place: each number after its last use */
    status = close(w, w->rate_v, columns, error);
    if (status == KT_OK &&
        !(kt_all_finite(w->end, 2 * n * columns) &&
          (!kt_has_auxiliary_states(w->model) || kt_all_finite(w->rate_v, columns * kt_padded_v(w->model)))))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "derivatives",
                            "they overflow: look for a step that is far too long, or for a force that is huge");
    return status;
}

void kt_step_copy(const kt_step_work *w, size_t first, size_t columns, double *to) {
    const size_t n = w->model->n.v, m = w->model->n.x, V = kt_padded_v(w->model);
    if (m == 0)
        kt_copy(to, w->end + 2 * n * first, 2 * n * columns * sizeof *to);
    for (size_t j = first; j < first + columns && m > 0; j++, to += 2 * n + m) {
        kt_copy(to, w->end + 2 * n * j, 2 * n * sizeof *to);
        kt_copy(to + 2 * n, w->rate_v + j * V + n, m * sizeof *to);
    }
}

void kt_step_give(const kt_step_work *w, double *A, double *B) {
    if (A)
        kt_step_copy(w, 0, w->states, A);
    if (B)
        kt_step_copy(w, w->states, w->model->n.v, B);
    kt_auxiliary_states_put(w->model, w->data, w->next);
}

kt_status kt_step_derivatives(const kt_model *model, kt_data *data, void *work, size_t work_size, const kt_step *step,
                              const double *q, const double *v, double *next_q, double *next_v, double *A, double *B,
                              kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, step, q || !model->n.q))
        return KT_ERROR_ARGUMENT;
    kt_step_work w;
    kt_status status = kt_step_begin(&w, model, data, work, work_size, step, error);
    if (status == KT_OK)
        status = kt_step_tangents(&w, q, v ? v : model->zero, B ? model->n.v : 0, error);
    if (status != KT_OK)
        return status;
    if (next_q)
        kt_copy(next_q, w.next, model->n.q * sizeof *next_q);
    if (next_v)
        kt_copy(next_v, w.next + model->n.q, model->n.v * sizeof *next_v);
    kt_step_give(&w, A, B);
    return KT_OK;
}
