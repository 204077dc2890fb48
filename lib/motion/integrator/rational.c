/* Stability functions of implicit methods: R = P / Q.
 *
 * Stages that are solved one after the other, with one gamma on the diagonal. The matrix B of such stages is lower
 * triangular, and Y = (1 - z B)^-1 1. With p_i the number of solved stages up to stage i, all stages except perhaps the
 * first,
 *
 *     Y_i = N_i / (1 - gamma z)^p_i
 *     N_i = (1 - gamma z)^(p_i - 1) + z sum_{j<i} B_ij N_j (1 - gamma z)^(p_i - 1 - p_j)
 *
 * and R is the last Y_i. For a Rosenbrock method, B is a + gamma. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/complex.h"
#include "integrator/integrator.h"

#include <math.h>

static kt_complex divide_robustly(kt_complex a, kt_complex b) { return kt_complex_multiply(a, kt_complex_invert(b)); }

/* Returns sum_k c_k z^k. If `large` is set, `z` is the reciprocal of the argument, and the result is the sum divided by
 * the argument's power `most`. */
static kt_complex polynomial(const double *c, int degree, int most, kt_complex z, bool large) {
    kt_complex sum = {0.0, 0.0};
    for (int i = 0; i <= most; i++) {
        const int k = large ? i : most - i;
        sum = kt_complex_multiply(sum, z);
        sum.re += k <= degree ? c[k] : 0.0;
    }
    return sum;
}

kt_complex kt_rational_value(const kt_stability *s, kt_complex z) {
    const int most = s->poles > s->degree ? s->poles : s->degree;
    const bool large = fabs(z.re) + fabs(z.im) > 1.0;
    const kt_complex one = {1.0, 0.0}, x = large ? divide_robustly(one, z) : z;
    return divide_robustly(polynomial(s->coefficient, s->degree, most, x, large),
                           polynomial(s->denominator, s->poles, most, x, large));
}

typedef struct numerator {
    long double c[KT_METHOD_STAGES_MAX + 1];
} numerator;

/* p (1 - gamma z)^power */
static numerator multiply_power(numerator p, long double gamma, int power) {
    for (int k = 0; k < power; k++)
        for (int i = KT_METHOD_STAGES_MAX; i > 0; i--)
            p.c[i] -= gamma * p.c[i - 1];
    return p;
}

void kt_rational_stages(const kt_method *m, double gamma, int first, int degree, kt_stability *out) {
    const numerator one = {{1.0L}};
    const int s = m->stages;
    numerator n[KT_METHOD_STAGES_MAX] = {{{1.0L}}};
    for (int i = first; i < s; i++) {
        n[i] = multiply_power(one, (long double)gamma, i - first);
        for (int j = 0; j < i; j++) {
            const numerator term = multiply_power(n[j], (long double)gamma, i - 1 - j);
            const long double b = (long double)m->a[i * s + j] + (m->gamma ? (long double)m->gamma[i * s + j] : 0.0L);
            for (int k = 0; k < KT_METHOD_STAGES_MAX; k++)
                n[i].c[k + 1] += b * term.c[k];
        }
    }
    out->poles = s - first;
    const numerator q = multiply_power(one, (long double)gamma, out->poles);
    for (int k = 0; k <= KT_METHOD_STAGES_MAX; k++) {
        out->coefficient[k] = k <= degree ? (double)n[s - 1].c[k] : 0.0;
        out->denominator[k] = (double)q.c[k];
    }
    for (out->degree = degree; out->degree > 0 && out->coefficient[out->degree] == 0.0;)
        out->degree--;
}

double kt_rational_limit(const kt_stability *s) {
    (void)s;
    return HUGE_VAL;
}
