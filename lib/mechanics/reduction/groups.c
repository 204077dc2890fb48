/* The groups' equations in their forms (`kt_group_form`): their factors and their least steps. Since the functions use
 * only equations, they serve groups of spatial and of planar links. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/groups.h"

#include "reduction/delassus.h"
#include "reduction/front.h"
#include "reduction/front4.h"
#include "reduction/half_columns.h"
#include "reduction/spatial_group.h"

#include <assert.h>

int KT_KERNEL(kt_group_factor)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    const kt_group *group = &model->group[g];
    data->special_form[g] = KT_SPECIAL_FORM_NONE;
    if (group->has_fronts)
        return KT_KERNEL(kt_front_factor)(model, data, g, rows, regular);
    const kt_reduction_kind *kind = model->reduction;
    const double small = KT_NEAR_SINGULAR * group->usual[rows];
    kt_group_work w;
    kt_group_find(model, data, g, rows, &w);
    int rank = kind->factor(&w, group->rank[rows]);
    data->factored[g] = rows;
    data->last[g] = rank > 0 ? kind->size(&w, rank - 1) : 0.0;
    data->near[g] = rank >= 0 && (rank < group->rank[rows] || data->last[g] < small);
    while (regular && rank > 0 && kind->size(&w, rank - 1) < small)
        rank--;
    data->rank[g] = rank < 0 ? 0 : rank;
    return rank;
}

bool KT_KERNEL(kt_group_prepare)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular,
                                 bool delassus, bool front4, bool range) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert((unsigned)rows < KT_ROWS_COUNT);
    const kt_group *group = &model->group[g];
    bool special = false;
    if (delassus && group->form == KT_FORM_DELASSUS) {
        special = KT_KERNEL(kt_delassus_prepare)(model, data, g, rows);
    } else if (range && group->form == KT_FORM_DENSE && group->ranges) {
        special = KT_KERNEL(kt_half_prepare)(model, data, g);
    } else if (front4 && group->form == KT_FORM_FRONT4 && group->count[rows] == group->count[KT_ROWS_ALL] &&
               !memchr(data->front_fixed + group->v, 1, (size_t)group->v_count)) {
        /* front4.h supports no coordinates that count as constants */
        special = true;
        data->factored[g] = rows;
        data->near[g] = false;
        data->rank[g] = group->rank[rows];
    }
    data->special_form[g] = !special ? KT_SPECIAL_FORM_NONE : regular ? KT_SPECIAL_FORM_REGULAR : KT_SPECIAL_FORM_WHOLE;
    return special || KT_KERNEL(kt_group_factor)(model, data, g, rows, regular) >= 0;
}

bool KT_KERNEL(kt_groups_factor)(const kt_model *model, kt_data *data, kt_rows rows, bool regular) {
    assert(kt_data_serve(model, data));
    bool fine = true;
    for (size_t g = 0; g < model->n.group; g++)
        fine &= KT_KERNEL(kt_group_factor)(model, data, g, rows, regular) >= 0;
    return fine;
}

bool KT_KERNEL(kt_groups_refactor)(const kt_model *model, kt_data *data) {
    assert(kt_data_serve(model, data));
    bool some = false;
    for (size_t g = 0; g < model->n.group; g++) {
        if (!data->special_form[g])
            continue;
        some = true;
        if (KT_KERNEL(kt_group_factor)(model, data, g, data->factored[g],
                                       data->special_form[g] == KT_SPECIAL_FORM_REGULAR) < 0)
            return false;
    }
    return some;
}

bool KT_KERNEL(kt_groups_least_step)(const kt_model *model, kt_data *data, double *step) {
    assert(kt_data_serve(model, data) && step != model->zero);
    const kt_reduction_kind *kind = model->reduction;
    memset(step, 0, model->n.v * sizeof *step);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        const kt_group *group = &model->group[g];
        if (data->special_form[g] && group->form == KT_FORM_DELASSUS) {
            KT_KERNEL(kt_delassus_least)(model, data, g, step);
            continue;
        }
        if (data->special_form[g]) { /* if front4.h finds no step, the general method does */
            if (KT_KERNEL(kt_front4_solve)(model, data, g, NULL, step))
                continue;
            (void)KT_KERNEL(kt_group_factor)(model, data, g, data->factored[g],
                                             data->special_form[g] == KT_SPECIAL_FORM_REGULAR);
        }
        if (group->has_fronts) {
            const kt_front_aim aim = {.kind = KT_FRONT_COORDINATES};
            if (!KT_KERNEL(kt_front_reduce)(model, data, g, &aim, NULL))
                return false;
            KT_KERNEL(kt_front_respond)(model, data, g, NULL, step);
            continue;
        }
        kind->particular(&w, data->rank[g], w.right, w.free);
        if ((!kind->least || group->balanced) && !kt_group_make_least(kind, &w, data->rank[g]))
            return false;
        for (int i = 0; i < w.m; i++)
            step[model->group_v[group->v + i]] = w.free[i];
    }
    return true;
}

void KT_KERNEL(kt_groups_multipliers_of)(const kt_model *model, kt_data *data, const double *force) {
    assert(kt_data_serve(model, data));
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, data->factored[g]);
        double *need = group->has_fronts ? kt_front_forces(&w) : kt_group_forces(&w);
        for (int i = 0; i < w.m; i++)
            need[i] = force[model->group_v[group->v + i]];
        if (group->has_fronts)
            KT_KERNEL(kt_front_multipliers_of)(model, data, g, w.multiplier);
        else
            model->reduction->multipliers(&w, data->rank[g], need, w.multiplier);
    }
}

/* Prepares damped steps of a group: computes the factors that do not depend on the damping. Returns the sum of the
 * squares of the equations' entries over their scales. The form of Delassus does so if the equations are few, otherwise
 * the fronts do; data->special_form tells kt_damped_solve which. */
double KT_KERNEL(kt_damped_measure)(const kt_model *model, kt_data *data, size_t g, kt_rows rows) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    double size = 0.0;
    const bool special =
        model->group[g].damped_form == KT_FORM_DELASSUS && KT_KERNEL(kt_delassus_measure)(model, data, g, rows, &size);
    data->special_form[g] = special ? KT_SPECIAL_FORM_WHOLE : KT_SPECIAL_FORM_NONE;
    return special ? size : KT_KERNEL(kt_front_measure)(model, data, g, rows);
}

bool KT_KERNEL(kt_damped_solve)(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,
                                double *step) {
    assert(g < model->n.group && damping >= 0.0);
    if (data->special_form[g])
        return KT_KERNEL(kt_delassus_damp)(model, data, g, gap, damping, step);
    const kt_front_aim aim = {.kind = KT_FRONT_DAMPED, .gap = gap, .damping = damping};
    if (!KT_KERNEL(kt_front_reduce)(model, data, g, &aim, NULL))
        return false;
    KT_KERNEL(kt_front_respond)(model, data, g, NULL, step);
    return true;
}
