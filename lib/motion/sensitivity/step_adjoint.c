/* The adjoint of a step. For a gradient y+ with respect to x+, the adjoints of slopes and stages are, from the last
 * stage to the first,
 *
 *     k_i = h (b_i y+ + sum_{j > i} a_ji x_j),   x_i = (dK_i / dX_i)' k_i,   y = y+ + sum x_i
 *
 * (Sanz-Serna 2016, section 3). These adjoints come between the adjoints of the projection and of the map from
 * rotations to quaternions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "joint/turn.h"
#include "linear/cholesky.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* Whether A and B are formed. For linearly implicit methods, they cost more than a sweep without them would save. With
 * auxiliary states, A and B are always formed. */
static bool is_formed(const kt_step_work *w) { return w->linear || kt_has_auxiliary_states(w->model); }

static bool step_closes(const kt_step_work *w) { return w->model->n.row && !w->step->unprojected; }

kt_status kt_adjoint_run(kt_step_work *w, const double *q, const double *v, kt_error *error) {
    const size_t nq = w->model->n.q, N = kt_state_numbers(w->model);
    kt_status status = kt_step_stages(w, q, v, error);
    if (status == KT_OK)
        status = kt_step_reject_contacts(w, w->next, error);
    if (status != KT_OK)
        return status;
    memcpy(w->raw, w->next, N * sizeof *w->raw);
    if (step_closes(w)) {
        const kt_status closed = kt_projection_run(&w->projection, w->next, w->next + nq, error);
        return closed == KT_OK ? kt_projection_reject_unknown(&w->projection, w->next + nq, 1.0, 1.0, error) : closed;
    }
    return kt_step_close(w->model, w->data, w->step, w->next, w->next + nq, error);
}

void kt_adjoint_save(const kt_step_work *w, double *slopes, double *next, uint32_t *iterations) {
    const size_t N = kt_state_numbers(w->model), kept = kt_step_kept(w->model, w->step->method);
    for (size_t i = 0; i < w->stages; i++)
        memcpy(slopes + i * kept, w->slope + (i + 1) * N - kept, kept * sizeof *slopes);
    memcpy(next, w->next, N * sizeof *next);
    *iterations = w->projection.iterations;
}

/* Restores the stages and the state after the step from the stored part of the slopes. */
static void recall_stages(kt_step_work *w, const double *slopes) {
    const size_t n = w->model->n.v;
    for (size_t i = 0; i < w->stages; i++) {
        double *a;
        (void)kt_step_stage(w, i, &a);
        memcpy(a, slopes + i * n, n * sizeof *a);
    }
    kt_step_finish(w);
}

kt_status kt_adjoint_recall(kt_step_work *w, const double *q, const double *v, const double *slopes, const double *next,
                            uint32_t iterations, kt_error *error) {
    const size_t nq = w->model->n.q, N = kt_state_numbers(w->model);
    kt_step_start(w, q, v);
    if (is_formed(w)) { /* the stages are not needed */
        memcpy(w->next, next, N * sizeof *next);
        return KT_OK;
    }
    if (w->coupled) {
        memcpy(w->slope, slopes, w->stages * N * sizeof *slopes);
        kt_coupled_recall(w);
    } else
        recall_stages(w, slopes);
    memcpy(w->raw, w->next, N * sizeof *w->raw);
    memcpy(w->next, next, N * sizeof *next);
    w->projection.iterations = iterations;
    return step_closes(w) ? kt_projection_begin(&w->projection, w->raw, w->raw + nq, error) : KT_OK;
}

void kt_adjoint_gather(const kt_method *method, size_t i, size_t stages, size_t all, const double *by_end,
                       const double *by_stage, double *by_slope) {
    for (size_t l = 0; l < all; l++)
        by_slope[l] = method->b[i] * by_end[l];
    for (size_t j = i + 1; j < stages; j++)
        kt_add_times(by_slope, kt_step_row(method, j)[i], by_stage + j * all, all);
}

