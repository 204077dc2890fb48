/* Vectors, rotations, poses, twists, wrenches: small plain values. Units are SI units and radians throughout.
 *
 * A rotation matrix is stored by columns: R.x, R.y and R.z are the axes of the rotated frame. The product R u takes the
 * components of a vector from the rotated frame to the reference frame. Quaternions are scalar first. G is the map from
 * the rates of a parametrisation to the angular velocity.
 *
 * Every call is a fixed number of operations and allocates nothing. Calls without a status do not check their
 * arguments: input that is not finite gives NaN.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_ALGEBRA_H
#define KINETREE_ALGEBRA_H

#include "kinetree/status.h"

#include <math.h>
#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A vector, or a point: its components. */
typedef struct kt_vec3 {
    double x, y, z; /* components along the axes of the corresponding frame */
} kt_vec3;

/* A quaternion, w + x i + y j + z k; of unit norm if it represents a rotation. */
typedef struct kt_quat {
    double w, x, y, z; /* scalar part first */
} kt_quat;

/* A matrix of 3 x 3 numbers, by columns. */
typedef struct kt_mat3 {
    kt_vec3 x, y, z; /* first, second, third column; of a rotation, the axes of the rotated frame */
} kt_mat3;

/* A frame relative to a reference frame: point = position + rotation * local. */
typedef struct kt_pose {
    kt_mat3 rotation; /* rotation of components, from the posed frame to the reference frame */
    kt_vec3 position; /* position of the origin, in the reference frame, m */
} kt_pose;

/* Angular velocity (or acceleration), and the velocity (or acceleration) of a point. The docstring of each call names
 * the frame and the point. */
typedef struct kt_twist {
    kt_vec3 angular, linear; /* rad/s and m/s, or rad/s^2 and m/s^2 */
} kt_twist;

/* Moment about a point, and force. The docstring of each call names the axes and the point. */
typedef struct kt_wrench {
    kt_vec3 moment, force; /* N m, N */
} kt_wrench;

/* ---- vectors and matrices ---------------------------------------------------------------------------------------- */

/* Returns the vector (x, y, z). */
static inline kt_vec3 kt_vec3_make(double x, double y, double z) {
    kt_vec3 u;
    u.x = x;
    u.y = y;
    u.z = z;
    return u;
}

