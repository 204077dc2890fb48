/* Accelerations and least steps of several states of a mechanism with loops at once (lane_groups.h). */
#include "reduction/lane_groups.h"

#include "base/copy.h"
#include "constraint/planar_rows.h"
#include "reduction/links.h"
#include "reduction/method.h"

static void fill_group(const kt_model *model, kt_data *data, size_t g, bool moving, const kt_real1 *q,
                       const kt_real1 *v) {
    kt_group_work w;
    kt_group_find(model, data, g, KT_ROWS_ALL, &w);
    kt_planar_rows_fill(model, data, g, &w, moving, q, v, 0.0);
}

/* As kt_group_factor: near a singular position the last direction is less than usual. */
static kt_condition factor_group(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    const kt_group *group = &model->group[g];
    const int rank = group->rank[rows];
    kt_group_work w;
    kt_group_find(model, data, g, rows, &w);
    const kt_condition full = KT_KERNEL(kt_qr_factor)(&w, rank);
    data->factored[g] = rows;
    return rank > 0 ? full & ~(kt_abs1(w.factor[(rank - 1) * (w.m + 1)]) < KT_NEAR_SINGULAR * group->usual[rows])
                    : full;
}

void KT_KERNEL(kt_groups_accelerate)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                     const kt_real1 *tau, const kt_external *external, kt_real1 *a) {
    data->sound = kt_condition_true();
    KT_KERNEL(kt_planar_links_motion)(model, data, q, v, external);
    for (size_t g = 0; g < model->n.group; g++) {
        if (model->group[g].form == KT_FORM_PIN)
            continue;
        fill_group(model, data, g, true, q, v);
        data->sound &= factor_group(model, data, g, KT_ROWS_ALL);
    }
    (void)KT_KERNEL(kt_planar_links_accelerate)(model, data, v, tau, false, a);
}

kt_condition KT_KERNEL(kt_groups_residuals)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                            kt_violation *violation) {
    *violation = (kt_violation){.speed = kt_real1_splat(KT_SPEED_LEAST)};
    KT_KERNEL(kt_planar_links_pose)(model, data, q);
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group_work w;
        fill_group(model, data, g, false, q, v);
        kt_group_find(model, data, g, KT_ROWS_ALL, &w);
        kt_group_position_residuals(&w, violation);
        kt_group_velocity_residuals(model, &model->group[g], &w, v, violation);
    }
    return kt_is_finite1(violation->position + violation->velocity);
}

void KT_KERNEL(kt_groups_velocity_violation)(const kt_model *model, kt_data *data, const kt_real1 *v,
                                             kt_violation *violation) {
    violation->velocity = violation->slip = kt_real1_splat(0.0);
    violation->speed = kt_real1_splat(KT_SPEED_LEAST);
    for (size_t g = 0; g < model->n.group; g++) {
        kt_group_work w;
        kt_group_find(model, data, g, KT_ROWS_ALL, &w);
        kt_group_velocity_residuals(model, &model->group[g], &w, v, violation);
    }
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
        kt_group_work w;
        kt_violation violation = {.speed = zero};
        kt_group_find(model, data, g, KT_ROWS_CLOSED, &w);
        kt_group_position_residuals(&w, &violation);
        for (int r = 0; r < w.k; r++)
            w.right[r] = kt_choose(violation.gap > goal, -w.residual[r], zero);
    }
}

static void least_in_coordinates(const kt_model *model, kt_data *data) {
    kt_clear(data->delta, model->n.v * sizeof *data->delta);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        kt_group_work w;
        kt_group_find(model, data, g, data->factored[g], &w);
        KT_KERNEL(kt_qr_particular)(&w, group->rank[data->factored[g]], w.right, w.free);
        for (int i = 0; i < w.m; i++)
            data->delta[model->group_v[group->v + i]] = w.free[i];
    }
}

kt_condition KT_KERNEL(kt_groups_step)(const kt_model *model, kt_data *data, kt_metric metric) {
    data->sound = kt_condition_true();
    if (metric != KT_METRIC_MASS) {
        least_in_coordinates(model, data);
        return data->sound;
    }
    KT_KERNEL(kt_planar_links_move)(model, data, data->rest);
    (void)KT_KERNEL(kt_planar_links_accelerate)(model, data, NULL, data->rest, true, data->delta);
    return data->sound;
}
