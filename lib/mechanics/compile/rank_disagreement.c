/* Constraint groups whose equations repeat each other except for the rounding of their data.
 *
 * Such a group closes only at the given position. The loops of such a group are corrected to the last digit, or
 * the group counts as closed up to a disagreement. Both only count if the mechanism then moves. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/levenberg_marquardt.h"
#include "assembly/rounding.h"
#include "compile/rank_samples.h"

#include <stdlib.h>
#include <string.h>

/* The factor by which motion may increase a disagreement that samples show. */
#define DISAGREEMENT_GROWTH 30.0

/* Whether a displacement of a group remains after the loops are closed again. The displacement is one that the
 * equations allow at the base, by a share of their units. Equations that repeat each other leave the motion. The
 * equations of a stretched linkage that is slightly out of reach allow the motion only to first order, so that closing
 * the loops reverses the displacement. */
static bool motion_stays(const kt_model *model, kt_data *data, size_t g, const double *base, kt_rank_samples *found) {
    static const double share = 0.03;
    const kt_reduction_kernels *kernels = model->group_kernels;
    const kt_group *group = &model->group[g];
    double *q = found->q + model->n.q, *allowed = data->delta, *step = data->scratch_v, *moved = data->moved_v;
    kt_violation violation;
    for (size_t sample = 0; sample < KT_RANK_SAMPLES; sample++) {
        memset(found->fraction, 0, model->n.group * sizeof *found->fraction);
        found->fraction[g] = 1.0;
        kt_rank_scatter(model, share, found->fraction, sample, allowed);
        if (!kernels->residuals(model, data, 0.0, base, NULL, NULL, &violation) ||
            !kernels->prepare(model, data, KT_ROWS_CLOSED, false))
            return false;
        for (size_t h = 0; h < model->n.group; h++) {
            const kt_group_work w = kt_group_matrices(model, data, h, KT_ROWS_CLOSED);
            memset(w.residual, 0, (size_t)w.k * sizeof *w.residual);
        }
        kt_aim_nearest(model, data, allowed);
        if (!kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, step))
            return false;
        double before = 0.0, after = 0.0;
        for (size_t i = 0; i < model->n.v; i++)
            allowed[i] -= step[i];
        memcpy(step, allowed, model->n.v * sizeof *step); /* the search overwrites delta */
        kt_position_add(model, base, step, q);
        memcpy(found->near, step, model->n.v * sizeof *step);
        (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_SAMPLE, q);
        if (!kt_rank_is_closed(model, data, g))
            return false;
        kt_position_subtract(model, q, base, moved);
        for (int i = 0; i < group->v_count; i++) {
            const int32_t v = model->group_v[group->v + i];
            const double unit = model->unit[group->v + i] * model->unit[group->v + i];
            before += found->near[v] * found->near[v] / unit;
            after += found->near[v] * moved[v] / unit;
        }
        if (before > 1e-6 * share * share && !(after >= 0.98 * before))
            return false;
    }
    return true;
}

/* Marks the groups that close neither in a sample nor from the given position. A group that closes from the given
 * position is only hard to sample, and its equations agree. */
static void mark_open_groups(kt_model *model, kt_data *data, kt_rank_samples *found) {
    model->disagreement = 0.0;
    memcpy(found->q, model->q0, model->n.q * sizeof *found->q);
    (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_STUBBORN, found->q);
    for (size_t g = 0; g < model->n.group; g++)
        found->open[g] = !found->sampled[g] && !kt_rank_is_closed(model, data, g);
}

/* The disagreement of the groups that no sample closes; 0 where one is larger than the tolerance. */
static double find_disagreement(kt_model *model, kt_data *data, kt_rank_samples *found) {
    double most = 0.0, *base = found->q;
    const bool *open = found->open;
    bool *seen = found->seen;
    memset(seen, 0, model->n.group * sizeof *seen);
    model->disagreement = model->rounding = model->tolerance;
    memcpy(base, model->q0, model->n.q * sizeof *base);
    for (size_t g = 0; g < model->n.group; g++)
        found->fraction[g] = 1.0;
    (void)kt_assemble_levenberg_marquardt(model, data, 0.0, NULL, KT_SEARCH_STUBBORN, base);
    for (size_t s = 0; s < KT_RANK_SAMPLES; s++) {
        kt_rank_take_sample(model, data, s < 3 ? 0.3 : s < 6 ? 0.15 : 0.1, s, found);
        for (size_t g = 0; g < model->n.group; g++)
            if (open[g] && kt_rank_is_closed(model, data, g)) {
                most = fmax(most, kt_group_store_disagreement(model, data, g));
                seen[g] = true;
            }
    }
    for (size_t g = 0; g < model->n.group; g++)
        most = open[g] && !seen[g] ? 0.0 : most;
    return most;
}

