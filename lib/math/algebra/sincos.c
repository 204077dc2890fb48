/* Sines and cosines of many angles at once (sincos.h).
 *
 * |x| = n pi/2 + (r + e), |r| <= pi/4, n from rounding |x| 2/pi. The constant pi/2 is split into P1 + P2 + P3 + P4, the
 * first three of 33 bits at most. Therefore the products of these parts with n are exact for n < 2^20. This reduction
 * is that of Cody & Waite (Software Manual for the Elementary Functions, 1980). The sum r + e is right to its last bits
 * even if x is nearly n pi/2. The part that rounding removes from r is e. Taylor's series end with r^17 and r^18. The
 * relative error of their remainder is below 1e-19:
 *
 *   sin(r + e) = r + e + r^2 (r (-1/3! + r^2/5! - ...) - e/2)
 *   cos(r + e) = 1 - r^2/2 + (r^4/4! - ... - r e)
 *
 * and the two swap and change sign with n mod 4. Error below one unit in the last place (test/math/algebra/sincos.c
 * measures 0.88). Larger angles, beyond n = 2^20, and numbers that are not finite use libm's sin and cos, one by one.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/sincos.h"

#include "algebra/lane.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

/* The steps above, and x - x as a test of finite numbers, need the arithmetic of IEEE 754 in double precision. */
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || __FINITE_MATH_ONLY__ > 0
#error "sums must keep their order, and NaN must exist: compile without -ffast-math, -Ofast and -ffinite-math-only"
#elif FLT_EVAL_METHOD < 0 || FLT_EVAL_METHOD == 2
#error "each operation must be rounded: on x86, compile with -msse2 -mfpmath=sse"
#endif

/* GROUPS vectors are computed at once, each with as many angles as the instruction set has lanes. The operations of one
 * vector depend on each other, and a processor does not look far enough ahead to execute operations of the next vector
 * meanwhile. Therefore the operations of the vectors are interleaved. A processor without vectors of doubles (a
 * Cortex-M7) computes angles one by one. The bits are the same. KT_TAKEN puts q[i[k]] in lane k, without a delay
 * through memory. */
#if defined(__arm__)
enum { LANES = 1, GROUPS = 1 };
#define KT_FOLLOWING                                                                                                   \
    { 0 }
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]] }
#elif defined(__AVX512F__)
enum { LANES = 8, GROUPS = 3 };
#define KT_FOLLOWING                                                                                                   \
    { 0, 1, 2, 3, 4, 5, 6, 7 }
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]], (q)[(i)[1]], (q)[(i)[2]], (q)[(i)[3]], (q)[(i)[4]], (q)[(i)[5]], (q)[(i)[6]], (q)[(i)[7]] }
#elif defined(__AVX2__)
enum { LANES = 4, GROUPS = 3 };
#define KT_FOLLOWING                                                                                                   \
    { 0, 1, 2, 3 }
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]], (q)[(i)[1]], (q)[(i)[2]], (q)[(i)[3]] }
#else
enum { LANES = 2, GROUPS = 4 };
#define KT_FOLLOWING                                                                                                   \
    { 0, 1 }
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]], (q)[(i)[1]] }
#endif

typedef double kt_v8 __attribute__((vector_size(8 * LANES)));
typedef double kt_v8_anywhere __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
typedef int64_t kt_i8 __attribute__((vector_size(8 * LANES)));
typedef int32_t kt_place8 __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

#define KT_V8(x) ((x) - (kt_v8){0.0}) /* x, also of -0 */
#define KT_I8(x) ((x) - (kt_i8){0})
#define KT_SINCOS_LIMIT 1647099.0 /* 2^20 pi/2 */

#define KT_EACH for (int g = 0; g < groups; g++)

/* Taylor's coefficients of the sine and of the cosine, the last first. */
static const double series[][2] = {
    {1.0 / 355687428096000.0, -1.0 / 6402373705728000.0},
    {-1.0 / 1307674368000.0, 1.0 / 20922789888000.0},
    {1.0 / 6227020800.0, -1.0 / 87178291200.0},
    {-1.0 / 39916800.0, 1.0 / 479001600.0},
    {1.0 / 362880.0, -1.0 / 3628800.0},
    {-1.0 / 5040.0, 1.0 / 40320.0},
    {1.0 / 120.0, -1.0 / 720.0},
    {-1.0 / 6.0, 1.0 / 24.0},
};

