/* Dynamics and closure of mechanisms with loops, in space and in the plane. They are the recursion over links
 * (links.h), in which each constraint group is one step (groups.h).
 *
 * This file is compiled twice. With KT_PLANAR it yields the kernels for models with planar links (planar_driver.c).
 * Otherwise it yields those that treat all links as spatial (driver.c). Reactions have components out of the plane;
 * they are left to the spatial kernels (reaction.c). */
#ifndef KT_PLANAR
#error "KT_PLANAR must be true or false"
#endif

#include "constraint/loop_wrenches.h"
#include "reduction/driver_parts.h"
#include "reduction/groups.h"
#include "reduction/half_columns.h"
#include "reduction/kernel.h"
#include "reduction/planar_group.h"
#include "reduction/spatial_group.h"

/* Completes the motion of links whose poses and velocities are there (kt_data.posed). */
KT_INLINE void complete_motion(const kt_model *model, kt_data *data, const kt_dynamic_state *at) {
    data->posed = false;
    data->motion[0].linear = -model->gravity;
    KT_KERNEL(kt_spatial_links_clear)(model, data, model->n.link);
    if (at->external)
        kt_external_set(model, data, at->external);
}

KT_INLINE void fill_group(const kt_model *model, kt_data *data, size_t g, bool moving, const double *q, const double *v,
                          double t) {
    if (moving && kt_group_is_locked(model, &model->group[g]) &&
        !model->loop[model->group_loop[model->group[g].loop]].form) {
        kt_rows_fill_one(model, data, g, q, t);
        return;
    }
    kt_group_fill(model, data, g, KT_PLANAR, moving, q, v, t);
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

/* With `special`, four kinds of groups have solvers of their own. In the plane, groups of one pin are solved in closed
 * form, and fronts of four parameters by front4.h. Groups of few equations are solved by delassus.h. Those of closed
 * contacts and stops are solved by half_columns.h. */
KT_INLINE size_t try_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, bool regular,
                             bool special, double *a) {
    const size_t end = kt_spatial_end(model, KT_PLANAR);
    size_t failed = 0;
    if (KT_PLANAR || !data->posed)
        kt_links_motion(model, data, KT_PLANAR, at->q, at->v, at->external);
    else
        complete_motion(model, data, at);
    for (size_t g = 0; g < model->n.group; g++) {
        if (KT_PLANAR && special && model->group[g].form == KT_FORM_PIN)
            continue;
        fill_group(model, data, g, true, at->q, at->v, at->t);
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

KT_INLINE bool residuals(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                         const bool *held, kt_violation *violation) {
    *violation = kt_violation_none;
    kt_links_pose(model, data, KT_PLANAR, q);
    for (size_t g = 0; g < model->n.group; g++) {
        fill_group(model, data, g, false, q, v, t);
        KT_KERNEL(kt_group_residuals)(model, data, g, v, held, violation);
    }
    return isfinite(violation->position + violation->velocity);
}

KT_INLINE void fill(const kt_model *model, kt_data *data, double t, const double *q, const double *v) {
    if (KT_PLANAR) {
        kt_links_motion(model, data, KT_PLANAR, q, v, NULL);
    } else {
        kt_links_pose(model, data, KT_PLANAR, q);
        KT_KERNEL(kt_spatial_links_move)(model, data, v, model->n.link);
    }
    for (size_t g = 0; g < model->n.group; g++)
        fill_group(model, data, g, true, q, v, t);
}

/* Fronts of four parameters do not support coordinates that count as constants. */
KT_INLINE bool has_fixed(const kt_data *data, const kt_group *group) {
    return group->form == KT_FORM_FRONT4 && memchr(data->front_fixed + group->v, 1, (size_t)group->v_count);
}

KT_INLINE bool prepare(const kt_model *model, kt_data *data, kt_rows rows, bool regular) {
    bool fine = true;
    for (size_t g = 0; g < model->n.group; g++)
        fine &= KT_KERNEL(kt_group_prepare)(model, data, g, rows, regular, true,
                                            KT_PLANAR && !has_fixed(data, &model->group[g]), false);
    return fine;
}

KT_INLINE bool least_step(const kt_model *model, kt_data *data, kt_metric metric, const double *force, double *step) {
    if (metric != KT_METRIC_MASS)
        return KT_KERNEL(kt_groups_least_step)(model, data, step);
    while (!kt_links_step_of_mass(model, data, KT_PLANAR, model->zero, force, step))
        if (!KT_KERNEL(kt_groups_refactor)(model, data))
            return false;
    return true;
}

/* ---- kernels ----------------------------------------------------------------------------------------------------- */

#define KT_DRIVER_KERNELS                                                                                              \
    .forward = forward, .residuals = residuals, .fill = fill, .prepare = prepare, .least_step = least_step,            \
    .violate = kt_group_add_violation, .apply = KT_KERNEL(kt_front_apply), .measure = KT_KERNEL(kt_damped_measure),    \
    .damp = KT_KERNEL(kt_damped_solve), .nullspace = KT_KERNEL(kt_front_nullspace),                                    \
    .factor = KT_KERNEL(kt_groups_factor)
