/* A straight span of rope or belt from one pulley to another, without slip and of constant length.
 *
 * n is the axis of the first pulley; the axis of the second one is along s n, s = +-1. d leads from the first centre to
 * the second, p = d - (n . d) n is its part in the plane, a = |p|, e = p / a. rho_1 and rho_2 are the radii, positive
 * if the span passes the centre on the left of its direction x: it leaves the pulleys at C_k + rho_k m, m = n x x. Then
 *     m . p = rho_1 - rho_2 =: D,   L = x . p = sqrt(a^2 - D^2),   x = cos(delta) e - sin(delta) n x e,  sin(delta) =
 * D / a Rope that a pulley takes up leaves the span. With the angles chi_k of x in the frames of the pulleys
 *     phi = L - rho_1 chi_1 + rho_2 chi_2 = L + D delta - rho_1 beta_1 + s rho_2 beta_2
 * (beta_k: plane_angle.h). The sum f(a) = L + D delta has f' = L / a and f'' = D^2 / (a^2 L), and
 *     a' = e . u,   a'' = e . u'' + (t . u)^2 / a,   t = n x e
 * For parallel axes phi' = x . (v_2 - v_1) + rho_1 w_1 - rho_2 w_2: a force along the span. lambda > 0 is a
 * compression. Whole turns of d change phi by 2 pi D. If one circle comes to be within the other, the length of the
 * span remains at 1e-6 D, so that all numbers are finite.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_SPAN_H
#define KT_LOOP_SPAN_H

#include "loop/plane_angle.h"

/* The row of a span whose line of centres turns by less than half a turn from its start: phi may have any size. */
KT_INLINE kt_loop_row kt_row_of_long_span(const kt_loop_record *loop, const kt_loop_end end[2],
                                          const kt_loop_relative *r, const double rho[2], double phase) {
    const kt_vector n = end[0].axes[2], p = r->d - kt_scale(kt_dot(n, r->d), n);
    const double c[2] = {-rho[0], loop->sense * rho[1]}, D = rho[0] - rho[1];
    const kt_real square = kt_max(kt_dot(p, p), KT_PLANE_LEAST), a = kt_sqrt(square);
    const kt_real length = kt_sqrt(kt_max(square - D * D, 1e-12 * D * D + KT_PLANE_LEAST));
    const kt_vector e = kt_over(p, a);
    const kt_real along = kt_dot(e, r->u), across = kt_dot(kt_cross(n, e), r->u), slope = length / a;
    kt_loop_row row = kt_row_of_angles(loop, end, r, c);
    row.force = row.force + kt_scale(slope, e);
    row.residual = row.residual + length + D * kt_atan2(kt_real_of(D), length) - phase;
    row.drift =
        row.drift + slope * (kt_dot(e, r->coriolis) + across * across / a) + D * D / (square * length) * along * along;
    return row;
}

/* The row of a span of constant length, whose line of centres may turn. */
KT_INLINE kt_loop_row kt_row_of_span(const kt_loop_record *loop, const kt_loop_end end[2], const kt_loop_relative *r,
                                     const double rho[2], double phase) {
    kt_loop_row row = kt_row_of_long_span(loop, end, r, rho, phase);
    row.residual = kt_plane_reduce(row.residual, loop->period);
    return row;
}

/* The tension at rest of a span, a force on the second end along -x; adds to its wrench about the second point. */
KT_INLINE void kt_span_pull(const kt_loop_end end[2], const double rho[2], double tension, kt_vector *moment,
                            kt_vector *force) {
    const kt_vector n = end[0].axes[2], d = end[1].point - end[0].point, p = d - kt_scale(kt_dot(n, d), n);
    const double D = rho[0] - rho[1];
    const kt_real square = kt_dot(p, p), length = kt_sqrt(square - D * D);
    const kt_vector x = kt_over(kt_scale(length, p) - kt_scale(D, kt_cross(n, p)), square);
    const kt_vector pull = kt_scale(-tension, x);
    *force = *force + pull;
    *moment = *moment + kt_cross(kt_scale(rho[1], kt_cross(n, x)), pull);
}

/* Completes the record of a loop of spans. */
static inline bool kt_span_start(const kt_loop *loop, const kt_loop_start *at, double radius2, kt_loop_record *record,
                                 kt_error *error) {
    const double rho[2] = {loop->radius, radius2}, D = rho[0] - rho[1];
    const kt_vec3 n = at->end[0].rotation.z, d = kt_vec3_sub(at->end[1].position, at->end[0].position);
    const double apart = kt_vec3_norm(kt_vec3_cross(n, d));
    if (loop->slack && loop->tension > 0.0)
        return kt_plane_fault(error, "a rope that becomes slack has no tension at rest; leave out tension, or slack");
    if (rho[0] == 0.0)
        return kt_plane_fault(error,
                              "the first pulley has no radius; give the pulley first, and then the point to which "
                              "the rope is tied, or type: distance");
    if (rho[1] != 0.0 && kt_vec3_norm(kt_vec3_cross(n, at->end[1].rotation.z)) > KT_PLANE_CLOSE)
        return kt_plane_fault(error, "the axes of the pulleys are not parallel; correct axis or axis2");
    if (!at->counted[0] || (rho[1] != 0.0 && !at->counted[1]))
        return kt_plane_fault(error,
                              "a pulley turns in a joint that does not count its turns about the axis; give it a "
                              "revolute joint about the axis");
    if (!(apart > fabs(D))) {
        (void)snprintf(error->message, sizeof error->message,
                       "the pulleys are too close for a span: their centres are %.6g m apart, and the radii need more "
                       "than %.6g m; move the ends, or correct the radii",
                       apart, fabs(D));
        return false;
    }
    record->gain[0] = rho[0];
    record->gain[1] = rho[1];
    record->period = loop->slack ? 0.0 : KT_PLANE_TURN * fabs(D);
    record->counted = true;
    record->tension = loop->tension;
    for (int i = 0; i < 2; i++) {
        const double side = i == 0 ? D : -D;
        record->phase[i] = sqrt(apart * apart - D * D) + side * asin(side / apart);
    }
    kt_plane_start(at, record);
    return true;
}

#endif
