/* Violations of the equations of all groups, and the distance of the groups from a singular position. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/project.h"
#include "reduction/kernel.h"

#include <assert.h>
#include <math.h>

bool kt_is_near_singular(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->near[g])
            return true;
    return false;
}

double kt_smallest_direction(const kt_model *model, const kt_data *data, kt_rows rows) {
    double least = 1.0;
    for (size_t g = 0; g < model->n.group; g++) {
        const bool lost = data->rank[g] < model->group[g].rank[rows];
        if (data->near[g])
            least = fmin(least, lost ? 0.0 : data->last[g] / model->group[g].usual[rows]);
    }
    return least;
}

void kt_velocity_violation(const kt_model *model, kt_data *data, const double *v, kt_violation *violation) {
    assert(kt_data_serve(model, data));
    violation->velocity = violation->slip = 0.0;
    violation->speed = KT_SPEED_LEAST;
    for (size_t g = 0; g < model->n.group; g++)
        model->group_kernels->violate(model, data, g, v, violation);
}

void kt_residuals_to_right_hand_side(const kt_model *model, const kt_data *data, double goal) {
    assert(kt_data_serve(model, data) && goal >= 0.0);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_CLOSED);
        kt_violation violation = kt_violation_none;
        kt_group_position_residuals(&w, &violation);
        for (int r = 0; r < w.k; r++) /* closed groups do not move, even if others must */
            w.right[r] = violation.gap > goal ? -w.residual[r] : 0.0;
    }
}
