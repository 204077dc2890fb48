/* Linear multistep methods [MSD 5.3]: weights, order and linear stability.
 *
 *     y1 = sum_{i=1..n} a_i y_{1-i} + h sum_{j=0..n} b_j f_{1-j}
 *
 * The two-step family with the spectral radius rho at infinity [MSD 5.31], of order 2; rho = 0 is BDF2:
 *
 *     a_1 = 4 (1 - rho) / (3 - rho)             b_0 = 2 / ((1 + rho) (3 - rho))
 *     a_2 = 1 - a_1                             b_1 = 2 - 2 b_0 - a_1 / 2,   b_2 = b_0 - a_1 / 2
 *
 * Order. A method of order p integrates y = t^q exactly, q = 0 .. p [MSD 5.7 .. 5.14]. With t1 = 0 and h = 1:
 *
 *     0^q = sum_i a_i (-i)^q + q sum_j b_j (-j)^(q-1)
 *
 * Linear stability [MSD 5.16 .. 5.20]. For y' = lambda y, y_k = xi^k solves the recurrence if xi is a root of
 *
 *     implicit:   (1 - b_0 z) xi^n - sum_i (a_i + b_i z) xi^(n-i)
 *     PECE:       xi^n - (1 + b_0 z) xi^(n-1) - sum_i (b_i z + b_0 p_i z^2) xi^(n-i)
 *
 * with the predictor's weights p_i. The root that is e^z for small z represents the motion, and the others are
 * spurious. A mode grows if any root is larger than 1. Roots are found with the iteration of Weierstrass (Durand and
 * Kerner). Each root is then corrected with Newton's.
 *
 * Source: E. Hairer, S. P. Norsett, G. Wanner, Solving ODE I, III.1 to III.3; G. Wanner, E. Hairer, Solving ODE II,
 * V.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/multistep.h"

#include "integrator/complex.h"
#include "kinetree/algebra.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdio.h>

/* ---- weights ----------------------------------------------------------------------------------------------------- */

/* The two-step method of second order with the spectral radius rho at infinity. */
static kt_multistep two_step_of(double rho) {
    kt_multistep w = {.steps = 2};
    w.past[1] = 4.0 * (1.0 - rho) / (3.0 - rho);
    w.past[2] = 1.0 - w.past[1];
    w.slopes[0] = 2.0 / ((1.0 + rho) * (3.0 - rho));
    w.slopes[1] = 2.0 - 2.0 * w.slopes[0] - 0.5 * w.past[1];
    w.slopes[2] = w.slopes[0] - 0.5 * w.past[1];
    return w;
}

/* The weights of a method, indexed by steps into the past; index 0 is the end of the step. */
kt_multistep kt_multistep_of(const kt_method *m) {
    if (m->slopes == NULL)
        return two_step_of(m->rho);
    kt_multistep w = {.steps = m->steps, .past = {0.0, 1.0}};
    for (int i = 0; i <= m->steps; i++) {
        w.slopes[i] = m->slopes[i];
        if (i > 0 && m->past != NULL)
            w.past[i] = m->past[i - 1];
        if (i > 0 && m->predictor != NULL)
            w.predictor[i] = m->predictor[i - 1];
    }
    return w;
}

kt_status kt_multistep_check_sizes(const kt_method *m, kt_error *error) {
    const bool by_radius = m->slopes == NULL;
    if (m->steps < 1 || m->steps > KT_METHOD_STEPS_MAX || (by_radius && m->steps != 2))
        return kt_table_reject(m, error,
                               "a multistep method has 1 to 4 steps, and a method that is given by rho has two");
    if (by_radius && !(m->rho >= 0.0 && m->rho <= 1.0))
        return kt_table_reject(m, error, "rho, the spectral radius at infinity, must be 0 to 1");
    if (!by_radius && m->predictor == NULL)
        return kt_table_reject(m, error, "a corrector needs its predictor");
    return kt_table_check_sizes(m, error);
}

/* ---- order ------------------------------------------------------------------------------------------------------- */

/* The condition of order for y = t^q: 0^q = sum_i a_i (-i)^q + q sum_j b_j (-j)^(q-1), within the rounding of a and
 * b. */
