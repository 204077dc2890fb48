/* Accelerations and forces of a group of states, in lanes. States that lanes cannot compute are evaluated one by one.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "batch/batch.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"

/* Copies the numbers of one model to all lanes, unless the lanes have these numbers already. */
static void put_group_model(kt_batch_work *w, const kt_model *model) {
    if (w->put == model && w->revision == model->revision)
        return;
    w->batch->kernels->put_model(model, w->lanes, kt_lanes_first(w->batch->n.width));
    w->put = model;
    w->revision = model->revision;
}

/* Copies to each lane the numbers of its model. Returns one of the models if the models differ only in these numbers.
 * Otherwise the lanes get the numbers of the batch's own model, for the rates of positions, and the result is NULL. */
static const kt_model *put_models(kt_batch_work *w, const kt_model *const *own, size_t used) {
    const kt_batch *batch = w->batch;
    bool same = true, agree = true;
    if (!batch->kernels)
        return NULL;
    for (size_t i = 1; i < used; i++) {
        same = same && own[i] == own[0];
        agree = agree && kt_lanes_agree(own[0], own[i]);
    }
    if (same || !agree) {
        put_group_model(w, same ? own[0] : batch->model);
        return same ? own[0] : NULL;
    }
    w->put = NULL;
    for (size_t i = 0; i < batch->n.width; i++)
        batch->kernels->put_model(i < used ? own[i] : own[0], w->lanes, (kt_lane_mask)1 << i);
    return own[0];
}

kt_batch_group kt_batch_group_of(kt_batch_work *w, size_t group) {
    const kt_batch *batch = w->batch;
    const kt_batch_counts *n = &batch->n;
    const size_t first = group * n->width, left = n->states - first, used = left < n->width ? left : n->width;
    const double *y = batch->y + first * n->N;
    return (kt_batch_group){.first = first,
                            .model = put_models(w, batch->own + first, used),
                            .used = used,
                            .active = kt_lanes_first(used),
                            .q = y,
                            .v = y + n->width * n->nq,
                            .x = y + n->width * (n->nq + n->nv),
                            .tau = batch->tau + first * n->nv};
}

void kt_batch_fail(kt_batch_work *w, kt_batch_group *group, size_t lane, const kt_error *made, kt_batch_fault *fault) {
    const size_t state = group->first + lane;
    group->active &= ~((kt_lane_mask)1 << lane);
    w->batch->status[state] = (uint8_t)made->code;
    w->failed++;
    if (fault->status != KT_OK && fault->state < state)
        return;
    fault->state = state;
    fault->status = kt_error_set(fault->error, made->code,
                                 kt_where_format("state %lu%s%.*s", (unsigned long)state, made->where[0] ? ": " : "",
                                                 KT_WHERE_SIZE - 40, made->where)
                                     .text,
                                 "%s", made->message);
}

void kt_batch_take(kt_batch_work *w, const kt_batch_group *group, size_t lane) {
    const kt_batch_counts *n = &w->batch->n;
    kt_data_lend(w->batch->own[group->first + lane], w->data);
    kt_lane_take(group->q, n->width, lane, n->nq, w->one_q);
    kt_lane_take(group->v, n->width, lane, n->nv, w->one_v);
    kt_lane_take(group->tau, n->width, lane, n->nv, w->one_tau);
    if (n->nx > 0)
        kt_lane_take(group->x, n->width, lane, n->nx, w->data->x);
}

/* Computes a lane with the call for one state. */
static void accelerate_alone(kt_batch_work *w, kt_batch_group *group, size_t lane, double t, kt_batch_fault *fault) {
    const kt_batch_counts *n = &w->batch->n;
    kt_error made;
    kt_batch_take(w, group, lane);
    w->alone_count++;
    const kt_status status = kt_acceleration_evaluate(w->batch->own[group->first + lane], w->data, t, w->one_q,
                                                      w->one_v, w->one_tau, NULL, w->one_a, &made);
    if (status == KT_OK)
        kt_lane_put(w->one_a, n->width, lane, n->nv, w->result);
    else
        kt_batch_fail(w, group, lane, &made, fault);
}

