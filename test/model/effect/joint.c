/* Effects in joints, and the list of all effects. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "effect/effect.h"

#include <float.h>

#define EPS DBL_EPSILON

KT_TEST(a_damper_opposes_the_speed_and_turns_its_power_into_heat) {
    const kt_effect_record damper = {.type = KT_EFFECT_JOINT_DAMPER, .damping = 2.5};
    const double speeds[4] = {-3.0, -1e-5, 0.0, 7.0};
    for (int i = 0; i < 4; i++) {
        const double v = speeds[i];
        kt_effect_balance balance;
        const double force = kt_effect_kinds[KT_EFFECT_JOINT_DAMPER]->joint_force(&damper, NULL, 0.3, v, 1.0, &balance);
        kt_check_near("force", force, -2.5 * v, EPS * fabs(v));
        kt_check_near("dissipated", balance.dissipated, -force * v, 4.0 * EPS * v * v);
        kt_check_near("energy", balance.energy, 0.0, 0.0);
        kt_check_near("supplied", balance.supplied, 0.0, 0.0);
        kt_check_near("without a balance",
                      kt_effect_kinds[KT_EFFECT_JOINT_DAMPER]->joint_force(&damper, NULL, 0.3, v, 1.0, NULL), force,
                      0.0);
    }
}

KT_TEST(a_motor_gives_its_function_of_time_and_supplies_the_power) {
    double numbers[8];
    const double coefficients[3] = {0.5, -2.0, 0.25};
    const kt_function functions[2] = {kt_function_sine(1.5, 0.7, 0.2, 0.3), kt_function_polynomial(coefficients, 3)};
    const double t = 1.9,
                 expected[2] = {0.3 + 1.5 * sin(2.0 * 3.141592653589793 * 0.7 * t + 0.2), 0.5 - 2.0 * t + 0.25 * t * t};
    for (int i = 0; i < 2; i++) {
        const kt_effect_record motor = {.type = KT_EFFECT_MOTOR,
                                        .curve = {kt_curve_compile(&functions[i], numbers, 2)}};
        for (int speed = -1; speed <= 1; speed++) {
            kt_effect_balance balance;
            const double force =
                kt_effect_kinds[KT_EFFECT_MOTOR]->joint_force(&motor, numbers, 0.1, 1.25 * speed, t, &balance);
            kt_check_near("force", force, expected[i], 16.0 * EPS);
            kt_check_near("supplied", balance.supplied, expected[i] * 1.25 * speed, 16.0 * EPS);
            kt_check_near("dissipated", balance.dissipated, 0.0, 0.0);
            kt_check_near("energy", balance.energy, 0.0, 0.0);
        }
    }
}

KT_TEST(every_effect_acts_on_ends_or_on_a_joint) {
    for (int type = 0; type < KT_EFFECT_TYPE_COUNT; type++) {
        const kt_effect_kind *kind = kt_effect_kinds[type];
        const int ends = kt_descriptor_end_count(kt_effect_descriptor((kt_effect_type)type));
        kt_check_true(kt_effect_type_name((kt_effect_type)type), kind != NULL);
        if (type == KT_EFFECT_EXPRESSION) { /* on either, by values of formulas */
            kt_check_true("  by formulas alone", kind->formula_wrench && !kind->wrench && !kind->joint_force);
            continue;
        }
        kt_check_true("  a wrench on ends, or a joint force", (kind->wrench != NULL) == (ends > 0));
        kt_check_true("  and not both", (kind->joint_force != NULL) == (ends == 0));
        kt_check_true("  one or two ends", ends >= 0 && ends <= 2);
    }
}
