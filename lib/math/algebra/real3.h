/* Numbers and vectors of the recursions over the tree. The recursions are compiled for one state, where a number is a
 * double. With KT_LANES they are compiled again, for KT_LANES states of one model at once. A number then has a lane for
 * each state, and a vector is its components. Each lane goes through the operations of the single number, one by one,
 * so that a lane has the same bits as a calculation of one state.
 *
 *   kt_real1   A number, combined by operators, also with numbers of the model that all states share.
 *   kt_real2   A vector in a plane, combined by the functions whose names end in 2.
 *   kt_real3   A vector in space, combined by the functions whose names end in 3.
 *   kt_condition   of each state
 *   kt_index1  the place of a number among others, of each state
 *   kt_const1, kt_const3 ...   numbers, vectors ... of links and bodies, in lanes those of each state's model
 *
 * C has no operators of structs. Therefore each operation on vectors is a function, whose name ends with the number of
 * components N. The functions and the formulas that they stand for:
 *
 *   kt_addN a + b           kt_add_scaledN(a, s, b)  a + s b       kt_dotN  a . b
 *   kt_subN a - b           kt_sub_scaledN(a, s, b)  a - s b       kt_dotsN(a, b, c, d)  a . b + c . d
 *   kt_scaleN(s, a)  s a    kt_mulN  a_i b_i                       kt_crossN  a x b
 *   kt_minusN  -a           kt_across2  (-a_y, a_x)                kt_swap2  (a_y, a_x)
 *   kt_apply3(A, u)  A u    kt_apply_transposed3(A, u)  A' u       kt_sum3  a_x + a_y + a_z
 *   kt_symmetric2_apply(d, s, u)  [d_x s; s d_y] u
 *   kt_loadN, kt_storeN  from and to memory                        kt_makeN, kt_sameN, kt_zero3  from numbers
 *
 * Some conditions end a recursion for one state. A recursion for several states goes on, and records the states for
 * which the condition holds (kt_fails, kt_is_rejected).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_REAL3_H
#define KT_ALGEBRA_REAL3_H

#include "algebra/lane.h"

#include <stdbool.h>

/* A function that replaces an operator is never a call, even if the compiler optimises for size. */
#define KT_OPERATOR static inline __attribute__((always_inline, unused))

/* A component of a vector. If the vector is in memory, only this component is read. */
#ifndef KT_LANES
#define KT_PART2(a, k) ((a)[k])
#define KT_PART3(a, k) ((a)[k])
#else
#define KT_PART2(a, k) kt_part2(a, k)
#define KT_PART3(a, k) kt_part3(a, k)
#endif

#ifndef KT_LANES

typedef double kt_real1;
typedef kt_v2 kt_real2;
typedef kt_v4 kt_real3;
typedef bool kt_condition;
typedef int32_t kt_index1;
typedef double kt_const1;
typedef kt_vec3 kt_const3;
typedef kt_mat3 kt_const_mat3;
typedef kt_pose kt_const_pose;
typedef kt_sym3 kt_const_sym3;

#define kt_make2(x, y) ((kt_v2){(x), (y)})
#define kt_make3(x, y, z) ((kt_v4){(x), (y), (z), 0.0})
#define kt_from3 kt_v4_from
#define kt_cross3 kt_v4_cross
#define kt_dot3 kt_v4_dot
#define kt_sum3 kt_v4_sum
#define kt_apply3 kt_v4_apply
#define kt_apply_to3 kt_v4_apply_to
#define kt_apply_transposed3 kt_v4_apply_transposed
#define kt_same3 kt_v4_splat
#define kt_load2 kt_v2_load
#define kt_from2 kt_v2_load
#define kt_same2 kt_v2_splat
#define kt_store2 kt_v2_store
#define kt_swap2 kt_v2_swap
#define kt_across2 kt_v2_across
#define kt_dot2 kt_v2_dot
#define kt_dots2 kt_v2_dot2
#define kt_dots3 kt_v4_dot2
#define kt_const_from3 kt_v4_from
#define kt_const_apply3 kt_v4_apply_to
#define kt_const_same3 kt_v4_splat
#define kt_const_load2 kt_v2_load
#define kt_const_same2 kt_v2_splat

