/* Relations of joint positions and rates: coupling, motion and rates, against closed forms of their functions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "loop/loop.h"

#include <float.h>

#define EPS DBL_EPSILON

KT_TEST(a_coupling_is_a_sum_less_its_offset) {
    double numbers[1];
    const kt_function offset = kt_function_constant(0.75);
    const kt_loop_record loop = {.type = KT_LOOP_COUPLING, .curve = kt_curve_compile(&offset, numbers, 0)};
    const kt_relation_row row = kt_loop_kinds_baseline[KT_LOOP_COUPLING]->relate(&loop, numbers, 2.0, 3.0);
    kt_check_near("phi", row.residual, 1.25, 0.0);
    kt_check_near("phi_t", row.rate, 0.0, 0.0);
    kt_check_near("drift", row.drift, 0.0, 0.0);
}

/* phi = q - f(t): phi' = q' + rate, phi'' = q'' + drift vanish where q moves as f does. */
KT_TEST(a_motion_follows_its_function) {
    const double coefficients[4] = {0.5, -1.0, 2.0, 0.25};
    const kt_function functions[3] = {kt_function_polynomial(coefficients, 4), kt_function_sine(0.8, 1.5, 0.3, 0.1),
                                      kt_function_ramp(1.0, 3.0, 0.0, 2.0)};
    const double t = 0.6, w = 2.0 * 3.141592653589793 * 1.5, s = t / 2.0;
    const double expected[3][3] = {
        {0.5 - t + 2.0 * t * t + 0.25 * t * t * t, -1.0 + 4.0 * t + 0.75 * t * t, 4.0 + 1.5 * t},
        {0.1 + 0.8 * sin(w * t + 0.3), 0.8 * w * cos(w * t + 0.3), -0.8 * w * w * sin(w * t + 0.3)},
        {1.0 + 2.0 * s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s), 3.0 * (1.0 - 2.0 * s)}};
    for (int i = 0; i < 3; i++) {
        double numbers[8];
        const kt_loop_record loop = {.type = KT_LOOP_MOTION, .curve = kt_curve_compile(&functions[i], numbers, 0)};
        const kt_relation_row row = kt_loop_kinds_baseline[KT_LOOP_MOTION]->relate(&loop, numbers, 2.0, t);
        kt_check_near("phi", row.residual, 2.0 - expected[i][0], 4.0 * EPS);
        kt_check_near("phi_t", row.rate, -expected[i][1], 8.0 * EPS * w);
        kt_check_near("drift", row.drift, -expected[i][2], 8.0 * EPS * w * w);
    }
}

/* phi' = A v - f(t), phi'' = A a - f'(t), and no phi. */
KT_TEST(rates_are_driven_by_a_function_and_its_slope) {
    const double coefficients[3] = {0.5, -1.0, 2.0}, t = 0.6;
    double numbers[8];
    const kt_function f = kt_function_polynomial(coefficients, 3);
    const kt_loop_record loop = {.type = KT_LOOP_RATES, .curve = kt_curve_compile(&f, numbers, 0)};
    const kt_relation_row row = kt_loop_kinds_baseline[KT_LOOP_RATES]->relate(&loop, numbers, 2.0, t);
    kt_check_near("closes", row.closes, 0.0, 0.0);
    kt_check_near("phi", row.residual, 0.0, 0.0);
    kt_check_near("phi_t", row.rate, -(0.5 - t + 2.0 * t * t), 4.0 * EPS);
    kt_check_near("drift", row.drift, -(-1.0 + 4.0 * t), 4.0 * EPS);
}
