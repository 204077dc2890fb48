/* Accelerations and least steps of several states of a mechanism with loops at once (lane_groups.h). */
#include "reduction/lane_groups.h"

#include "base/copy.h"
#include "constraint/planar_rows.h"
#include "constraint/spatial_rows.h"
#include "reduction/delassus.h"
#include "reduction/links.h"
#include "reduction/method.h"

static bool has_planar(const kt_model *model) { return model->sweep != KT_SWEEP_SPATIAL; }

/* The links 1 to end - 1 are treated as spatial ones. */
static size_t spatial_end(const kt_model *model) { return has_planar(model) ? model->n.spatial : model->n.link; }

static void fill_group(const kt_model *model, kt_data *data, size_t g, bool moving, const kt_lanes_at *at) {
    const bool in_plane = has_planar(model) && kt_group_is_planar(model, &model->group[g]);
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    if (kt_group_has_fronts(&model->group[g]))
        KT_KERNEL(kt_front_fill)(model, data, g, in_plane, moving, at->q, at->v, at->t);
    else if (in_plane)
        kt_planar_rows_fill(model, data, g, &w, moving, at->q, at->v, at->t);
    else
        kt_rows_fill(model, data, g, moving, at->q, at->v, at->t);
}

/* As kt_group_prepare: near a singular position the last direction is less than usual. */
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

/* Adds the violation of a group's velocities, and stores it in `right`. */
static void add_velocity_violation(const kt_model *model, kt_data *data, size_t g, const kt_real1 *v,
                                   kt_violation *violation) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    if (!kt_group_has_fronts(group)) {
        kt_group_velocity_residuals(model, group, &w, v, violation);
        return;
    }
    KT_KERNEL(kt_front_apply)(model, data, g, KT_ROWS_ALL, v, w.right, w.multiplier);
    kt_group_violation(&w, w.multiplier, violation);
}

void KT_KERNEL(kt_groups_accelerate)(const kt_model *model, kt_data *data, const kt_lanes_at *at, kt_real1 *a) {
    const size_t end = spatial_end(model);
    data->sound = kt_condition_true();
    if (has_planar(model))
        KT_KERNEL(kt_planar_links_motion)(model, data, at->q, at->v, at->external);
    if (end > 1)
        KT_KERNEL(kt_spatial_links_motion)(model, data, at->q, at->v, at->external, end);
    for (size_t g = 0; g < model->n.group; g++) {
        if (model->group[g].form == KT_FORM_PIN)
            continue;
        fill_group(model, data, g, true, at);
        data->sound &= factor_group(model, data, g, KT_ROWS_ALL);
    }
    if (end > 1)
        (void)KT_KERNEL(kt_spatial_links_accelerate)(model, data, at->tau, end, model->has_delassus, a);
    if (has_planar(model))
        (void)KT_KERNEL(kt_planar_links_accelerate)(model, data, at->v, at->tau, false, a);
}

kt_condition KT_KERNEL(kt_groups_residuals)(const kt_model *model, kt_data *data, const kt_lanes_at *at,
                                            kt_violation *violation) {
    const size_t end = spatial_end(model);
    *violation = (kt_violation){.speed = kt_real1_splat(KT_SPEED_LEAST)};
    if (has_planar(model))
        KT_KERNEL(kt_planar_links_pose)(model, data, at->q);
    if (end > 1)
        KT_KERNEL(kt_spatial_links_pose)(model, data, at->q, end);
    for (size_t g = 0; g < model->n.group; g++) {
        fill_group(model, data, g, false, at);
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        kt_group_position_residuals(&w, violation);
        add_velocity_violation(model, data, g, at->v, violation);
    }
    return kt_is_finite1(violation->position + violation->velocity);
}

void KT_KERNEL(kt_groups_velocity_violation)(const kt_model *model, kt_data *data, const kt_real1 *v,
                                             kt_violation *violation) {
    violation->velocity = violation->slip = kt_real1_splat(0.0);
    violation->speed = kt_real1_splat(KT_SPEED_LEAST);
    for (size_t g = 0; g < model->n.group; g++)
        add_velocity_violation(model, data, g, v, violation);
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
    if (metric != KT_METRIC_MASS) {
        least_in_coordinates(model, data);
        return data->sound;
    }
    const size_t end = spatial_end(model);
    if (has_planar(model))
        KT_KERNEL(kt_planar_links_move)(model, data, data->rest);
    if (end > 1) {
        KT_KERNEL(kt_spatial_links_move)(model, data, data->rest, end);
        KT_KERNEL(kt_spatial_links_clear)(model, data, end);
        data->motion[0].linear = kt_zero3();
        (void)KT_KERNEL(kt_spatial_links_accelerate)(model, data, data->rest, end, model->has_delassus, data->delta);
    }
    if (has_planar(model))
        (void)KT_KERNEL(kt_planar_links_accelerate)(model, data, NULL, data->rest, true, data->delta);
    return data->sound;
}
