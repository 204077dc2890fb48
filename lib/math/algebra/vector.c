/* The Euler vector theta = angle times axis, t = |theta|; and axis and angle as separate quantities.
 *
 *     R = exp(theta x) = I + (sin t / t) theta x + ((1 - cos t) / t^2) theta x theta x                  [MSD A.6]
 * is the matrix of a unit quaternion,
 *     w = cos(t/2),  v = h theta / 2,   h = sin(t/2) / (t/2).
 * The terms of this quaternion do not cancel at small t, and a rounded t rotates R but does not stretch it. The inverse
 * also uses the quaternion, which is well conditioned at every angle, half turns included.
 *
 *     omega = G thetadot
 *     G = I + (h^2 / 2) theta x + c theta x theta x,    c = (t - sin t) / t^3                           [MSD A.28]
 * The notes write c = 1/t^2 - sin t / t^3, h^2 / 2 = (1 - cos t) / t^2. As t goes to 0, c is a difference of equal
 * numbers, so that it is summed as
 *     c = 1/6 (1 - t^2 / (4 5) (1 - t^2 / (6 7) (1 - ...)))
 * The inverse is sought as
 *     G^-1 = I - theta x / 2 + e theta x theta x
 * Since (theta x)^3 = -t^2 theta x, the condition G G^-1 = I yields, with y = t/2,
 *     e = (1 - y cot y) / t^2 = (sin y - y cos y) / (4 y^2 sin y)
 *     sin y - y cos y = y^3 / 3 (1 - y^2 / (2 5) (1 - y^2 / (4 7) (1 - y^2 / (6 9) ...)))
 * The inverse is singular at full turns, sin y = 0.
 *
 * Axis n and angle a: differentiating R(a n) along a and n (n'ndot = 0),
 *     omega = n adot + sin a ndot + (1 - cos a) n x ndot
 * The last two terms are ndot, rotated about n by half the angle a and scaled by 2 sin(a/2). Undoing both gives the
 * inverse:
 *     ndot = (cot(a/2) p - n x p) / 2,   p = omega - n n'omega
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "kinetree/algebra.h"

#include <float.h>
#include <stddef.h>

static double sinc(double x) { return x != 0.0 ? sin(x) / x : 1.0; }

/* I + p x + c u x u x */
static kt_mat3 skew_polynomial(kt_vec3 p, double c, kt_vec3 u) {
    const kt_vec3 cu = kt_vec3_scale(c, u);
    kt_mat3 g;
    g.x = kt_vec3_make(1.0 - (cu.y * u.y + cu.z * u.z), cu.x * u.y + p.z, cu.x * u.z - p.y);
    g.y = kt_vec3_make(cu.x * u.y - p.z, 1.0 - (cu.x * u.x + cu.z * u.z), cu.y * u.z + p.x);
    g.z = kt_vec3_make(cu.x * u.z + p.y, cu.y * u.z - p.x, 1.0 - (cu.x * u.x + cu.y * u.y));
    return g;
}

kt_quat kt_quat_from_euler_vector(kt_vec3 theta) {
    const double t = kt_vec3_norm_wide(theta), s = 0.5 * sinc(0.5 * t);
    return kt_quat_make(cos(0.5 * t), s * theta.x, s * theta.y, s * theta.z);
}

kt_vec3 kt_euler_vector_from_quat(kt_quat q) {
    const double n2 = kt_quat_norm_squared(q);
    if (!(n2 > 1e-280 && n2 < 1e280))
        q = kt_quat_rescale(q);
    const double sign = q.w < 0.0 ? -1.0 : 1.0, w = sign * q.w;
    const kt_vec3 v = kt_vec3_make(sign * q.x, sign * q.y, sign * q.z);
    const double n = kt_vec3_norm_wide(v);
    return kt_vec3_scale(n > 0.0 ? 2.0 * (atan2(n, w) / n) : 2.0 / w, v);
}

kt_mat3 kt_mat3_from_euler_vector(kt_vec3 theta) { return kt_mat3_from_quat(kt_quat_from_euler_vector(theta)); }

kt_vec3 kt_euler_vector_from_mat3(kt_mat3 rotation) { return kt_euler_vector_from_quat(kt_quat_from_mat3(rotation)); }

kt_mat3 kt_euler_vector_map(kt_vec3 theta) {
    const double t = kt_vec3_norm_wide(theta), h = sinc(0.5 * t);
    const kt_vec3 p = kt_vec3_scale(0.5 * h, kt_vec3_scale(h, theta));
    if (t >= 1.0)
        return skew_polynomial(p, 1.0 - sin(t) / t, kt_vec3_scale(1.0 / t, theta));
    double c = 1.0;
    for (int k = 9; k >= 2; k--) /* the first term left out is below 1e-18 */
        c = 1.0 - t * t / (2 * k * (2 * k + 1)) * c;
    return skew_polynomial(p, c / 6.0, theta);
}

