/* Vectors and matrices of effects, for values and for derivatives (algebra/real.h). For values, the types are kt_vec3
 * and kt_mat3. With KT_DUAL the types also hold derivatives. With KT_LANES they hold several states (algebra/real3.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EFFECT_TRIPLE_H
#define KT_EFFECT_TRIPLE_H

#include "algebra/real.h"

#ifdef KT_LANES

typedef kt_real3 kt_triple;
typedef struct kt_triple_columns {
    kt_triple x, y, z;
} kt_triple_columns;

KT_OPERATOR kt_triple kt_triple_zero(void) { return kt_zero3(); }
KT_OPERATOR kt_triple kt_triple_constant(kt_plain x, kt_plain y, kt_plain z) { return kt_make3(x, y, z); }
KT_OPERATOR kt_triple kt_triple_add(kt_triple a, kt_triple b) { return kt_add3(a, b); }
KT_OPERATOR kt_triple kt_triple_sub(kt_triple a, kt_triple b) { return kt_sub3(a, b); }
KT_OPERATOR kt_triple kt_triple_scale(kt_real s, kt_triple a) { return kt_scale3(s, a); }
KT_OPERATOR kt_real kt_triple_dot(kt_triple a, kt_triple b) { return kt_dot3(a, b); }
KT_OPERATOR kt_triple kt_triple_cross(kt_triple a, kt_triple b) { return kt_cross3(a, b); }
KT_OPERATOR kt_triple kt_columns_apply(kt_triple_columns a, kt_triple u) {
    return kt_add3(kt_add3(kt_scale3(u.x, a.x), kt_scale3(u.y, a.y)), kt_scale3(u.z, a.z));
}
KT_OPERATOR kt_triple_columns kt_columns_multiply(kt_triple_columns a, kt_triple_columns b) {
    return (kt_triple_columns){kt_columns_apply(a, b.x), kt_columns_apply(a, b.y), kt_columns_apply(a, b.z)};
}
KT_OPERATOR kt_triple kt_triple_choose(kt_condition condition, kt_triple a, kt_triple b) {
    return (kt_triple){kt_choose(condition, a.x, b.x), kt_choose(condition, a.y, b.y), kt_choose(condition, a.z, b.z)};
}
#define KT_CHOOSE_TRIPLE(condition, a, b) kt_triple_choose(condition, a, b)

#else

#define KT_CHOOSE_TRIPLE(condition, a, b) ((condition) ? (a) : (b))

#endif

#if !defined(KT_DUAL) && !defined(KT_LANES)

typedef kt_vec3 kt_triple;
typedef kt_mat3 kt_triple_columns;

KT_INLINE kt_triple kt_triple_zero(void) { return kt_vec3_make(0.0, 0.0, 0.0); }
KT_INLINE kt_triple kt_triple_constant(kt_plain x, kt_plain y, kt_plain z) { return kt_vec3_make(x, y, z); }

#define kt_triple_add kt_vec3_add
#define kt_triple_sub kt_vec3_sub
#define kt_triple_scale kt_vec3_scale
#define kt_triple_dot kt_vec3_dot
#define kt_triple_cross kt_vec3_cross
/* (d_x u_x, d_y u_y, d_z u_z) */
KT_INLINE kt_triple kt_triple_scale_each(const double d[3], kt_triple u) {
    return kt_vec3_make(d[0] * u.x, d[1] * u.y, d[2] * u.z);
}
#define kt_columns_apply kt_mat3_apply
#define kt_columns_apply_transposed kt_mat3_apply_transposed
#define kt_columns_multiply kt_mat3_multiply
#define kt_columns_transpose kt_mat3_transpose

#elif defined(KT_DUAL)

typedef kt_vector kt_triple;
typedef struct kt_triple_columns {
    kt_triple x, y, z;
} kt_triple_columns;

KT_INLINE kt_triple kt_triple_zero(void) { return kt_vector_zero(); }
KT_INLINE kt_triple kt_triple_constant(kt_plain x, kt_plain y, kt_plain z) { return (kt_triple){x, y, z}; }

KT_INLINE kt_triple kt_triple_add(kt_triple a, kt_triple b) { return a + b; }
KT_INLINE kt_triple kt_triple_sub(kt_triple a, kt_triple b) { return a - b; }
KT_INLINE kt_triple kt_triple_scale(kt_real s, kt_triple a) { return kt_scale(s, a); }
KT_INLINE kt_real kt_triple_dot(kt_triple a, kt_triple b) { return kt_dot(a, b); }
KT_INLINE kt_triple kt_triple_cross(kt_triple a, kt_triple b) { return kt_cross(a, b); }
KT_INLINE kt_triple kt_triple_scale_each(const double d[3], kt_triple u) {
    return (kt_triple){d[0], d[1], d[2], 0.0, d[0], d[1], d[2], 0.0} * u;
}
KT_INLINE kt_triple kt_columns_apply(kt_triple_columns a, kt_triple u) {
    const kt_vector columns[3] = {a.x, a.y, a.z};
    return kt_apply(columns, u);
}
KT_INLINE kt_triple kt_columns_apply_transposed(kt_triple_columns a, kt_triple u) {
    const kt_vector columns[3] = {a.x, a.y, a.z};
    return kt_apply_transposed(columns, u);
}
KT_INLINE kt_triple_columns kt_columns_multiply(kt_triple_columns a, kt_triple_columns b) {
    return (kt_triple_columns){kt_columns_apply(a, b.x), kt_columns_apply(a, b.y), kt_columns_apply(a, b.z)};
}
KT_INLINE kt_triple kt_columns_row(kt_triple_columns a, int k) {
    return kt_vector_make(kt_component(a.x, k), kt_component(a.y, k), kt_component(a.z, k));
}
KT_INLINE kt_triple_columns kt_columns_transpose(kt_triple_columns a) {
    return (kt_triple_columns){kt_columns_row(a, 0), kt_columns_row(a, 1), kt_columns_row(a, 2)};
}

