/* At a dead point one direction of a group is lost, and the drives prescribe a rate along it. No velocities satisfy the
 * equations at a dead point. On the way to a dead point, velocities grow like 1 / sqrt(t* - t). Finally rounding errors
 * let a step jump to positions at which the drives move the mechanism back again.
 *
 * If a motion passes through a singular position instead, its velocities stay finite. The prescribed rate along the
 * lost direction vanishes with the size of that direction. Therefore, near the position (KT_DEAD), the rates of the
 * drives are compared with the rates that the other directions alone can follow. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/dead_point.h"

#include <string.h>

/* Whether the rates of the drives of a group leave a remainder `missed` that is not small relative to the rates. */
static bool is_dead(const kt_group_work *w, const double *missed) {
    double most = 0.0, rate = 0.0;
    for (int r = 0; r < w->k; r++) {
        most = fmax(most, fabs(missed[r]) / w->scale[r]);
        rate = fmax(rate, fabs(w->rate[r]) / w->scale[r]);
    }
    return most > KT_DEAD_FRACTION * rate;
}

/* Whether a direction of a group is nearly lost, as last factored with all directions counted. Groups with only
 * holonomic equations are not tested, because a search for later positions finds the end of their motion
 * (simulation/fail.c). */
static bool group_direction_is_lost(const kt_model *model, const kt_data *data, size_t g) {
    const kt_group *group = &model->group[g];
    return group->count[KT_ROWS_ALL] > group->count[KT_ROWS_CLOSED] && data->near[g] &&
           (data->rank[g] < group->rank[KT_ROWS_ALL] || data->last[g] < KT_DEAD * group->usual[KT_ROWS_ALL]);
}

bool kt_is_dead_point(const kt_model *model, kt_data *data) {
    const kt_reduction_kernels *kernels = model->group_kernels;
    kt_violation violation;
    bool lost = false, dead = false;
    if (!kernels->factor(model, data, KT_ROWS_ALL, false))
        return false;
    for (size_t g = 0; g < model->n.group; g++)
        lost |= data->lost[g] = group_direction_is_lost(model, data, g);
    if (!lost || !kernels->factor(model, data, KT_ROWS_ALL, true))
        return false;
    memset(data->delta, 0, model->n.v * sizeof *data->delta);
    kt_velocity_violation(model, data, data->delta, &violation);
    if (!kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, data->delta))
        return false;
    kt_velocity_violation(model, data, data->delta, &violation);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        const bool here = data->lost[g] && is_dead(&w, w.right);
        for (int r = 0; r < w.k && !here; r++)
            w.right[r] = 0.0;
        dead |= here;
    }
    return dead;
}
