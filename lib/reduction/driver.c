/* The driver that treats all links as spatial ones. It also computes the reactions of loops for all models. */
#define KT_PLANAR false
#include "reduction/driver.h"
#include "reduction/half_columns.h"

/* A' lambda = M x + F' A - (tau - h) */
static void multipliers(const kt_model *model, kt_data *data, const double *v, const double *a) {
    KT_KERNEL(kt_spatial_links_move)(model, data, v, model->n.link);
    data->motion[0].linear = -model->gravity;
    for (size_t i = 1; i < model->n.link; i++)
        kt_link_acceleration(&model->link[i], &data->motion[model->link[i].parent], a, &data->motion[i]);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        const kt_group *group = &model->group[g];
        const kt_link_motion *p = &data->motion[group->parent];
        const bool locked = data->special_form[g] && kt_group_is_locked(model, group);
        if (data->special_form[g] && !locked)
            continue;
        if (kt_group_has_fronts(group)) {
            KT_KERNEL(kt_front_multipliers)(model, data, g, a, w.multiplier);
            continue;
        }
        double *x = kt_group_accelerations(&w), *need = kt_group_forces(&w);
        for (int i = 0; i < w.m; i++)
            x[i] = a[model->group_v[group->v + i]];
        kt_dense_apply(w.mass, w.m, w.m, x, need);
        for (int i = 0; i < w.m; i++) {
            need[i] -= w.bias[i];
            for (int c = 0; c < 3 && group->parent; c++)
                need[i] += w.coupling[6 * (size_t)i + (size_t)c] * p->alpha[c] +
                           w.coupling[6 * (size_t)i + 3 + (size_t)c] * p->linear[c];
        }
        if (locked)
            w.multiplier[0] = need[0] / w.a[0];
        else
            model->reduction->multipliers(&w, data->rank[g], need, w.multiplier);
    }
}

static void basis(const kt_model *model, kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        if (!kt_group_has_fronts(&model->group[g]))
            model->reduction->basis(&w, data->rank[g]);
    }
}

const kt_reduction_kernels KT_KERNEL(kt_reduction_kernels) = {KT_DRIVER_KERNELS, .multipliers = multipliers,
                                                              .basis = basis, .react = KT_KERNEL(kt_react)};
