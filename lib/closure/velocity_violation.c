/* The violations of velocity equations, by the entries of A or, in a group with fronts, by its kernel. */
#include "closure/project.h"

void kt_group_velocity_violation(const kt_model *model, kt_data *data, size_t g, const double *v,
                                 kt_violation *violation) {
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    if (!kt_group_has_fronts(&model->group[g])) {
        kt_group_velocity_residuals(model, &model->group[g], &w, v, violation);
        return;
    }
    kt_reduction_kernels_of(model)->apply(model, data, g, KT_ROWS_ALL, v, w.right, w.multiplier);
    kt_group_violation(&w, w.multiplier, violation);
}

void kt_velocity_violation(const kt_model *model, kt_data *data, const double *v, kt_violation *violation) {
    violation->velocity = violation->slip = 0.0;
    violation->speed = KT_SPEED_LEAST;
    for (size_t g = 0; g < model->n.group; g++)
        kt_group_velocity_violation(model, data, g, v, violation);
}
