/* The breakpoints of functions of time, compared with one-sided differences of the functions' values. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "model/function.h"

#include <float.h>
#include <math.h>

enum { NUMBERS = 128 };

typedef struct curve {
    kt_curve of;
    double numbers[NUMBERS];
} curve;

static curve compiled(kt_function function) {
    curve c;
    c.of = kt_curve_compile(&function, c.numbers, 0);
    return c;
}

/* The jump of a derivative from just before t to just after. The `order` is 0 for the value, and at most 2. The value
 * of `rounding` is the largest jump of a continuous value. It follows from the next derivative over that time, and from
 * the rounding of the terms. */
static double jump(const curve *c, double t, int order, double *rounding) {
    double left[3], right[3], largest = 1.0;
    kt_curve_evaluate(&c->of, c->numbers, t - 4.0 * DBL_EPSILON * fabs(t), left);
    kt_curve_evaluate(&c->of, c->numbers, t + 4.0 * DBL_EPSILON * fabs(t), right);
    for (int i = 0; i < 3; i++)
        largest = fmax(largest, fmax(fabs(left[i]), fabs(right[i])));
    *rounding = 32.0 * DBL_EPSILON * fmax(1.0, fabs(t)) * largest;
    return fabs(right[order] - left[order]);
}

/* All breakpoints from -1 on, and their orders. Derivatives below the order are continuous, and the derivative of this
 * order jumps (a third derivative cannot be computed). */
static void check_breakpoints(const char *name, kt_function function, int count, const double *times,
                              const int *orders) {
    const curve c = compiled(function);
    double t = -1.0, rounding;
    int64_t left = 1;
    kt_worst continuous = kt_worst_make("continuous below");
    kt_check_equal_int(name, kt_curve_has_breakpoints(&c.of), count > 0);
    for (int k = 0; k < count; k++) {
        const kt_breakpoint breakpoint = kt_curve_next_breakpoint(&c.of, c.numbers, t, HUGE_VAL, &left);
        kt_check_near("time, s", breakpoint.time, times[k], 0.0);
        if (!kt_check_equal_int("order", breakpoint.order, orders[k]) || breakpoint.order < 1)
            return;
        for (int order = 0; order < breakpoint.order && order < 3; order++) {
            const double by = jump(&c, breakpoint.time, order, &rounding);
            kt_worst_below(&continuous, by, rounding, "%g s, order %d", breakpoint.time, order);
        }
        if (breakpoint.order < 3) /* the least of all is 1/3 */
            kt_check_above("jumps", jump(&c, breakpoint.time, breakpoint.order, &rounding), 0.1);
        t = breakpoint.time;
    }
    if (count > 0)
        kt_check_worst(&continuous);
    kt_check_equal_int("no further one",
                       kt_curve_next_breakpoint(&c.of, c.numbers, t, HUGE_VAL, &left).time == HUGE_VAL, 1);
}

#define KT_BREAKPOINTS(name, function, ...)                                                                            \
    do {                                                                                                               \
        const struct {                                                                                                 \
            double t;                                                                                                  \
            int order;                                                                                                 \
        } list[] = {__VA_ARGS__};                                                                                      \
        double times[sizeof list / sizeof list[0]];                                                                    \
        int orders[sizeof list / sizeof list[0]];                                                                      \
        for (size_t i = 0; i < sizeof list / sizeof list[0]; i++) {                                                    \
            times[i] = list[i].t;                                                                                      \
            orders[i] = list[i].order;                                                                                 \
        }                                                                                                              \
        check_breakpoints(name, function, (int)(sizeof list / sizeof list[0]), times, orders);                         \
    } while (0)

KT_TEST(breakpoints_of_functions_are_where_derivatives_jump) {
    static const double bell[] = {1.0, 0.0, 2.0, 3.0, 3.5, 1.0, 4.0, 0.5};
    static const double kinked[] = {1.0, 0.0, 2.0, 0.0, 3.0, 2.0, 4.0, 4.0, 5.0, 4.0};
    KT_BREAKPOINTS("ramp", kt_function_ramp(0.0, 2.0, 1.0, 3.0), {1.0, 2}, {3.0, 2});
    KT_BREAKPOINTS("linear", kt_function_table(bell, 8, KT_INTERPOLATION_LINEAR), {1.0, 1}, {2.0, 1}, {3.5, 1},
                   {4.0, 1});
    KT_BREAKPOINTS("spline", kt_function_table(bell, 8, KT_INTERPOLATION_CUBIC), {1.0, 1}, {2.0, 3}, {3.5, 3},
                   {4.0, 1});
    KT_BREAKPOINTS("monotone", kt_function_table(bell, 8, KT_INTERPOLATION_MONOTONE), {1.0, 1}, {2.0, 2}, {3.5, 2},
                   {4.0, 1});
    /* Rows on one line are no breakpoints: `0 to 2` rests, as before the table, and `2 to 4` is one line. */
    KT_BREAKPOINTS("rows on lines", kt_function_table(kinked, 10, KT_INTERPOLATION_LINEAR), {2.0, 1}, {4.0, 1});
}

/* At 1 s the slope of the table jumps, and only the curvature of the ramp: the sum is as smooth as its worst part. */
KT_TEST(a_breakpoint_of_a_sum_has_the_lowest_order_of_its_parts) {
    static const double bell[] = {1.0, 0.0, 2.0, 3.0, 3.5, 1.0, 4.0, 0.5};
    const kt_function ramp = kt_function_ramp(0.0, 2.0, 1.0, 3.0),
                      table = kt_function_table(bell, 8, KT_INTERPOLATION_LINEAR);
    const kt_function parts[] = {ramp, table, ramp};
    for (int first = 0; first < 2; first++)
        KT_BREAKPOINTS("sum", kt_function_sum(parts + first, 2), {1.0, 1}, {2.0, 1}, {3.0, 2}, {3.5, 1}, {4.0, 1});
}

KT_TEST(functions_without_breakpoints_have_none) {
    static const double c[] = {1.0, 2.0, 3.0};
    check_breakpoints("constant", kt_function_constant(2.0), 0, NULL, NULL);
    check_breakpoints("sine", kt_function_sine(1.0, 2.0, 0.5, 1.0), 0, NULL, NULL);
    check_breakpoints("polynomial", kt_function_polynomial(c, 3), 0, NULL, NULL);
    check_breakpoints("level ramp", kt_function_ramp(2.0, 2.0, 1.0, 3.0), 0, NULL, NULL);
}

KT_TEST(longest_step_is_a_quarter_of_a_period) {
    const curve sine = compiled(kt_function_sine(1.0, 2.0, 0.5, 1.0)),
                flat = compiled(kt_function_sine(0.0, 2.0, 0.0, 1.0));
    const curve ramp = compiled(kt_function_ramp(0.0, 2.0, 1.0, 3.0));
    kt_check_near("sine, s", kt_curve_longest_step(&sine.of, sine.numbers), 0.125, DBL_EPSILON);
    kt_check_equal_int("without amplitude", kt_curve_longest_step(&flat.of, flat.numbers) == HUGE_VAL, 1);
    kt_check_equal_int("ramp", kt_curve_longest_step(&ramp.of, ramp.numbers) == HUGE_VAL, 1);
}
