/* Servo: a joint's force towards a target r(t), of limited size.
 *     u = k (r - q) + c (r' - v),   force = limit(u),   supplied = force v
 *
 * The limit L is smooth. The force is u up to 0.9 L, and +-L from 1.1 L on. Between 0.9 L and 1.1 L, the force is a
 * parabola with the derivatives 1 and 0 at the ends, so that the force is C1:
 *     force = L - (1.1 L - u)^2 / (0.4 L)
 * Therefore, far from its limit, the servo has the force of its gains. The force never exceeds the limit, and is C1 for
 * the integrator's error control.
 *
 * The bounds `lower` and `upper` are hard, as in other programs. Hard bounds replace u with min(max(u,
 * lower), upper), which has a kink at each bound. Both bounds need not have the same magnitude.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static void servo_check(kt_checker *checker, const kt_effect *effect) {
    if (!checker->set && effect->stiffness == 0.0 && effect->damping == 0.0)
        kt_effect_report_neither(checker, "stiffness", "damping");
    kt_effect_check_bounds(checker, effect);
}

/* Half of the width of the parabola, as a share of the limit. */
static const double blend = 0.1;

/* The smooth limit above; `blend` is 0.1. */
static kt_real limit_magnitude(kt_real u, double limit) {
    const kt_real size = kt_abs(u);
    const kt_condition is_beyond = kt_not(kt_value(size) <= (1.0 - blend) * limit);
    if (!kt_is_anywhere(is_beyond))
        return u;
    const kt_real missing = (1.0 + blend) * limit - size;
    const kt_real force = KT_CHOOSE(kt_value(size) < (1.0 + blend) * limit,
                                    limit - missing * missing / (4.0 * blend * limit), kt_real_of(limit));
    return KT_CHOOSE(is_beyond, KT_CHOOSE(kt_value(u) < 0.0, -force, force), u);
}

/* Restricts u to the hard bounds. A NaN stays NaN. */
static kt_real bound_force(kt_real u, const kt_effect_record *effect) {
    const kt_real least = KT_CHOOSE(kt_value(u) < effect->lower, kt_real_of(effect->lower), u);
    return KT_CHOOSE(kt_value(u) > effect->upper, kt_real_of(effect->upper), least);
}

static kt_real servo_force(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, kt_plain t,
                           kt_effect_power *balance) {
    kt_plain r[3];
    kt_effect_curve_evaluate(&effect->curve[0], numbers, t, r);
    const kt_real u = effect->stiffness * (r[0] - q) + effect->damping * (r[1] - v);
    const kt_real force = limit_magnitude(bound_force(u, effect), effect->limit);
    if (balance)
        *balance = (kt_effect_power){.supplied = force * v};
    return force;
}

#if KT_IS_OF_VALUES
/* The derivative of the force with respect to u. The derivative is 1 below the parabola, and 0 beyond the parabola or a
 * hard bound. On the parabola, the derivative is (1.1 L - |u|) / (0.2 L). r: the target and its derivatives. */
static double derivative_of_limit(const kt_effect_record *effect, double q, double v, const double r[3]) {
    const double u = effect->stiffness * (r[0] - q) + effect->damping * (r[1] - v);
    const double missing = (1.0 + blend) * effect->limit - fabs(u);
    if (u < effect->lower || u > effect->upper)
        return 0.0;
    if (!(fabs(u) > (1.0 - blend) * effect->limit))
        return 1.0;
    return missing > 0.0 ? missing / (2.0 * blend * effect->limit) : 0.0;
}

static void servo_jacobian(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                           double derivative[2]) {
    double r[3];
    kt_curve_evaluate(&effect->curve[0], numbers, t, r);
    const double derivative_of_force = derivative_of_limit(effect, q, v, r);
    derivative[0] = -derivative_of_force * effect->stiffness;
    derivative[1] = -derivative_of_force * effect->damping;
}

static double servo_time_derivative(const kt_effect_record *effect, const double *numbers, double q, double v,
                                    double t) {
    double r[3];
    kt_effect_curve_derivatives(&effect->curve[0], numbers, t, r);
    return derivative_of_limit(effect, q, v, r) * (effect->stiffness * r[1] + effect->damping * r[2]);
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_servo) = {.derivatives = 1,
                                                   .check = servo_check,
                                                   .joint_force = servo_force,
                                                   .joint_derivatives = KT_IF_JACOBIAN(servo_jacobian),
                                                   .joint_time_derivative = KT_IF_JACOBIAN(servo_time_derivative),
                                                   .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_effect, KT_COORDINATE_WORDS),
    {"target", KT_KEY_FUNCTION, KT_EFFECT_AT(target), "rad|m", "r, the position to reach, a function of time",
     .needed = true},
    {"stiffness", KT_KEY_NUMBER, KT_EFFECT_AT(stiffness), "N m/rad|N/m", "k; stiffness or damping is needed",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"damping", KT_KEY_NUMBER, KT_EFFECT_AT(damping), "N m s/rad|N s/m", "c, of r' - v",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"limit", KT_KEY_NUMBER, KT_EFFECT_AT(limit), "N m|N", "L, the largest force; smooth near it", "none",
     .range = KT_RANGE_POSITIVE},
    {"lower", KT_KEY_NUMBER, KT_EFFECT_AT(lower), "N m|N", "the least force, a hard bound", "none", .needed = false},
    {"upper", KT_KEY_NUMBER, KT_EFFECT_AT(upper), "N m|N", "the largest force, a hard bound", "none", .needed = false},
};
const kt_descriptor kt_effect_servo_descriptor = {
    .name = "servo",
    .help = "a drive that follows a target position in a joint, with a limited force",
    .formula = "u = k (r - q) + c (r' - v), not below `lower` and not above `upper`\n"
               "force = u up to 0.9 L, L from 1.1 L on, smooth between them; likewise below zero",
    .example = KT_EXAMPLE_ARM "  - type: servo\n"
                              "    joint: arm\n"
                              "    target: {ramp: {from: 20 deg, to: 90 deg, start: 0, end: 0.5}}\n"
                              "    stiffness: 200\n"
                              "    damping: 20\n"
                              "    limit: 15\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_JOINT,
};
#endif
