/* Numbers and vectors of code that is compiled for values and, with KT_DUAL, for dual numbers. A dual number is a value
 * with its derivative along one direction of the state. The derivative is exact, and nobody has to derive its formula.
 *
 * Such a number is x + i h dx, a complex one with h = 2^-200: sums and products of these are
 *     (x + i h dx) + (y + i h dy) = x + y + i h (dx + dy),   (x + i h dx)(y + i h dy) = x y + i h (x dy + dx y) - h^2
 * The term with h^2 is far below the last digit. This is the complex step (Squire and Trapp 1998, SIAM Review 40), with
 * functions by the chain rule. A vector has its value in lanes 0 to 3. The lanes from 4 on have h times its derivative.
 * Without KT_DUAL all of this is double and kt_v4, and costs nothing.
 *
 * Operators add and subtract vectors; these functions do the rest. Operators combine numbers, and kt_value makes them
 * comparable.
 *
 * With KT_LANES a number has one value for each of several states (algebra/real3.h); this header has no vectors of such
 * numbers. Code that is compiled for these, too, does not branch on conditions that may differ between states.
 * KT_CHOOSE takes one of two numbers; in lanes both are computed. The function kt_is_anywhere returns whether a
 * condition holds for any state. A kt_plain is a number without a derivative, such as the time or a sign.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_REAL_H
#define KT_ALGEBRA_REAL_H

#include "algebra/lane.h"
#include "algebra/real3.h"

#include <math.h>

#ifndef KT_LANES

typedef double kt_plain;

#define KT_CHOOSE(condition, a, b) ((condition) ? (a) : (b))
/* The larger of two numbers. If one number is NaN, the result is the other number. In lanes, only a NaN of the second
 * number is replaced, with the first number. */
KT_OPERATOR double kt_most1(double a, double b) { return fmax(a, b); }
KT_OPERATOR bool kt_is_finite1(double x) { return isfinite(x); }
KT_OPERATOR double kt_sqrt1(double x) { return sqrt(x); }
KT_OPERATOR double kt_abs1(double x) { return fabs(x); }
KT_OPERATOR bool kt_is_anywhere(bool condition) { return condition; }
KT_OPERATOR bool kt_not(bool condition) { return !condition; }
KT_OPERATOR kt_plain kt_plain_of(double x) { return x; }

#endif

#ifdef KT_LANES

typedef kt_real1 kt_real, kt_plain;

KT_OPERATOR kt_real kt_choose(kt_condition condition, kt_real a, kt_real b) {
    return (kt_real)((condition & (kt_condition)a) | (~condition & (kt_condition)b));
}
#define KT_CHOOSE(condition, a, b) kt_choose(condition, a, b)
KT_OPERATOR kt_real kt_most1(kt_real a, kt_real b) { return kt_choose(b > a, b, a); }
KT_OPERATOR kt_condition kt_is_finite1(kt_real x) { return x - x == kt_real1_splat(0.0); }
KT_OPERATOR bool kt_is_anywhere(kt_condition condition) {
    int64_t any = 0;
    for (int lane = 0; lane < KT_LANES; lane++)
        any |= condition[lane];
    return any != 0;
}
KT_OPERATOR kt_condition kt_not(kt_condition condition) { return ~condition; }
KT_OPERATOR kt_plain kt_plain_of(double x) { return kt_real1_splat(x); }
KT_OPERATOR kt_real kt_real_of(double x) { return kt_real1_splat(x); }
KT_OPERATOR kt_real kt_value(kt_real x) { return x; }

/* Functions of the C library, lane by lane. */
#define KT_LANE_BY_LANE(name, function)                                                                                \
    KT_INLINE kt_real name(kt_real x) {                                                                                \
        for (int lane = 0; lane < KT_LANES; lane++)                                                                    \
            x[lane] = function(x[lane]);                                                                               \
        return x;                                                                                                      \
    }
KT_LANE_BY_LANE(kt_sqrt, sqrt)
KT_LANE_BY_LANE(kt_exp, exp)
KT_LANE_BY_LANE(kt_tanh, tanh)
#undef KT_LANE_BY_LANE
KT_INLINE kt_real kt_pow(kt_real x, double exponent) {
    for (int lane = 0; lane < KT_LANES; lane++)
        x[lane] = pow(x[lane], exponent);
    return x;
}
KT_OPERATOR kt_real kt_abs(kt_real x) { return (kt_real)((kt_condition)x & INT64_MAX); }
KT_OPERATOR kt_real kt_max(kt_real x, double least) { return kt_choose(x > least, x, kt_real_of(least)); }
KT_OPERATOR kt_real1 kt_sqrt1(kt_real1 x) { return kt_sqrt(x); }
KT_OPERATOR kt_real1 kt_abs1(kt_real1 x) { return kt_abs(x); }

#elif !defined(KT_DUAL)

typedef double kt_real;
typedef kt_v4 kt_vector;

