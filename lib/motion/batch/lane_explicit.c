/* Steps of many states with an explicit Runge-Kutta method (integrator/explicit.c). The stages and sums of one step are
 * computed for all lanes at once. The bits are those of kt_step_evaluate (sensitivity/tangent_step.c), state by state.
 * The other method is semi-implicit Euler, which has first order, and is symplectic if forces do not depend on
 * velocities (Hairer, Lubich and Wanner, Geometric Numerical Integration, I.1):
 *     v1 = v0 + h a(t0, q0, v0),   q1 = q0 (+) h v1,   of auxiliary states x1 = x0 + h f(t0, q0, v0, x0)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/batch.h"

#include "base/copy.h"
#include "evaluate/evaluate.h"
#include "joint/joint.h"
#include "kinetree/joint.h"

/* The rates of positions of a group. */
static void find_position_rates(kt_batch_work *w, const kt_batch_group *group, double *out) {
    const kt_batch *batch = w->batch;
    if (batch->kernels)
        batch->kernels->rate(batch->model, w->lanes, group->q, group->v, out);
    else /* groups of one state */
        kt_position_rate(batch->model, group->q, group->v, out);
}

/* The rates of auxiliary states, state by state, as kt_batch_accelerate accelerations. */
static void rate_auxiliary_states(kt_batch_work *w, kt_batch_group *group, const double *t, double *out,
                                  kt_batch_fault *fault) {
    const kt_batch_counts *n = &w->batch->n;
    double *rates = w->data->x + n->nx;
    kt_error made;
    for (size_t lane = 0; lane < n->width; lane++) {
        const size_t state = group->first + lane;
        if (!kt_lane_is_in(group->active, lane))
            continue;
        kt_batch_take(w, group, lane);
        if (kt_auxiliary_state_rates_trusted(w->batch->own[state], w->data, t[lane], w->one_q, w->one_v, rates,
                                             &made) == KT_OK)
            kt_lane_put(rates, n->width, lane, n->nx, out);
        else
            kt_batch_fail(w, group, lane, &made, fault);
    }
}

/* All stages of the active lanes; w->stage receives the state after the step, before loops are closed. */
static void take_group_stages(kt_batch_work *w, kt_batch_group *group, double h, kt_batch_fault *fault) {
    const kt_batch *batch = w->batch;
    const kt_batch_counts *n = &batch->n;
    const kt_method *m = batch->method;
    const size_t nq = n->width * n->nq, moving = nq + n->width * n->nv, N = n->width * n->N;
    const double *y = group->q;
    _Alignas(KT_ALIGNMENT) double t[KT_LANES_MOST];
    kt_batch_group at = *group;
    at.q = w->stage;
    at.v = w->stage + nq;
    at.x = w->stage + moving;
    for (size_t i = 0; i < n->stages && at.active; i++) {
        double *k = w->slope + i * N;
        for (size_t lane = 0; lane < n->width; lane++)
            t[lane] = kt_stage_time(m->c[i], batch->t[group->first + lane], h);
        kt_combine_rows(w->stage, y, h, m->a + i * (i - (i > 0)) / 2, i, w->slope, N);
        find_position_rates(w, &at, k);
        kt_batch_accelerate(w, &at, t, fault);
        kt_copy(k + nq, w->result, (moving - nq) * sizeof *k);
        if (n->nx > 0)
            rate_auxiliary_states(w, &at, t, k + moving, fault);
    }
    kt_combine_rows(w->stage, y, h, m->b, n->stages, w->slope, N);
    group->active = at.active;
}

/* Takes a semi-implicit step of the active lanes. w->stage receives the state after the step, before loops
 * are closed. */
