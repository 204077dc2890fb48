/* Dynamics and closure of mechanisms with loops, in space and in the plane. Both are a recursion over links (links.h),
 * in which each constraint group is one step (groups.h).
 *
 * This file is compiled three times. With KT_PLANAR it yields the kernels for models with planar links
 * (planar_driver.c). Without KT_PLANAR it yields the kernels that treat all links as spatial (driver.c). Reactions have
 * components out of the plane, so that only the spatial kernels compute them (reaction.c). In lanes, the file yields
 * only its first part, for models of either kind (lane_groups.c).
 *
 * Flags: `moving`, the right-hand sides b'' are wanted, otherwise velocities count as zero; `regular`, directions that
 * are about to be lost near a singular position are left out (kernel.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PLANAR
#error "KT_PLANAR must be true or false, or in lanes a property of `model`"
#endif

#include "constraint/loop_jacobian.h"
#include "constraint/planar_loop_jacobian.h"
#include "dynamics/aba_planar.h"
#include "reduction/front.h"
#include "reduction/links.h"

/* ---- all links, and the equations of a group --------------------------------------------------------------------- */

/* The links 1 to end - 1 are treated as spatial ones. */
KT_INLINE size_t kt_spatial_end(const kt_model *model) { return KT_PLANAR ? model->n.spatial : model->n.link; }

KT_INLINE void kt_links_pose(const kt_model *model, kt_data *data, const kt_real1 *q) {
    const size_t end = kt_spatial_end(model);
    if (KT_PLANAR)
        KT_KERNEL(kt_planar_links_pose)(model, data, q);
    if (end > 1)
        KT_KERNEL(kt_spatial_links_pose)(model, data, q, end);
}

KT_INLINE void kt_links_motion(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                               const kt_external *external) {
    const size_t end = kt_spatial_end(model);
    if (KT_PLANAR)
        kt_planar_articulated_motion(model, data, q, v, external);
    if (end > 1)
        KT_KERNEL(kt_spatial_links_motion)(model, data, q, v, external, end);
}

/* Minimises dv' M dv / 2 - force' dv with A dv = right. The conditions of this minimum are the equations of motion at
 * rest without gravity, with dv for the accelerations. Returns false if the inertia is singular. zero: nv zeros. */
KT_INLINE bool kt_links_step_of_mass(const kt_model *model, kt_data *data, const kt_real1 *zero, const kt_real1 *force,
                                     kt_real1 *step) {
    const size_t end = kt_spatial_end(model);
    if (KT_PLANAR)
        KT_KERNEL(kt_planar_links_move)(model, data, zero);
    if (end > 1) {
        KT_KERNEL(kt_spatial_links_move)(model, data, zero, end);
        KT_KERNEL(kt_spatial_links_clear)(model, data, end);
        data->motion[0].linear = kt_zero3();
        if (KT_KERNEL(kt_spatial_links_accelerate)(model, data, force, end, model->has_delassus, step))
            return false;
    }
    return !KT_PLANAR || KT_KERNEL(kt_planar_links_accelerate)(model, data, NULL, force, true, step) == 0;
}

KT_INLINE void kt_group_fill(const kt_model *model, kt_data *data, size_t g, bool moving, const kt_real1 *q,
                             const kt_real1 *v, kt_real1 t) {
    const kt_group *group = &model->group[g];
    const bool in_plane = KT_PLANAR && group->planar;
    if (group->has_fronts) {
        KT_KERNEL(kt_front_fill)(model, data, g, in_plane, moving, q, v, t);
    } else if (in_plane) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        kt_planar_rows_fill(model, data, g, &w, moving, q, v, t);
#ifndef KT_LANES
    } else if (moving && kt_group_is_locked(model, group) && !model->loop[model->group_loop[group->loop]].form) {
        kt_rows_fill_one(model, data, g, q, t);
#endif
    } else {
        kt_rows_fill(model, data, g, moving, q, v, t);
    }
}

/* Stores -(A v + phi_t) of a group in `right`, and adds the values to the violation. Dense groups have the entries of
 * A; fronts have the products A v and the largest terms of these sums (front.h). */