static kt_status check_power(const kt_method *m, const char *what, const double *a, const double *b, int q,
                             kt_error *error) {
    long double sum = q == 0 ? -1.0L : 0.0L, size = 1.0L;
    for (int i = 0; i <= KT_METHOD_STEPS_MAX; i++) {
        const long double state = (long double)a[i] * powl((long double)-i, (long double)q);
        const long double slope =
            q > 0 ? (long double)q * (long double)b[i] * powl((long double)-i, (long double)(q - 1)) : 0.0L;
        sum += state + slope;
        size += fabsl(state) + fabsl(slope);
    }
    if (fabsl(sum) <= 4.0L * (long double)DBL_EPSILON * size)
        return KT_OK;
    char message[160];
    snprintf(message, sizeof message,
             "%s does not integrate t^%d: off by %.3g. Correct the weights, or claim a lower order", what, q,
             (double)sum);
    return kt_table_reject(m, error, message);
}

kt_status kt_multistep_check_order(const kt_method *m, kt_error *error) {
    static const double last[KT_METHOD_STEPS_MAX + 1] = {0.0, 1.0};
    const kt_multistep w = kt_multistep_of(m);
    kt_status status = KT_OK;
    for (int q = 0; status == KT_OK && q <= m->order; q++) {
        status = check_power(m, "the multistep method", w.past, w.slopes, q, error);
        if (status == KT_OK && m->predictor != NULL)
            status = check_power(m, "the predictor", last, w.predictor, q, error);
    }
    return status;
}

/* ---- the characteristic polynomial ------------------------------------------------------------------------------- */

/* characteristic[i] has the coefficients of 1, z and z^2 in the factor of xi^(n-i). */
kt_status kt_multistep_stability(const kt_method *m, int stages, kt_stability *out, kt_error *error) {
    (void)stages;
    (void)error;
    const kt_multistep w = kt_multistep_of(m);
    const bool implicit = kt_method_is_implicit(m);
    out->steps = w.steps;
    out->degree = implicit ? 1 : 2;
    out->poles = implicit ? 1 : 0;
    out->characteristic[0][0] = 1.0;
    out->characteristic[0][1] = implicit ? -w.slopes[0] : 0.0;
    for (int i = 1; i <= w.steps; i++) {
        out->characteristic[i][0] = -w.past[i];
        out->characteristic[i][1] = -w.slopes[i] - (!implicit && i == 1 ? w.slopes[0] : 0.0);
        out->characteristic[i][2] = implicit ? 0.0 : -w.slopes[0] * w.predictor[i];
    }
    return KT_OK;
}

typedef struct roots {
    kt_complex c[KT_METHOD_STEPS_MAX + 1]; /* sum_i c_i xi^(n-i), c_0 = 1 */
    kt_complex xi[KT_METHOD_STEPS_MAX];
    int count;
} roots;

/* a / b, without overflow of |b|^2. */
static kt_complex divide_complex(kt_complex a, kt_complex b) {
    const double size = kt_hypot(b.re, b.im);
    const kt_complex unit = {b.re / size, -b.im / size};
    const kt_complex product = kt_complex_multiply(a, unit);
    return (kt_complex){product.re / size, product.im / size};
}

static double modulus_of(kt_complex a) { return kt_hypot(a.re, a.im); }

/* p(xi); *slope = p'(xi). */
static kt_complex evaluate_polynomial_at_root(const roots *r, kt_complex xi, kt_complex *slope) {
    kt_complex value = r->c[0];
    *slope = (kt_complex){0.0, 0.0};
    for (int i = 1; i <= r->count; i++) {
        *slope = kt_complex_multiply(*slope, xi);
        slope->re += value.re;
        slope->im += value.im;
        value = kt_complex_multiply(value, xi);
        value.re += r->c[i].re;
        value.im += r->c[i].im;
    }
    return value;
}

