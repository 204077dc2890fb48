/* Torque: a vector m(t) on a body, its components in world axes or in the end's; supplied = m . omega. */
#include "effect/kind.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_end(checker, "on", &effect->between[0]);
    kt_effect_check_value(checker, effect);
}

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                 kt_wrench *wrench, kt_effect_balance *balance) {
    const kt_vec3 m = kt_effect_value(effect, numbers, end, t);
    wrench[0] = (kt_wrench){.moment = m, .force = {0.0, 0.0, 0.0}};
    if (balance)
        *balance = (kt_effect_balance){.supplied = kt_vec3_dot(m, end[0].omega)};
}

const kt_effect_kind kt_effect_torque = {.ends = 1, .functions = 3, .check = check, .push = push};
