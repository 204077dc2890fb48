/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/algebra.h"

#include "check.h"

#include <float.h>
#include <math.h>

enum { DRAWS = 1000000 };

/* A length against the square root in long double, in units of the last place. */
static double error_of(double x, double y) {
    int exponent;
    const double size = fmax(fabs(x), fabs(y));
    (void)frexp(size, &exponent);
    const long double a = ldexpl((long double)x, -exponent), b = ldexpl((long double)y, -exponent);
    const long double exact = sqrtl(a * a + b * b);
    const double h = kt_hypot(x, y);
    (void)frexp(h, &exponent);
    int own;
    (void)frexp(size, &own);
    const double unit = fmax(ldexp(1.0, exponent - own - DBL_MANT_DIG), ldexp(1.0, DBL_MIN_EXP - own - DBL_MANT_DIG));
    return (double)fabsl(ldexpl((long double)h, -own) - exact) / unit;
}

/* A number whose exponent is uniform between two. */
static double draw(kt_random *random, double from, double to) {
    return kt_random_normal(random) * exp2(kt_random_uniform(random, from, to));
}

/* The bound is one unit in the last place; half a unit is the rounding of the result alone. */
KT_TEST(lengths_of_pairs_are_exact_to_a_unit_in_the_last_place) {
    kt_random random = kt_random_of_test();
    double worst[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < DRAWS; k++) {
        const double x = draw(&random, -30.0, 30.0);
        worst[0] = fmax(worst[0], error_of(x, x * draw(&random, -2.0, 2.0)));
        worst[1] = fmax(worst[1], error_of(draw(&random, 500.0, 1015.0), draw(&random, 500.0, 1015.0)));
        worst[2] = fmax(worst[2], error_of(draw(&random, -1060.0, -450.0), draw(&random, -1060.0, -450.0)));
    }
    (void)kt_check_below("units in the last place, near each other", worst[0], 1.0);
    (void)kt_check_below("likewise of squares that overflow", worst[1], 1.0);
    (void)kt_check_below("likewise of squares that underflow", worst[2], 1.0);
}

KT_TEST(lengths_of_special_numbers_are_those_of_the_standard) {
    const double inf = (double)INFINITY, nan = (double)NAN;
    const double observed[] = {kt_hypot(inf, nan),  kt_hypot(nan, -inf),        kt_hypot(-inf, 1.0),
                               kt_hypot(0.0, -0.0), kt_hypot(-3.0, 0.0),        kt_hypot(DBL_MAX, 0.0),
                               kt_hypot(3.0, -4.0), kt_hypot(0.0, DBL_TRUE_MIN)};
    const double expected[] = {inf, inf, inf, 0.0, 3.0, DBL_MAX, 5.0, DBL_TRUE_MIN};
    (void)kt_check_equal_bits("lengths", observed, expected, sizeof observed / sizeof *observed);
    (void)kt_check_true("a NaN with a number is NaN", isnan(kt_hypot(nan, 1.0)) && isnan(kt_hypot(1.0, nan)));
    (void)kt_check_true("a length may overflow", isinf(kt_hypot(DBL_MAX, DBL_MAX)));
}