kt_lane_mask kt_lanes_accelerate(const kt_lane_kernels *kernels, const kt_model *model, const kt_lane_state *at,
                                 const kt_lane_work *work) {
    double *wrench = model->n.force_link > 0 ? work->wrench : NULL;
    kt_lane_state loaded = *at;
    if (model->n.effect == 0 && model->n.x == 0)
        return at->active & kernels->forward(model, work->lanes, at, wrench, work->a);
    loaded.tau = work->total;
    const kt_lane_mask done = kernels->effects(model, work->lanes, at, work->total, wrench);
    return done & kernels->forward(model, work->lanes, &loaded, wrench, work->a);
}

/* Fails the states in which an open contact touches (kt_acceleration_evaluate). */
static void reject_open_contacts(kt_batch_work *w, kt_batch_group *group, const double *t, kt_batch_fault *fault) {
    kt_error made;
    for (size_t lane = 0; lane < w->batch->n.width; lane++) {
        if (!kt_lane_is_in(group->active, lane))
            continue;
        kt_batch_take(w, group, lane);
        const kt_dynamic_state at = {.t = t[lane], .q = w->one_q, .v = w->one_v};
        if (kt_open_contacts_reject(w->batch->own[group->first + lane], w->data, &at, &made) != KT_OK)
            kt_batch_fail(w, group, lane, &made, fault);
    }
}

void kt_batch_accelerate(kt_batch_work *w, kt_batch_group *group, const double *t, kt_batch_fault *fault) {
    const kt_batch *batch = w->batch;
    if (batch->model->variants != NULL)
        reject_open_contacts(w, group, t, fault);
    const kt_lane_state at = {
        .t = t, .q = group->q, .v = group->v, .x = group->x, .tau = group->tau, .active = group->active};
    const kt_lane_work work = {.lanes = w->lanes, .total = w->total, .wrench = w->wrench, .a = w->result};
    kt_lane_mask done = 0;
    if (batch->kernels && group->model && kt_lanes_fit_model(group->model))
        done = kt_lanes_accelerate(batch->kernels, group->model, &at, &work);
    for (size_t lane = 0; lane < batch->n.width; lane++) {
        if (kt_lane_is_in(done, lane))
            w->in_lanes++;
        else if (kt_lane_is_in(group->active, lane))
            accelerate_alone(w, group, lane, t[lane], fault);
    }
}

/* Inverse dynamics of one lane by the functions for a single state, which report what is wrong. */
static void invert_alone(kt_batch_work *w, kt_batch_group *group, const double *a, size_t lane, kt_batch_fault *fault) {
    const kt_batch_counts *n = &w->batch->n;
    kt_error made;
    kt_batch_take(w, group, lane);
    kt_lane_take(a, n->width, lane, n->nv, w->one_a);
    w->alone_count++;
    const kt_status status = kt_dynamics_inverse(w->batch->own[group->first + lane], w->data, w->one_q, w->one_v,
                                                 w->one_a, NULL, w->one_tau, &made);
    if (status == KT_OK)
        kt_lane_put(w->one_tau, n->width, lane, n->nv, w->result);
    else
        kt_batch_fail(w, group, lane, &made, fault);
}

void kt_batch_invert(kt_batch_work *w, kt_batch_group *group, kt_batch_fault *fault) {
    const kt_batch *batch = w->batch;
    const double *a = batch->a + group->first * batch->n.nv;
    kt_lane_mask done = 0;
    if (batch->kernels && group->model)
        done = group->active & batch->kernels->inverse(group->model, w->lanes, group->q, group->v, a, NULL, w->result);
    for (size_t lane = 0; lane < group->used; lane++) {
        if (kt_lane_is_in(done, lane))
            w->in_lanes++;
        else
            invert_alone(w, group, a, lane, fault);
    }
}