static void take_semi_implicit(kt_batch_work *w, kt_batch_group *group, double h, kt_batch_fault *fault) {
    const kt_batch *batch = w->batch;
    const kt_batch_counts *n = &batch->n;
    const size_t nq = n->width * n->nq, nv = n->width * n->nv;
    double *q = w->stage, *v = w->stage + nq;
    kt_batch_accelerate(w, group, batch->t + group->first, fault);
    if (n->nx > 0)
        rate_auxiliary_states(w, group, batch->t + group->first, v + nv, fault);
    for (size_t i = 0; i < n->width * n->nx; i++)
        v[nv + i] = group->x[i] + h * v[nv + i];
    for (size_t i = 0; i < nv; i++)
        v[i] = group->v[i] + h * w->result[i];
    if (n->nq == n->nv) {
        for (size_t i = 0; i < nv; i++)
            q[i] = group->q[i] + h * v[i];
        return;
    }
    for (size_t lane = 0; lane < n->width; lane++) {
        kt_lane_take(group->q, n->width, lane, n->nq, w->one_q);
        kt_lane_take(v, n->width, lane, n->nv, w->one_v);
        for (size_t i = 0; i < n->nv; i++)
            w->one_v[i] *= h;
        kt_position_add(batch->model, w->one_q, w->one_v, w->one_a);
        kt_lane_put(w->one_a, n->width, lane, n->nq, q);
    }
}

/* Closes the loops of one lane by the functions for a single state. */
static void close_alone(kt_batch_work *w, kt_batch_group *group, size_t lane, double h, kt_batch_fault *fault) {
    const kt_batch_counts *n = &w->batch->n;
    const size_t nq = n->width * n->nq, state = group->first + lane;
    kt_error made;
    kt_data_lend(w->batch->own[state], w->data);
    kt_lane_take(w->stage, n->width, lane, n->nq, w->one_q);
    kt_lane_take(w->stage + nq, n->width, lane, n->nv, w->one_v);
    if (kt_state_close(w->batch->own[state], w->data, w->batch->t[state] + h, true, w->one_q, w->one_v, &made) !=
        KT_OK) {
        kt_batch_fail(w, group, lane, &made, fault);
        return;
    }
    kt_lane_put(w->one_q, n->width, lane, n->nq, w->stage);
    kt_lane_put(w->one_v, n->width, lane, n->nv, w->stage + nq);
}

/* Closes the loops of the states in w->stage in lanes. Returns the lanes whose loops are closed; all other states are
 * unchanged. */
static kt_lane_mask close_stage_loops(kt_batch_work *w, const kt_batch_group *group, double h) {
    const kt_batch *batch = w->batch;
    const kt_batch_counts *n = &batch->n;
    const size_t N = n->width * (n->nq + n->nv);
    double *moved = w->moved, *v = moved + n->width * n->nq;
    _Alignas(KT_ALIGNMENT) double t[KT_LANES_MOST];
    if (!batch->kernels || !group->model || !kt_lanes_fit_model(group->model))
        return 0;
    kt_copy(moved, w->stage, N * sizeof *moved);
    for (size_t lane = 0; lane < n->width; lane++)
        t[lane] = batch->t[group->first + lane] + h;
    const kt_lane_mask closed = batch->kernels->project(group->model, w->lanes, group->active, t, moved, v);
    for (size_t lane = 0; lane < n->width; lane++)
        for (size_t i = 0; i < n->nq + n->nv && kt_lane_is_in(closed, lane); i++)
            w->stage[i * n->width + lane] = moved[i * n->width + lane];
    return closed;
}

