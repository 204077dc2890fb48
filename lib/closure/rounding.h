/* What rounding may leave in the equations of loops, decided here alone: a share of the numbers that a residual is made
 * of, relative to the scale that it is held against.
 *
 * - Lengths as given. The points of a loop are computed from its lengths and, where it ends on the ground, from
 *   distances from the world's origin: 1e-16 of these is no gap, however small the loop is. Of a hinge at 0.1 + 0.2
 *   with a joint at 0.3 it is all there is. This share, of the longest, is model->rounding (kt_attach_measure_loops).
 * - Coordinates. A crank at 3e5 rad is known to 6e-11 rad, and no step closes its loop any better.
 * - Speeds. An entry of A that should be zero is a rounding error of what it could be, the scale of its row over the
 *   unit of its coordinate; and the rate of a drive is a sum of terms, which may cancel.
 *
 * Directions of A that are smaller than this share of what they could be are no directions (compile/rank.c).
 */
#ifndef KT_CLOSURE_ROUNDING_H
#define KT_CLOSURE_ROUNDING_H

#include "closure/project.h"

/* Rounding errors add up over the operations of a residual: some tens of them. */
#define KT_ROUNDING (64.0 * DBL_EPSILON)

/* The gap, relative to the scales of the equations, that rounding may leave at q: in a group; in all. Coordinates
 * count for KT_CLOSED_ASSEMBLED at most: what has run away is not closed. */
double kt_group_rounding(const kt_model *model, size_t g, const double *q);
double kt_loops_rounding(const kt_model *model, const double *q);

/* Whether a gap is closed to `tolerance`, or to rounding if that is more: of the group g as filled at q; of all. */
bool kt_group_is_closed(const kt_model *model, const kt_data *data, size_t g, const double *q, double tolerance);
static inline bool kt_loops_are_closed(const kt_model *model, const double *q, double gap, double tolerance) {
    return gap <= tolerance || gap <= kt_loops_rounding(model, q);
}

/* Whether the velocity equations of a group, or of all, whose violations are in `right`, hold at q to `tolerance` of
 * the speeds that they are made of, or to rounding if that is more. */
bool kt_group_velocities_fit(const kt_model *model, const kt_data *data, size_t g, double t, const double *q,
                             const double *v, double tolerance);
bool kt_velocities_fit(const kt_model *model, const kt_data *data, double t, const double *q, const double *v,
                       double tolerance);

#endif
