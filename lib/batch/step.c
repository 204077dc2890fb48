/* Steps of many states by an explicit Runge-Kutta method (integrator/explicit.c): stages and their sums are those of one
 * step, of all lanes at once. The bits are those of kt_step_evaluate (sensitivity/step.c), state by state. */
#include "batch/batch.h"

#include "base/copy.h"
#include "joint/joint.h"
#include "kinetree/closure.h"
#include "kinetree/joint.h"

#include <string.h>

/* The rates of positions of a group: its velocities, but for quaternions, whose rates are computed lane by lane. */
static void rate(kt_batch *batch, const kt_batch_group *group, double *out) {
    const kt_batch_counts *n = &batch->n;
    if (n->nq == n->nv) {
        kt_copy(out, group->v, n->width * n->nv * sizeof *out);
        return;
    }
    for (size_t lane = 0; lane < n->width; lane++) {
        kt_lane_take(group->q, n->width, lane, n->nq, batch->one_q);
        kt_lane_take(group->v, n->width, lane, n->nv, batch->one_v);
        kt_position_rate(batch->model, batch->one_q, batch->one_v, batch->one_a);
        kt_lane_put(batch->one_a, n->width, lane, n->nq, out);
    }
}

/* out = y + h sum_j weight_j k_j */
static void combine(kt_batch *batch, const double *y, double h, const double *weights, size_t count, double *out) {
    const size_t N = batch->n.width * (batch->n.nq + batch->n.nv);
    double *rows[KT_METHOD_STAGES_MAX];
    size_t used = 0;
    for (size_t j = 0; j < count; j++) {
        rows[j] = batch->slope + j * N;
        if (weights[j] != 0.0)
            batch->term[used++] = (kt_stage_term){weights[j], j};
    }
    kt_combine(out, y, h, batch->term, used, rows, N);
}

/* All stages of the live lanes; the state after the step, before it is closed, is left in batch->stage. */
static void take_stages(kt_batch *batch, kt_batch_group *group, double h, kt_batch_fault *fault) {
    const kt_batch_counts *n = &batch->n;
    const kt_method *m = batch->method;
    const size_t nq = n->width * n->nq, N = nq + n->width * n->nv;
    const double *y = group->q;
    _Alignas(KT_ALIGNMENT) double t[32];
    kt_batch_group at = *group;
    at.q = batch->stage;
    at.v = batch->stage + nq;
    for (size_t i = 0; i < n->stages && at.live; i++) {
        double *k = batch->slope + i * N;
        for (size_t lane = 0; lane < n->width; lane++) {
            const double start = batch->t[group->first + lane];
            t[lane] = m->c[i] == 1.0 ? start + h : start + m->c[i] * h;
        }
        combine(batch, y, h, m->a + i * (i - (i > 0)) / 2, i, batch->stage);
        rate(batch, &at, k);
        kt_batch_accelerate(batch, &at, t, fault);
        kt_copy(k + nq, batch->result, (N - nq) * sizeof *k);
    }
    combine(batch, y, h, m->b, n->stages, batch->stage);
    group->live = at.live;
}

/* Closes loops, and makes quaternions units, of the state in one_q and one_v. */
static kt_status close_state(kt_batch *batch, double t, kt_error *error) {
    if (KT_HAS_LOOPS && batch->model->n.group > 0)
        return kt_state_project(batch->model, batch->data, t, batch->one_q, batch->one_v, NULL, error);
    return kt_position_make_units(batch->model, batch->one_q)
               ? KT_OK
               : kt_error_set(error, KT_ERROR_NOT_FINITE, "step", "a quaternion has become zero");
}

/* Writes the states in batch->stage to the lanes that have come so far. */
static void finish(kt_batch *batch, kt_batch_group *group, double h, kt_batch_fault *fault) {
    const kt_batch_counts *n = &batch->n;
    const size_t nq = n->width * n->nq;
    const bool open = n->nq > n->nv || batch->model->n.group > 0;
    double *y = batch->y + group->first * (n->nq + n->nv);
    for (size_t lane = 0; lane < n->width; lane++) {
        kt_error made;
        if (!kt_lane_is_in(group->live, lane))
            continue;
        double *t = &batch->t[group->first + lane];
        kt_lane_take(batch->stage, n->width, lane, n->nq, batch->one_q);
        kt_lane_take(batch->stage + nq, n->width, lane, n->nv, batch->one_v);
        if (open && close_state(batch, *t + h, &made) != KT_OK) {
            kt_batch_fail(batch, group->first + lane, &made, fault);
            group->live &= ~((kt_lane_mask)1 << lane);
            continue;
        }
        kt_lane_put(batch->one_q, n->width, lane, n->nq, y);
        kt_lane_put(batch->one_v, n->width, lane, n->nv, y + nq);
        *t += h;
    }
}

kt_status kt_batch_step(kt_batch *batch, double h, int steps, kt_error *error) {
    if (KT_IS_MISSING(error, batch))
        return KT_ERROR_ARGUMENT;
    if (!batch->method)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "batch",
                            "it has no method to take steps by; give one in the options of kt_batch_init");
    if (!isfinite(h) || steps < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step", "%d steps of h = %g s cannot be taken", steps, h);
    kt_batch_fault fault = {KT_OK, 0, error};
    memset(batch->status, KT_OK, batch->n.states);
    for (size_t g = 0; g < batch->n.groups; g++) {
        kt_batch_group group = kt_batch_group_of(batch, g);
        for (int i = 0; i < steps && group.live; i++) {
            take_stages(batch, &group, h, &fault);
            finish(batch, &group, h, &fault);
        }
    }
    return fault.status;
}
