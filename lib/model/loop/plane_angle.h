/* The angle of d, from the first end's point to the second's, in the plane normal to an end's axis z.
 *
 *     beta = atan2(d . y, d . x),   p = d - (z . d) z,   g = z x d / |p|^2
 * Let r be the rate of d as seen in the end's frame, and a its acceleration as seen there. Then
 *     beta'  = g . r
 *     beta'' = g . a - 2 (p . r) (g . r) / |p|^2
 * In the frame of end 1 (relative_motion.h): r = u, a = u' + coriolis. In that of end 2:
 *     r = u - w x d,   a = u' - w' x d - 2 w2 x r - w2 x (w2 x d)
 * where g . (w' x d) = w' . (d x g).
 *
 * beta counts no whole turns. If the ends turn about parallel axes, the joints count the turn T_k of each
 * (kt_loop_end), and beta_k + T_k is the angle psi of d in the frame of the ancestor, with a sign of z_1 . z_2 and a
 * constant. Whole turns of psi then change c_1 beta_1 + c_2 beta_2 by a multiple of 2 pi (c_1 +- c_2) alone.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_PLANE_ANGLE_H
#define KT_LOOP_PLANE_ANGLE_H

#include "loop/relative_motion.h"

#include <math.h>
#include <stdio.h>

#define KT_PLANE_TURN 6.283185307179586

/* Relative to the radii: distances and differences of ratios below it are rounding of the data. */
#define KT_PLANE_CLOSE 1e-6

/* d along an axis has no angle; squares below this one count as it, so that all numbers are finite there. */
#define KT_PLANE_LEAST 1e-200

/* beta' = moment . w + force . u; bias: beta'' but for moment . w' + force . u' */
typedef struct kt_plane_angle {
    kt_real beta, bias;
    kt_vector moment, force;
} kt_plane_angle;

/* The angle beta of d in the plane across the axis of end k. Its rate is g . (rate of d), with g = e_z x d / |d
 * across|^2. `force` and `moment` are the coefficients of the relative velocities in the row. */
KT_INLINE kt_plane_angle kt_plane_angle_of(const kt_loop_end end[2], const kt_loop_relative *r, int k) {
    kt_plane_angle angle;
    const kt_vector *e = end[k].axes, d = r->d, w2 = end[1].omega;
    const kt_real x = kt_dot(d, e[0]), y = kt_dot(d, e[1]), square = kt_max(x * x + y * y, KT_PLANE_LEAST);
    const kt_vector g = kt_over(kt_cross(e[2], d), square);
    const kt_vector rate = k == 0 ? r->u : r->u - kt_cross(r->w, d);
    const kt_vector bias = k == 0 ? r->coriolis : -kt_cross(w2, rate + rate + kt_cross(w2, d));
    const kt_real outward = kt_dot(d, rate) - kt_dot(e[2], d) * kt_dot(e[2], rate);
    angle.beta = kt_atan2(y, x);
    angle.force = g;
    angle.moment = k == 0 ? kt_vector_zero() : -kt_cross(d, g);
    angle.bias = kt_dot(g, bias) - 2.0 * outward * kt_dot(g, rate) / square;
    return angle;
}

/* The row of c_1 beta_1 + c_2 beta_2, whose residual is 0 at the start, and is not reduced to a period. */
KT_INLINE kt_loop_row kt_row_of_angles(const kt_loop_record *loop, const kt_loop_end end[2], const kt_loop_relative *r,
                                       const double c[2]) {
    const kt_plane_angle one = kt_plane_angle_of(end, r, 0);
    kt_plane_angle two = {.moment = kt_vector_zero(), .force = kt_vector_zero()};
    if (c[1] != 0.0) /* else its axis may have any direction */
        two = kt_plane_angle_of(end, r, 1);
    const kt_real first = kt_remainder(one.beta + end[0].turn - loop->bearing[0], KT_PLANE_TURN);
    const kt_real alike = loop->sense * first;
    const kt_real second = alike + kt_remainder(two.beta + end[1].turn - loop->bearing[1] - alike, KT_PLANE_TURN);
    return (kt_loop_row){.moment = kt_scale(c[1], two.moment),
                         .force = kt_scale(c[0], one.force) + kt_scale(c[1], two.force),
                         .residual = c[0] * (first - (end[0].turn - loop->turned[0])) +
                                     c[1] * (second - (end[1].turn - loop->turned[1])),
                         .drift = c[0] * one.bias + c[1] * two.bias,
                         .holonomic = true};
}

KT_INLINE kt_real kt_plane_reduce(kt_real phi, double period) { return period > 0.0 ? kt_remainder(phi, period) : phi; }

/* The angle of d in the frame of an end, at the start. */
static inline double kt_plane_bearing(const kt_loop_start *at, int k) {
    const kt_vec3 d = kt_vec3_sub(at->end[1].position, at->end[0].position);
    return atan2(kt_vec3_dot(d, at->end[k].rotation.y), kt_vec3_dot(d, at->end[k].rotation.x));
}

/* Completes the members of a record that kt_row_of_angles reads; record->counted is set. */
static inline void kt_plane_start(const kt_loop_start *at, kt_loop_record *record) {
    for (int k = 0; k < 2; k++) {
        record->turned[k] = record->counted ? at->turn[k] : 0.0;
        record->bearing[k] = kt_plane_bearing(at, k) + record->turned[k];
    }
    record->sense = kt_vec3_dot(at->end[0].rotation.z, at->end[1].rotation.z) < 0.0 ? -1.0 : 1.0;
}

static inline bool kt_plane_fault(kt_error *error, const char *message) {
    (void)snprintf(error->message, sizeof error->message, "%s", message);
    return false;
}

#endif