/* Return, in turn: a + b; a - b; s a; the scalar product a . b; the length |a|. */
static inline kt_vec3 kt_vec3_add(kt_vec3 a, kt_vec3 b) { return kt_vec3_make(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline kt_vec3 kt_vec3_sub(kt_vec3 a, kt_vec3 b) { return kt_vec3_make(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline kt_vec3 kt_vec3_scale(double s, kt_vec3 a) { return kt_vec3_make(s * a.x, s * a.y, s * a.z); }
static inline double kt_vec3_dot(kt_vec3 a, kt_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double kt_vec3_norm(kt_vec3 a) { return sqrt(kt_vec3_dot(a, a)); }

/* Returns the vector product a x b. */
static inline kt_vec3 kt_vec3_cross(kt_vec3 a, kt_vec3 b) {
    return kt_vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/* Returns the identity matrix. */
static inline kt_mat3 kt_mat3_identity(void) {
    kt_mat3 m;
    m.x = kt_vec3_make(1.0, 0.0, 0.0);
    m.y = kt_vec3_make(0.0, 1.0, 0.0);
    m.z = kt_vec3_make(0.0, 0.0, 1.0);
    return m;
}

/* Return, in turn: A u; A' u; A B. */
static inline kt_vec3 kt_mat3_apply(kt_mat3 a, kt_vec3 u) {
    return kt_vec3_make(a.x.x * u.x + a.y.x * u.y + a.z.x * u.z, a.x.y * u.x + a.y.y * u.y + a.z.y * u.z,
                        a.x.z * u.x + a.y.z * u.y + a.z.z * u.z);
}
static inline kt_vec3 kt_mat3_apply_transposed(kt_mat3 a, kt_vec3 u) {
    return kt_vec3_make(kt_vec3_dot(a.x, u), kt_vec3_dot(a.y, u), kt_vec3_dot(a.z, u));
}
static inline kt_mat3 kt_mat3_multiply(kt_mat3 a, kt_mat3 b) {
    kt_mat3 c;
    c.x = kt_mat3_apply(a, b.x);
    c.y = kt_mat3_apply(a, b.y);
    c.z = kt_mat3_apply(a, b.z);
    return c;
}

/* Returns the transpose A', which is the inverse of a rotation. */
static inline kt_mat3 kt_mat3_transpose(kt_mat3 a) {
    kt_mat3 t;
    t.x = kt_vec3_make(a.x.x, a.y.x, a.z.x);
    t.y = kt_vec3_make(a.x.y, a.y.y, a.z.y);
    t.z = kt_vec3_make(a.x.z, a.y.z, a.z.z);
    return t;
}

/* Return, in turn: A + B; s A. */
static inline kt_mat3 kt_mat3_add(kt_mat3 a, kt_mat3 b) {
    kt_mat3 c;
    c.x = kt_vec3_add(a.x, b.x);
    c.y = kt_vec3_add(a.y, b.y);
    c.z = kt_vec3_add(a.z, b.z);
    return c;
}
static inline kt_mat3 kt_mat3_scale(double s, kt_mat3 a) {
    kt_mat3 c;
    c.x = kt_vec3_scale(s, a.x);
    c.y = kt_vec3_scale(s, a.y);
    c.z = kt_vec3_scale(s, a.z);
    return c;
}

/* Returns the determinant; 1 for a rotation. */
static inline double kt_mat3_determinant(kt_mat3 a) { return kt_vec3_dot(a.x, kt_vec3_cross(a.y, a.z)); }

/* Returns u x, the matrix of the cross product: (u x) v = u cross v. */
static inline kt_mat3 kt_mat3_skew(kt_vec3 u) {
    kt_mat3 m;
    m.x = kt_vec3_make(0.0, u.z, -u.y);
    m.y = kt_vec3_make(-u.z, 0.0, u.x);
    m.z = kt_vec3_make(u.y, -u.x, 0.0);
    return m;
}

/* Return whether all numbers are finite. */
static inline bool kt_vec3_is_finite(kt_vec3 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }
static inline bool kt_mat3_is_finite(kt_mat3 a) {
    return kt_vec3_is_finite(a.x) && kt_vec3_is_finite(a.y) && kt_vec3_is_finite(a.z);
}

/* For kt_hypot: x >= y >= 0, whose squares are normal numbers. The residual h^2 - x^2 - y^2 is computed from a
 * difference d without rounding. One step of Newton's method on h^2 then removes most of the rounding of h.
 * Source: Borges, An improved algorithm for hypot(a, b), 2019, algorithm 1 without fused operations. */
static inline double kt_hypot_scaled(double x, double y) {
    const double h = sqrt(x * x + y * y), d = h <= 2.0 * y ? h - y : h - x;
    const double first = h <= 2.0 * y ? x * (2.0 * d - x) : 2.0 * d * (x - 2.0 * y);
    const double second = h <= 2.0 * y ? (d - 2.0 * (x - y)) * d : (4.0 * d - y) * y + d * d;
    return h - (first + second) / (2.0 * h);
}

/* Returns sqrt(x^2 + y^2) over the whole range of double, with the same bits on every libm. An infinite number gives
 * infinity, even if the other number is NaN. The error is below one unit in the last place. */
static inline double kt_hypot(double x, double y) {
    const double a = fabs(x), b = fabs(y), more = a < b ? b : a, less = a < b ? a : b;
    const double scale = 4.149515568880993e+180; /* 2^600; the other bounds are 2^-54, 2^511 and 2^-459 */
    if (!isfinite(x) || !isfinite(y))
        return isinf(x) || isinf(y) ? (double)INFINITY : x + y;
    if (less <= more * 5.551115123125783e-17)
        return more + less;
    if (more > 6.703903964971299e+153)
        return kt_hypot_scaled(more / scale, less / scale) * scale;
    if (less < 6.717876107567089e-139)
        return kt_hypot_scaled(more * scale, less * scale) / scale;
    return kt_hypot_scaled(more, less);
}

/* Returns |a| over the whole range of double. No intermediate result overflows or underflows.
 * Cost: slower than kt_vec3_norm. */
static inline double kt_vec3_norm_wide(kt_vec3 a) { return kt_hypot(kt_hypot(a.x, a.y), a.z); }

/* Returns a / |a| for any finite a except zero, of any magnitude; zero gives NaN. */
static inline kt_vec3 kt_vec3_normalize(kt_vec3 a) {
    double n2 = kt_vec3_dot(a, a);
    if (!(n2 > 1e-280 && n2 < 1e280)) { /* bring the largest component near one, exactly */
        int exponent;
        (void)frexp(fmax(fabs(a.x), fmax(fabs(a.y), fabs(a.z))), &exponent);
        a = kt_vec3_make(ldexp(a.x, -exponent), ldexp(a.y, -exponent), ldexp(a.z, -exponent));
        n2 = kt_vec3_dot(a, a);
    }
    return kt_vec3_scale(1.0 / sqrt(n2), a);
}

/* ---- quaternions (Euler-Rodrigues parameters): R = I + 2 w v x + 2 v x v x, v = (x, y, z) [MSD A.24] ------------- */

/* Returns w + x i + y j + z k. */
static inline kt_quat kt_quat_make(double w, double x, double y, double z) {
    kt_quat q;
    q.w = w;
    q.x = x;
    q.y = y;
    q.z = z;
    return q;
}

/* Return, in turn: 1, no rotation; w - x i - y j - z k, the inverse of a unit quaternion. */
static inline kt_quat kt_quat_identity(void) { return kt_quat_make(1.0, 0.0, 0.0, 0.0); }
static inline kt_quat kt_quat_conjugate(kt_quat q) { return kt_quat_make(q.w, -q.x, -q.y, -q.z); }

/* Returns p q: the rotation q followed by p about the axes of the reference frame, R(p q) = R(p) R(q). */
static inline kt_quat kt_quat_multiply(kt_quat p, kt_quat q) {
    return kt_quat_make(p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                        p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w);
}

/* Returns |q|^2. */
static inline double kt_quat_norm_squared(kt_quat q) { return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z; }

/* Returns q times a power of two, such that the largest component is between one half and one. */
static inline kt_quat kt_quat_rescale(kt_quat q) {
    int exponent;
    (void)frexp(fmax(fmax(fabs(q.w), fabs(q.x)), fmax(fabs(q.y), fabs(q.z))), &exponent);
    return kt_quat_make(ldexp(q.w, -exponent), ldexp(q.x, -exponent), ldexp(q.y, -exponent), ldexp(q.z, -exponent));
}

/* Returns q / |q| for any finite q except zero, of any magnitude; zero gives NaN. */
static inline kt_quat kt_quat_normalize(kt_quat q) {
    double n2 = kt_quat_norm_squared(q);
    if (!(n2 > 1e-280 && n2 < 1e280)) {
        q = kt_quat_rescale(q);
        n2 = kt_quat_norm_squared(q);
    }
    const double s = 1.0 / sqrt(n2);
    return kt_quat_make(s * q.w, s * q.x, s * q.y, s * q.z);
}

/* Returns R(q / |q|) for any finite q except zero, normalised or not; zero gives NaN.
 * Source: [MSD A.24]. */
static inline kt_mat3 kt_mat3_from_quat(kt_quat q) {
    double n2 = kt_quat_norm_squared(q);
    if (!(n2 > 1e-280 && n2 < 1e280)) {
        q = kt_quat_rescale(q);
        n2 = kt_quat_norm_squared(q);
    }
    const double s = 2.0 / n2;
    const double wx = s * q.w * q.x, wy = s * q.w * q.y, wz = s * q.w * q.z;
    const double xx = s * q.x * q.x, xy = s * q.x * q.y, xz = s * q.x * q.z;
    const double yy = s * q.y * q.y, yz = s * q.y * q.z, zz = s * q.z * q.z;
    kt_mat3 r;
    r.x = kt_vec3_make(1.0 - (yy + zz), xy + wz, xz - wy);
    r.y = kt_vec3_make(xy - wz, 1.0 - (xx + zz), yz + wx);
    r.z = kt_vec3_make(xz + wy, yz - wx, 1.0 - (xx + yy));
    return r;
}

/* Returns the unit quaternion, w >= 0, of a rotation matrix. If w = 0, its largest component is positive. The result is
 * accurate at every angle, since the largest of the four components is found first.
 * Source: Shepperd 1978. */
KT_API kt_quat kt_quat_from_mat3(kt_mat3 rotation);

/* Returns the quaternion exponential: the rotation by |theta| rad about theta. The result is exact for every angle,
 * including zero. */
KT_API kt_quat kt_quat_from_euler_vector(kt_vec3 theta);

/* Returns the quaternion logarithm, |theta| <= pi rad; q and -q give the same result. The argument q need not be
 * normalised; zero gives NaN. */
KT_API kt_vec3 kt_euler_vector_from_quat(kt_quat q);

/* Returns omega = 2 E qdot [MSD A.32, A.33]. If q is not normalised, the result is the angular velocity of R(q / |q|),
 * omega = 2 E qdot / |q|^2, for |q| from 1e-140 to 1e140.
 * Frame: reference frame. */
static inline kt_vec3 kt_quat_angular_world(kt_quat q, kt_quat rate) {
    const kt_quat p = kt_quat_multiply(rate, kt_quat_conjugate(q));
    return kt_vec3_scale(2.0 / kt_quat_norm_squared(q), kt_vec3_make(p.x, p.y, p.z));
}

/* Returns R' omega = 2 G qdot [MSD A.35, A.36]; otherwise as kt_quat_angular_world.
 * Frame: body frame. */
static inline kt_vec3 kt_quat_angular_body(kt_quat q, kt_quat rate) {
    const kt_quat p = kt_quat_multiply(kt_quat_conjugate(q), rate);
    return kt_vec3_scale(2.0 / kt_quat_norm_squared(q), kt_vec3_make(p.x, p.y, p.z));
}

/* Returns qdot = E' omega / 2. The map is never singular and keeps |q|.
 * Frame: omega in the reference frame. */
static inline kt_quat kt_quat_rate_world(kt_quat q, kt_vec3 omega) {
    return kt_quat_multiply(kt_quat_make(0.0, 0.5 * omega.x, 0.5 * omega.y, 0.5 * omega.z), q);
}

/* Returns qdot = G' omega / 2. The map is never singular and keeps |q|.
 * Frame: omega in the body frame. */
static inline kt_quat kt_quat_rate_body(kt_quat q, kt_vec3 omega) {
    return kt_quat_multiply(q, kt_quat_make(0.0, 0.5 * omega.x, 0.5 * omega.y, 0.5 * omega.z));
}

/* ---- rotation matrices ------------------------------------------------------------------------------------------- */

/* Returns the rotation R1, R2 or R3 by `angle` rad about a coordinate axis [MSD A.1]. The argument axis is 0, 1 or 2.
 * Zeros and ones are exact. */
KT_API kt_mat3 kt_mat3_about(int axis, double angle);

/* Returns omega = ax(Rdot R').
 * Frame: reference frame. */
static inline kt_vec3 kt_mat3_angular_world(kt_mat3 rotation, kt_mat3 rate) {
    const kt_vec3 xy = kt_vec3_add(kt_vec3_cross(rotation.x, rate.x), kt_vec3_cross(rotation.y, rate.y));
    return kt_vec3_scale(0.5, kt_vec3_add(xy, kt_vec3_cross(rotation.z, rate.z)));
}

/* Returns Rdot = omega x R.
 * Frame: omega in the reference frame. */
static inline kt_mat3 kt_mat3_rate_world(kt_mat3 rotation, kt_vec3 omega) {
    kt_mat3 rate;
    rate.x = kt_vec3_cross(omega, rotation.x);
    rate.y = kt_vec3_cross(omega, rotation.y);
    rate.z = kt_vec3_cross(omega, rotation.z);
    return rate;
}

/* Returns the rotation nearest to a matrix that is almost a rotation (its polar factor), orthonormal to rounding. A
 * matrix that is exactly orthonormal, such as a signed permutation, is returned unchanged. The iteration converges if
 * |R'R - I| < 1/2. Other matrices are not detected.
 * Cost: twelve products of 3 x 3 matrices.
 * Source: Higham, Functions of Matrices, 8.3. */
KT_API kt_mat3 kt_mat3_orthonormalize(kt_mat3 almost);

/* ---- Euler angles: R = Ri(a) Rj(b) Rk(c) for sequence ijk, composed left to right about carried axes --------------
 *
 * `sequence` is one of the following twelve; any other is KT_ERROR_ARGUMENT:
 *
 *     121 123 131 132 212 213 231 232 312 313 321 323
 *
 * The angles, rad, are in the order of the sequence. If the first and third axes coincide, the middle angle is
 * singular: sin b = 0 for i = k, otherwise cos b = 0. An angle counts as singular within rounding, up to 16 DBL_EPSILON
 * (times |b|, if b is given and above 1). Angles or entries that are not finite are KT_ERROR_NOT_FINITE. [MSD A.3-A.5,
 * A.25-A.27] */

/* Computes the rotation with these Euler angles. */
KT_API KT_CHECKED kt_status kt_mat3_from_euler(int sequence, kt_vec3 angles, kt_mat3 *rotation, kt_error *error);

/* Computes Euler angles of a rotation. The angles a and c are in [-pi, pi]. The angle b is in [0, pi] if i = k.
 * Otherwise b is in [-pi/2, pi/2]. At a singular middle angle only a + c or a - c is determined. The call then
 * succeeds, returns the singular b and c = 0, and sets *singular (which may be NULL) to true. The angles reproduce the
 * rotation to rounding, also for a middle angle that is almost singular. */
KT_API KT_CHECKED kt_status kt_euler_from_mat3(int sequence, kt_mat3 rotation, kt_vec3 *angles, bool *singular,
                                               kt_error *error);

/* Computes G: omega = G (adot, bdot, cdot).
 * Frame: omega in the reference frame. */
KT_API KT_CHECKED kt_status kt_euler_map(int sequence, kt_vec3 angles, kt_mat3 *map, kt_error *error);

/* Computes the inverse of G.
 * Errors: KT_ERROR_SINGULAR at a singular middle angle. */
KT_API KT_CHECKED kt_status kt_euler_map_inverse(int sequence, kt_vec3 angles, kt_mat3 *inverse, kt_error *error);

/* Convert roll, pitch, yaw, in this order: R = R3(yaw) R2(pitch) R1(roll). This is sequence 321 with its angles in
 * reverse order. The angles are singular at pitch = +-pi/2. At a singular pitch, kt_rpy_from_mat3 returns roll = 0
 * and sets *singular (may be NULL). */
KT_API kt_mat3 kt_mat3_from_rpy(kt_vec3 rpy);
KT_API kt_vec3 kt_rpy_from_mat3(kt_mat3 rotation, bool *singular);
KT_API kt_mat3 kt_rpy_map(kt_vec3 rpy);
KT_API KT_CHECKED kt_status kt_rpy_map_inverse(kt_vec3 rpy, kt_mat3 *inverse, kt_error *error);

/* ---- Euler vector: theta = angle times axis, R = exp(theta x) [MSD A.6, A.28] ------------------------------------ */

/* Returns the rotation by |theta| rad about theta. The result is exact for every angle, including zero. */
KT_API kt_mat3 kt_mat3_from_euler_vector(kt_vec3 theta);

/* Returns the Euler vector of a rotation, |theta| <= pi rad. The result is accurate for every rotation, including zero
 * and half turns. At a half turn theta and -theta are the same rotation. If the matrix does not determine the sign, the
 * largest component is positive. */
KT_API kt_vec3 kt_euler_vector_from_mat3(kt_mat3 rotation);

/* Returns G: omega = G thetadot. The transpose G' gives omega in the rotated frame.
 * Frame: omega in the reference frame. */
KT_API kt_mat3 kt_euler_vector_map(kt_vec3 theta);

/* Computes the inverse of G.
 * Errors: KT_ERROR_SINGULAR at full turns, |theta| = 2 pi k with k > 0, within rounding. */
KT_API KT_CHECKED kt_status kt_euler_vector_map_inverse(kt_vec3 theta, kt_mat3 *inverse, kt_error *error);

/* ---- axis and angle: the axis is any vector but zero; it is normalised ------------------------------------------- */

/* Computes the rotation by `angle` rad about `axis`.
 * Errors: KT_ERROR_ARGUMENT for a zero axis, KT_ERROR_NOT_FINITE. */
KT_API KT_CHECKED kt_status kt_mat3_from_axis_angle(kt_vec3 axis, double angle, kt_mat3 *rotation, kt_error *error);

/* Computes the unit axis and the angle, in [0, pi] rad, of a rotation. The identity has the axis z. */
KT_API void kt_axis_angle_from_mat3(kt_mat3 rotation, kt_vec3 *axis, double *angle);

/* Returns omega for a unit axis n and its rate nrate (normal to n):
 *
 *     omega = n anglerate + sin(angle) nrate + (1 - cos(angle)) n cross nrate
 *
 * Frame: reference frame. */
KT_API kt_vec3 kt_axis_angle_angular_world(kt_vec3 axis, double angle, kt_vec3 axis_rate, double angle_rate);

/* Computes the rates of a unit axis and of the angle that give omega.
 * Errors: KT_ERROR_SINGULAR if the angle is 2 pi k, including k = 0. The bound of rounding is
 *
 *     |sin(angle / 2)| <= 16 DBL_EPSILON max(1, |angle|)
 */
KT_API KT_CHECKED kt_status kt_axis_angle_rate_world(kt_vec3 axis, double angle, kt_vec3 omega, kt_vec3 *axis_rate,
                                                     double *angle_rate, kt_error *error);

/* ---- Cayley-Gibbs-Rodrigues parameters: g = 2 tan(angle / 2) axis [MSD A.17, A.18, A.30] ------------------------- */

/* Returns the rotation with parameters g; every g represents a rotation. */
KT_API kt_mat3 kt_mat3_from_cgr(kt_vec3 cgr);

/* Computes the parameters of a rotation.
 * Errors: KT_ERROR_SINGULAR at half turns, within rounding: these have no parameters. */
KT_API KT_CHECKED kt_status kt_cgr_from_mat3(kt_mat3 rotation, kt_vec3 *cgr, kt_error *error);

/* Return G: omega = G gdot, and its inverse I - g x / 2 + g g' / 4. Both matrices are never singular.
 * Frame: omega in the reference frame. */
KT_API kt_mat3 kt_cgr_map(kt_vec3 cgr);
KT_API kt_mat3 kt_cgr_map_inverse(kt_vec3 cgr);

/* ---- a rotation as scene files and callers describe it ----------------------------------------------------------- */

/* The types of description of a rotation, and the numbers in `value` of a kt_rotation. */
typedef enum kt_rotation_type {
    KT_ROTATION_NONE = 0,       /* identity: a struct of zeros is a valid description */
    KT_ROTATION_QUATERNION = 1, /* value = w, x, y, z: norm within 1e-3 of one */
    KT_ROTATION_RPY = 2,        /* value = roll, pitch, yaw, rad */
    KT_ROTATION_EULER = 3,      /* sequence such as 313; value = its three angles, rad */
    KT_ROTATION_VECTOR = 4,     /* value = Euler vector, rad */
    KT_ROTATION_CGR = 5,        /* value = Cayley-Gibbs-Rodrigues parameters */
    KT_ROTATION_AXIS_ANGLE = 6, /* value = axis (not zero), angle in rad */
    KT_ROTATION_MATRIX = 7      /* value = rows R11 R12 R13 R21 ...: orthonormal within 1e-6, determinant +1 */
} kt_rotation_type;

/* A description of a rotation of a frame relative to a reference frame. The call kt_rotation_evaluate evaluates and
 * checks it. */
typedef struct kt_rotation {
    kt_rotation_type type; /* selects which numbers of `value` are read, and their meaning */
    int sequence;          /* sequence of KT_ROTATION_EULER; otherwise not read */
    double value[9];       /* numbers according to the type */
} kt_rotation;

/* Return a description of each type with the same numbers. These functions do not check the numbers. */
KT_API kt_rotation kt_rotation_quaternion(double w, double x, double y, double z);
KT_API kt_rotation kt_rotation_rpy(double roll, double pitch, double yaw);
KT_API kt_rotation kt_rotation_euler(int sequence, double a, double b, double c);
KT_API kt_rotation kt_rotation_vector(kt_vec3 theta);
KT_API kt_rotation kt_rotation_cgr(kt_vec3 cgr);
KT_API kt_rotation kt_rotation_axis_angle(kt_vec3 axis, double angle);
KT_API kt_rotation kt_rotation_matrix(kt_mat3 rotation);

/* Computes the matrix of a description, orthonormal to rounding.
 * Errors: KT_ERROR_NOT_FINITE. KT_ERROR_ARGUMENT for a quaternion or matrix that is no rotation, a zero axis, an
 * unknown sequence or type. Each message contains a remedy. */
KT_API KT_CHECKED kt_status kt_rotation_evaluate(const kt_rotation *description, kt_mat3 *rotation, kt_error *error);

/* Returns a right-handed triad as a rotation matrix. The column with index `which` is the unit vector `axis`. The next
 * columns, in cyclic order, complete the triad.
 *
 * The construction starts from the cyclic triad of the coordinate axis nearest to `axis`. The least rotation that
 * brings this coordinate axis onto `axis` turns the triad. If several axes are equally near, the function uses
 * coordinate axis `which` if it is among them, or else the axis cyclically next to `which`. The result is orthonormal
 * to rounding, and smooth except for the jumps between nearest axes. For an axis along +-x, +-y or +-z the entries are
 * exactly 0 or +-1. For which = 2 the columns are:
 *
 *     axis  columns      axis  columns
 *     z     x, y, z      -z    x, -y, -z
 *     x     y, z, x      -x    y, -z, -x
 *     y     z, x, y      -y    z, -x, -y
 *
 * Source: for the least rotation, Duff et al. 2017, J. Computer Graphics Techniques 6(1). */
KT_API kt_mat3 kt_triad_from_axis(kt_vec3 axis, int which);

/* ---- poses ------------------------------------------------------------------------------------------------------- */

/* Returns the pose of the reference frame itself. */
static inline kt_pose kt_pose_identity(void) {
    kt_pose p;
    p.rotation = kt_mat3_identity();
    p.position = kt_vec3_make(0.0, 0.0, 0.0);
    return p;
}

/* Returns the point of the reference frame that has coordinates `local` in the posed frame. */
static inline kt_vec3 kt_pose_apply(kt_pose a, kt_vec3 local) {
    return kt_vec3_add(a.position, kt_mat3_apply(a.rotation, local));
}

/* Returns a b. If a is the pose of B in A and b the pose of C in B, a b is the pose of C in A. */
static inline kt_pose kt_pose_compose(kt_pose a, kt_pose b) {
    kt_pose c;
    c.rotation = kt_mat3_multiply(a.rotation, b.rotation);
    c.position = kt_pose_apply(a, b.position);
    return c;
}

/* Returns the pose of the reference frame relative to the posed frame. */
static inline kt_pose kt_pose_invert(kt_pose a) {
    kt_pose b;
    b.rotation = kt_mat3_transpose(a.rotation);
    b.position = kt_vec3_scale(-1.0, kt_mat3_apply_transposed(a.rotation, a.position));
    return b;
}

/* ---- symmetric matrices and inertias ----------------------------------------------------------------------------- */

/* A symmetric matrix of 3 x 3 numbers: its entries. In an inertia xy is minus the product of inertia. */
typedef struct kt_sym3 {
    double xx, yy, zz, xy, xz, yz; /* kg m^2 in an inertia */
} kt_sym3;

/* Returns the matrix with these entries. */
static inline kt_sym3 kt_sym3_make(double xx, double yy, double zz, double xy, double xz, double yz) {
    kt_sym3 s;
    s.xx = xx;
    s.yy = yy;
    s.zz = zz;
    s.xy = xy;
    s.xz = xz;
    s.yz = yz;
    return s;
}

/* Returns A + B. */
static inline kt_sym3 kt_sym3_add(kt_sym3 a, kt_sym3 b) {
    return kt_sym3_make(a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz);
}

/* Returns S u. */
static inline kt_vec3 kt_sym3_apply(kt_sym3 s, kt_vec3 u) {
    return kt_vec3_make(s.xx * u.x + s.xy * u.y + s.xz * u.z, s.xy * u.x + s.yy * u.y + s.yz * u.z,
                        s.xz * u.x + s.yz * u.y + s.zz * u.z);
}

/* Returns R S R': transforms S from the rotated frame to the reference frame. */
static inline kt_sym3 kt_sym3_rotate(kt_mat3 r, kt_sym3 s) {
    kt_mat3 m, p; /* M = columns of S; P' = R S, whose columns are those of S turned */
    m.x = kt_vec3_make(s.xx, s.xy, s.xz);
    m.y = kt_vec3_make(s.xy, s.yy, s.yz);
    m.z = kt_vec3_make(s.xz, s.yz, s.zz);
    p = kt_mat3_transpose(kt_mat3_multiply(r, m));
    const kt_vec3 x = kt_mat3_apply(r, p.x), y = kt_mat3_apply(r, p.y), z = kt_mat3_apply(r, p.z);
    return kt_sym3_make(x.x, y.y, z.z, x.y, x.z, y.z);
}

/* Applies the parallel axis theorem: I + m (c'c 1 - c c'). Returns the inertia about a point from the inertia about the
 * centre of mass. The vector `com` is the centre of mass relative to the point, in the same axes.
 * Units: kg m^2; `com` in m. */
static inline kt_sym3 kt_sym3_shift(kt_sym3 about_com, double mass, kt_vec3 com) {
    const double x = com.x, y = com.y, z = com.z;
    return kt_sym3_add(about_com, kt_sym3_make(mass * (y * y + z * z), mass * (x * x + z * z), mass * (x * x + y * y),
                                               -mass * x * y, -mass * x * z, -mass * y * z));
}

/* Returns the eigenvalues in ascending order (x <= y <= z) of any finite symmetric matrix, with Jacobi rotations.
 * Errors are a few DBL_EPSILON times the largest eigenvalue, at any scale. The result is NaN if an entry is not
 * finite. */
KT_API kt_vec3 kt_sym3_eigenvalues(kt_sym3 s);

/* The reason why no body can have an inertia. */
typedef enum kt_inertia_fault {
    KT_INERTIA_VALID = 0,      /* a body can have it */
    KT_INERTIA_NOT_FINITE = 1, /* an entry is not finite */
    KT_INERTIA_NEGATIVE = 2,   /* the smallest principal moment is negative: not positive semi-definite */
    KT_INERTIA_TRIANGLE = 3    /* the largest principal moment exceeds the sum of the two others: no body can have it */
} kt_inertia_fault;

/* Returns whether a body can have this inertia about its centre of mass (or any of its points). Violations up to 1e-10
 * times the largest principal moment pass as rounding. For a rod or a thin plate equality holds. The output *moments
 * (may be NULL) receives the principal moments in ascending order, unless an entry is not finite. */
KT_API kt_inertia_fault kt_inertia_check(kt_sym3 inertia, kt_vec3 *moments);

/* Returns the excess of the largest principal moment over the sum of the two others, as a fraction of that sum. Returns
 * 0 if kt_inertia_check does not return KT_INERTIA_TRIANGLE, and infinity if that sum is not positive. */
KT_API double kt_inertia_excess(kt_sym3 inertia);

#ifdef __cplusplus
}
#endif
#endif
