/* Rows for orientations: of first order in the error, and regular up to an error of half a turn.
 *
 * The skew part of the relative rotation [MSD 6.51] is sin(theta) n. This residual is of first order, but decreases
 * again beyond a quarter turn. Therefore an iteration diverges beyond a quarter turn, and at half a turn the residual
 * is zero. Another candidate, 2 sin(theta / 2) n, has zero slope at half a turn. The residuals of the library are the
 * modified Rodrigues parameters [Wiener 1962; Schaub and Junkins 1996, J. Astronautical Sciences 44],
 *     p = 4 tan(theta / 4) n
 * At half a turn their size is 4 and their slope is 2. Newton's step rotates back by 2 sin(theta / 2), never too far.
 *
 * Frame 1 has the axes e_k, frame 2 the axes f_k, and
 *     w = w2 - w1
 * Rates x' are rates in frame 1. In this frame f_k' = w x f_k, and the rate of w is (w2' - w1') - g (relative_motion.h)
 * with
 *     g = w1 x w2
 * Therefore a row with moment m has -m . g in its drift.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_ORIENTATION_H
#define KT_LOOP_ORIENTATION_H

#include "loop/relative_motion.h"

#include <math.h>

/* Least sine of the angle between an axis and a direction at which the equations are singular. Nearer to the direction,
 * the slopes of the equations would grow without bound. Therefore the slopes of an axis at this distance are used. The
 * residual belongs to the true axis, so that a step away from the direction decreases the residual. */
#define KT_AXIS_CLEARANCE 1e-3

/* ---- equal orientation ---------------------------------------------------------------------------------------------
 *
 * q = (c, e), c >= 0, turns frame 1's axes into frame 2's;
 *     p = 4 e / (1 + c),  |p| = 4 tan(theta / 4),  s = |p|^2 / 16
 * From c' = -(w . e) / 2 and e' = (c w + w x e) / 2:
 *     p'  = (1 - s) w + w x p / 2 + (p . w) p / 8 =: B w,       B'B = (1 + s)^2 1
 *     p'' = B w' + (p . w) p' / 4 - (1 + s) |w|^2 p / 8
 * and row k is the component along e_k:
 *     phi = e_k . p,  moment B' e_k = (1 - s) e_k + p x e_k / 2 + (e_k . p) p / 8
 */
KT_INLINE void kt_row_parallel(const kt_loop_end end[2], const kt_loop_relative *r, kt_loop_row rows[3]) {
    const kt_vector *e = end[0].axes, *f = end[1].axes;
    const kt_vector x = kt_apply_transposed(e, f[0]), y = kt_apply_transposed(e, f[1]);
    const kt_vector z = kt_apply_transposed(e, f[2]);
    const kt_vector turn[3] = {x, y, z};
    const kt_euler_parameters q = kt_euler_parameters_of(turn);
    const kt_vector component = kt_scale(4.0 / (1.0 + q.w), q.e);
    const kt_vector p = kt_apply(e, component);
    const kt_real s = kt_dot(p, p) / 16.0;
    const kt_real pw = kt_dot(p, r->w), ww = kt_dot(r->w, r->w);
    for (int k = 0; k < 3; k++) {
        const kt_real phi = kt_component(component, k);
        const kt_vector m = kt_scale(1.0 - s, e[k]) + kt_scale(0.5, kt_cross(p, e[k])) + kt_scale(0.125 * phi, p);
        rows[k] =
            (kt_loop_row){.moment = m,
                          .force = kt_vector_zero(),
                          .residual = phi,
                          .drift = 0.25 * pw * kt_dot(m, r->w) - 0.125 * (1.0 + s) * ww * phi - kt_dot(m, r->turning),
                          .holonomic = true};
    }
}

/* ---- one axis ------------------------------------------------------------------------------------------------------
 */

/* Returns f. If the sine of f against e is below the clearance, f is moved to that distance from the line of e. If f
 * lies on that line, it is moved towards `aside`, normal to e. *sine: the sine of the unmoved f. */
