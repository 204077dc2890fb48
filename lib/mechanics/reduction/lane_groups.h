/* The constraint groups of several states at once (algebra/real3.h). The groups are pins, small dense matrices or in
 * the form of Delassus (kt_lanes_fit_model of batch/lanes.h), in planes and in space. The operations on a state are the
 * same as in driver.c and groups.c. Two kinds of states are marked as invalid: states near a singular position of a
 * group, and states that lose equations which are independent in others. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_LANE_GROUPS_H
#define KT_REDUCTION_LANE_GROUPS_H

#include "constraint/group.h"

#ifdef KT_LANES

/* Times, positions, velocities and joint forces of several states, and wrenches on bodies (NULL: none). */
typedef struct kt_lanes_at {
    kt_real1 t;
    const kt_real1 *q, *v, *tau;
    const kt_external *external;
} kt_lanes_at;

/* Computes accelerations; data->sound excludes states for which this fails. */
void KT_KERNEL(kt_groups_accelerate)(const kt_model *model, kt_data *data, const kt_lanes_at *at, kt_real1 *a);

/* Fills the equations at (t, q), and `right` with -(A v + phi_t). Returns the states whose numbers are finite. */
kt_condition KT_KERNEL(kt_groups_residuals)(const kt_model *model, kt_data *data, const kt_lanes_at *at,
                                            kt_violation *violation);

/* `right` and the violation of velocities again, for other velocities. */
void KT_KERNEL(kt_groups_velocity_violation)(const kt_model *model, kt_data *data, const kt_real1 *v,
                                             kt_violation *violation);

/* Factors the equations as filled. Returns the states that are regular. */
kt_condition KT_KERNEL(kt_groups_prepare)(const kt_model *model, kt_data *data, kt_rows rows);

/* `right` becomes -phi in groups whose gap is above the goal, otherwise 0. */
void KT_KERNEL(kt_groups_aim)(const kt_model *model, kt_data *data, double goal);

/* Computes the least step with A step = right as last factored, in coordinates or in kinetic energy, into data->delta.
 * Returns the states in which no inertia is singular. */
kt_condition KT_KERNEL(kt_groups_step)(const kt_model *model, kt_data *data, kt_metric metric);

#endif

#endif
