/* Derivatives of effects by dual numbers (dual_effect.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_DUAL_EFFECT_H
#define KT_DERIVATIVE_DUAL_EFFECT_H

#include "effect/path.h"

/* The derivatives of an effect's wrench on its last end; of a joint force with respect to q and v. */
void kt_dual_effect_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                             kt_effect_jacobian *jacobian);
/* The derivatives of an effect in a loop, whose links count turns to `counted` (kt_relative_turns). The array `force`
 * holds the force, and its derivatives by the coordinate and its rate. */
void kt_dual_relative_jacobian(const kt_effect_record *effect, const kt_loop_record *loop, const double counted[2],
                               const double force[3], const kt_effect_end *end, kt_effect_jacobian *jacobian);
void kt_dual_joint_derivatives(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                               double derivative[2]);

/* The derivatives of the wrenches of an effect along a path, on all links of the path, by the motion of the link
 * `moved` of these. The array `force` holds the force along the path, and its derivatives by length and speed. */
void kt_dual_path_jacobians(const kt_path_point_record *points, int count, const kt_effect_end *frame, int links,
                            int moved, const double force[3], kt_effect_jacobian *jacobian);

/* Computes the derivatives of a law by differences (law_differences.c). by[j][k] is the derivative of number k (the
 * force of the law, or a rate) by variable j. The call changes `values`, the values of the variables, and restores
 * them. The number at `error` is raised to the estimated relative error. Returns the code of the callback. */
int kt_law_difference(const kt_effect_record *effect, double *values, double by[KT_FORMULA_VARIABLE_MAX][6],
                      double *error);

#endif