KT_INLINE kt_vector kt_axis_clear(kt_vector e, kt_vector aside, kt_vector f, kt_real *sine) {
    const kt_vector across = kt_cross(kt_cross(e, f), e); /* f's part normal to e */
    *sine = kt_sqrt(kt_dot(across, across));
    if (kt_value(*sine) >= KT_AXIS_CLEARANCE)
        return f;
    const kt_vector away = kt_value(*sine) > 1e-145 ? kt_over(across, *sine) : aside;
    const double along = copysign(sqrt(1.0 - KT_AXIS_CLEARANCE * KT_AXIS_CLEARANCE), kt_value(kt_dot(e, f)));
    return kt_scale(KT_AXIS_CLEARANCE, away) + kt_scale(along, e);
}

/* The second end's z axis, moved to the clearance if it is nearly opposite to the first end's. *sine is 1 if the axes
 * are not nearly opposite. */
KT_INLINE kt_vector kt_axis_not_opposite(const kt_loop_end end[2], kt_real *sine) {
    const kt_vector e = end[0].axes[2], f = end[1].axes[2];
    *sine = 1.0;
    return kt_value(kt_dot(e, f)) < 0.0 ? kt_axis_clear(e, end[0].axes[0], f, sine) : f;
}

/* 4 tan(theta / 4) near half a turn, from sin(theta). */
KT_INLINE kt_real kt_axis_gap(kt_real sine) {
    const kt_real half = 0.5 * sine * sine / (1.0 + kt_sqrt(1.0 - sine * sine)); /* cos^2(theta / 2) */
    return 4.0 * kt_sqrt(1.0 - half) / (1.0 + kt_sqrt(half));
}

/* Axis f = f_z along e = e_z. The least rotation that takes e to f is theta about h = e x f, |h| = sin(theta); with
 * c = e . f, b = cos(theta / 2) = sqrt((1 + c) / 2),
 *     phi = F h in the directions e_x and e_y,  F = 4 tan(theta / 4) / sin(theta) = 2 / (b (1 + b))
 *     F' = dF/dc = -(1 + 2 b) / (2 b^3 (1 + b)^2),  F'' = (3 + 9 b + 8 b^2) / (8 b^5 (1 + b)^3)
 *     h_x = -e_y . f,  h_y = e_x . f
 *     (k . f)' = w . (f x k),  (k . f)'' = w' . (f x k) + k . (w x (w x f))
 * for a direction k of frame 1; then the chain rule. The moments' part along h is 2 / (1 + b). Near half a turn, this
 * part is the difference of two large terms. Both b and e x f are computed from the same h, so that their roundings
 * cancel. At c = -1 the direction is undefined, and h along e_y is taken. */
KT_INLINE void kt_row_coaxial(const kt_loop_end end[2], const kt_loop_relative *r, kt_loop_row rows[2]) {
    kt_real sine;
    const kt_vector e = end[0].axes[2], f = kt_axis_not_opposite(end, &sine), w = r->w;
    const kt_vector side[2] = {-end[0].axes[1], end[0].axes[0]};
    const kt_real h[2] = {kt_dot(side[0], f), kt_dot(side[1], f)};
    const kt_real c = kt_dot(e, f), h2 = h[0] * h[0] + h[1] * h[1];
    const kt_real half = kt_value(c) < 0.0 ? h2 / (2.0 * (1.0 - c)) : 0.5 * (1.0 + c);
    const kt_real b = kt_sqrt(half), one = 1.0 + b;
    const kt_real f0 = 2.0 / (b * one);
    const kt_real f1 = -(1.0 + 2.0 * b) / (2.0 * half * b * one * one);
    const kt_real f2 = (3.0 + b * (9.0 + 8.0 * b)) / (8.0 * half * half * b * one * one * one);
    const kt_real size = kt_value(sine) < KT_AXIS_CLEARANCE ? kt_axis_gap(sine) / kt_sqrt(h2) : f0;
    const kt_vector f_cross_e = -(kt_scale(h[0], end[0].axes[0]) + kt_scale(h[1], end[0].axes[1])); /* f x e */
    const kt_vector bias = kt_cross(w, kt_cross(w, f));
    const kt_real c1 = kt_dot(w, f_cross_e), c2 = kt_dot(e, bias);
    for (int k = 0; k < 2; k++) {
        const kt_vector lever = kt_cross(f, side[k]);
        const kt_vector m = kt_scale(f0, lever) + kt_scale(f1 * h[k], f_cross_e);
        const kt_real drift =
            f0 * kt_dot(side[k], bias) + 2.0 * f1 * c1 * kt_dot(w, lever) + (f2 * c1 * c1 + f1 * c2) * h[k];
        rows[k] = (kt_loop_row){.moment = m,
                                .force = kt_vector_zero(),
                                .residual = size * h[k],
                                .drift = drift - kt_dot(m, r->turning),
                                .holonomic = true};
    }
}