KT_OPERATOR kt_real1 kt_real1_splat(double x) { return x; }
KT_OPERATOR kt_real1 kt_const_real1(kt_const1 x) { return x; }
KT_OPERATOR double kt_const_any1(kt_const1 x) { return x; }
KT_OPERATOR kt_condition kt_condition_true(void) { return true; }
KT_OPERATOR kt_index1 kt_index1_of(int32_t i) { return i; }
KT_OPERATOR kt_condition kt_condition_false(void) { return false; }

KT_OPERATOR kt_real3 kt_zero3(void) { return kt_v4_splat(0.0); }
KT_OPERATOR kt_real3 kt_splat3(kt_v4 a) { return a; }
KT_OPERATOR void kt_set_part3(kt_real3 *a, int k, kt_real1 x) { (*a)[k] = x; }
KT_OPERATOR kt_real3 kt_add3(kt_real3 a, kt_real3 b) { return a + b; }
KT_OPERATOR kt_real3 kt_sub3(kt_real3 a, kt_real3 b) { return a - b; }
KT_OPERATOR kt_real3 kt_mul3(kt_real3 a, kt_real3 b) { return a * b; }
KT_OPERATOR kt_real3 kt_minus3(kt_real3 a) { return -a; }
KT_OPERATOR kt_real3 kt_scale3(kt_real1 s, kt_real3 a) { return kt_v4_splat(s) * a; }

KT_OPERATOR kt_real2 kt_add2(kt_real2 a, kt_real2 b) { return a + b; }
KT_OPERATOR kt_real2 kt_sub2(kt_real2 a, kt_real2 b) { return a - b; }
KT_OPERATOR kt_real2 kt_mul2(kt_real2 a, kt_real2 b) { return a * b; }
KT_OPERATOR kt_real2 kt_minus2(kt_real2 a) { return -a; }
KT_OPERATOR kt_real2 kt_scale2(kt_real1 s, kt_real2 a) { return kt_v2_splat(s) * a; }

#else

typedef double kt_real1 __attribute__((vector_size(8 * KT_LANES)));
typedef int64_t kt_condition __attribute__((vector_size(8 * KT_LANES)));
typedef kt_condition kt_index1;
typedef struct kt_real2 {
    kt_real1 x, y;
} kt_real2;
typedef struct kt_real3 {
    kt_real1 x, y, z;
} kt_real3;
typedef kt_real1 kt_const1;
typedef kt_real3 kt_const3;
typedef struct kt_const_mat3 {
    kt_const3 x, y, z;
} kt_const_mat3;
typedef struct kt_const_pose {
    kt_const_mat3 rotation;
    kt_const3 position;
} kt_const_pose;
typedef struct kt_const_sym3 {
    kt_const1 xx, yy, zz, xy, xz, yz;
} kt_const_sym3;

/* x - 0 is x, also where x is -0. */
KT_OPERATOR kt_real1 kt_real1_splat(double x) { return x - (kt_real1){0}; }
KT_OPERATOR kt_condition kt_condition_false(void) { return (kt_condition){0}; }
KT_OPERATOR kt_condition kt_condition_true(void) { return ~(kt_condition){0}; }
KT_OPERATOR kt_index1 kt_index1_of(int32_t i) { return (kt_index1){0} + i; }