#endif

KT_INLINE kt_real kt_triple_norm(kt_triple a) { return kt_sqrt(kt_triple_dot(a, a)); }

/* ---- from the numbers of the recursions, and of the model -------------------------------------------------------- */

#ifdef KT_LANES
KT_OPERATOR kt_triple kt_triple_of3(kt_real3 a) { return a; }
KT_OPERATOR kt_triple kt_triple_of_model(kt_vec3 a) { return kt_from3(a); }
KT_OPERATOR kt_triple_columns kt_columns_of3(const kt_real3 a[3]) { return (kt_triple_columns){a[0], a[1], a[2]}; }
KT_OPERATOR kt_triple_columns kt_columns_of_model(kt_mat3 a) {
    return (kt_triple_columns){kt_from3(a.x), kt_from3(a.y), kt_from3(a.z)};
}
#elif !defined(KT_DUAL)
#define kt_triple_of3 kt_v4_vec3
#define kt_triple_of_model(a) (a)
#define kt_columns_of3 kt_v4_mat3
#define kt_columns_of_model(a) (a)
#endif

#ifndef KT_LANES

/* ---- rotations by their Euler vector ------------------------------------------------------------------------------
 *
 * theta of R, and G^-T u, where w = G theta' is the angular velocity in the axes that R is expressed in [MSD A.28]:
 *     G^-1 = 1 - [theta] / 2 + c [theta]^2,   c = (1 - y cot y) / |theta|^2,   y = |theta| / 2
 *          c = 1 / 12 + x / 720 + x^2 / 30240 + ..,  x = |theta|^2: |B_2k| x^(k-1) / (2 k)!
 * In the changes, R' = w x R: w = sum r_k x r_k' / 2 over its columns, and theta' = G^-1 w.
 */
/* The coefficients |B_2k| / (2 k)! of c for k = 1 .. 7. Each is multiplied by x^(k - 1). */
static const double kt_rotation_vector_map_series[] = {1.0 / 12.0,         1.0 / 720.0,      1.0 / 30240.0,
                                                       1.0 / 1209600.0,    1.0 / 47900160.0, 691.0 / 1307674368000.0,
                                                       1.0 / 74724249600.0};

/* c of x = |theta|^2, by its series where 1 - y cot y would cancel. */
KT_INLINE kt_real kt_rotation_vector_map_coefficient(kt_real x) {
    if (kt_value(x) < 0.25) {
        kt_real c = 0.0;
        for (int k = 6; k >= 0; k--)
            c = kt_rotation_vector_map_series[k] + x * c;
        return c;
    }
    const kt_real y = 0.5 * kt_sqrt(x);
    return (1.0 - y / kt_tan(y)) / x;
}

#ifndef KT_DUAL

KT_INLINE kt_triple kt_rotation_vector_of(kt_triple_columns r) { return kt_euler_vector_from_mat3(r); }

KT_INLINE kt_triple kt_rotation_vector_transposed_map(kt_triple theta, kt_triple u) {
    kt_mat3 inverse = kt_mat3_identity();
    kt_error error;
    if (kt_euler_vector_map_inverse(theta, &inverse, &error) != KT_OK)
        inverse =
            kt_mat3_identity(); /* theta is not finite, and so will be the result: up to half a turn G is regular */
    return kt_mat3_apply_transposed(inverse, u);
}

/* dc/dx = (y (1 + cot^2 y) - cot y) / (8 y x) - c / x, or the derivative of the series. */
KT_INLINE double kt_rotation_vector_map_coefficient_derivative(double x) {
    double derivative = 0.0;
    for (int k = 6; k >= 1 && x < 0.25; k--)
        derivative = k * kt_rotation_vector_map_series[k] + x * derivative;
    if (x < 0.25)
        return derivative;
    const double y = 0.5 * sqrt(x), cot = 1.0 / tan(y);
    return (y * (1.0 + cot * cot) - cot) / (8.0 * y * x) - (1.0 - y * cot) / (x * x);
}

#else

/* theta of R as a dual number. Its derivative is G^-1 w with w = sum r_k x r_k' / 2. */
KT_INLINE kt_triple kt_rotation_vector_of(kt_triple_columns r) {
    const kt_v4 x = kt_lower(r.x), y = kt_lower(r.y), z = kt_lower(r.z), columns[3] = {x, y, z};
    const kt_v4 twice = kt_v4_cross(x, kt_upper(r.x)) + kt_v4_cross(y, kt_upper(r.y)) + kt_v4_cross(z, kt_upper(r.z));
    const kt_vec3 theta = kt_euler_vector_from_mat3(kt_v4_mat3(columns));
    kt_mat3 inverse;
    kt_error error;
    if (kt_euler_vector_map_inverse(theta, &inverse, &error) != KT_OK)
        inverse = kt_mat3_identity();
    const kt_vec3 change = kt_mat3_apply(inverse, kt_v4_vec3(kt_v4_splat(0.5) * twice));
    return kt_join(kt_v4_from(theta), kt_v4_from(change));
}

KT_INLINE kt_triple kt_rotation_vector_transposed_map(kt_triple theta, kt_triple u) {
    const kt_triple across = kt_cross(theta, u);
    return u + kt_scale(0.5, across) +
           kt_scale(kt_rotation_vector_map_coefficient(kt_dot(theta, theta)), kt_cross(theta, across));
}

#endif

#endif

#endif