/* ---- the angle about one axis --------------------------------------------------------------------------------------
 *
 * The relative rotation consists of a rotation about z by theta, and of the least rotation that takes z to the second
 * end's z (q = (w, x, y, z): theta = 2 atan2(z, w)):
 *     theta   = atan2(e_y . f_x - e_x . f_y, e_x . f_x + e_y . f_y)
 * With e = e_z, f = f_z, c = e . f and w the relative angular velocity, for any angle between the axes,
 *     theta'  = k . w,                               k = (e + f) / (1 + c)
 *     theta'' = k . w' - (k . w) c' / (1 + c),       c' = w . (f x e)        (w . f' = w . (w x f) = 0)
 * (Differentiate tan(theta / 2) = z / w of q and insert
 * f = (2 (x z + w y), 2 (y z - w x), 2 (w^2 + z^2) - 1).) */
typedef struct kt_axis_turn {
    kt_real theta, bias; /* bias: theta'' except for k . (w2' - w1') */
    kt_vector k;
} kt_axis_turn;

#define KT_TURN 6.283185307179586

KT_INLINE kt_axis_turn kt_axis_turn_of(const kt_loop_end end[2], const kt_loop_relative *r) {
    const kt_vector *x = end[0].axes, *y = end[1].axes;
    kt_real sine;
    kt_axis_turn turn;
    const kt_vector e = x[2], f = kt_axis_not_opposite(end, &sine);
    const kt_real c = 1.0 + kt_dot(e, f);
    turn.k = kt_over(e + f, c);
    turn.theta = kt_atan2(kt_dot(x[1], y[0]) - kt_dot(x[0], y[1]), kt_dot(x[0], y[0]) + kt_dot(x[1], y[1]));
    turn.bias = -kt_dot(turn.k, r->w) * kt_dot(r->w, kt_cross(f, e)) / c - kt_dot(turn.k, r->turning);
    return turn;
}

/* ---- two axes at right angles ------------------------------------------------------------------------------------ */

/* Axis f = f_z normal to e = e_z. The axes miss the right angle by eps:
 *     c = e . f = sin(eps),  s = |e x f| = cos(eps)
 * The slope of c would vanish at a quarter turn, the largest possible eps. So
 *     phi = 2 tan(eps / 2) = 2 c / (1 + s) =: G(c),  G' = 2 / (s (1 + s)),  G'' = 2 c (1 + 2 s) / (s^3 (1 + s)^2)
 * with the slope 1 to 2, and Newton's step is sin(eps). At s = 0 any direction leads back: f moves towards e_x. */
KT_INLINE void kt_row_orthogonal(const kt_loop_end end[2], const kt_loop_relative *r, kt_loop_row rows[1]) {
    kt_real sine;
    const kt_vector e = end[0].axes[2], f = kt_axis_clear(e, end[0].axes[0], end[1].axes[2], &sine), w = r->w;
    const kt_vector lever = kt_cross(f, e);
    const kt_real c = kt_dot(e, f), s = kt_sqrt(kt_dot(lever, lever)), one = 1.0 + s;
    const kt_real g1 = 2.0 / (s * one), g2 = 2.0 * c * (1.0 + 2.0 * s) / (s * s * s * one * one);
    const kt_vector m = kt_scale(g1, lever);
    const kt_real c1 = kt_dot(w, lever), c2 = kt_dot(e, kt_cross(w, kt_cross(w, f)));
    rows[0] = (kt_loop_row){.moment = m,
                            .force = kt_vector_zero(),
                            .residual = 2.0 * kt_dot(e, end[1].axes[2]) / (1.0 + sine),
                            .drift = g1 * c2 + g2 * c1 * c1 - kt_dot(m, r->turning),
                            .holonomic = true};
}

#endif
