/* The constraint groups of a mechanism, each in its form: their factors and their least steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_GROUPS_H
#define KT_REDUCTION_GROUPS_H

#include "constraint/group.h"
#include "reduction/kernel.h"

/* kt_group_prepare does the same as kt_group_factor, but leaves groups in a special form to their own code
 * (data->special_form). With `delassus`, groups in the form of Delassus are prepared for delassus.h. With `front4`,
 * fronts of four parameters are left to front4.h. With `range`, contacts are left to half_columns.h. Returns false if a
 * number is not finite.
 *
 * kt_groups_refactor factors the groups in their special forms. Returns false if no group has a special form, or if a
 * number is not finite.
 *
 * kt_group_factor factors one group. With `regular`, directions that are about to be lost near a singular position are
 * left out. Returns -1 if a number is not finite.
 *
 * kt_groups_factor factors all groups. Returns false if a number is not finite.
 *
 * kt_damped_measure and kt_damped_solve are `measure` and `damp` of kernel.h.
 *
 * kt_groups_least_step finds the least step in coordinates. Coordinates outside all groups do not change.
 *
 * kt_groups_multipliers_of finds the multipliers of all equations as last factored, for given joint forces: A' lambda =
 * force (nv). The multipliers are in the groups' work memory. No group may be in its special form.
 */
#define KT_GROUPS_DECLARE(isa)                                                                                         \
    int kt_group_factor_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular);             \
    bool kt_group_prepare_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, bool regular,            \
                                bool delassus, bool front4, bool range);                                               \
    bool kt_groups_refactor_##isa(const kt_model *model, kt_data *data);                                               \
    bool kt_groups_factor_##isa(const kt_model *model, kt_data *data, kt_rows rows, bool regular);                     \
    bool kt_groups_least_step_##isa(const kt_model *model, kt_data *data, double *step);                               \
    void kt_groups_multipliers_of_##isa(const kt_model *model, kt_data *data, const double *force);                    \
    double kt_damped_measure_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows);                      \
    bool kt_damped_solve_##isa(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,      \
                               double *step);
KT_EACH_ISA(KT_GROUPS_DECLARE)

#endif
