/* Force: a vector f(t) on a point of a body, its components in world axes or in the end's; supplied = f . v. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static void force_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, kt_plain t,
                         kt_effect_wrench *wrench, kt_effect_power *balance) {
    const kt_triple f = KT_EFFECT(kt_effect_value)(effect, numbers, end, t);
    wrench[0] = (kt_effect_wrench){.moment = kt_triple_zero(), .force = f};
    if (balance)
        *balance = (kt_effect_power){.supplied = kt_triple_dot(f, end[0].velocity)};
}

#if KT_IS_OF_VALUES
/* A force fixed in the end turns with its body: df = theta x f. */
static void force_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                           kt_effect_jacobian *jacobian) {
    const kt_vec3 value = kt_effect_value(effect, numbers, end, t);
    *jacobian = (kt_effect_jacobian){.force = value};
    if (effect->in_body)
        jacobian->stiffness[1][0] = kt_mat3_scale(-1.0, kt_mat3_skew(value));
}

static void force_time_derivative(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                  double t, kt_wrench *wrench) {
    wrench[0] = (kt_wrench){.force = kt_effect_value_time_derivative(effect, numbers, end, t)};
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_force) = {.energetics = kt_effect_energetics_of_curves,
                                                   .wrench = force_wrench,
                                                   .jacobian = KT_IF_JACOBIAN(force_jacobian),
                                                   .time_derivative = KT_IF_JACOBIAN(force_time_derivative),
                                                   .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"at", KT_KEY_END, KT_EFFECT_AT(between[0]), "", "the point", .needed = true},
    {"value", KT_KEY_FUNCTIONS, KT_EFFECT_AT(value), "N", "f: three numbers or functions of time", .needed = true},
    {"frame", KT_KEY_FRAME, KT_EFFECT_AT(frame), "",
     "`world`, or `body` for components along the axes of the marker, or else of the body", "world", .needed = false},
};
const kt_descriptor kt_effect_force_descriptor = {
    .name = "force",
    .help = "a force on a point of a body",
    .formula = "force = f(t)",
    .example = KT_EXAMPLE_CUBE "  - type: force\n"
                               "    at: box.corner\n"
                               "    value: [0, 0, {ramp: {from: 0, to: 10, start: 0.2, end: 0.4}}]\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITIES_FORCE, KT_QUANTITY_POWER),
};
#endif
