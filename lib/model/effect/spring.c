/* Spring and damper along the line between two points. With d = p2 - p1, n = d / |d|, rate = n . d':
 *     tension = k (|d| - L) + c rate,  V = k (|d| - L)^2 / 2,  dissipated = c rate^2
 * The tension pulls the ends together. A spring of no length (L = 0) therefore pulls with -k d.
 *
 * At coincident points n is undefined. In a motion through such a state, n is -d' / abs(d') before and d' / abs(d')
 * after the coincidence. At the coincidence, the elastic force k L n changes its sign, whereas c rate n = c d' does
 * not. The force is the mean of both sides: no elastic force, and damping of the whole d'.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

#include <float.h>

static void spring_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, kt_plain t,
                          kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple d = kt_triple_sub(end[1].point, end[0].point),
                    moving = kt_triple_sub(end[1].velocity, end[0].velocity);
    const kt_real square = kt_triple_dot(d, d);
    const kt_condition apart = kt_value(square) > DBL_MIN; /* below, the square has lost digits */
    const kt_real length = KT_CHOOSE(apart, kt_sqrt(square), kt_real_of(0.0)), stretch = length - effect->length;
    const kt_triple n = kt_triple_scale(KT_CHOOSE(apart, 1.0 / length, kt_real_of(0.0)), d);
    const kt_real rate = KT_CHOOSE(apart, kt_triple_dot(n, moving), kt_triple_norm(moving));
    const kt_triple pull =
        KT_CHOOSE_TRIPLE(apart, kt_triple_scale(effect->stiffness * stretch + effect->damping * rate, n),
                         kt_triple_scale(kt_real_of(effect->damping), moving));
    const kt_triple none = kt_triple_zero();
    wrench[0] = (kt_effect_wrench){.moment = none, .force = pull};
    wrench[1] = (kt_effect_wrench){.moment = none, .force = kt_triple_scale(kt_real_of(-1.0), pull)};
    if (balance)
        *balance = (kt_effect_power){.energy = 0.5 * effect->stiffness * stretch * stretch,
                                     .dissipated = effect->damping * rate * rate};
}

#if KT_IS_OF_VALUES
/* The force on the second end is -T n, T the tension. With P = 1 - n n', dn/dd = P / |d| and d(rate)/dd = (P d')' /
 * |d|:
 *     -d(T n)/dd = -k n n' - n (c P d')' / |d| - T P / |d|,   -d(T n)/dd' = -c n n' */
static void spring_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                            kt_effect_jacobian *jacobian) {
    (void)numbers, (void)t;
    const kt_vec3 d = kt_vec3_sub(end[1].point, end[0].point), moving = kt_vec3_sub(end[1].velocity, end[0].velocity);
    const double square = kt_vec3_dot(d, d), c = effect->damping;
    const kt_mat3 unit = kt_mat3_identity();
    jacobian->at_point = true;
    if (!(square > DBL_MIN)) {
        jacobian->force = kt_vec3_scale(-c, moving);
        jacobian->stiffness[1][1] = kt_mat3_scale(0.0, unit);
        jacobian->damping[1][1] = kt_mat3_scale(-c, unit);
        return;
    }
    const double length = sqrt(square);
    const kt_vec3 n = kt_vec3_scale(1.0 / length, d);
    const double rate = kt_vec3_dot(n, moving), stretch = length - effect->length;
    const double tension = effect->stiffness * stretch + c * rate, across = tension / length;
    const kt_vec3 turning = kt_vec3_scale(c / length, kt_vec3_sub(moving, kt_vec3_scale(rate, n)));
    const kt_vec3 along = kt_vec3_add(kt_vec3_scale(effect->stiffness - across, n), turning);
    jacobian->force = kt_vec3_scale(-tension, n);
    jacobian->stiffness[1][1] =
        kt_mat3_scale(-1.0, kt_mat3_add(kt_mat3_scale(across, unit), kt_outer_product(n, along)));
    jacobian->damping[1][1] = kt_mat3_scale(-c, kt_outer_product(n, n));
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_spring) = {
    .energetics = kt_effect_energetics_of_damper, .wrench = spring_wrench, .jacobian = KT_IF_JACOBIAN(spring_jacobian)};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_effect),
    {"stiffness", KT_KEY_NUMBER, KT_EFFECT_AT(stiffness), "N/m", "k, tension for each metre of extension",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"length", KT_KEY_DISTANCE, KT_EFFECT_AT(length), "m", "L, distance without tension",
     "the distance at the start, where loops have been closed", .range = KT_RANGE_NOT_NEGATIVE},
    {"damping", KT_KEY_NUMBER, KT_EFFECT_AT(damping), "N s/m", "c, tension for each m/s of extension",
     .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_effect_spring_descriptor = {
    .name = "spring",
    .help = "a spring and a damper along the line between two points",
    .formula = "tension = k (d - L) + c d'    d: distance of the ends",
    .example = "bodies:\n"
               "  - {name: bob, joint: {type: prismatic, axis: z, position: -1}, mass: 1}\n"
               "effects:\n"
               "  - {type: spring, between: [world, bob], stiffness: 100, length: 0.8, damping: 0.5}\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES_LINE,
};
#endif
