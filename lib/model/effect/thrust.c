/* Thrust of mass that leaves a body, or arrives. Its velocity u relative to the body is fixed in the axes of the
 * end:
 *     f = m'(t) u   [MSD H 3.1],   supplied = f . v
 * For a rocket, u is against the motion and m' < 0. The mass m(t) of the body itself is defined with the body
 * (dynamics/variable_mass.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

/* f = m' u; curve[0] is m(t), and exhaust is u. */
static kt_triple thrust_force_of(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                                 double t) {
    double mass[3];
    kt_curve_evaluate(&effect->curve[0], numbers, t, mass);
    const kt_triple force = {mass[1] * effect->exhaust.x, mass[1] * effect->exhaust.y, mass[1] * effect->exhaust.z};
    return kt_columns_apply(end->axes, force);
}

static void thrust_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, double t,
                          kt_effect_wrench *wrench, kt_effect_power *balance) {
    const kt_triple f = thrust_force_of(effect, numbers, end, t);
    wrench[0] = (kt_effect_wrench){.moment = {0.0, 0.0, 0.0}, .force = f};
    if (balance)
        *balance = (kt_effect_power){.supplied = kt_triple_dot(f, end[0].velocity)};
}

#if KT_IS_OF_VALUES
/* The thrust turns with the body: df = theta x f. */
static void thrust_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                            kt_effect_jacobian *jacobian) {
    const kt_vec3 force = thrust_force_of(effect, numbers, end, t);
    *jacobian = (kt_effect_jacobian){.force = force};
    jacobian->stiffness[1][0] = kt_mat3_scale(-1.0, kt_mat3_skew(force));
}

static void thrust_time_derivative(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end,
                                   double t, kt_wrench *wrench) {
    double mass[3];
    kt_effect_curve_derivatives(&effect->curve[0], numbers, t, mass);
    wrench[0] = (kt_wrench){.force = kt_mat3_apply(end->axes, kt_vec3_scale(mass[2], effect->exhaust))};
}
#endif

/* A constant mass thrusts nothing. */
static kt_energetics thrust_energetics(const kt_effect_record *effect) {
    return kt_curve_rests(&effect->curve[0]) ? KT_ENERGY_CONSERVED : KT_ENERGY_SUPPLIED;
}

const kt_effect_kind KT_EFFECT(kt_effect_thrust) = {.energetics = thrust_energetics,
                                                    .wrench = thrust_wrench,
                                                    .jacobian = KT_IF_JACOBIAN(thrust_jacobian),
                                                    .time_derivative = KT_IF_JACOBIAN(thrust_time_derivative),
                                                    .derivatives = 1,
                                                    .stores_none = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"at", KT_KEY_END, KT_EFFECT_AT(between[0]), "", "the point", .needed = true},
    {"mass", KT_KEY_FUNCTION, KT_EFFECT_AT(mass), "kg", "m(t), the mass of the body; its rate alone counts",
     .needed = true},
    {"exhaust", KT_KEY_VECTOR, KT_EFFECT_AT(exhaust), "m/s",
     "u, the velocity of the mass that leaves or arrives relative to the point, "
     "along the axes of the marker, or else of the body",
     .needed = true},
};
const kt_descriptor kt_effect_thrust_descriptor = {
    .name = "thrust",
    .help = "thrust of mass that leaves or arrives",
    .formula = "force = m'(t) u",
    .example = KT_EXAMPLE_CUBE "  - type: thrust\n"
                               "    at: box\n"
                               "    mass: {ramp: {from: 1, to: 0.5, start: 0, end: 2}}\n"
                               "    exhaust: [0, 0, -200]\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITIES_FORCE, KT_QUANTITY_POWER),
};
#endif
