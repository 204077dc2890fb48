/* The constraint groups of a mechanism, each in its form: factored, solved for least steps, and what it leaves open.
 */
#ifndef KT_REDUCTION_GROUPS_H
#define KT_REDUCTION_GROUPS_H

#include "constraint/group.h"
#include "reduction/kernel.h"

/* kt_group_prepare: as kt_group_factor, but groups in a form of their own are left to it (data->special_form): if
 *   `delassus`, those of Delassus, which are prepared for delassus.h; if `front4`, fronts of four parameters, to front4.h.
 *   Returns false if a number is not finite.
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
#define KT_GROUPS_DECLARE(isa)                                                                                         \
    int kt_group_factor_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular);             \
    bool kt_group_prepare_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular,            \
                                bool delassus, bool front4);                                                           \
    bool kt_groups_refactor_##isa(const kt_model *model, kt_data *data);                                               \
    bool kt_groups_factor_##isa(const kt_model *model, kt_data *data, kt_rows rows, bool regular);                     \
    void kt_group_residuals_##isa(const kt_model *model, kt_data *data, size_t g, const double *v, const bool *held,   \
                                  kt_violation *violation);                                                            \
    bool kt_groups_least_step_##isa(const kt_model *model, kt_data *data, double *step);                               \
    void kt_groups_multipliers_of_##isa(const kt_model *model, kt_data *data, const double *force);                    \
    double kt_damped_measure_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows);                      \
    bool kt_damped_solve_##isa(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,      \
                               double *step);
KT_GROUPS_DECLARE(baseline)
KT_GROUPS_DECLARE(v3)
KT_GROUPS_DECLARE(v4)

#endif
