/* Three-vectors in four lanes, for the recursions: one arithmetic instruction for each vector, on processors with such
 * instructions.
 *
 * Lane 3 of a vector is zero. The compiler's vector extension is lane-wise IEEE arithmetic at any width, so every
 * instruction set gives the same bits.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LANE_H
#define KT_LANE_H

#include "kinetree/algebra.h"

#include <stdint.h>
#include <string.h>

typedef double kt_v4 __attribute__((vector_size(32)));

/* Two lanes, for vectors in a plane. */
typedef double kt_v2 __attribute__((vector_size(16)));

/* A build that counts branches defines KT_INLINE without inlining, because each inlined copy would count its branches
 * again (test/coverage). */
#ifndef KT_INLINE
#ifdef __OPTIMIZE_SIZE__ /* the compiler decides: forced, the recursions take twice the space */
#define KT_INLINE static inline __attribute__((unused))
#else
#define KT_INLINE static inline __attribute__((always_inline, unused))
#endif
#endif

KT_INLINE kt_v4 kt_v4_splat(double s) { return (kt_v4){s, s, s, s}; }
KT_INLINE kt_v4 kt_v4_from(kt_vec3 a) { return (kt_v4){a.x, a.y, a.z, 0.0}; }
KT_INLINE kt_vec3 kt_v4_vec3(kt_v4 a) { return kt_vec3_make(a[0], a[1], a[2]); }
KT_INLINE kt_v4 kt_v4_load(const double *x) {
    kt_v4 v;
    memcpy(&v, x, sizeof v);
    return v;
}
KT_INLINE void kt_v4_store(double *x, kt_v4 v) { memcpy(x, &v, sizeof v); }

KT_INLINE kt_v2 kt_v2_splat(double s) { return (kt_v2){s, s}; }
KT_INLINE kt_v2 kt_v2_load(const double *x) {
    kt_v2 v;
    memcpy(&v, x, sizeof v);
    return v;
}
KT_INLINE void kt_v2_store(double *x, kt_v2 v) { memcpy(x, &v, sizeof v); }
KT_INLINE kt_v2 kt_v2_swap(kt_v2 a) { return __builtin_shufflevector(a, a, 1, 0); }
KT_INLINE double kt_v2_dot(kt_v2 a, kt_v2 b) {
    const kt_v2 p = a * b, sum = p + kt_v2_swap(p);
    return sum[0];
}
/* a . b + c . d */
KT_INLINE double kt_v2_dot2(kt_v2 a, kt_v2 b, kt_v2 c, kt_v2 d) {
    const kt_v2 p = a * b + c * d, sum = p + kt_v2_swap(p);
    return sum[0];
}
/* (-x, y) */
KT_INLINE kt_v2 kt_v2_mirror(kt_v2 a) {
    typedef int64_t bits __attribute__((vector_size(16)));
    return (kt_v2)((bits)a ^ (bits){INT64_MIN, 0});
}
/* a rotated by a right angle: (-y, x) */
KT_INLINE kt_v2 kt_v2_across(kt_v2 a) { return kt_v2_mirror(kt_v2_swap(a)); }

/* a x b */
KT_INLINE kt_v4 kt_v4_cross(kt_v4 a, kt_v4 b) {
#if defined(__SSE2__) && !defined(__AVX__)
    /* Registers of two lanes, for which gcc compiles the shuffles below badly: the same products and differences. */
    typedef double pair __attribute__((vector_size(16)));
    union {
        kt_v4 whole;
        pair half[2];
    } x = {.whole = a}, y = {.whole = b}, out;
    const pair axy = x.half[0], azw = x.half[1], bxy = y.half[0], bzw = y.half[1];
    const pair ayz = __builtin_shufflevector(axy, azw, 1, 2), byz = __builtin_shufflevector(bxy, bzw, 1, 2);
    const pair azx = __builtin_shufflevector(azw, axy, 0, 2), bzx = __builtin_shufflevector(bzw, bxy, 0, 2);
    out.half[0] = ayz * bzx - azx * byz;
    out.half[1] = (pair){axy[0] * bxy[1] - axy[1] * bxy[0], 0.0};
    return out.whole;
#endif
    const kt_v4 a1 = __builtin_shufflevector(a, a, 1, 2, 0, 3), a2 = __builtin_shufflevector(a, a, 2, 0, 1, 3);
    const kt_v4 b1 = __builtin_shufflevector(b, b, 1, 2, 0, 3), b2 = __builtin_shufflevector(b, b, 2, 0, 1, 3);
    return a1 * b2 - a2 * b1;
}

/* Sum of lanes 0 to 2. */
KT_INLINE double kt_v4_sum(kt_v4 a) { return (a[0] + a[1]) + a[2]; }

/* a . b over lanes 0 to 2 */
KT_INLINE double kt_v4_dot(kt_v4 a, kt_v4 b) { return kt_v4_sum(a * b); }

/* a . b + c . d */
KT_INLINE double kt_v4_dot2(kt_v4 a, kt_v4 b, kt_v4 c, kt_v4 d) { return kt_v4_sum(a * b + c * d); }

/* A u, A by columns */
KT_INLINE kt_v4 kt_v4_apply(const kt_v4 a[3], kt_v4 u) {
    return a[0] * kt_v4_splat(u[0]) + a[1] * kt_v4_splat(u[1]) + a[2] * kt_v4_splat(u[2]);
}

KT_INLINE kt_v4 kt_v4_apply_to(const kt_v4 a[3], kt_vec3 u) {
    return a[0] * kt_v4_splat(u.x) + a[1] * kt_v4_splat(u.y) + a[2] * kt_v4_splat(u.z);
}

/* out = A', which may be A */
KT_INLINE void kt_v4_transpose(const kt_v4 a[3], kt_v4 out[3]) {
    const kt_v4 xz = __builtin_shufflevector(a[0], a[1], 0, 4, 2, 6),
                y = __builtin_shufflevector(a[0], a[1], 1, 5, 3, 7);
    const kt_v4 last = a[2];
    out[0] = __builtin_shufflevector(xz, last, 0, 1, 4, 7);
    out[1] = __builtin_shufflevector(y, last, 0, 1, 5, 7);
    out[2] = __builtin_shufflevector(xz, last, 2, 3, 6, 7);
}

/* A' u */
KT_INLINE kt_v4 kt_v4_apply_transposed(const kt_v4 a[3], kt_v4 u) {
    kt_v4 part[3] = {a[0] * u, a[1] * u, a[2] * u};
    kt_v4_transpose(part, part);
    return part[0] + part[1] + part[2];
}

KT_INLINE void kt_v4_from_mat3(kt_mat3 m, kt_v4 out[3]) {
    out[0] = kt_v4_from(m.x);
    out[1] = kt_v4_from(m.y);
    out[2] = kt_v4_from(m.z);
}

KT_INLINE kt_mat3 kt_v4_mat3(const kt_v4 m[3]) {
    kt_mat3 r;
    r.x = kt_v4_vec3(m[0]);
    r.y = kt_v4_vec3(m[1]);
    r.z = kt_v4_vec3(m[2]);
    return r;
}

#endif
