/* Sines and cosines of many angles at once (sincos.h).
 *
 * |x| = n pi/2 + (r + e), |r| <= pi/4, n from rounding |x| 2/pi. pi/2 is split into P1 + P2 + P3 + P4, the first
 * three of 33 bits at most, so that n P1, n P2 and n P3 are exact for n < 2^20 (Cody & Waite, Software Manual for the
 * Elementary Functions, 1980): r + e is right to its last bits even where x is nearly n pi/2. e is what rounding took
 * from r. Taylor's series to r^17 and r^18 leave less than 1e-19 of the result:
 *
 *   sin(r + e) = r + e + r^2 (r (-1/3! + r^2/5! - ...) - e/2)
 *   cos(r + e) = 1 - r^2/2 + (r^4/4! - ... - r e)
 *
 * and the two swap and change sign with n mod 4. Error below one unit in the last place (test/algebra/sincos.c
 * measures 0.88). Angles beyond 2^20 pi/2, and what is not finite, take libm's sin and cos, one by one.
 */
#include "algebra/sincos.h"

#include "algebra/lane.h"

#include <math.h>
#include <stdbool.h>

/* How many at once: as many as a vector of the instruction set has lanes, or those of several, which hide each other's
 * latency. gcc 12 takes eight lanes in vectors of four apart so that they wait for each other through memory (1.7 times the
 * time). A processor without vectors of doubles (a Cortex-M7) computes angles one by one. The bits are the same.
 * KT_TAKEN: q[i[k]] in lane k. */
#if defined(__arm__)
enum { LANES = 1 };
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]] }
#elif defined(__AVX2__) && !defined(__AVX512F__)
enum { LANES = 4 };
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]], (q)[(i)[1]], (q)[(i)[2]], (q)[(i)[3]] }
#else
enum { LANES = KT_SINCOS_LANES };
#define KT_TAKEN(q, i)                                                                                                 \
    { (q)[(i)[0]], (q)[(i)[1]], (q)[(i)[2]], (q)[(i)[3]], (q)[(i)[4]], (q)[(i)[5]], (q)[(i)[6]], (q)[(i)[7]] }
#endif

typedef double kt_v8 __attribute__((vector_size(8 * LANES)));
typedef double kt_v8_anywhere __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
typedef int64_t kt_i8 __attribute__((vector_size(8 * LANES)));

#define KT_V8(x) ((x) - (kt_v8){0.0}) /* x, also of -0 */
#define KT_I8(x) ((x) - (kt_i8){0})
#define KT_SINCOS_LIMIT 1647099.0 /* 2^20 pi/2 */

KT_INLINE kt_v8 kt_v8_choose(kt_i8 mask, kt_v8 a, kt_v8 b) { return (kt_v8)((mask & (kt_i8)a) | (~mask & (kt_i8)b)); }

