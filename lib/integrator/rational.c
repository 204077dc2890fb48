/* Stability functions of implicit methods: R = P / Q. */
#include "integrator/integrator.h"

#include <math.h>

static kt_complex times(kt_complex a, kt_complex b) {
    const kt_complex product = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return product;
}

static kt_complex over(kt_complex a, kt_complex b) {
    const double square = b.re * b.re + b.im * b.im;
    const kt_complex inverse = {b.re / square, -b.im / square};
    return times(a, inverse);
}

/* sum_k c_k z^k, or where z is large sum_k c_k z^(k - most), which `z` is then the reciprocal for. */
static kt_complex polynomial(const double *c, int degree, int most, kt_complex z, bool large) {
    kt_complex sum = {0.0, 0.0};
    for (int i = 0; i <= most; i++) {
        const int k = large ? i : most - i;
        sum = times(sum, z);
        sum.re += k <= degree ? c[k] : 0.0;
    }
    return sum;
}

kt_complex kt_rational_value(const kt_stability *s, kt_complex z) {
    const int most = s->poles > s->degree ? s->poles : s->degree;
    const bool large = fabs(z.re) + fabs(z.im) > 1.0;
    const kt_complex one = {1.0, 0.0}, x = large ? over(one, z) : z;
    return over(polynomial(s->coefficient, s->degree, most, x, large),
                polynomial(s->denominator, s->poles, most, x, large));
}

double kt_rational_limit(const kt_stability *s) {
    (void)s;
    return HUGE_VAL;
}
