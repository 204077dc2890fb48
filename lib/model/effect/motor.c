/* Motor: a joint's force (or torque) as a function of time, f(t); supplied = f v. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static kt_real motor_force(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, kt_plain t,
                           kt_effect_power *balance) {
    kt_plain f[3];
    (void)q;
    kt_effect_curve_evaluate(&effect->curve[0], numbers, t, f);
    if (balance)
        *balance = (kt_effect_power){.supplied = f[0] * v};
    return f[0];
}

#if KT_IS_OF_VALUES
static void motor_jacobian(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                           double derivative[2]) {
    (void)effect, (void)numbers, (void)q, (void)v, (void)t;
    derivative[0] = derivative[1] = 0.0;
}

static double motor_time_derivative(const kt_effect_record *effect, const double *numbers, double q, double v,
                                    double t) {
    double f[3];
    (void)q, (void)v;
    kt_effect_curve_derivatives(&effect->curve[0], numbers, t, f);
    return f[1];
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_motor) = {.energetics = kt_effect_energetics_of_curves,
                                                   .joint_force = motor_force,
                                                   .joint_derivatives = KT_IF_JACOBIAN(motor_jacobian),
                                                   .joint_time_derivative = KT_IF_JACOBIAN(motor_time_derivative),
                                                   .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_effect, KT_COORDINATE_WORDS),
    {"torque", KT_KEY_FUNCTION, KT_EFFECT_AT(torque), "N m|N", "f", .also = "force", .needed = true},
};
const kt_descriptor kt_effect_motor_descriptor = {
    .name = "motor",
    .help = "a torque or force in a joint as a function of time",
    .formula = "force = f(t)",
    .example = KT_EXAMPLE_ARM "  - {type: motor, joint: arm, torque: {sine: {amplitude: 2, frequency: 0.5}}}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_JOINT,
};
#endif
