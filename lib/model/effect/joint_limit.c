/* Elastic stops of a joint. At x > 0 beyond a stop, with the rate w = dx/dt, the force back is
 *     N = k x + c w k x / (k x + c |w|),   V = k x^2 / 2,   dissipated = c w^2 k x / (k x + c |w|) >= 0.
 *
 * The damping force is half the harmonic mean of c |w| and k x. Far inside the stop, this force equals that of a damper
 * c. At the stop, the force grows from zero with the spring's force, and never exceeds the spring's force. The force is
 * therefore continuous at the beginning and the end of contact, at which a plain damper c w would jump. The factor also
 * satisfies N >= 0: a stop never pulls. The law needs no length or rate over which to blend, and scales with the
 * joint's units. (Hunt and Crossley, 1975, introduced damping that vanishes with the indentation.)
 *
 * N has a kink at x = 0, like every one-sided spring, and is C1 elsewhere. A joint that leaves with c |w| >> k x hardly
 * feels the stop, whose energy then turns into heat.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

static void joint_limit_check(kt_checker *checker, const kt_effect *effect) {
    const double none = (double)INFINITY;
    kt_effect_check_hard(checker, effect, "stop");
    if (!checker->set && effect->lower == -none && effect->upper == none)
        kt_effect_report_neither(checker, "lower", "upper");
    else
        kt_effect_check_bounds(checker, effect);
}

static kt_real joint_limit_force(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v,
                                 kt_plain t, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_real above = q - effect->upper, below = effect->lower - q;
    const kt_condition is_upper = kt_value(above) >= kt_value(below);
    const kt_plain side = KT_CHOOSE(is_upper, kt_plain_of(1.0), kt_plain_of(-1.0));
    const kt_real x = KT_CHOOSE(is_upper, above, below);
    const kt_condition is_beyond = kt_not(kt_value(x) <= 0.0);
    if (!kt_is_anywhere(is_beyond)) {
        if (balance)
            *balance = (kt_effect_power){.energy = kt_real_of(0.0)};
        return kt_real_of(0.0);
    }
    const kt_real elastic = effect->stiffness * x, viscous = effect->damping * side * v;
    const kt_real damped = viscous * (elastic / (elastic + kt_abs(viscous)));
    if (balance)
        *balance = (kt_effect_power){.energy = 0.5 * elastic * x, .dissipated = damped * side * v};
    return KT_CHOOSE(is_beyond, -side * (elastic + damped), kt_real_of(0.0));
}

#if KT_IS_OF_VALUES
/* With e = k x, d = c w and s = e + |d|, the two derivatives of d e / s are
 *
 *     k d |d| / s^2 and c (e / s)^2 */
static void joint_limit_jacobian(const kt_effect_record *effect, const double *numbers, double q, double v, double t,
                                 double derivative[2]) {
    (void)numbers, (void)t;
    const double above = q - effect->upper, below = effect->lower - q, side = above >= below ? 1.0 : -1.0;
    const double x = side > 0.0 ? above : below;
    derivative[0] = derivative[1] = 0.0;
    if (x <= 0.0)
        return;
    const double elastic = effect->stiffness * x, viscous = effect->damping * side * v;
    const double sum = elastic + fabs(viscous), share = elastic / sum;
    derivative[0] = -effect->stiffness * (1.0 + viscous / sum * (fabs(viscous) / sum));
    derivative[1] = -effect->damping * share * share;
}
#endif

#if KT_IS_OF_VALUES
/* The gap of the nearer stop. */
static kt_gap joint_limit_gap(const kt_effect_record *effect, double q, double v) {
    const double rate = effect->upper - q <= q - effect->lower ? -v : v;
    return (kt_gap){.distance = kt_stop_distance(effect, q), .rate = rate, .velocity = {0.0, 0.0, rate}};
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_joint_limit) = {.check = joint_limit_check,
                                                         .energetics = kt_effect_energetics_of_damper,
                                                         .joint_force = joint_limit_force,
                                                         .joint_gap = KT_GAP(joint_limit_gap),
                                                         .joint_derivatives = KT_IF_JACOBIAN(joint_limit_jacobian)};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_effect, KT_COORDINATE_WORDS),
    {"lower", KT_KEY_NUMBER, KT_EFFECT_AT(lower), "rad|m", "the lower stop; lower or upper is needed", "none",
     .needed = false},
    {"upper", KT_KEY_NUMBER, KT_EFFECT_AT(upper), "rad|m", "the upper stop", "none", .needed = false},
    {"stiffness", KT_KEY_NUMBER, KT_EFFECT_AT(stiffness), "N m/rad|N/m", KT_ELASTIC_WORDS("k"), KT_ELASTIC_STIFFNESS},
    {"damping", KT_KEY_NUMBER, KT_EFFECT_AT(damping), "N m s/rad|N s/m",
     "c; the damping force grows from zero with the excess", .range = KT_RANGE_NOT_NEGATIVE},
    KT_HARD_KEYS("e: the stops are hard; a joint that arrives at -w leaves at e w (Newton's rule)")};
const kt_descriptor kt_effect_joint_limit_descriptor = {
    .name = "joint_limit",
    .help = "elastic or hard stops of a joint",
    .formula =
        "x = q - upper > 0:  force = -(k x + c v k x / (k x + c |v|)),  likewise below lower; nothing between them",
    .example = KT_EXAMPLE_ARM "  - type: joint_limit\n"
                              "    joint: arm\n"
                              "    lower: -10 deg\n"
                              "    upper: 45 deg\n"
                              "    stiffness: 500\n"
                              "    damping: 2\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITY_JOINT_FORCE, KT_QUANTITY_POWER, KT_QUANTITY_EXCESS, KT_QUANTITY_COORDINATE_RATE),
};
#endif
