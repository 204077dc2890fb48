/* Stability functions of implicit methods: R = P / Q. */
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

double kt_rational_limit(const kt_stability *s) {
    (void)s;
    return HUGE_VAL;
}
