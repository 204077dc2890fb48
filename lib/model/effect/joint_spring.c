/* Spring and damper in a joint, with the rest position r(t). The actuator that moves the rest position supplies energy.
 *     force = -k (q - r) - c v
 *     V = k (q - r)^2 / 2,   dissipated = c v^2,   supplied = -k (q - r) r' */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static kt_real joint_spring_force(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v,
                                  kt_plain t, kt_effect_power *balance) {
    kt_plain r[3] = {kt_plain_of(effect->curve[0].a), kt_plain_of(0.0), kt_plain_of(0.0)};
    if (!kt_curve_rests(&effect->curve[0]))
        kt_effect_curve_evaluate(&effect->curve[0], numbers, t, r);
    const kt_real stretch = q - r[0];
    if (balance)
        *balance = (kt_effect_power){.energy = 0.5 * effect->stiffness * stretch * stretch,
                                     .dissipated = effect->damping * v * v,
                                     .supplied = -effect->stiffness * stretch * r[1]};
    return -effect->stiffness * stretch - effect->damping * v;
}

static kt_energetics joint_spring_energetics(const kt_effect_record *effect) {
    return kt_curve_rests(&effect->curve[0]) ? kt_energetics_of(effect->damping > 0.0) : KT_ENERGY_SUPPLIED;
}

#if KT_IS_OF_VALUES
static void joint_spring_jacobian(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                                  double derivative[2]) {
    (void)numbers, (void)q, (void)v, (void)t;
    derivative[0] = -effect->stiffness;
    derivative[1] = -effect->damping;
}

static double joint_spring_time_derivative(const kt_effect_record *effect, const double *numbers, double q, double v,
                                           double t) {
    double r[3];
    (void)q, (void)v;
    kt_effect_curve_derivatives(&effect->curve[0], numbers, t, r);
    return effect->stiffness * r[1];
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_joint_spring) = {
    .energetics = joint_spring_energetics,
    .joint_force = joint_spring_force,
    .joint_derivatives = KT_IF_JACOBIAN(joint_spring_jacobian),
    .joint_time_derivative = KT_IF_JACOBIAN(joint_spring_time_derivative)};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_effect, KT_COORDINATE_WORDS),
    {"stiffness", KT_KEY_NUMBER, KT_EFFECT_AT(stiffness), "N m/rad|N/m", "k", .range = KT_RANGE_NOT_NEGATIVE},
    {"rest", KT_KEY_FUNCTION, KT_EFFECT_AT(rest), "rad|m", "r, the position without force, a function of time", "0",
     .needed = false},
    {"damping", KT_KEY_NUMBER, KT_EFFECT_AT(damping), "N m s/rad|N s/m", "c", .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_effect_joint_spring_descriptor = {
    .name = "joint_spring",
    .help = "a spring and a damper in a joint",
    .formula = "force = -k (q - r) - c v",
    .example = KT_EXAMPLE_ARM "  - {type: joint_spring, joint: arm, stiffness: 2, rest: 10 deg, damping: 0.05}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_JOINT,
};
#endif
