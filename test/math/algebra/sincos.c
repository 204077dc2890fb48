/* The sines and cosines of the recursions against those of long double, in units in the last place. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "algebra/sincos.h"
#include "dynamics/dynamics.h"
#include "kinetree/dynamics.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { GROUP = 1024 };

/* One level of the instruction set. */
typedef void gather(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine);

/* Evaluates up to GROUP angles. The list is padded, as the library requires. */
static void take(gather *kernel, const double *q, const int32_t *angle, size_t count, double *sine, double *cosine) {
    static int32_t places[GROUP + KT_SINCOS_LANES];
    memset(places, 0, sizeof places);
    memcpy(places, angle, count * sizeof *angle);
    kernel(q, places, count, sine, cosine);
}

/* Angles, a group at a time, and the worst errors so far. */
typedef struct sweep {
    double x[GROUP];
    size_t count;
    double worst_sine, worst_cosine; /* units in the last place */
    double at_sine, at_cosine;
    size_t total;
} sweep;

static double error_in_units(double observed, long double expected) {
    int exponent;
    (void)frexpl(expected, &exponent);
    const long double unit = ldexpl(1.0L, exponent - DBL_MANT_DIG < -1074 ? -1074 : exponent - DBL_MANT_DIG);
    return (double)(fabsl((long double)observed - expected) / unit);
}

static void flush(sweep *s) {
    static double sine[GROUP], cosine[GROUP];
    static int32_t index[GROUP];
    for (size_t i = 0; i < s->count; i++)
        index[i] = (int32_t)i;
    take(kt_sincos_gather, s->x, index, s->count, sine, cosine);
    for (size_t i = 0; i < s->count; i++) {
        const long double x = (long double)s->x[i];
        const double es = error_in_units(sine[i], sinl(x)), ec = error_in_units(cosine[i], cosl(x));
        if (!(es <= s->worst_sine)) {
            s->worst_sine = es;
            s->at_sine = s->x[i];
        }
        if (!(ec <= s->worst_cosine)) {
            s->worst_cosine = ec;
            s->at_cosine = s->x[i];
        }
    }
    s->total += s->count;
    s->count = 0;
}

static void add(sweep *s, double x) {
    s->x[s->count++] = x;
    if (s->count == GROUP)
        flush(s);
}

static void judge(sweep *s) {
    flush(s);
    kt_note("%zu angles; worst sine at %.17g, worst cosine at %.17g", s->total, s->at_sine, s->at_cosine);
    kt_check_below("sine, units in the last place", s->worst_sine, 1.0);
    kt_check_below("cosine, units in the last place", s->worst_cosine, 1.0);
}

/* For results between 1/2 and 1, an error of one unit is DBL_EPSILON / 2. */
KT_TEST(error_is_below_one_unit_within_a_turn) {
    kt_random random = kt_random_of_test();
    sweep s = {.count = 0};
    for (int i = 0; i < 400000; i++)
        add(&s, kt_random_uniform(&random, -7.0, 7.0));
    for (int i = 0; i < 100000; i++) /* every magnitude */
        add(&s, ldexp(kt_random_uniform(&random, -1.0, 1.0), kt_random_int(&random, -1074, 2)));
    judge(&s);
}

KT_TEST(error_is_below_one_unit_up_to_the_limit) {
    kt_random random = kt_random_of_test();
    sweep s = {.count = 0};
    for (int i = 0; i < 400000; i++)
        add(&s, kt_random_uniform(&random, -1647099.0, 1647099.0));
    for (int i = 0; i < 100000; i++)
        add(&s, ldexp(kt_random_uniform(&random, -1.0, 1.0), kt_random_int(&random, 1, 20)));
    judge(&s);
}

/* The doubles on both sides of every multiple of pi / 2 up to the limit, where all but the last bits cancel. */
KT_TEST(error_is_below_one_unit_beside_every_multiple_of_a_quarter_turn) {
    const long double quarter = 1.57079632679489661923132169163975144L;
    sweep s = {.count = 0};
    for (int n = 0; n <= 1 << 20; n++) {
        const double x = (double)(n * quarter);
        add(&s, x);
        add(&s, -nextafter(x, 2.0 * x + 1.0));
        add(&s, nextafter(x, -1.0));
    }
    judge(&s);
}

/* And half way between, where the quadrants meet. */
KT_TEST(error_is_below_one_unit_where_quadrants_meet) {
    sweep s = {.count = 0};
    for (int n = 0; n <= 1 << 18; n++) {
        const double x = (double)((n + 0.5L) * 1.57079632679489661923L);
        add(&s, x);
        add(&s, nextafter(x, 1e9));
        add(&s, -nextafter(x, -1e9));
    }
    judge(&s);
}

KT_TEST(error_is_below_one_unit_beyond_the_limit) {
    kt_random random = kt_random_of_test();
    sweep s = {.count = 0};
    for (int i = 0; i < 20000; i++)
        add(&s, ldexp(kt_random_uniform(&random, -1.0, 1.0), kt_random_int(&random, 20, 1024)));
    add(&s, 1647099.0);
    add(&s, nextafter(1647099.0, 2e6));
    add(&s, DBL_MAX);
    judge(&s);
}

