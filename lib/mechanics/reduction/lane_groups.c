/* Accelerations and least steps of several states of a mechanism with loops at once (lane_groups.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/lane_groups.h"

#include "base/copy.h"
#include "reduction/delassus.h"
#include "reduction/method.h"

#define KT_PLANAR (model->sweep != KT_SWEEP_SPATIAL)
#include "reduction/driver.h"

/* Factors a group as kt_group_prepare does. Near a singular position, the size of the last direction is smaller than
 * usual. */
static kt_condition factor_group(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    const kt_group *group = &model->group[g];
    const int rank = group->rank[rows];
    if (group->form == KT_FORM_DELASSUS)
        return KT_KERNEL(kt_delassus_prepare)(model, data, g, rows);
    const kt_group_work w = kt_group_matrices(model, data, g, rows);
    const kt_condition full = KT_KERNEL(kt_qr_factor)(&w, rank);
    data->factored[g] = rows;
    return rank > 0 ? full & ~(kt_abs1(w.factor[(rank - 1) * (w.m + 1)]) < KT_NEAR_SINGULAR * group->usual[rows])
                    : full;
}

void KT_KERNEL(kt_groups_accelerate)(const kt_model *model, kt_data *data, const kt_lanes_at *at, kt_real1 *a) {
    const size_t end = kt_spatial_end(model);
    data->sound = kt_condition_true();
    kt_links_motion(model, data, at->q, at->v, at->external);
    for (size_t g = 0; g < model->n.group; g++) {
        if (model->group[g].form == KT_FORM_PIN)
            continue;
        kt_group_fill(model, data, g, true, at->q, at->v, at->t);
        data->sound &= factor_group(model, data, g, KT_ROWS_ALL);
    }
    if (end > 1)
        (void)KT_KERNEL(kt_spatial_links_accelerate)(model, data, at->tau, end, model->has_delassus, a);
    if (KT_PLANAR)
        (void)KT_KERNEL(kt_planar_links_accelerate)(model, data, at->v, at->tau, false, a);
}

kt_condition KT_KERNEL(kt_groups_residuals)(const kt_model *model, kt_data *data, const kt_lanes_at *at,
                                            kt_violation *violation) {
    return residuals(model, data, at->t, at->q, at->v, NULL, violation);
}

void KT_KERNEL(kt_groups_velocity_violation)(const kt_model *model, kt_data *data, const kt_real1 *v,
                                             kt_violation *violation) {
    violation->velocity = violation->slip = kt_real1_splat(0.0);
    violation->speed = kt_real1_splat(KT_SPEED_LEAST);
    for (size_t g = 0; g < model->n.group; g++)
        kt_group_add_violation(model, data, g, v, violation);
}

kt_condition KT_KERNEL(kt_groups_prepare)(const kt_model *model, kt_data *data, kt_rows rows) {
    kt_condition regular = kt_condition_true();
    for (size_t g = 0; g < model->n.group; g++)
        regular &= factor_group(model, data, g, rows);
    return regular;
}

void KT_KERNEL(kt_groups_aim)(const kt_model *model, kt_data *data, double goal) {
    const kt_real1 zero = kt_real1_splat(0.0);
    for (size_t g = 0; g < model->n.group; g++) {
        kt_violation violation = {.speed = zero};
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_CLOSED);
        kt_group_position_residuals(&w, &violation);
        for (int r = 0; r < w.k; r++)
            w.right[r] = kt_choose(violation.gap > goal, -w.residual[r], zero);
    }
}

/* The least step that closes the groups, A x = right, in the metric of the coordinates. */
static void least_in_coordinates(const kt_model *model, kt_data *data) {
    kt_clear(data->delta, model->n.v * sizeof *data->delta);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (group->form == KT_FORM_DELASSUS) {
            KT_KERNEL(kt_delassus_least)(model, data, g, data->delta);
            continue;
        }
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        KT_KERNEL(kt_qr_particular)(&w, group->rank[data->factored[g]], w.right, w.free);
        for (int i = 0; i < w.m; i++)
            data->delta[model->group_v[group->v + i]] = w.free[i];
    }
}

kt_condition KT_KERNEL(kt_groups_step)(const kt_model *model, kt_data *data, kt_metric metric) {
    data->sound = kt_condition_true();
    if (metric != KT_METRIC_MASS)
        least_in_coordinates(model, data);
    else
        (void)kt_links_step_of_mass(model, data, data->rest, data->rest, data->delta);
    return data->sound;
}