kt_status kt_euler_vector_map_inverse(kt_vec3 theta, kt_mat3 *inverse, kt_error *error) {
    if (KT_IS_MISSING(error, inverse))
        return KT_ERROR_ARGUMENT;
    if (!kt_vec3_is_finite(theta))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the Euler vector [%g, %g, %g] is not finite", theta.x,
                            theta.y, theta.z);
    const double t = kt_vec3_norm_wide(theta), y = 0.5 * t;
    const kt_vec3 p = kt_vec3_scale(-0.5, theta);
    if (t < 2.0) {
        double c = 1.0;
        for (int k = 9; k >= 1; k--) /* the first term left out is below 1e-18 */
            c = 1.0 - y * y / (2 * k * (2 * k + 3)) * c;
        *inverse = skew_polynomial(p, c / (12.0 * sinc(y)), theta);
        return KT_OK;
    }
    if (fabs(sin(y)) <= 16.0 * DBL_EPSILON * t)
        return kt_error_set(
            error, KT_ERROR_SINGULAR, NULL,
            "the Euler vector [%g, %g, %g] is a whole number of full turns, where its rates do not "
            "give every angular velocity: replace it by the vector of the same rotation within half a turn",
            theta.x, theta.y, theta.z);
    *inverse = skew_polynomial(p, 1.0 - y * cos(y) / sin(y), kt_vec3_scale(1.0 / t, theta));
    return KT_OK;
}

kt_status kt_mat3_from_axis_angle(kt_vec3 axis, double angle, kt_mat3 *rotation, kt_error *error) {
    if (KT_IS_MISSING(error, rotation))
        return KT_ERROR_ARGUMENT;
    if (!kt_vec3_is_finite(axis) || !isfinite(angle))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "axis [%g, %g, %g] or angle %g is not finite", axis.x,
                            axis.y, axis.z, angle);
    if (axis.x == 0.0 && axis.y == 0.0 && axis.z == 0.0)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, NULL,
            "the rotation axis [0, 0, 0] has no direction: give one that is not zero, such as [0, 0, 1]");
    const kt_vec3 n = kt_vec3_normalize(axis);
    const double s = sin(0.5 * angle);
    *rotation = kt_mat3_from_quat(kt_quat_make(cos(0.5 * angle), s * n.x, s * n.y, s * n.z));
    return KT_OK;
}

void kt_axis_angle_from_mat3(kt_mat3 rotation, kt_vec3 *axis, double *angle) {
    if (!axis || !angle)
        return;
    const kt_quat q = kt_quat_from_mat3(rotation);
    const kt_vec3 v = kt_vec3_make(q.x, q.y, q.z);
    const double n = kt_vec3_norm_wide(v);
    *axis = n == 0.0 ? kt_vec3_make(0.0, 0.0, 1.0) : kt_vec3_normalize(v);
    *angle = 2.0 * atan2(n, q.w);
}

kt_vec3 kt_axis_angle_angular_world(kt_vec3 n, double angle, kt_vec3 axis_rate, double angle_rate) {
    const double half = sin(0.5 * angle);
    const kt_vec3 turning = kt_vec3_add(kt_vec3_scale(angle_rate, n), kt_vec3_scale(sin(angle), axis_rate));
    return kt_vec3_add(turning, kt_vec3_scale(2.0 * half * half, kt_vec3_cross(n, axis_rate)));
}

kt_status kt_axis_angle_rate_world(kt_vec3 n, double angle, kt_vec3 omega, kt_vec3 *axis_rate, double *angle_rate,
                                   kt_error *error) {
    if (KT_IS_MISSING(error, axis_rate, angle_rate))
        return KT_ERROR_ARGUMENT;
    if (!kt_vec3_is_finite(n) || !isfinite(angle) || !kt_vec3_is_finite(omega))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL,
                            "axis [%g, %g, %g], angle %g or angular velocity [%g, %g, %g] is not finite", n.x, n.y, n.z,
                            angle, omega.x, omega.y, omega.z);
    const double s = sin(0.5 * angle), c = cos(0.5 * angle);
    if (fabs(s) <= 16.0 * DBL_EPSILON * fmax(1.0, fabs(angle)))
        return kt_error_set(error, KT_ERROR_SINGULAR, NULL,
                            "at the angle %g, no rotation, an axis has no rate: use a quaternion or an Euler vector",
                            angle);
    const double along = kt_vec3_dot(n, omega);
    const kt_vec3 p = kt_vec3_sub(omega, kt_vec3_scale(along, n));
    *axis_rate = kt_vec3_sub(kt_vec3_scale(0.5 * c / s, p), kt_vec3_scale(0.5, kt_vec3_cross(n, p)));
    *angle_rate = along;
    return KT_OK;
}
