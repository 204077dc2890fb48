/* The parts of a driver that serve one state (driver.h) and several states (lane_groups.c): motions of all links, and
 * the equations of a group. With `planar`, planar links are computed in their planes. Otherwise all links are treated
 * as spatial ones. */
#ifndef KT_REDUCTION_DRIVER_PARTS_H
#define KT_REDUCTION_DRIVER_PARTS_H

#include "constraint/planar_rows.h"
#include "constraint/spatial_rows.h"
#include "dynamics/aba_planar.h"
#include "reduction/front.h"
#include "reduction/links.h"

/* The links 1 to end - 1 are treated as spatial ones. */
KT_INLINE size_t kt_spatial_end(const kt_model *model, bool planar) {
    return planar ? model->n.spatial : model->n.link;
}

KT_INLINE void kt_links_pose(const kt_model *model, kt_data *data, bool planar, const kt_real1 *q) {
    const size_t end = kt_spatial_end(model, planar);
    if (planar)
        KT_KERNEL(kt_planar_links_pose)(model, data, q);
    if (end > 1)
        KT_KERNEL(kt_spatial_links_pose)(model, data, q, end);
}

KT_INLINE void kt_links_motion(const kt_model *model, kt_data *data, bool planar, const kt_real1 *q, const kt_real1 *v,
                               const kt_external *external) {
    const size_t end = kt_spatial_end(model, planar);
    if (planar)
        kt_planar_articulated_motions(model, data, q, v, external);
    if (end > 1)
        KT_KERNEL(kt_spatial_links_motion)(model, data, q, v, external, end);
}

/* Minimises dv' M dv / 2 - force' dv with A dv = right. These are the equations of motion at rest without gravity, with
 * dv for the accelerations. Returns false if the inertia is singular. zero: nv zeros. */
KT_INLINE bool kt_links_step_of_mass(const kt_model *model, kt_data *data, bool planar, const kt_real1 *zero,
                                     const kt_real1 *force, kt_real1 *step) {
    const size_t end = kt_spatial_end(model, planar);
    if (planar)
        KT_KERNEL(kt_planar_links_move)(model, data, zero);
    if (end > 1) {
        KT_KERNEL(kt_spatial_links_move)(model, data, zero, end);
        KT_KERNEL(kt_spatial_links_clear)(model, data, end);
        data->motion[0].linear = kt_zero3();
        if (KT_KERNEL(kt_spatial_links_accelerate)(model, data, force, end, model->has_delassus, step))
            return false;
    }
    return !planar || KT_KERNEL(kt_planar_links_accelerate)(model, data, NULL, force, true, step) == 0;
}

KT_INLINE void kt_group_fill(const kt_model *model, kt_data *data, size_t g, bool planar, bool moving,
                             const kt_real1 *q, const kt_real1 *v, kt_real1 t) {
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const bool in_plane = planar && kt_group_is_planar(model, &model->group[g]);
    if (kt_group_has_fronts(&model->group[g]))
        KT_KERNEL(kt_front_fill)(model, data, g, in_plane, moving, q, v, t);
    else if (in_plane)
        kt_planar_rows_fill(model, data, g, &w, moving, q, v, t);
    else
        kt_rows_fill(model, data, g, moving, q, v, t);
}

/* Adds the violation of a group's velocities, and stores it in `right`. Uses the entries of A or, if fronts reduce the
 * group, the product with A (front.h). */
KT_INLINE void kt_group_add_violation(const kt_model *model, kt_data *data, size_t g, const kt_real1 *v,
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

#endif