/* Closes the states in w->stage, and writes these states to the lanes whose step has succeeded so far. */
static void finish_group_step(kt_batch_work *w, kt_batch_group *group, double h, kt_batch_fault *fault) {
    kt_batch *batch = w->batch;
    const kt_batch_counts *n = &batch->n;
    const size_t N = n->N;
    double *y = batch->y + group->first * N;
    kt_lane_mask closed = batch->kernels ? batch->kernels->finite(w->stage, n->nq + n->nv) : 0;
    if (batch->model->n.group > 0)
        closed &= close_stage_loops(w, group, h);
    else if (n->nq > n->nv && batch->kernels)
        closed &= batch->kernels->make_units(batch->model, w->lanes, w->stage);
    for (size_t lane = 0; lane < n->width; lane++)
        if (kt_lane_is_in(group->active & ~closed, lane))
            close_alone(w, group, lane, h, fault);
    if (group->active == kt_lanes_first(n->width))
        kt_copy(y, w->stage, n->width * N * sizeof *y);
    for (size_t lane = 0; lane < n->width; lane++) {
        if (!kt_lane_is_in(group->active, lane))
            continue;
        batch->t[group->first + lane] += h;
        for (size_t i = 0; i < N && group->active != kt_lanes_first(n->width); i++)
            y[i * n->width + lane] = w->stage[i * n->width + lane];
    }
}

/* Sets the joint forces of the active lanes for a step, at which a sample begins. */
static void put_sample(kt_batch *batch, const kt_batch_group *group, const kt_batch_inputs *inputs, int step) {
    const size_t width = batch->n.width, nv = batch->n.nv, samples = (size_t)inputs->samples;
    const size_t sample = (size_t)(step / inputs->hold);
    double *tau = batch->tau + group->first * nv;
    for (size_t lane = 0; lane < group->used && sample < samples && step % inputs->hold == 0; lane++)
        if (kt_lane_is_in(group->active, lane))
            kt_lane_put(inputs->torque + ((group->first + lane) * samples + sample) * nv, width, lane, nv, tau);
}

void kt_batch_advance(kt_batch_work *w, kt_batch_group *group, const kt_batch_job *job, kt_batch_fault *fault) {
    for (int i = 0; i < job->steps && group->active; i++) {
        if (job->inputs)
            put_sample(w->batch, group, job->inputs, i);
        if (job->task == KT_BATCH_SEMI_IMPLICIT_STEP)
            take_semi_implicit(w, group, job->h, fault);
        else
            take_group_stages(w, group, job->h, fault);
        finish_group_step(w, group, job->h, fault);
    }
}

/* Hard contacts, stops and slack ropes, and friction that sticks: their events end steps of a simulation alone. */
static kt_status reject_contacts(const kt_model *model, kt_error *error) {
    for (int i = 0; i < kt_loop_count(model); i++)
        if (kt_loop_side(model, i) != KT_SIDE_NONE || kt_loop_is_stick(model, i))
            return kt_error_set(
                error, KT_ERROR_UNSUPPORTED, kt_loop_name(model, i),
                "it is hard or sticks, and steps of a batch do not follow where it closes, opens or slips; "
                "take a simulation for each state (kt_ensemble_run)");
    return KT_OK;
}

static kt_status check_inputs(const kt_batch *batch, const kt_batch_inputs *inputs, kt_error *error) {
    const struct {
        const char *where;
        int value;
    } counts[] = {{"inputs.samples", inputs->samples}, {"inputs.hold", inputs->hold}};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        if (counts[i].value < 1)
            return kt_error_set(error, KT_ERROR_ARGUMENT, counts[i].where, "%d; give 1 or more", counts[i].value);
    return KT_IS_MISSING(error, inputs->torque || batch->n.nv == 0) ? KT_ERROR_ARGUMENT : KT_OK;
}

kt_status kt_batch_check_step(const kt_batch *batch, const kt_batch_job *job, kt_error *error) {
    if (!batch->method && job->task == KT_BATCH_STEP)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "batch",
                            "it has no integration method; give one in the options of kt_batch_init");
    if (!isfinite(job->h) || job->steps < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step", "%d steps of h = %g s cannot be taken", job->steps,
                            job->h);
    const kt_status status = job->inputs ? check_inputs(batch, job->inputs, error) : KT_OK;
    return status == KT_OK ? reject_contacts(batch->model, error) : status;
}
