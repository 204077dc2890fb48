/* Torque: a vector m(t) on a body, its components in world axes or in the end's; supplied = m . omega. */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_end(checker, "on", &effect->between[0]);
    kt_effect_check_value(checker, effect);
}

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, double t,
                 kt_effect_wrench *wrench, kt_effect_power *balance) {
    const kt_triple m = KT_EFFECT(kt_effect_value)(effect, numbers, end, t);
    wrench[0] = (kt_effect_wrench){.moment = m, .force = {0.0, 0.0, 0.0}};
    if (balance)
        *balance = (kt_effect_power){.supplied = kt_triple_dot(m, end[0].omega)};
}

const kt_effect_kind KT_EFFECT(kt_effect_torque) = {
    .ends = 1, .functions = 3, .check = check, .energetics = kt_effect_energetics_of_curves, .push = push};