KT_INLINE double kt_value(kt_real x) { return x; }
KT_INLINE kt_real kt_real_of(double x) { return x; }
KT_INLINE kt_real kt_sqrt(kt_real x) { return sqrt(x); }
KT_INLINE kt_real kt_atan2(kt_real y, kt_real x) { return atan2(y, x); }
KT_INLINE kt_real kt_max(kt_real x, double least) { return fmax(x, least); }
KT_INLINE kt_real kt_remainder(kt_real x, double period) { return remainder(x, period); }
KT_INLINE kt_real kt_abs(kt_real x) { return fabs(x); }
KT_INLINE kt_real kt_pow(kt_real x, double exponent) { return pow(x, exponent); }
KT_INLINE kt_real kt_exp(kt_real x) { return exp(x); }
KT_INLINE kt_real kt_tanh(kt_real x) { return tanh(x); }
KT_INLINE kt_real kt_tan(kt_real x) { return tan(x); }
KT_INLINE kt_real kt_sin(kt_real x) { return sin(x); }
KT_INLINE kt_real kt_cos(kt_real x) { return cos(x); }

KT_INLINE kt_vector kt_vector_zero(void) { return kt_v4_splat(0.0); }
KT_INLINE kt_vector kt_vector_make(kt_real x, kt_real y, kt_real z) { return (kt_v4){x, y, z, 0.0}; }
KT_INLINE kt_real kt_component(kt_vector a, int k) { return a[k]; }
KT_INLINE kt_real kt_dot(kt_vector a, kt_vector b) { return kt_v4_dot(a, b); }
KT_INLINE kt_vector kt_cross(kt_vector a, kt_vector b) { return kt_v4_cross(a, b); }
KT_INLINE kt_vector kt_scale(kt_real s, kt_vector a) { return kt_v4_splat(s) * a; }
KT_INLINE kt_vector kt_over(kt_vector a, kt_real s) { return a / kt_v4_splat(s); }
KT_INLINE kt_vector kt_apply(const kt_vector a[3], kt_vector u) { return kt_v4_apply(a, u); }
KT_INLINE kt_vector kt_apply_transposed(const kt_vector a[3], kt_vector u) { return kt_v4_apply_transposed(a, u); }

#else

typedef double _Complex kt_real;
typedef double kt_vector __attribute__((vector_size(64)));

#define KT_TINY 0x1p-200

/* Real and imaginary part; C lays a complex number out as an array of two. */
typedef union kt_parts {
    kt_real whole;
    double part[2];
} kt_parts;
KT_INLINE kt_real kt_dual_join(double low, double high) { return (kt_parts){.part = {low, high}}.whole; }
KT_INLINE double kt_dual_value(kt_real x) { return (kt_parts){.whole = x}.part[0]; }
KT_INLINE double kt_dual_scaled_derivative(kt_real x) { return (kt_parts){.whole = x}.part[1]; }

/* From a value and its derivative, and back. */
KT_INLINE kt_real kt_dual_make(double x, double change) { return kt_dual_join(x, KT_TINY * change); }
KT_INLINE double kt_value(kt_real x) { return kt_dual_value(x); }
KT_INLINE kt_real kt_real_of(double x) { return x; }
KT_INLINE double kt_derivative_of(kt_real x) { return kt_dual_scaled_derivative(x) / KT_TINY; }

KT_INLINE kt_v4 kt_lower(kt_vector a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3); }
KT_INLINE kt_v4 kt_upper(kt_vector a) { return __builtin_shufflevector(a, a, 4, 5, 6, 7); }
KT_INLINE kt_vector kt_join(kt_v4 low, kt_v4 high) {
    return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}
KT_INLINE kt_vector kt_vector_of(kt_v4 x, kt_v4 change) { return kt_join(x, kt_v4_splat(KT_TINY) * change); }
KT_INLINE kt_v4 kt_vector_value(kt_vector a) { return kt_lower(a); }
KT_INLINE kt_v4 kt_vector_derivative(kt_vector a) { return kt_upper(a) / kt_v4_splat(KT_TINY); }

/* f(x) from the values f and f' at x */
KT_INLINE kt_real kt_chain(kt_real x, double f, double slope) {
    return kt_dual_join(f, slope * kt_dual_scaled_derivative(x));
}
/* At 0, the least length of a vector, the derivative is taken as 0. */
KT_INLINE kt_real kt_sqrt(kt_real x) {
    const double root = sqrt(kt_dual_value(x));
    return kt_chain(x, root, root > 0.0 ? 0.5 / root : 0.0);
}
KT_INLINE kt_real kt_atan2(kt_real y, kt_real x) {
    const double yy = kt_dual_value(y), xx = kt_dual_value(x);
    return kt_dual_join(atan2(yy, xx),
                        (xx * kt_dual_scaled_derivative(y) - yy * kt_dual_scaled_derivative(x)) / (xx * xx + yy * yy));
}
KT_INLINE kt_real kt_max(kt_real x, double least) { return kt_dual_value(x) >= least ? x : kt_dual_join(least, 0.0); }
KT_INLINE kt_real kt_remainder(kt_real x, double period) {
    return kt_dual_join(remainder(kt_dual_value(x), period), kt_dual_scaled_derivative(x));
}
KT_INLINE kt_real kt_abs(kt_real x) { return kt_dual_value(x) < 0.0 ? -x : x; }
KT_INLINE kt_real kt_pow(kt_real x, double exponent) {
    return kt_chain(x, pow(kt_dual_value(x), exponent), exponent * pow(kt_dual_value(x), exponent - 1.0));
}
KT_INLINE kt_real kt_exp(kt_real x) { return kt_chain(x, exp(kt_dual_value(x)), exp(kt_dual_value(x))); }
KT_INLINE kt_real kt_tanh(kt_real x) {
    const double f = tanh(kt_dual_value(x));
    return kt_chain(x, f, 1.0 - f * f);
}
KT_INLINE kt_real kt_tan(kt_real x) {
    const double f = tan(kt_dual_value(x));
    return kt_chain(x, f, 1.0 + f * f);
}
KT_INLINE kt_real kt_sin(kt_real x) { return kt_chain(x, sin(kt_dual_value(x)), cos(kt_dual_value(x))); }
KT_INLINE kt_real kt_cos(kt_real x) { return kt_chain(x, cos(kt_dual_value(x)), -sin(kt_dual_value(x))); }

