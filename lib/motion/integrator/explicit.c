/* The family of explicit Runge-Kutta methods, given by their tables (HNW II.1):
 *
 *     k_i = f(t + c_i h, y0 + h sum_{j<i} a_ij k_j),   i = 1 .. s
 *     y1  = y0 + h sum_i b_i k_i
 *     err = h sum_i e_i k_i
 *
 * The step itself is in stages.c.
 *
 * Linear stability. For y' = lambda y the stages are Y = y0 1 + z A Y. Since A is strictly lower triangular,
 *
 *     R(z) = 1 + z b' (I - z A)^-1 1 = 1 + sum_k z^k b' A^(k-1) 1
 *
 * The coefficients up to the order p equal 1/k! and are set to that. If |R| = 1 to rounding over a whole interval, as
 * on the imaginary axis near 0, |R| cannot be compared with 1. The limits therefore come from the remainder after the
 * part that is identically 1 has been removed:
 *
 *     real axis:       (1 - R(-x)) / x, which must lie in [0, 2 / x]
 *     imaginary axis:  |R(iy)|^2 - 1 = sum_k e_k y^(2k)
 *
 * The first nonzero e_k decides near 0. The limit on the imaginary axis is the first sign change of the sum over y^(2k)
 * of that k.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.2.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

/* ---- the table, compiled ----------------------------------------------------------------------------------------- */

/* `terms` is the most that can be nonzero: s (s - 1) / 2 of a, s of each of b, e and e_low, and w + r of row r of the
 * stages of the dense output, which read all slots before their own. */
void kt_explicit_measure(const kt_method *method, kt_integrator_sizes *sizes) {
    const size_t s = (size_t)method->stages, w = (size_t)kt_method_fresh(method) + 1, d = (size_t)method->dense_stages;
    sizes->slots = w + d;
    sizes->rows = s + KT_ROW_DENSE + d;
    sizes->terms = s * (s - 1) / 2 + KT_ROW_DENSE * s + d * w + d * (d - 1) / 2 + 1;
}

/* Appends a row of `count` weights; NULL: none. */
static void compile_row(kt_integrator *it, size_t row, const double *weights, size_t count) {
    it->row[row + 1] = it->row[row] + kt_stage_terms(weights, weights ? count : 0, it->terms + it->row[row]);
}

void kt_explicit_init(kt_integrator *it) {
    const kt_method *m = it->table;
    const size_t s = (size_t)m->stages;
    it->fresh = (size_t)kt_method_fresh(m);
    it->gives_end_derivative = m->fsal;
    it->row[0] = 0;
    for (size_t i = 0; i < s; i++)
        compile_row(it, i, m->a + i * (i - (i > 0)) / 2, i);
    compile_row(it, s + KT_ROW_B, m->b, s);
    compile_row(it, s + KT_ROW_E, m->e, s);
    compile_row(it, s + KT_ROW_E_LOW, m->e_low, s);
    size_t row_start = 0;
    for (size_t r = 0; r < (size_t)m->dense_stages; r++) {
        compile_row(it, s + KT_ROW_DENSE + r, m->dense_a + row_start, it->fresh + 1 + r);
        row_start += it->fresh + 1 + r;
    }
}

/* ---- the error --------------------------------------------------------------------------------------------------- */

static double explicit_error_at(const kt_integrator *it, double h, size_t i) {
    const size_t *row = it->row + it->table->stages;
    return h * kt_slopes_sum(it->terms + row[KT_ROW_E], row[KT_ROW_E + 1] - row[KT_ROW_E], it->k, i);
}

static double explicit_error_norm(const kt_integrator *it, double h) {
    const size_t *row = it->row + it->table->stages;
    const size_t *low_row = row + KT_ROW_E_LOW;
    const bool has_low = it->table->e_low != NULL;
    const double high = kt_slopes_mean_square(it, it->terms + row[KT_ROW_E], row[KT_ROW_E + 1] - row[KT_ROW_E]);
    const double low =
        has_low && high != 0.0 ? kt_slopes_mean_square(it, it->terms + low_row[0], low_row[1] - low_row[0]) : 0.0;
    return kt_explicit_error(h, high, has_low, low);
}

/* ---- linear stability -------------------------------------------------------------------------------------------- */

