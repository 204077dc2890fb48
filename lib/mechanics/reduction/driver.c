/* The driver that treats all links as spatial links. The driver also computes the reactions of loops for all models. */
/* SPDX-License-Identifier: Apache-2.0 */
#define KT_PLANAR false
#include "reduction/driver.h"

/* A' lambda = M x + F' A - (tau - h) */
static void driver_multipliers(const kt_model *model, kt_data *data, const double *v, const double *a) {
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
        if (group->has_fronts) {
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

/* The null spaces of groups without fronts; those of other groups are computed column by column (`nullspace`). */
static void driver_basis(const kt_model *model, kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        if (!model->group[g].has_fronts)
            model->reduction->basis(&w, data->rank[g]);
    }
}

static void driver_pose(const kt_model *model, kt_data *data, const double *q) { kt_links_pose(model, data, q); }

static void driver_move(const kt_model *model, kt_data *data, const double *v) {
    KT_KERNEL(kt_spatial_links_move)(model, data, v, model->n.link);
}

/* phi = sum_k c_k q_k + f(q) + phi0(t), and its rate by v (NULL: without) */
static kt_relation_row relation_row(const kt_model *model, const kt_loop_record *loop, double t, const double *q,
                                    const double *v) {
    const bool has_formula = kt_has_formula_row(loop);
    kt_formula_row f = {.value = 0.0};
    double sum = 0.0, along = 0.0;
    if (has_formula)
        kt_formula_row_evaluate(model, loop, q, NULL, &f);
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &model->term[loop->term + k];
        sum += term->coefficient * q[model->link[term->link].q];
        along += v ? (term->coefficient + (has_formula ? f.by[k] : 0.0)) * v[model->link[term->link].v] : 0.0;
    }
    kt_relation_row row = kt_loop_relate(loop, model->number, sum, t);
    row.residual += f.value;
    row.rate += along;
    return row;
}

/* The first equation of a loop (kt_reduction_kernels.first_row). u is the velocity of the second end's point as seen
 * from the first end. */
static kt_relation_row first_row(const kt_model *model, const kt_data *data, size_t loop, double t, const double *q,
                                 const double *v) {
    const kt_loop_record *of = &model->loop[loop];
    if (of->term_count > 0)
        return relation_row(model, of, t, q, v);
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_real3 arm;
    if (v == NULL && kt_loop_is_over_ground(of))
        return (kt_relation_row){
            .residual = kt_dot3(kt_from3(of->frame[0].rotation.z), kt_point_over_ground(model, data, of, &arm))};
    for (int k = 0; k < 2; k++)
        kt_end_follow(model, data, of, k, v != NULL, v, &end[k]);
    if (of->counted)
        kt_ends_count(model, of, q, end);
    (void)kt_loop_evaluate(of, model->number, end, t, rows);
    if (of->equations != NULL)
        kt_stop_store_code(model, data, of, rows[0].rate);
    const kt_real3 d = end[1].point - end[0].point, w = end[1].omega - end[0].omega;
    const kt_real3 u = end[1].velocity - end[0].velocity - kt_cross3(end[0].omega, d);
    return (kt_relation_row){.residual = rows[0].holonomic ? rows[0].residual : 0.0,
                             .rate = kt_dot3(rows[0].moment, w) + kt_dot3(rows[0].force, u) + rows[0].rate};
}
#define KT_FIRST_ROW_KERNELS , .pose = driver_pose, .move = driver_move, .first_row = first_row

const kt_reduction_kernels KT_KERNEL(kt_reduction_kernels) = {KT_DRIVER_KERNELS, .multipliers = driver_multipliers,
                                                              .basis = driver_basis, .react = KT_KERNEL(kt_react),
                                                              .stress = KT_KERNEL(kt_stress_find) KT_FIRST_ROW_KERNELS};
