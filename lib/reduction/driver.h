/* The parts of driver.c, which planar_driver.c uses as well if some or all links are planar.
 *
 * `end`: the links 1 to end - 1 and the groups among them are treated; end is n.link or n.spatial.
 */
#ifndef KT_REDUCTION_DRIVER_H
#define KT_REDUCTION_DRIVER_H

#include "constraint/group.h"

/* kt_spatial_pose: poses of the links; the ground is at rest without gravity.
 * kt_spatial_move: velocities, after poses.
 * kt_spatial_clear: sets wrenches and the inertias from children to zero.
 * kt_spatial_motion: all of these, then external wrenches (may be NULL); the ground's acceleration is minus gravity.
 * kt_spatial_accelerate: backward and forward pass, after the groups' equations have been factored; returns the link at
 *   which the inertia is singular, or 0. `delassus`: groups in the form of Delassus are solved by delassus.h, which has
 *   prepared them.
 * kt_group_prepare: as kt_group_factor; if `delassus`, groups in the form of Delassus are prepared for delassus.h
 *   (data->special_form). Returns false if a number is not finite.
 * kt_groups_refactor: factors the groups in their special forms; returns false if there are none or a number is not
 *   finite.
 * kt_group_factor: factors one group; with `regular`, directions that are about to be lost near a singular position are
 *   left out. Returns -1 if a number is not finite.
 * kt_groups_factor: factors all groups; returns false if a number is not finite.
 * kt_group_residuals: adds the violations of equations that have been filled, and stores -(A v + phi_t) in `right` (v
 *   may be NULL); coordinates to be held (NULL: none) count as constants from then on.
 * kt_damped_measure, kt_damped_solve: `measure` and `damp` of kernel.h.
 * kt_groups_least_step: the least step in coordinates; coordinates outside all groups do not change.
 * kt_groups_multipliers_of: the multipliers of all equations as last factored, in the groups' work memory, of given
 *   joint forces: A' lambda = force (nv). No group may be in its special form. */
#define KT_CLOSED_DECLARE(isa)                                                                                         \
    void kt_spatial_pose_##isa(const kt_model *, kt_data *, const double *, size_t);                                   \
    void kt_spatial_move_##isa(const kt_model *, kt_data *, const double *, size_t);                                   \
    void kt_spatial_clear_##isa(const kt_model *, kt_data *, size_t);                                                  \
    void kt_spatial_motion_##isa(const kt_model *, kt_data *, const double *, const double *, const kt_wrench *,       \
                                 size_t);                                                                              \
    size_t kt_spatial_accelerate_##isa(const kt_model *, kt_data *, const double *, size_t, bool, double *);           \
    int kt_group_factor_##isa(const kt_model *, kt_data *, size_t, kt_rows, bool);                                     \
    bool kt_group_prepare_##isa(const kt_model *, kt_data *, size_t, kt_rows, bool, bool);                             \
    bool kt_groups_refactor_##isa(const kt_model *, kt_data *);                                                        \
    bool kt_groups_factor_##isa(const kt_model *, kt_data *, kt_rows, bool);                                           \
    void kt_group_residuals_##isa(const kt_model *, kt_data *, size_t, const double *, const bool *, kt_violation *);  \
    bool kt_groups_least_step_##isa(const kt_model *, kt_data *, double *);                                            \
    void kt_groups_multipliers_of_##isa(const kt_model *, kt_data *, const double *);                                  \
    double kt_damped_measure_##isa(const kt_model *, kt_data *, size_t, kt_rows);                                      \
    bool kt_damped_solve_##isa(const kt_model *, kt_data *, size_t, const double *, double, double *);
KT_CLOSED_DECLARE(baseline)
KT_CLOSED_DECLARE(v3)
KT_CLOSED_DECLARE(v4)

#endif