KT_TEST(sines_of_zeros_and_tiny_angles_are_exact) {
    const double x[8] = {0.0, -0.0, 4.9406564584124654e-324, -2.2250738585072014e-308, 1e-200, -1e-30, 1e-9, 0.5};
    const double one[6] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    const int32_t index[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    double sine[8], cosine[8];
    take(kt_sincos_gather, x, index, 8, sine, cosine);
    kt_check_equal_bits("sine is the angle", sine, x, 7);
    kt_check_equal_bits("cosine is one", cosine, one, 6);
}

KT_TEST(sine_is_odd_and_cosine_even_to_the_bit) {
    kt_random random = kt_random_of_test();
    int odd = 0, even = 0;
    for (int i = 0; i < 20000; i++) {
        const double x = ldexp(kt_random_uniform(&random, 0.0, 1.0), kt_random_int(&random, -40, 30));
        const double pair[2] = {x, -x};
        double sine[8], cosine[8];
        take(kt_sincos_gather, pair, (int32_t[]){0, 1}, 2, sine, cosine);
        odd += sine[0] != -sine[1];
        even += cosine[0] != cosine[1];
    }
    kt_check_equal_int("sines that are not odd", odd, 0);
    kt_check_equal_int("cosines that are not even", even, 0);
}

KT_TEST(what_is_not_finite_gives_nan) {
    const double x[4] = {(double)INFINITY, -(double)INFINITY, (double)NAN, 1.0};
    double sine[8], cosine[8];
    take(kt_sincos_gather, x, (int32_t[]){0, 1, 2, 3}, 4, sine, cosine);
    for (int i = 0; i < 3; i++)
        kt_check_true("sine and cosine are NaN", isnan(sine[i]) && isnan(cosine[i]));
    kt_check_near("next to them, sin 1", sine[3], sin(1.0), DBL_EPSILON);
}

/* A sine does not depend on its neighbours. One neighbour is beyond the limit, and one is NaN. */
KT_TEST(an_angle_has_the_same_bits_in_any_company) {
    kt_random random = kt_random_of_test();
    int different = 0;
    for (int i = 0; i < 20000; i++) {
        const double x = kt_random_uniform(&random, -1e3, 1e3);
        const double q[3] = {x, i % 2 ? 1e9 : (double)NAN, 0.1};
        double alone_sine[8], alone_cosine[8], sine[16], cosine[16];
        take(kt_sincos_gather, q, (int32_t[]){0}, 1, alone_sine, alone_cosine);
        take(kt_sincos_gather, q, (int32_t[]){2, 1, 2, 2, 2, 2, 2, 2, 2, 0}, 10, sine, cosine);
        different += sine[9] != alone_sine[0] || cosine[9] != alone_cosine[0];
        take(kt_sincos_gather, q, (int32_t[]){2, 1, 2, 0}, 4, sine, cosine);
        different += sine[3] != alone_sine[0] || cosine[3] != alone_cosine[0];
    }
    kt_check_equal_int("angles whose bits differ", different, 0);
}

/* Most angles are computed several at once in vectors, and the remaining ones alone. */
static void same_bits_in_any_number(const char *what, gather *kernel) {
    enum { MOST = 56 };
    kt_random random = kt_random_of_test();
    double q[MOST], alone[2][MOST][KT_SINCOS_LANES], sine[MOST], cosine[MOST];
    int32_t index[MOST];
    int different = 0;
    for (int32_t i = 0; i < MOST; i++) {
        q[i] = i % 19 == 5 ? 1e9 : kt_random_uniform(&random, -1e3, 1e3);
        index[i] = i;
        take(kernel, q, &i, 1, alone[0][i], alone[1][i]);
    }
    for (size_t count = 1; count <= MOST; count++) {
        take(kernel, q, index, count, sine, cosine);
        for (size_t i = 0; i < count; i++)
            different += memcmp(&sine[i], &alone[0][i][0], sizeof *sine) != 0 ||
                         memcmp(&cosine[i], &alone[1][i][0], sizeof *cosine) != 0;
    }
    kt_check_equal_int(what, different, 0);
}

KT_TEST(angles_have_the_same_bits_in_any_number) {
    same_bits_in_any_number("angles whose bits differ by the baseline", kt_sincos_gather_baseline);
#ifdef KT_ISAS
    if (kt_isa_resolve(KT_ISA_V3) == KT_ISA_V3)
        same_bits_in_any_number("angles whose bits differ by v3", kt_sincos_gather_v3);
    if (kt_isa_resolve(KT_ISA_V4) == KT_ISA_V4)
        same_bits_in_any_number("angles whose bits differ by v4", kt_sincos_gather_v4);
#endif
}

static void same_bits(const char *what, gather *kernel) {
    kt_random random = kt_random_of_test();
    static double x[GROUP], sine[2][GROUP], cosine[2][GROUP];
    static int32_t index[GROUP];
    int different = 0;
    for (int n = 0; n < 200; n++) {
        for (int i = 0; i < GROUP; i++) {
            x[i] = ldexp(kt_random_uniform(&random, -1.0, 1.0), kt_random_int(&random, -20, n % 2 ? 20 : 23));
            index[i] = i;
        }
        take(kt_sincos_gather_baseline, x, index, GROUP, sine[0], cosine[0]);
        take(kernel, x, index, GROUP, sine[1], cosine[1]);
        different +=
            memcmp(sine[0], sine[1], sizeof sine[0]) != 0 || memcmp(cosine[0], cosine[1], sizeof cosine[0]) != 0;
    }
    kt_check_equal_int(what, different, 0);
}

KT_TEST(all_levels_give_the_same_bits) {
#ifdef KT_ISAS
    if (kt_isa_resolve(KT_ISA_V3) == KT_ISA_V3)
        same_bits("groups that differ between baseline and v3", kt_sincos_gather_v3);
    else
        kt_skip("v3", KT_NO_ISA);
    if (kt_isa_resolve(KT_ISA_V4) == KT_ISA_V4)
        same_bits("groups that differ between baseline and v4", kt_sincos_gather_v4);
    else
        kt_skip("v4", KT_NO_ISA);
#else
    kt_skip("v3 and v4", KT_NO_ISA);
#endif
    same_bits("groups that differ between two runs", kt_sincos_gather_baseline);
}
