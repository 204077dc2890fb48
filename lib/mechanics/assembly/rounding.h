/* The part of a residual that rounding may leave in the equations of loops. Only this file defines this part: a share
 * of the numbers in a residual, relative to the scale of the equation.
 *
 * - Lengths as given. The points of a loop are computed from its lengths and, if it ends on the ground, from distances
 *   from the world's origin. A share of 1e-16 of these is no gap, however small the loop is. A hinge at 0.1 + 0.2 with
 *   a joint at 0.3 has only this gap. The share of the longest length is model->rounding (kt_attach_measure_loops).
 * - Coordinates. A crank at 3e5 rad is exact to 6e-11 rad, and no step closes its loop any better.
 * - Speeds. An entry of A that should be zero is a rounding error of its possible size. That size is the scale of its
 *   row over the unit of its coordinate. The rate of a drive is a sum of terms, which may cancel.
 *
 * A direction of A counts as absent if it is smaller than this share of its possible size (compile/rank.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_ROUNDING_H
#define KT_CLOSURE_ROUNDING_H

#include "assembly/project.h"

/* Rounding errors add up over the operations of a residual, which are some tens. */
#define KT_ROUNDING (64.0 * DBL_EPSILON)

/* The gap, relative to the scales of the equations, that rounding may leave at q: in a group; in all groups.
 * Coordinates count for at most KT_CLOSED_ASSEMBLED: a state that has run away is not closed. */
double kt_group_rounding(const kt_model *model, size_t g, const double *q);
double kt_loops_rounding(const kt_model *model, const double *q);

/* Whether a gap is closed to `tolerance`, or to rounding if rounding is larger. The first function tests the group g as
 * filled at q, the second function all groups. */
bool kt_group_is_closed(const kt_model *model, const kt_data *data, size_t g, const double *q, double tolerance);
static inline bool kt_loops_are_closed(const kt_model *model, const double *q, double gap, double tolerance) {
    return gap <= tolerance || gap <= kt_loops_rounding(model, q);
}

/* Whether the velocity equations of a group, or of all, are satisfied at q. The violations are in `right`. The bound is
 * `tolerance` times the speeds of their terms, or rounding if that is more. */
bool kt_group_velocities_fit(const kt_model *model, const kt_data *data, size_t g, double t, const double *q,
                             const double *v, double tolerance);
bool kt_velocities_fit(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                       double tolerance);

#endif
