/* Force: a vector f(t) on a point of a body, its components in world axes or in the end's; supplied = f . v. */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_end(checker, "at", &effect->between[0]);
    kt_effect_check_value(checker, effect);
}

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, double t,
                 kt_effect_wrench *wrench, kt_effect_power *balance) {
    const kt_triple f = KT_EFFECT(kt_effect_value)(effect, numbers, end, t);
    wrench[0] = (kt_effect_wrench){.moment = {0.0, 0.0, 0.0}, .force = f};
    if (balance)
        *balance = (kt_effect_power){.supplied = kt_triple_dot(f, end[0].velocity)};
}

const kt_effect_kind KT_EFFECT(kt_effect_force) = {
    .ends = 1, .functions = 3, .check = check, .energetics = kt_effect_energetics_of_curves, .push = push};
