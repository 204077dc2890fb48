/* Torque: a vector m(t) on a body, its components in world axes or in the end's; supplied = m . omega. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static void torque_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, kt_plain t,
                          kt_effect_wrench *wrench, kt_effect_power *balance) {
    const kt_triple m = KT_EFFECT(kt_effect_value)(effect, numbers, end, t);
    wrench[0] = (kt_effect_wrench){.moment = m, .force = kt_triple_zero()};
    if (balance)
        *balance = (kt_effect_power){.supplied = kt_triple_dot(m, end[0].omega)};
}

#if KT_IS_OF_VALUES
/* A moment that is fixed in the body turns with the body: dm = theta x m. */
static void torque_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                            kt_effect_jacobian *jacobian) {
    const kt_vec3 value = kt_effect_value(effect, numbers, end, t);
    *jacobian = (kt_effect_jacobian){.moment = value};
    if (effect->in_body)
        jacobian->stiffness[0][0] = kt_mat3_scale(-1.0, kt_mat3_skew(value));
}

static void torque_time_derivative(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                   double t, kt_wrench *wrench) {
    wrench[0] = (kt_wrench){.moment = kt_effect_value_time_derivative(effect, numbers, end, t)};
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_torque) = {.energetics = kt_effect_energetics_of_curves,
                                                    .wrench = torque_wrench,
                                                    .jacobian = KT_IF_JACOBIAN(torque_jacobian),
                                                    .time_derivative = KT_IF_JACOBIAN(torque_time_derivative),
                                                    .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"on", KT_KEY_END, KT_EFFECT_AT(between[0]), "", "the body", .needed = true},
    {"value", KT_KEY_FUNCTIONS, KT_EFFECT_AT(value), "N m", "m: three numbers or functions of time", .needed = true},
    {"frame", KT_KEY_FRAME, KT_EFFECT_AT(frame), "",
     "`world`, or `body` for components along the axes of the marker, or else of the body", "world", .needed = false},
};
const kt_descriptor kt_effect_torque_descriptor = {
    .name = "torque",
    .help = "a torque on a body",
    .formula = "moment = m(t)",
    .example = KT_EXAMPLE_CUBE "  - {type: torque, on: box, value: [0, 0, 0.01], frame: body}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITIES_MOMENT, KT_QUANTITY_POWER),
};
#endif