/* All lanes; every |x| <= KT_SINCOS_LIMIT. */
KT_INLINE void kt_v8_sincos(const int groups, const kt_v8 *x, kt_v8 *sine, kt_v8 *cosine) {
    const kt_v8 round = KT_V8(0x1.8p52); /* adding it leaves the nearest integer in the low bits */
    kt_i8 minus[GROUPS], quadrant[GROUPS];
    kt_v8 size[GROUPS], n[GROUPS], a[GROUPS], b[GROUPS], p2[GROUPS], p3[GROUPS], r[GROUPS], e[GROUPS];
    KT_EACH {
        /* cppcheck-suppress uninitvar ; callers fill as many vectors as `groups` */
        minus[g] = (kt_i8)x[g] & KT_I8(INT64_MIN);
        size[g] = (kt_v8)((kt_i8)x[g] ^ minus[g]); /* so that sine(-0) is -0 */
        n[g] = size[g] * KT_V8(0x1.45f306dc9c883p-1) + round;
        quadrant[g] = (kt_i8)n[g];
        n[g] -= round;
    }
    KT_EACH a[g] = size[g] - n[g] * KT_V8(0x1.921fb544p+0); /* P1 */
    KT_EACH p2[g] = n[g] * KT_V8(0x1.0b4611a6p-34);         /* P2 */
    KT_EACH p3[g] = n[g] * KT_V8(0x1.3198a2ep-69);          /* P3 */
    KT_EACH b[g] = a[g] - p2[g];
    KT_EACH r[g] = b[g] - p3[g];
    KT_EACH {
        const kt_v8 lost = ((a[g] - b[g]) - p2[g]) - n[g] * KT_V8(0x1.b839a252049c1p-104); /* P4 */
        e[g] = ((b[g] - r[g]) - p3[g]) + lost;
    }

    kt_v8 z[GROUPS], p[GROUPS], c[GROUPS];
    KT_EACH {
        z[g] = r[g] * r[g];
        p[g] = KT_V8(series[0][0]);
        c[g] = KT_V8(series[0][1]);
    }
#pragma GCC unroll 1 /* unrolled, gcc 12 computes one polynomial after the other */
    for (size_t k = 1; k < sizeof series / sizeof *series; k++)
        KT_EACH {
            p[g] = p[g] * z[g] + KT_V8(series[k][0]);
            c[g] = c[g] * z[g] + KT_V8(series[k][1]);
        }

    KT_EACH {
        const kt_v8 s = r[g] + (e[g] + z[g] * (r[g] * p[g] - KT_V8(0.5) * e[g]));
        const kt_v8 half = KT_V8(0.5) * z[g], one = KT_V8(1.0) - half;
        const kt_v8 k = one + (((KT_V8(1.0) - one) - half) + (z[g] * z[g] * c[g] - r[g] * e[g]));

        /* exchanges s and k in odd quadrants */
        const kt_i8 swap = -(quadrant[g] & KT_I8(1)) & ((kt_i8)s ^ (kt_i8)k);
        const kt_i8 sine_sign = (quadrant[g] & KT_I8(2)) << 62;
        const kt_i8 cosine_sign = ((quadrant[g] + KT_I8(1)) & KT_I8(2)) << 62;
        sine[g] = (kt_v8)((kt_i8)s ^ swap ^ sine_sign ^ minus[g]);
        cosine[g] = (kt_v8)((kt_i8)k ^ swap ^ cosine_sign);
    }
}

/* Whether the indices of all lanes are consecutive, as in a chain. Two indices are compared in one number. */
KT_INLINE bool kt_are_neighbours(const int32_t *place) {
    const kt_place8 off = *(const kt_place8 *)place - (kt_place8)KT_FOLLOWING - place[0];
    uint64_t pair[(LANES + 1) / 2] = {0}, all = 0;
    memcpy(pair, &off, sizeof off);
    for (int k = 0; k < (LANES + 1) / 2; k++)
        all |= pair[k];
    return all == 0;
}

/* Replaces the results for angles beyond the limit with the results of libm. */
static void replace_large(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine) {
    for (size_t k = 0; k < count; k++) {
        const double x = q[angle[k]];
        if (!(fabs(x) <= KT_SINCOS_LIMIT)) {
            sine[k] = sin(x);
            cosine[k] = cos(x);
        }
    }
}

/* Computes the sines and cosines of some vectors; `left` receives the sign of a size that is too large. For a single
 * vector, a test whether the vector can be loaded whole does not pay. */
KT_INLINE void take_groups(const int groups, const double *q, const int32_t *angle, kt_i8 *left, double *sine,
                           double *cosine) {
    kt_v8 x[GROUPS], s[GROUPS], c[GROUPS];
    KT_EACH {
        const int32_t *i = angle + g * LANES;
        if (groups > 1 && kt_are_neighbours(i))
            x[g] = *(const kt_v8_anywhere *)(q + i[0]);
        else
            x[g] = (kt_v8)KT_TAKEN(q, i);
        *left |= (kt_i8)KT_V8(KT_SINCOS_LIMIT) - ((kt_i8)x[g] & KT_I8(INT64_MAX));
    }
    kt_v8_sincos(groups, x, s, c);
    KT_EACH {
        *(kt_v8_anywhere *)(sine + g * LANES) = s[g];
        *(kt_v8_anywhere *)(cosine + g * LANES) = c[g];
    }
}

void kt_sincos_gather(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine) {
    /* Bits of sizes compare like the sizes, and numbers that are not finite are beyond all. A difference of bits is
     * negative if a size is too large. The signs are tested at the end, since lanes are tested one by one. */
    const size_t room = (count + KT_SINCOS_LANES - 1) / KT_SINCOS_LANES * KT_SINCOS_LANES;
    kt_i8 left = {0};
    int64_t beyond = 0;
    size_t i = 0;
    for (; GROUPS > 1 && i < count && i + GROUPS * LANES <= room; i += GROUPS * LANES)
        take_groups(GROUPS, q, angle + i, &left, sine + i, cosine + i);
    for (; i < count; i += LANES)
        take_groups(1, q, angle + i, &left, sine + i, cosine + i);
    for (int k = 0; k < LANES; k++)
        beyond |= left[k];
    if (beyond < 0)
        replace_large(q, angle, count, sine, cosine);
}