/* Computes x_i, and adds the stage's part of the gradient by tau. */
static kt_status pull_stage_adjoint(kt_step_work *w, size_t i, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n;
    const double *q = w->stage + i * N;
    double *by_q = w->by_stage + i * N, *by_v = by_q + nq;
    memset(by_q, 0, N * sizeof *by_q);
    const kt_status status = kt_stage_adjoint(w, i, w->by_slope + nq, error);
    if (status != KT_OK)
        return status;
    for (size_t j = 0; j < n; j++) {
        by_v[j] = w->tangent[n + j];
        w->by_force[j] += w->tangent[2 * n + j];
    }
    kt_turns_drop_transposed(model, q, w->tangent, by_q);
    kt_turns_rate_transposed(model, q, q + nq, w->by_slope, by_q, by_v);
    return KT_OK;
}

/* Computes the adjoint with A and B. */
static kt_status multiply_step_adjoint(kt_step_work *w, kt_error *error) {
    const size_t nq = w->model->n.q, n = w->model->n.v, m = w->model->n.x, N = kt_state_numbers(w->model);
    const double *change_x = w->rate_v + n;
    memcpy(w->raw, w->y, N * sizeof *w->raw);
    const kt_status status = kt_step_tangents(w, w->raw, w->raw + nq, n, error);
    for (size_t k = 0; k < 3 * n + m && status == KT_OK; k++) {
        w->tangent[k] = kt_dense_dot(w->end + 2 * n * k, w->by_next, (int)(2 * n));
        if (m > 0)
            w->tangent[k] += kt_dense_dot(change_x + k * kt_padded_v(w->model), w->by_next + 2 * n, (int)m);
    }
    if (status != KT_OK)
        return status;
    kt_copy(w->by_next, w->tangent, (2 * n + m) * sizeof *w->by_next);
    kt_copy(w->by_force, w->tangent + 2 * n + m, n * sizeof *w->by_force);
    return KT_OK;
}

kt_status kt_adjoint_sweep(kt_step_work *w, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n;
    if (is_formed(w))
        return multiply_step_adjoint(w, error);
    kt_status status =
        step_closes(w) ? kt_projection_transposed(&w->projection, w->next, w->next + nq, w->by_next, error) : KT_OK;
    if (status != KT_OK)
        return status;
    memset(w->by_end, 0, nq * sizeof *w->by_end);
    memcpy(w->by_end + nq, w->by_next + n, n * sizeof *w->by_end);
    kt_turns_drop_transposed(model, w->raw, w->by_next, w->by_end);
    memcpy(w->by_start, w->by_end, N * sizeof *w->by_start);
    memset(w->by_force, 0, n * sizeof *w->by_force);
    if (w->coupled)
        status = kt_coupled_adjoint(w, error);
    for (size_t i = w->stages; i-- > 0 && status == KT_OK;) {
        if (!w->coupled) {
            kt_adjoint_gather(w->step->method, i, w->stages, N, w->by_end, w->by_stage, w->by_slope);
            for (size_t l = 0; l < N; l++)
                w->by_slope[l] *= w->step->h;
            status = pull_stage_adjoint(w, i, error);
        }
        for (size_t l = 0; l < N; l++)
            w->by_start[l] += w->by_stage[i * N + l];
    }
    if (status != KT_OK)
        return status;
    kt_turns_lift_transposed(model, w->y, w->by_start, w->by_next);
    memcpy(w->by_next + n, w->by_start + nq, n * sizeof *w->by_next);
    if (kt_all_finite(w->by_next, 2 * n) && kt_all_finite(w->by_force, n))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_NOT_FINITE, "gradient",
                        "it overflows: look for a motion that grows without bound, or for a force that is huge");
}

kt_status kt_step_adjoint(const kt_model *model, kt_data *data, void *work, size_t work_size, const kt_step *step,
                          const double *q, const double *v, const double *by_next, double *by_state, double *by_tau,
                          kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, step, q || !model->n.q, by_next || !kt_tangent_numbers(model)))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    const size_t n = model->n.v, changes = kt_tangent_numbers(model);
    kt_step_work w;
    kt_status status = kt_step_begin(&w, model, data, work, work_size, step, error);
    if (status == KT_OK)
        status = kt_adjoint_run(&w, q, v, error);
    if (status != KT_OK)
        return status;
    kt_copy(w.by_next, by_next, changes * sizeof *by_next);
    status = kt_adjoint_sweep(&w, error);
    if (status != KT_OK)
        return status;
    if (by_state)
        kt_copy(by_state, w.by_next, changes * sizeof *by_state);
    if (by_tau)
        kt_copy(by_tau, w.by_force, n * sizeof *by_tau);
    return KT_OK;
}
