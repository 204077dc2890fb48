/* The step size: PI control and the first step.
 *
 * Sources: HNW II.4 for the first step and the factors; E. Hairer, G. Wanner, Solving Ordinary Differential Equations
 * II, 1996, section IV.2, for the PI control, after K. Gustafsson, ACM Trans. Math. Softw. 17 (1991) 533.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "integrator/lane_parts.h"

#include <assert.h>
#include <math.h>

double kt_control_power(double x, double p) {
    assert(x > 0.0);
    int exponent;
    double m = frexp(x, &exponent);
    if (m < KT_SQRT_HALF) {
        m *= 2.0;
        exponent--;
    }
    const double u = p * kt_binary_logarithm(m, (double)exponent), whole = floor(u + 0.5);
    return ldexp(kt_binary_power(u - whole), (int)whole);
}

/* safety err^(-alpha/k) control_error^(beta/k); an estimate of zero gives the largest factor. */
double kt_control_accepted(const kt_integrator *it, double error) {
    const kt_integrator_options *o = &it->options;
    if (!(error > 0.0))
        return o->factor_max;
    return kt_control_growth(it, kt_control_power(error, kt_control_exponent(it)),
                             kt_control_power(it->memory.control_error, kt_control_exponent_before(it)));
}

/* safety err^(-alpha/k). The error of the last accepted step is not used, since it is unrelated to a step that
 * failed. */
double kt_control_rejected(const kt_integrator *it, double error) {
    const kt_integrator_options *o = &it->options;
    if (!isfinite(error))
        return o->factor_min;
    return kt_control_clamp(o->safety * kt_control_power(error, kt_control_exponent(it)), o->factor_min, o->safety);
}

/* A first step that should be accepted. The error of a method with err ~ h^k is about h^k times the k-th derivative. If
 * the motion changes at the rate lambda, that derivative is about |f| lambda^(k-1). The step h makes the error a
 * hundredth of the tolerance, in the weighted norm. The rate is |f'| / |f|, from an Euler step of a hundredth of |y| /
 * |f|, and at least |f| / |y|.
 *
 * HNW II.4 takes h^k max(|f|, |f'|) = 1/100 instead, which depends on the unit of time. A motion that is ten thousand
 * times faster then begins with a step ten times too long. A slower motion begins with a step too short. */
static double first_guess(const kt_integrator *it, double h0, double d0, double d1, double d2) {
    const double k = it->error_order;
    double rate = d2 / d1;
    if (d0 > 0.0 && d1 / d0 > rate)
        rate = d1 / d0;
    if (d1 > 0.0 && rate > 0.0 && isfinite(d1) && isfinite(rate))
        return kt_control_power(0.01 / d1, 1.0 / k) * kt_control_power(rate, (1.0 - k) / k);
    if (d2 > 0.0 && isfinite(d2))
        return kt_control_power(0.01 / d2, 0.5); /* f = 0 here: err ~ |f'| h^2 */
    return h0;
}

double kt_control_initial(kt_integrator *it, double direction, double limit, kt_try *result) {
    assert(direction == 1.0 || direction == -1.0);
    assert(limit > 0.0);
    const size_t n = it->sizes.n;
    const double *f0 = it->k[0];
    const double d0 = kt_scaled_norm(it, it->y, NULL), d1 = kt_scaled_norm(it, f0, NULL);
    const bool has_scale = d0 >= 1e-5 && d1 >= 1e-5 && isfinite(d1);
    double h0 = has_scale ? 0.01 * d0 / d1 : 1e-6;
    h0 = h0 < 0.5 * limit ? h0 : 0.5 * limit; /* half, so that rounding does not lead beyond the limit */
    h0 = h0 > 0.0 ? h0 : limit;               /* half of the least number is 0 */

    /* If f cannot be computed at that distance, a hundredth of it is tried, up to eight times in all. */
    kt_try_result reached = KT_TRY_RECOVERABLE;
    for (int tries = 0; tries < 8; tries++) {
        for (size_t i = 0; i < n; i++)
            it->trial[i] = it->y[i] + direction * h0 * f0[i];
        reached = kt_evaluate(it, it->memory.t + direction * h0, it->trial, 1, result);
        if (reached == KT_TRY_PASSED || reached == KT_TRY_STOPPED)
            break;
        h0 *= 0.01;
    }
    if (reached == KT_TRY_STOPPED)
        return 0.0;
    if (reached != KT_TRY_PASSED)
        return h0;

    const double d2 = kt_scaled_norm(it, it->k[1], f0) / h0;
    const double h1 = first_guess(it, h0, has_scale ? d0 : 0.0, d1, d2);
    return 100.0 * h0 < h1 ? 100.0 * h0 : h1;
}
