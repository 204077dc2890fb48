/* Elastic stops of a joint. Beyond a stop by x > 0, moving further at the rate w = dx/dt, it pushes back with
 *     N = k x + c w k x / (k x + c |w|),   V = k x^2 / 2,   dissipated = c w^2 k x / (k x + c |w|) >= 0.
 *
 * The damping force is the harmonic mean (halved) of c |w| and k x: far inside it is that of a damper c, and at the
 * stop it grows from zero with the spring's own force, which it never exceeds. So the force is continuous where contact
 * begins and ends - a plain damper c w would jump there - and N >= 0 always: a stop never pulls back. It needs no
 * length or rate over which to blend, and scales with the joint's units. (The idea that damping must vanish with the
 * indentation is Hunt and Crossley's, 1975.) N has a kink at x = 0, as every one-sided spring; elsewhere it is C1. A
 * joint that leaves with c |w| >> k x hardly feels the stop, whose energy then turns into heat.
 */
#include "effect/effect.h"

static bool check_stop(kt_checker *checker, const char *field, double value, double none) {
    return value == none || kt_checker_number(checker, field, value);
}

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_scalar_joint(checker, "joint", -1, effect->joint);
    const bool lower = check_stop(checker, "lower", effect->lower, -(double)INFINITY);
    const bool upper = check_stop(checker, "upper", effect->upper, (double)INFINITY);
    if (lower && upper && isinf(effect->lower) && isinf(effect->upper))
        kt_checker_fault(checker, "lower", -1, "there is neither lower nor upper; give at least one of them");
    else if (lower && upper && effect->lower > effect->upper)
        kt_checker_fault(checker, "lower", -1, "lower is %g, above upper, which is %g; exchange them", effect->lower,
                         effect->upper);
    kt_checker_positive(checker, "stiffness", effect->stiffness);
    kt_checker_not_negative(checker, "damping", "", effect->damping);
}

static kt_real drive(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, double t,
                     kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_real above = q - effect->upper, below = effect->lower - q;
    const double side = kt_value(above) >= kt_value(below) ? 1.0 : -1.0;
    const kt_real x = side > 0.0 ? above : below;
    if (kt_value(x) <= 0.0) {
        if (balance)
            *balance = (kt_effect_power){.energy = 0.0};
        return 0.0;
    }
    const kt_real elastic = effect->stiffness * x, viscous = effect->damping * side * v;
    const kt_real damped = viscous * (elastic / (elastic + kt_abs(viscous)));
    if (balance)
        *balance = (kt_effect_power){.energy = 0.5 * elastic * x, .dissipated = damped * side * v};
    return -side * (elastic + damped);
}

static kt_energetics energetics(const kt_effect_record *effect) { return kt_energetics_of(effect->damping > 0.0); }

const kt_effect_kind KT_EFFECT(kt_effect_joint_limit) = {.check = check, .energetics = energetics, .drive = drive};