/* xi_i -= p(xi_i) / prod_{j != i} (xi_i - xi_j), all roots at once, from points of a spiral. */
static void iterate_roots(roots *r) {
    double largest = 0.0;
    for (int i = 1; i <= r->count; i++)
        largest = fmax(largest, modulus_of(r->c[i]));
    kt_complex start = {1.0, 0.0};
    for (int i = 0; i < r->count; i++) {
        start = kt_complex_multiply(start, (kt_complex){0.4, 0.9});
        r->xi[i] = (kt_complex){(1.0 + largest) * start.re, (1.0 + largest) * start.im};
    }
    double moved = 1.0;
    for (int k = 0; k < 200 && moved > 1e-15; k++) {
        moved = 0.0;
        for (int i = 0; i < r->count; i++) {
            kt_complex unused, step = evaluate_polynomial_at_root(r, r->xi[i], &unused);
            for (int j = 0; j < r->count; j++)
                if (j != i)
                    step = divide_complex(step, kt_complex_subtract(r->xi[i], r->xi[j]));
            r->xi[i] = kt_complex_subtract(r->xi[i], step);
            moved = fmax(moved, modulus_of(step) / (1e-300 + modulus_of(r->xi[i])));
        }
    }
}

/* Applies Newton's correction if it is small. At a multiple root it does not improve the root. */
static void correct_roots(roots *r) {
    for (int i = 0; i < r->count; i++)
        for (int k = 0; k < 2; k++) {
            kt_complex slope;
            const kt_complex value = evaluate_polynomial_at_root(r, r->xi[i], &slope),
                             step = divide_complex(value, slope);
            if (modulus_of(step) <= 1e-6 * modulus_of(r->xi[i]))
                r->xi[i] = kt_complex_subtract(r->xi[i], step);
        }
}

/* The factor of xi^(n-i) at z. */
static kt_complex coefficient(const kt_stability *s, int i, kt_complex z) {
    const double *c = s->characteristic[i];
    const kt_complex square = kt_complex_multiply(z, z);
    return (kt_complex){c[0] + c[1] * z.re + c[2] * square.re, c[1] * z.im + c[2] * square.im};
}

/* Returns false if a root is infinite: at the pole of an implicit method. */
static bool find_characteristic_roots(const kt_stability *s, kt_complex z, roots *r) {
    const kt_complex first = coefficient(s, 0, z);
    r->count = s->steps;
    r->c[0] = (kt_complex){1.0, 0.0};
    for (int i = 1; i <= s->steps; i++)
        r->c[i] = divide_complex(coefficient(s, i, z), first);
    for (int i = 1; i <= s->steps; i++)
        if (!isfinite(r->c[i].re) || !isfinite(r->c[i].im))
            return false;
    iterate_roots(r);
    correct_roots(r);
    return true;
}

/* The root that represents the motion: of all roots the nearest to e^z. */
kt_complex kt_multistep_value(const kt_stability *s, kt_complex z) {
    assert(s->degree >= 0);
    roots r;
    if (!find_characteristic_roots(s, z, &r))
        return (kt_complex){HUGE_VAL, 0.0};
    const double size = exp(z.re);
    const kt_complex truth = {size * cos(z.im), size * sin(z.im)};
    kt_complex nearest = r.xi[0];
    for (int i = 1; i < r.count; i++)
        if (modulus_of(kt_complex_subtract(r.xi[i], truth)) < modulus_of(kt_complex_subtract(nearest, truth)))
            nearest = r.xi[i];
    return nearest;
}

double kt_multistep_gain(const kt_stability *s, kt_complex z) {
    roots r;
    if (!find_characteristic_roots(s, z, &r))
        return HUGE_VAL;
    double most = 0.0;
    for (int i = 0; i < r.count; i++)
        most = fmax(most, modulus_of(r.xi[i]));
    return most;
}

/* ---- limits ------------------------------------------------------------------------------------------------------ */

/* On the imaginary axis near 0, the root that represents the motion differs from 1 by less than its rounding. The first
 * point is therefore as far out as SEEN. A growth below 1e-13 in a step counts as rounding. */
#define SEEN 0.0625
#define ROUNDING 1e-13

double kt_multistep_real_limit(const kt_stability *s) { return kt_axis_limit(s, -1.0, 0.0, 0.0, ROUNDING); }

double kt_multistep_imaginary_limit(const kt_stability *s) {
    const double limit = kt_axis_limit(s, 0.0, 1.0, SEEN, ROUNDING);
    return limit > 0.0 ? limit : 0.0;
}
