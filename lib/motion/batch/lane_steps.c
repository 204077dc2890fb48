/* The computations around the stages of a step, for several states at once. The results have the bits of the code for
 * one state: sums of slopes, dense output and mean squares of errors of integrator/explicit.c, powers of
 * integrator/step_control.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "algebra/real.h"
#include "integrator/lane_parts.h"

#include <float.h>

static kt_real1 slope(double *const *k, size_t slot, size_t i) { return ((const kt_real1 *)(const void *)k[slot])[i]; }

/* sum_j weight_j k_j */
static kt_real1 stage_sum_of(const kt_stage_term *terms, size_t count, double *const *k, size_t i) {
    kt_real1 sum = kt_real1_splat(0.0);
    for (size_t j = 0; j < count; j++)
        sum += terms[j].weight * slope(k, terms[j].slot, i);
    return sum;
}

void KT_KERNEL(kt_lanes_combine)(double *out, const double *y, const double *h, const kt_stage_term *terms,
                                 size_t count, double *const *k, size_t n) {
    const kt_real1 *from = (const void *)y, step = *(const kt_real1 *)(const void *)h;
    kt_real1 *to = (void *)out;
    for (size_t i = 0; i < n; i++)
        to[i] = from[i] + step * stage_sum_of(terms, count, k, i);
}

void KT_KERNEL(kt_lanes_mean_square)(double *out, const kt_lane_scales *scales, const kt_stage_term *terms,
                                     size_t count, double *const *k, size_t n) {
    enum { TILE = 8 }; /* partial sums, as in kt_slopes_mean_square, so that the bits are equal */
    const kt_real1 *y0 = (const void *)scales->y0, *y1 = (const void *)scales->y1;
    const kt_real1 absolute = *(const kt_real1 *)(const void *)scales->absolute;
    const kt_real1 relative = *(const kt_real1 *)(const void *)scales->relative;
    kt_real1 part[TILE], total = kt_real1_splat(0.0);
    for (int l = 0; l < TILE; l++)
        part[l] = total;
    for (size_t i = 0; i < n; i++) {
        const kt_real1 a = kt_abs(y0[i]), b = kt_abs(y1[i]);
        const kt_real1 u = stage_sum_of(terms, count, k, i) / (absolute + relative * kt_choose(a > b, a, b) + DBL_MIN);
        part[i % TILE] += u * u;
    }
    for (int l = 0; l < TILE; l++)
        total += part[l];
    *(kt_real1 *)(void *)out = total / (double)n;
}

/* The whole part of numbers below 2^31. */
static kt_real1 whole_part_of(kt_real1 x) {
    const kt_real1 whole = __builtin_convertvector(__builtin_convertvector(x, kt_condition), kt_real1);
    return whole - kt_choose(whole > x, kt_real1_splat(1.0), kt_real1_splat(0.0));
}

/* base^exponent = 2^u with u = exponent log2(base), for positive numbers. Returns the lanes in which base and u are
 * in the usual range; the numbers of the other lanes are undefined. */
kt_lane_mask KT_KERNEL(kt_lanes_power)(const double *bases, const double *exponents, double *out) {
    const kt_condition bits = (kt_condition)(*(const kt_real1 *)(const void *)bases), biased = bits >> 52;
    const kt_real1 p = *(const kt_real1 *)(const void *)exponents;
    kt_real1 exponent = __builtin_convertvector(biased - 1022, kt_real1);
    kt_real1 m = (kt_real1)((bits & INT64_C(0x000fffffffffffff)) | INT64_C(0x3fe0000000000000));
    const kt_condition low = m < KT_SQRT_HALF;
    m = kt_choose(low, m * 2.0, m);
    exponent = kt_choose(low, exponent - 1.0, exponent);
    const kt_real1 u = p * kt_binary_logarithm(m, exponent);
    const kt_condition usual = (biased > 0) & (biased < 2047) & (kt_abs(u) < 1000.0);
    const kt_real1 whole = whole_part_of(kt_choose(usual, u, kt_real1_splat(0.0)) + 0.5);
    const kt_condition two = (__builtin_convertvector(whole, kt_condition) + 1023) << 52;
    *(kt_real1 *)(void *)out = kt_binary_power(u - whole) * (kt_real1)two;
    return kt_mask_of(usual);
}

void KT_KERNEL(kt_lanes_interpolate)(double *out, const kt_lane_step *step, const double *thetas, double *const *k,
                                     size_t n) {
    const kt_real1 theta = *(const kt_real1 *)(const void *)thetas, h = *(const kt_real1 *)(const void *)step->h;
    const kt_real1 part = theta * theta * (3.0 - 2.0 * theta), *y0 = (const void *)step->y0,
                   *y1 = (const void *)step->y1;
    const size_t slots = (size_t)kt_method_slots(step->method), fresh = (size_t)kt_method_fresh(step->method);
    kt_real1 weight[KT_METHOD_STAGES_MAX + 1], *to = (void *)out;
    kt_dense_weights(step->method, slots, fresh, theta, weight);
    for (size_t i = 0; i < n; i++) {
        kt_real1 sum = kt_real1_splat(0.0);
        for (size_t j = 0; j < slots; j++)
            sum += weight[j] * slope(k, j, i);
        const kt_real1 y = y0[i] + h * sum + part * (y1[i] - y0[i]);
        to[i] = kt_choose(theta == 0.0, y0[i], kt_choose(theta == KT_LANE_AT_END, y1[i], y));
    }
}
