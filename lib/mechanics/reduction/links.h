/* The recursion over links with constraint groups, in space (spatial_links.c) and in the plane (planar_links.c).
 *
 * The spatial links 1 to `end` - 1 and the groups among them are treated. The argument is n.spatial, or n.link if all
 * links are treated as spatial. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_LINKS_H
#define KT_REDUCTION_LINKS_H

#include "dynamics/dynamics.h"

/* pose computes the poses of the links. The ground is at rest without gravity.
 *
 * move computes velocities, after poses.
 *
 * clear sets wrenches and the inertias from children to zero (in the plane `move` does).
 *
 * motion does all of these, then adds external wrenches (may be NULL). The ground's acceleration is minus gravity. In
 * the plane, kt_planar_articulated_motion is the same.
 *
 * accelerate is the backward and forward pass, after the groups' equations have been factored. Returns the link at
 * which the inertia is singular, or 0. With `delassus`, groups in the form of Delassus are solved by delassus.h, which
 * has prepared them. In the plane, if v is not NULL, groups of one pin are solved in closed form for these velocities.
 * If v is NULL, these groups have been factored like all others. `weightless`: without gravity.
 *
 * In lanes (algebra/real3.h), the groups are pins, dense matrices or in the form of Delassus (lane_groups.c). The mask
 * data->sound excludes lanes in which a group is near a singular position, or a joint has no inertia. */
#define KT_LINKS_DECLARE(isa)                                                                                          \
    void kt_spatial_links_pose_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, size_t end);             \
    void kt_spatial_links_move_##isa(const kt_model *model, kt_data *data, const kt_real1 *v, size_t end);             \
    void kt_spatial_links_clear_##isa(const kt_model *model, kt_data *data, size_t end);                               \
    void kt_spatial_links_motion_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,     \
                                       const kt_external *external, size_t end);                                       \
    size_t kt_spatial_links_accelerate_##isa(const kt_model *model, kt_data *data, const kt_real1 *tau, size_t end,    \
                                             bool delassus, kt_real1 *a);                                              \
    void kt_planar_links_pose_##isa(const kt_model *model, kt_data *data, const kt_real1 *q);                          \
    void kt_planar_links_move_##isa(const kt_model *model, kt_data *data, const kt_real1 *v);                          \
    size_t kt_planar_links_accelerate_##isa(const kt_model *model, kt_data *data, const kt_real1 *v,                   \
                                            const kt_real1 *tau, bool weightless, kt_real1 *a);
KT_EACH_KERNEL(KT_LINKS_DECLARE)
#undef KT_LINKS_DECLARE

#endif