KT_INLINE void kt_group_add_violation(const kt_model *model, kt_data *data, size_t g, const kt_real1 *v,
                                      kt_violation *violation) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const int columns = group->has_fronts ? 0 : w.m;
    if (group->has_fronts)
        KT_KERNEL(kt_front_apply)(model, data, g, KT_ROWS_ALL, v, w.right, w.multiplier);
    for (int r = 0; r < w.k; r++) {
        kt_real1 sum = w.rate[r], largest = kt_abs1(w.rate[r]);
        if (group->has_fronts) {
            sum += w.right[r];
            largest = kt_most1(largest, w.multiplier[r]);
        }
        for (int i = 0; i < columns; i++) {
            const kt_real1 term = w.a[(size_t)r * (size_t)w.m + (size_t)i] * v[model->group_v[group->v + i]];
            sum += term;
            largest = kt_most1(largest, kt_abs1(term));
        }
        w.right[r] = -sum;
        violation->velocity =
            KT_CHOOSE((kt_abs1(sum) > violation->velocity) | (sum != sum), kt_abs1(sum), violation->velocity);
        violation->slip = kt_most1(violation->slip, kt_abs1(sum) / w.scale[r]);
        violation->speed = kt_most1(violation->speed, largest / w.scale[r]);
    }
}

#ifndef KT_LANES
/* After this call, the equations treat held coordinates as constants. */
KT_INLINE void hold_coordinates(const kt_model *model, kt_data *data, const kt_group *group, const kt_group_work *w,
                                const bool *held) {
    for (int i = 0; i < w->m && group->has_fronts; i++)
        data->front_fixed[group->v + i] = held[model->group_v[group->v + i]];
    for (int i = 0; i < w->m && !group->has_fronts; i++)
        for (int r = 0; r < w->k && held[model->group_v[group->v + i]]; r++)
            w->a[(size_t)r * (size_t)w->m + (size_t)i] = 0.0;
}
#endif

/* Fills the equations of all groups at (t, q), and `right` with -(A v + phi_t) unless v is NULL. Returns whether the
 * numbers are finite. In lanes no coordinates are held. */
KT_INLINE kt_condition residuals(const kt_model *model, kt_data *data, kt_real1 t, const kt_real1 *q, const kt_real1 *v,
                                 const bool *held, kt_violation *violation) {
    *violation = (kt_violation){.speed = kt_real1_splat(KT_SPEED_LEAST)};
    kt_links_pose(model, data, q);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        kt_group_fill(model, data, g, false, q, v, t);
        kt_group_position_residuals(&w, violation);
        if (v)
            kt_group_add_violation(model, data, g, v, violation);
#ifndef KT_LANES
        if (held)
            hold_coordinates(model, data, &model->group[g], &w, held);
#else
        (void)held;
#endif
    }
    return kt_is_finite1(violation->position + violation->velocity);
}

#ifndef KT_LANES

#include "constraint/loop_wrenches.h"
#include "constraint/self_stress.h"
#include "reduction/groups.h"
#include "reduction/half_columns.h"
#include "reduction/kernel.h"
#include "reduction/planar_group.h"
#include "reduction/spatial_group.h"