KT_INLINE kt_vector kt_vector_zero(void) { return (kt_vector){0.0}; }
KT_INLINE kt_vector kt_vector_make(kt_real x, kt_real y, kt_real z) {
    return (kt_vector){kt_dual_value(x),
                       kt_dual_value(y),
                       kt_dual_value(z),
                       0.0,
                       kt_dual_scaled_derivative(x),
                       kt_dual_scaled_derivative(y),
                       kt_dual_scaled_derivative(z),
                       0.0};
}
KT_INLINE kt_real kt_component(kt_vector a, int k) { return kt_dual_join(a[k], a[4 + k]); }
KT_INLINE kt_real kt_dot(kt_vector a, kt_vector b) {
    const kt_v4 x = kt_lower(a), y = kt_lower(b);
    return kt_dual_join(kt_v4_dot(x, y), kt_v4_dot2(x, kt_upper(b), kt_upper(a), y));
}
KT_INLINE kt_vector kt_cross(kt_vector a, kt_vector b) {
    const kt_v4 x = kt_lower(a), y = kt_lower(b);
    return kt_join(kt_v4_cross(x, y), kt_v4_cross(x, kt_upper(b)) + kt_v4_cross(kt_upper(a), y));
}
KT_INLINE kt_vector kt_scale(kt_real s, kt_vector a) {
    const kt_v4 x = kt_lower(a), real = kt_v4_splat(kt_dual_value(s));
    return kt_join(real * x, real * kt_upper(a) + kt_v4_splat(kt_dual_scaled_derivative(s)) * x);
}
KT_INLINE kt_vector kt_over(kt_vector a, kt_real s) { return kt_scale(1.0 / s, a); }
KT_INLINE kt_vector kt_apply(const kt_vector a[3], kt_vector u) {
    return kt_scale(kt_component(u, 0), a[0]) + kt_scale(kt_component(u, 1), a[1]) + kt_scale(kt_component(u, 2), a[2]);
}
KT_INLINE kt_vector kt_apply_transposed(const kt_vector a[3], kt_vector u) {
    return kt_vector_make(kt_dot(a[0], u), kt_dot(a[1], u), kt_dot(a[2], u));
}

#endif

#ifndef KT_LANES

/* ---- rotations --------------------------------------------------------------------------------------------------- */

/* The unit quaternion (w, e), w >= 0, of a rotation matrix by columns. */
typedef struct kt_euler_parameters {
    kt_real w;
    kt_vector e;
} kt_euler_parameters;

KT_INLINE kt_euler_parameters kt_euler_parameters_of(const kt_vector r[3]) {
#ifndef KT_DUAL
    const kt_quat q = kt_quat_from_mat3(kt_v4_mat3(r));
    return (kt_euler_parameters){.w = q.w, .e = {q.x, q.y, q.z, 0.0}};
#else
    /* R' = s x R, so s = sum r_k x r_k' / 2;  w' = -s . e / 2,  e' = (w s + s x e) / 2. */
    const kt_v4 x[3] = {kt_lower(r[0]), kt_lower(r[1]), kt_lower(r[2])}, half = kt_v4_splat(0.5);
    const kt_quat q = kt_quat_from_mat3(kt_v4_mat3(x));
    const kt_v4 e = {q.x, q.y, q.z, 0.0};
    const kt_v4 s = half * (kt_v4_cross(x[0], kt_upper(r[0])) + kt_v4_cross(x[1], kt_upper(r[1])) +
                            kt_v4_cross(x[2], kt_upper(r[2])));
    return (kt_euler_parameters){.w = kt_dual_join(q.w, -0.5 * kt_v4_dot(s, e)),
                                 .e = kt_join(e, half * (kt_v4_splat(q.w) * s + kt_v4_cross(s, e)))};
#endif
}

#endif

/* The larger of two numbers; the second number if either is NaN. */
KT_OPERATOR kt_real1 kt_larger(kt_real1 a, kt_real1 b) { return KT_CHOOSE(a > b, a, b); }

#endif