/* The coefficients of R: 1/k! up to the order p, then b' A^(k-1) 1. */
static kt_status explicit_polynomial(const kt_method *m, int stages, kt_stability *out, kt_error *error) {
    (void)stages; /* an explicit method has a fixed number of stages */
    (void)error;
    const int s = m->stages;
    long double power[KT_METHOD_STAGES_MAX], factorial = 1.0L; /* A^(k-1) 1 */
    for (int i = 0; i < s; i++)
        power[i] = 1.0L;
    out->coefficient[0] = 1.0;
    for (int k = 1; k <= s; k++) {
        long double sum = 0.0L;
        for (int i = 0; i < s; i++)
            sum += (long double)m->b[i] * power[i];
        factorial *= (long double)k;
        out->coefficient[k] = (double)(k <= m->order ? 1.0L / factorial : sum);
        for (int i = s - 1; i >= 0; i--) { /* row i reads only the rows before it */
            long double next = 0.0L;
            for (int j = 0; j < i; j++)
                next += (long double)m->a[i * (i - 1) / 2 + j] * power[j];
            power[i] = next;
        }
    }
    for (out->degree = s; out->degree > 0 && out->coefficient[out->degree] == 0.0;)
        out->degree--;
    return KT_OK;
}

static kt_complex explicit_value(const kt_stability *s, kt_complex z) {
    kt_complex sum = {s->coefficient[s->degree], 0.0};
    for (int k = s->degree - 1; k >= 0; k--) {
        const kt_complex times = {sum.re * z.re - sum.im * z.im, sum.re * z.im + sum.im * z.re};
        sum.re = times.re + s->coefficient[k];
        sum.im = times.im;
    }
    return sum;
}

/* (1 - R(-x)) / x = c_1 - c_2 x + c_3 x^2 - ... */
static bool explicit_inside_real(const void *problem, double x) {
    const kt_stability *s = problem;
    double quotient = 0.0;
    for (int k = s->degree; k >= 1; k--)
        quotient = s->coefficient[k] - x * quotient;
    return quotient >= 0.0 && x * quotient <= 2.0;
}

static double explicit_real_limit(const kt_stability *s) {
    return kt_first_exit(explicit_inside_real, s, kt_farthest_stable(s));
}

/* sum_k e_k x^k / x^first, x = y^2, where e_first is the first nonzero term. */
typedef struct excess {
    double e[KT_METHOD_STAGES_MAX + 1];
    int first, degree;
} excess;

/* |R(iy)| <= 1, judged by the sum without its factor y^(2 first). */
static bool explicit_inside_imaginary(const void *problem, double y) {
    const excess *p = problem;
    double sum = 0.0;
    for (int k = p->degree; k >= p->first; k--)
        sum = p->e[k] + y * y * sum;
    return sum <= 0.0;
}

/* e_k = sum_{i + j = 2k} (-1)^((i - j)/2) c_i c_j; a sum below the rounding error of its terms is set to 0. */
static excess make_excess(const kt_stability *s) {
    excess p = {.degree = s->degree, .first = -1};
    for (int k = 1; k <= s->degree; k++) {
        long double sum = 0.0L, size = 0.0L;
        for (int i = 0; i <= s->degree; i++) {
            const int j = 2 * k - i;
            if (j < 0 || j > s->degree)
                continue;
            const long double term = (long double)s->coefficient[i] * (long double)s->coefficient[j];
            sum += (i - k) % 2 == 0 ? term : -term;
            size += fabsl(term);
        }
        p.e[k] = fabsl(sum) <= 16.0L * (long double)DBL_EPSILON * size ? 0.0 : (double)sum;
        if (p.first < 0 && p.e[k] != 0.0)
            p.first = k;
    }
    return p;
}

static double explicit_imaginary_limit(const kt_stability *s) {
    const excess p = make_excess(s);
    if (p.first < 0 || p.e[p.first] > 0.0)
        return 0.0;
    return kt_first_exit(explicit_inside_imaginary, &p, kt_farthest_stable(s));
}

/* ------------------------------------------------------------------------------------------------------------------ */

const kt_method_family kt_family_explicit = {
    .name = "explicit",
    .open = true,
    .check_sizes = kt_table_check_sizes,
    .measure = kt_explicit_measure,
    .init = kt_explicit_init,
    .try_step = kt_explicit_step,
    .error = explicit_error_norm,
    .error_at = explicit_error_at,
    .interpolate = kt_table_interpolate,
    .stability = explicit_polynomial,
    .value = explicit_value,
    .real_limit = explicit_real_limit,
    .imaginary_limit = explicit_imaginary_limit,
};