KT_OPERATOR kt_real3 kt_make3(kt_real1 x, kt_real1 y, kt_real1 z) { return (kt_real3){x, y, z}; }
KT_OPERATOR kt_real3 kt_zero3(void) { return (kt_real3){.x = {0}}; }
KT_OPERATOR kt_real3 kt_from3(kt_vec3 a) {
    return (kt_real3){kt_real1_splat(a.x), kt_real1_splat(a.y), kt_real1_splat(a.z)};
}
KT_OPERATOR kt_real3 kt_splat3(kt_v4 a) { return kt_from3(kt_v4_vec3(a)); }
KT_OPERATOR kt_real3 kt_same3(double s) { return kt_from3((kt_vec3){s, s, s}); }
/* Chosen at compilation: k is a constant where loops are unrolled; else through memory. */
KT_OPERATOR kt_real1 kt_part3(kt_real3 a, int k) { return k == 0 ? a.x : k == 1 ? a.y : a.z; }
KT_OPERATOR void kt_set_part3(kt_real3 *a, int k, kt_real1 x) {
    if (k == 0)
        a->x = x;
    else if (k == 1)
        a->y = x;
    else
        a->z = x;
}
KT_OPERATOR kt_real3 kt_add3(kt_real3 a, kt_real3 b) { return (kt_real3){a.x + b.x, a.y + b.y, a.z + b.z}; }
KT_OPERATOR kt_real3 kt_sub3(kt_real3 a, kt_real3 b) { return (kt_real3){a.x - b.x, a.y - b.y, a.z - b.z}; }
KT_OPERATOR kt_real3 kt_mul3(kt_real3 a, kt_real3 b) { return (kt_real3){a.x * b.x, a.y * b.y, a.z * b.z}; }
KT_OPERATOR kt_real3 kt_minus3(kt_real3 a) { return (kt_real3){-a.x, -a.y, -a.z}; }
KT_OPERATOR kt_real3 kt_scale3(kt_real1 s, kt_real3 a) { return (kt_real3){s * a.x, s * a.y, s * a.z}; }
KT_OPERATOR kt_real3 kt_cross3(kt_real3 a, kt_real3 b) {
    return (kt_real3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
KT_OPERATOR kt_real1 kt_sum3(kt_real3 a) { return (a.x + a.y) + a.z; }
KT_OPERATOR kt_real1 kt_dot3(kt_real3 a, kt_real3 b) { return kt_sum3(kt_mul3(a, b)); }
KT_OPERATOR kt_real3 kt_apply3(const kt_real3 a[3], kt_real3 u) {
    return kt_add3(kt_add3(kt_scale3(u.x, a[0]), kt_scale3(u.y, a[1])), kt_scale3(u.z, a[2]));
}
KT_OPERATOR kt_real3 kt_apply_to3(const kt_real3 a[3], kt_vec3 u) { return kt_apply3(a, kt_from3(u)); }
KT_OPERATOR kt_real3 kt_apply_transposed3(const kt_real3 a[3], kt_real3 u) {
    return (kt_real3){kt_dot3(a[0], u), kt_dot3(a[1], u), kt_dot3(a[2], u)};
}

KT_OPERATOR kt_real1 kt_const_real1(kt_const1 x) { return x; }
/* Returns a number that is the same in all lanes. */
KT_OPERATOR double kt_const_any1(kt_const1 x) { return x[0]; }
KT_OPERATOR kt_real3 kt_const_from3(kt_const3 a) { return a; }
KT_OPERATOR kt_real3 kt_const_apply3(const kt_real3 a[3], kt_const3 u) { return kt_apply3(a, u); }
KT_OPERATOR kt_real3 kt_const_same3(kt_const1 s) { return (kt_real3){s, s, s}; }

KT_OPERATOR kt_real2 kt_make2(kt_real1 x, kt_real1 y) { return (kt_real2){x, y}; }
KT_OPERATOR kt_real2 kt_const_load2(const kt_const1 *x) { return (kt_real2){x[0], x[1]}; }
KT_OPERATOR kt_real2 kt_const_same2(kt_const1 s) { return (kt_real2){s, s}; }
KT_OPERATOR kt_real2 kt_load2(const kt_real1 *x) { return (kt_real2){x[0], x[1]}; }
KT_OPERATOR kt_real2 kt_from2(const double *x) { return (kt_real2){kt_real1_splat(x[0]), kt_real1_splat(x[1])}; }
KT_OPERATOR kt_real2 kt_same2(double s) { return (kt_real2){kt_real1_splat(s), kt_real1_splat(s)}; }
KT_OPERATOR void kt_store2(kt_real1 *x, kt_real2 a) {
    x[0] = a.x;
    x[1] = a.y;
}
KT_OPERATOR kt_real1 kt_part2(kt_real2 a, int k) { return k == 0 ? a.x : a.y; }
KT_OPERATOR kt_real2 kt_add2(kt_real2 a, kt_real2 b) { return (kt_real2){a.x + b.x, a.y + b.y}; }
KT_OPERATOR kt_real2 kt_sub2(kt_real2 a, kt_real2 b) { return (kt_real2){a.x - b.x, a.y - b.y}; }
KT_OPERATOR kt_real2 kt_mul2(kt_real2 a, kt_real2 b) { return (kt_real2){a.x * b.x, a.y * b.y}; }
KT_OPERATOR kt_real2 kt_minus2(kt_real2 a) { return (kt_real2){-a.x, -a.y}; }
KT_OPERATOR kt_real2 kt_scale2(kt_real1 s, kt_real2 a) { return (kt_real2){s * a.x, s * a.y}; }
KT_OPERATOR kt_real2 kt_swap2(kt_real2 a) { return (kt_real2){a.y, a.x}; }
KT_OPERATOR kt_real2 kt_across2(kt_real2 a) { return (kt_real2){-a.y, a.x}; }
KT_OPERATOR kt_real1 kt_dot2(kt_real2 a, kt_real2 b) { return a.x * b.x + a.y * b.y; }

/* a . b + c . d */
KT_OPERATOR kt_real1 kt_dots2(kt_real2 a, kt_real2 b, kt_real2 c, kt_real2 d) {
    return (a.x * b.x + c.x * d.x) + (a.y * b.y + c.y * d.y);
}
KT_OPERATOR kt_real1 kt_dots3(kt_real3 a, kt_real3 b, kt_real3 c, kt_real3 d) {
    return kt_sum3(kt_add3(kt_mul3(a, b), kt_mul3(c, d)));
}

#endif

KT_OPERATOR kt_real2 kt_add_scaled2(kt_real2 a, kt_real1 s, kt_real2 b) { return kt_add2(a, kt_scale2(s, b)); }
KT_OPERATOR kt_real2 kt_sub_scaled2(kt_real2 a, kt_real1 s, kt_real2 b) { return kt_sub2(a, kt_scale2(s, b)); }
KT_OPERATOR kt_real3 kt_add_scaled3(kt_real3 a, kt_real1 s, kt_real3 b) { return kt_add3(a, kt_scale3(s, b)); }
KT_OPERATOR kt_real3 kt_sub_scaled3(kt_real3 a, kt_real1 s, kt_real3 b) { return kt_sub3(a, kt_scale3(s, b)); }

KT_OPERATOR kt_real2 kt_symmetric2_apply(kt_real2 diagonal, kt_real1 off, kt_real2 u) {
    return kt_add_scaled2(kt_mul2(diagonal, u), off, kt_swap2(u));
}

/* a x b, a number in a plane. */
KT_OPERATOR kt_real1 kt_cross2(kt_real2 a, kt_real2 b) {
    return KT_PART2(a, 0) * KT_PART2(b, 1) - KT_PART2(a, 1) * KT_PART2(b, 0);
}

/* out = A B */
KT_INLINE void kt_multiply3(const kt_real3 a[3], const kt_real3 b[3], kt_real3 out[3]) {
    const kt_real3 x = kt_apply3(a, b[0]), y = kt_apply3(a, b[1]), z = kt_apply3(a, b[2]);
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* out = R J R' */
KT_INLINE void kt_rotate_inertia3(const kt_real3 r[3], const kt_const_sym3 *j, kt_real3 out[3]) {
    const kt_real3 x = kt_const_apply3(r, (kt_const3){j->xx, j->xy, j->xz});
    const kt_real3 y = kt_const_apply3(r, (kt_const3){j->xy, j->yy, j->yz});
    const kt_real3 z = kt_const_apply3(r, (kt_const3){j->xz, j->yz, j->zz});
    for (int k = 0; k < 3; k++)
        out[k] = kt_add3(kt_add3(kt_scale3(KT_PART3(r[0], k), x), kt_scale3(KT_PART3(r[1], k), y)),
                         kt_scale3(KT_PART3(r[2], k), z));
}

/* Symmetric matrices, by columns. For several states, only the elements on and below the diagonal are stored. For one
 * state, both triangles are stored with equal bits, so that both forms give equal results. */

/* Copies the elements below the diagonal to the upper triangle. */
KT_OPERATOR void kt_symmetric3_mirror(kt_real3 a[3]) {
#ifdef KT_LANES
    (void)a;
#else
    a[1] = __builtin_shufflevector(a[1], a[0], 5, 1, 2, 3);
    a[2] = __builtin_shufflevector(__builtin_shufflevector(a[0], a[1], 2, 6, 2, 3), a[2], 0, 1, 6, 7);
#endif
}

/* All columns. */
KT_OPERATOR void kt_symmetric3_columns(const kt_real3 a[3], kt_real3 out[3]) {
#ifdef KT_LANES
    out[0] = a[0];
    out[1] = kt_make3(a[0].y, a[1].y, a[1].z);
    out[2] = kt_make3(a[0].z, a[1].z, a[2].z);
#else
    out[0] = a[0];
    out[1] = a[1];
    out[2] = a[2];
#endif
}

KT_OPERATOR kt_real3 kt_symmetric3_apply(const kt_real3 a[3], kt_real3 u) {
    kt_real3 column[3];
    kt_symmetric3_columns(a, column);
    return kt_apply3(column, u);
}

KT_OPERATOR void kt_symmetric3_add(kt_real3 a[3], const kt_real3 b[3]) {
#ifdef KT_LANES
    a[0] = kt_add3(a[0], b[0]);
    a[1].y += b[1].y;
    a[1].z += b[1].z;
    a[2].z += b[2].z;
#else
    for (int k = 0; k < 3; k++)
        a[k] += b[k];
#endif
}

/* A += B + B' of any matrix B. */
KT_OPERATOR void kt_symmetric3_add_both(kt_real3 a[3], const kt_real3 b[3]) {
#ifdef KT_LANES
    a[0] = kt_add3(a[0], kt_make3(b[0].x + b[0].x, b[0].y + b[1].x, b[0].z + b[2].x));
    a[1].y += b[1].y + b[1].y;
    a[1].z += b[1].z + b[2].y;
    a[2].z += b[2].z + b[2].z;
#else
    kt_v4 other[3];
    kt_v4_transpose(b, other);
    for (int k = 0; k < 3; k++)
        a[k] += b[k] + other[k];
#endif
}

/* A -= d u u'; d multiplies last, since (d u_i) u_j is not (d u_j) u_i. */
KT_OPERATOR void kt_symmetric3_subtract_square(kt_real3 a[3], kt_real1 d, kt_real3 u) {
#ifdef KT_LANES
    a[0] = kt_sub3(a[0], kt_scale3(d, kt_scale3(u.x, u)));
    a[1].y -= d * (u.y * u.y);
    a[1].z -= d * (u.y * u.z);
    a[2].z -= d * (u.z * u.z);
#else
    for (int k = 0; k < 3; k++)
        a[k] -= kt_v4_splat(d) * (kt_v4_splat(u[k]) * u);
#endif
}

/* Whether a recursion ends because a condition does not hold. A recursion for one state ends. A recursion for several
 * states goes on; *all then contains the states for which all conditions held. */
/* NOLINTNEXTLINE(readability-non-const-parameter): it is written where there are lanes */
KT_OPERATOR bool kt_fails(kt_condition *all, kt_condition condition) {
#ifndef KT_LANES
    (void)all;
    return !condition;
#else
    *all &= condition;
    return false;
#endif
}

/* The columns of R(p), for a quaternion p of any non-zero norm (kt_mat3_from_quat). */
KT_OPERATOR void kt_rotation3(const kt_real1 *p, kt_real3 r[3]) {
#ifndef KT_LANES
    kt_v4_from_mat3(kt_mat3_from_quat(kt_quat_make(p[0], p[1], p[2], p[3])), r);
#else
    const kt_real1 w = p[0], x = p[1], y = p[2], z = p[3], n2 = w * w + x * x + y * y + z * z;
    const kt_condition usual = (n2 > 1e-280) & (n2 < 1e280);
    int64_t all = -1;
    for (int lane = 0; lane < KT_LANES; lane++)
        all &= usual[lane];
    if (!all) { /* some have to be scaled first */
        for (int lane = 0; lane < KT_LANES; lane++) {
            const kt_mat3 m = kt_mat3_from_quat(kt_quat_make(w[lane], x[lane], y[lane], z[lane]));
            const kt_vec3 column[3] = {m.x, m.y, m.z};
            for (int k = 0; k < 3; k++) {
                r[k].x[lane] = column[k].x;
                r[k].y[lane] = column[k].y;
                r[k].z[lane] = column[k].z;
            }
        }
        return;
    }
    const kt_real1 s = 2.0 / n2, wx = s * w * x, wy = s * w * y, wz = s * w * z;
    const kt_real1 xx = s * x * x, xy = s * x * y, xz = s * x * z, yy = s * y * y, yz = s * y * z, zz = s * z * z;
    r[0] = kt_make3(1.0 - (yy + zz), xy + wz, xz - wy);
    r[1] = kt_make3(xy - wz, 1.0 - (xx + zz), yz + wx);
    r[2] = kt_make3(xz + wy, yz - wx, 1.0 - (xx + yy));
#endif
}

#endif