static void forget_disagreement(kt_model *model, size_t g) {
    const kt_group *group = &model->group[g];
    for (int i = 0; i < group->loop_count; i++) {
        kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        loop->disagreement[0] = loop->disagreement[1] = 0.0;
    }
}

/* Deletes the results of samples for a group. */
static void forget_samples(kt_model *model, const kt_data *data, size_t g, kt_rank_samples *found) {
    found->sampled[g] = false;
    found->rank[KT_ROWS_COUNT * g] = found->rank[KT_ROWS_COUNT * g + 1] = 0;
    model->group[g].usual[0] = model->group[g].usual[1] = 0.0;
    kt_rank_coarsen(model, data, g);
}

/* Whether a group closes in a sample, and moves from a position. */
static bool group_moves(kt_model *model, kt_data *data, size_t g, const double *base, kt_rank_samples *found) {
    return found->sampled[g] && motion_stays(model, data, g, base, found);
}

/* Whether a group without a drive closes only at isolated positions, like a group whose equations repeat each other
 * except for rounding. */
static bool is_locked(const kt_model *model, size_t g, const kt_rank_samples *found) {
    const kt_group *group = &model->group[g];
    for (int i = 0; i < group->loop_count; i++)
        if (kt_loop_is_driven(&model->loop[model->group_loop[group->loop + i]]))
            return false;
    return found->sampled[g] && found->rank[KT_ROWS_COUNT * g + KT_ROWS_CLOSED] == group->v_count &&
           group->count[KT_ROWS_CLOSED] == group->count[KT_ROWS_ALL];
}

/* Corrects the ends of a group's loops so that their equations repeat each other to the last digit. Sets *done if
 * such corrections are found and the mechanism then moves. The motion is tried at a sample, since bars may lie in
 * line at the given position. Returns KT_OK or KT_ERROR_MEMORY. */
static kt_status undo_rounding(kt_model *model, kt_data *data, size_t g, kt_rank_samples *found, bool *done) {
    const double rounding = model->rounding;
    kt_pose *given = malloc(2 * model->n.loop * sizeof *given);
    *done = false;
    if (!given)
        return KT_ERROR_MEMORY;
    for (size_t i = 0; i < 2 * model->n.loop; i++)
        given[i] = model->loop[i / 2].frame[i % 2];
    memcpy(found->q, model->q0, model->n.q * sizeof *found->q);
    const kt_status status = kt_group_repair(model, data, g, found->q, given, done);
    model->rounding = rounding;
    if (*done) {
        forget_samples(model, data, g, found);
        kt_rank_find(model, data, found);
        *done = group_moves(model, data, g, found->q + 2 * model->n.q, found);
        if (!*done) {
            kt_loops_place_ends(model, given);
            forget_samples(model, data, g, found);
            kt_rank_find(model, data, found);
        }
    }
    if (!*done)
        forget_disagreement(model, g);
    free(given);
    return status;
}

/* Treats groups that close at no position, except for a disagreement below the tolerance: their equations repeat each
 * other, but their data are rounded. If no correction of the data is found, the groups count as closed up to the
 * disagreement that motion may cause. Directions that are not larger than this do not count. Returns KT_OK or
 * KT_ERROR_MEMORY. */
kt_status kt_rank_accept_disagreement(kt_model *model, kt_data *data, kt_rank_samples *found) {
    const double rounding = model->rounding;
    kt_status status = KT_OK;
    bool any = false;
    mark_open_groups(model, data, found);
    for (size_t g = 0; status == KT_OK && g < model->n.group && model->tolerance > 0.0; g++) {
        bool undone = false;
        if (!found->sampled[g] || is_locked(model, g, found))
            status = undo_rounding(model, data, g, found, &undone);
        found->open[g] = !undone && found->open[g];
        any |= found->open[g];
    }
    if (status != KT_OK || !any)
        return status;
    const double most = find_disagreement(model, data, found);
    bool accepted = most > 0.0;
    model->disagreement = DISAGREEMENT_GROWTH * most;
    model->rounding = fmax(rounding, model->disagreement);
    for (size_t g = 0; g < model->n.group && accepted; g++)
        if (found->open[g])
            kt_rank_coarsen(model, data, g);
    if (accepted)
        kt_rank_find(model, data, found);
    for (size_t g = 0; g < model->n.group && accepted; g++)
        accepted = !found->open[g] || group_moves(model, data, g, found->q, found);
    if (accepted)
        return KT_OK;
    model->disagreement = 0.0;
    model->rounding = rounding;
    for (size_t g = 0; g < model->n.group; g++)
        if (found->open[g]) {
            forget_disagreement(model, g);
            forget_samples(model, data, g, found);
        }
    return KT_OK;
}