/* Completes the motion of links whose poses and velocities are computed already (kt_data.posed). */
KT_INLINE void complete_motion(const kt_model *model, kt_data *data, const kt_dynamic_state *at) {
    data->posed = false;
    data->motion[0].linear = -model->gravity;
    KT_KERNEL(kt_spatial_links_clear)(model, data, model->n.link);
    if (at->external)
        kt_external_set(model, data, at->external);
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

/* With `special`, four kinds of groups have solvers of their own. In the plane, groups of one pin are solved in closed
 * form, and fronts of four parameters by front4.h. delassus.h solves groups of few equations, and half_columns.h groups
 * of closed contacts and stops. */
KT_INLINE size_t try_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, bool regular,
                             bool special, double *a) {
    const size_t end = kt_spatial_end(model);
    size_t failed = 0;
    if (KT_PLANAR || !data->posed)
        kt_links_motion(model, data, at->q, at->v, at->external);
    else
        complete_motion(model, data, at);
    for (size_t g = 0; g < model->n.group; g++) {
        if (KT_PLANAR && special && model->group[g].form == KT_FORM_PIN)
            continue;
        kt_group_fill(model, data, g, true, at->q, at->v, at->t);
        if (!KT_KERNEL(kt_group_prepare)(model, data, g, KT_ROWS_ALL, regular, special, KT_PLANAR && special, special))
            failed = (size_t)model->group_link[model->group[g].link];
    }
    if (!failed && end > 1)
        failed = KT_KERNEL(kt_spatial_links_accelerate)(model, data, at->tau, end, special && model->has_delassus, a);
    if (!failed && KT_PLANAR)
        failed = KT_KERNEL(kt_planar_links_accelerate)(model, data, special ? at->v : NULL, at->tau, false, a);
    return failed;
}

/* If one of the special forms fails for any reason, the general method decides. */
KT_INLINE size_t forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, bool regular, double *a) {
    if (!regular && (KT_PLANAR || model->has_delassus) && try_forward(model, data, at, false, true, a) == 0)
        return 0;
    return try_forward(model, data, at, regular, false, a);
}

/* ---- closure ----------------------------------------------------------------------------------------------------- */

KT_INLINE void follow(const kt_model *model, kt_data *data, const double *q, const double *v) {
    if (KT_PLANAR) {
        kt_links_motion(model, data, q, v, NULL);
    } else {
        kt_links_pose(model, data, q);
        KT_KERNEL(kt_spatial_links_move)(model, data, v, model->n.link);
    }
}

/* The equations of a single loop, with right-hand sides b'', into the slots of its group's matrices. */
KT_INLINE void fill_loop(const kt_model *model, const kt_data *data, const kt_dynamic_state *at, int index,
                         const int32_t *slot, const kt_group_work *w) {
    const kt_loop_record *loop = &model->loop[index];
    if (KT_PLANAR && model->group[loop->group].planar) {
        const kt_loop_in_plane x = {loop, &model->planar_loop[index], slot, at->q};
        kt_planar_rows_loop(model, data, w, &x, true, at->v, at->t);
    } else {
        kt_rows_loop(model, data, w, loop, slot, at->q, at->v, at->t);
    }
}

KT_INLINE void fill(const kt_model *model, kt_data *data, double t, const double *q, const double *v) {
    follow(model, data, q, v);
    for (size_t g = 0; g < model->n.group; g++)
        kt_group_fill(model, data, g, true, q, v, t);
}

KT_INLINE bool prepare(const kt_model *model, kt_data *data, kt_rows rows, bool regular) {
    bool fine = true;
    for (size_t g = 0; g < model->n.group; g++)
        fine &= KT_KERNEL(kt_group_prepare)(model, data, g, rows, regular, true, KT_PLANAR, false);
    return fine;
}

KT_INLINE bool least_step(const kt_model *model, kt_data *data, kt_metric metric, const double *force, double *step) {
    if (metric != KT_METRIC_MASS)
        return KT_KERNEL(kt_groups_least_step)(model, data, step);
    while (!kt_links_step_of_mass(model, data, model->zero, force, step))
        if (!KT_KERNEL(kt_groups_refactor)(model, data))
            return false;
    return true;
}

/* ---- kernels ----------------------------------------------------------------------------------------------------- */

#define KT_DRIVER_KERNELS                                                                                              \
    .forward = forward, .residuals = residuals, .fill = fill, .follow = follow, .fill_loop = fill_loop,                \
    .prepare = prepare, .least_step = least_step, .violate = kt_group_add_violation,                                   \
    .apply = KT_KERNEL(kt_front_apply), .measure = KT_KERNEL(kt_damped_measure), .damp = KT_KERNEL(kt_damped_solve),   \
    .nullspace = KT_KERNEL(kt_front_nullspace), .factor = KT_KERNEL(kt_groups_factor)

#endif
