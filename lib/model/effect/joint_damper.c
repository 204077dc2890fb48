/* Linear damper in a joint: force = -c v, dissipated = c v^2. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static kt_real joint_damper_force(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v,
                                  kt_plain t, kt_effect_power *balance) {
    (void)numbers, (void)q, (void)t;
    if (balance)
        *balance = (kt_effect_power){.dissipated = effect->damping * v * v};
    return -effect->damping * v;
}

#if KT_IS_OF_VALUES
static void joint_damper_jacobian(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                                  double derivative[2]) {
    (void)numbers, (void)q, (void)v, (void)t;
    derivative[0] = 0.0;
    derivative[1] = -effect->damping;
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_joint_damper) = {.energetics = kt_effect_energetics_of_damper,
                                                          .joint_force = joint_damper_force,
                                                          .joint_derivatives = KT_IF_JACOBIAN(joint_damper_jacobian),
                                                          .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_effect, KT_COORDINATE_WORDS),
    {"damping", KT_KEY_NUMBER, KT_EFFECT_AT(damping), "N m s/rad|N s/m", "c", .range = KT_RANGE_NOT_NEGATIVE,
     .needed = true},
};
const kt_descriptor kt_effect_joint_damper_descriptor = {
    .name = "joint_damper",
    .help = "a linear damper in a joint",
    .formula = "force = -c v",
    .example = KT_EXAMPLE_ARM "  - {type: joint_damper, joint: arm, damping: 0.1}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_JOINT,
};
#endif