/* All lanes; every |x| <= KT_SINCOS_LIMIT. */
KT_INLINE void kt_v8_sincos(kt_v8 x, kt_v8 *sine, kt_v8 *cosine) {
    const kt_i8 minus = (kt_i8)x & KT_I8(INT64_MIN);
    const kt_v8 size = (kt_v8)((kt_i8)x ^ minus); /* so that sine(-0) is -0 */
    const kt_v8 round = KT_V8(0x1.8p52);          /* adding it leaves the nearest integer in the low bits */
    const kt_v8 shifted = size * KT_V8(0x1.45f306dc9c883p-1) + round;
    const kt_i8 quadrant = (kt_i8)shifted;
    const kt_v8 n = shifted - round;
    const kt_v8 a = size - n * KT_V8(0x1.921fb544p+0); /* P1 */
    const kt_v8 p2 = n * KT_V8(0x1.0b4611a6p-34);      /* P2 */
    const kt_v8 p3 = n * KT_V8(0x1.3198a2ep-69);       /* P3 */
    const kt_v8 b = a - p2, r = b - p3;
    const kt_v8 lost = ((a - b) - p2) - n * KT_V8(0x1.b839a252049c1p-104); /* P4 */
    const kt_v8 e = ((b - r) - p3) + lost;

    const kt_v8 z = r * r;
    kt_v8 p = KT_V8(1.0 / 355687428096000.0);
    p = p * z - KT_V8(1.0 / 1307674368000.0);
    p = p * z + KT_V8(1.0 / 6227020800.0);
    p = p * z - KT_V8(1.0 / 39916800.0);
    p = p * z + KT_V8(1.0 / 362880.0);
    p = p * z - KT_V8(1.0 / 5040.0);
    p = p * z + KT_V8(1.0 / 120.0);
    p = p * z - KT_V8(1.0 / 6.0);
    const kt_v8 s = r + (e + z * (r * p - KT_V8(0.5) * e));

    kt_v8 c = KT_V8(-1.0 / 6402373705728000.0);
    c = c * z + KT_V8(1.0 / 20922789888000.0);
    c = c * z - KT_V8(1.0 / 87178291200.0);
    c = c * z + KT_V8(1.0 / 479001600.0);
    c = c * z - KT_V8(1.0 / 3628800.0);
    c = c * z + KT_V8(1.0 / 40320.0);
    c = c * z - KT_V8(1.0 / 720.0);
    c = c * z + KT_V8(1.0 / 24.0);
    const kt_v8 half = KT_V8(0.5) * z, one = KT_V8(1.0) - half;
    const kt_v8 k = one + (((KT_V8(1.0) - one) - half) + (z * z * c - r * e));

    const kt_i8 swap = -(quadrant & KT_I8(1));
    const kt_i8 sine_sign = (quadrant & KT_I8(2)) << 62, cosine_sign = ((quadrant + KT_I8(1)) & KT_I8(2)) << 62;
    *sine = (kt_v8)((kt_i8)kt_v8_choose(swap, k, s) ^ sine_sign ^ minus);
    *cosine = (kt_v8)((kt_i8)kt_v8_choose(swap, s, k) ^ cosine_sign);
}

/* Whether the indices of all lanes are consecutive, as they are in a chain. */
KT_INLINE bool kt_are_neighbours(const int32_t *place) {
    int32_t off = 0;
    for (int32_t k = 0; k < LANES; k++)
        off |= place[k] - place[0] - k;
    return off == 0;
}

/* Not lane by lane through memory, which would have to be waited for. */
KT_INLINE kt_v8 kt_v8_gather(const double *q, const int32_t *i) { return (kt_v8)KT_TAKEN(q, i); }

/* Replaces those of angles beyond the limit. */
static void take_large(kt_v8 x, size_t lanes, double *sine, double *cosine) {
    for (size_t k = 0; k < lanes; k++)
        if (!(fabs(x[k]) <= KT_SINCOS_LIMIT)) {
            sine[k] = sin(x[k]);
            cosine[k] = cos(x[k]);
        }
}

void kt_sincos_gather(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine) {
    for (size_t i = 0; i < count; i += LANES) {
        const size_t lanes = count - i < LANES ? count - i : LANES;
        kt_v8 x, s, c;
        if (lanes == LANES && kt_are_neighbours(angle + i))
            x = *(const kt_v8_anywhere *)(q + angle[i]);
        else
            x = kt_v8_gather(q, angle + i);
        /* Bits of sizes compare like the sizes, with what is not finite beyond all: a difference of them is negative
         * where a size is too large. (Comparisons of eight lanes at once are taken apart by the compiler.) */
        const kt_i8 left = (kt_i8)KT_V8(KT_SINCOS_LIMIT) - ((kt_i8)x & KT_I8(INT64_MAX));
        int64_t beyond = 0;
        for (int k = 0; k < LANES; k++)
            beyond |= left[k];
        kt_v8_sincos(x, &s, &c);
        *(kt_v8_anywhere *)(sine + i) = s;
        *(kt_v8_anywhere *)(cosine + i) = c;
        if (beyond < 0)
            take_large(x, lanes, sine + i, cosine + i);
    }
}
