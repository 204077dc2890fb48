/* Force: a vector f(t) on a point of a body, its components in world axes or in the end's; supplied = f . v. */
#include "effect/kind.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_end(checker, "at", &effect->between[0]);
    kt_effect_check_value(checker, effect);
}

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                 kt_wrench *wrench, kt_effect_balance *balance) {
    const kt_vec3 f = kt_effect_value(effect, numbers, end, t);
    wrench[0] = (kt_wrench){.moment = {0.0, 0.0, 0.0}, .force = f};
    if (balance)
        *balance = (kt_effect_balance){.supplied = kt_vec3_dot(f, end[0].velocity)};
}

const kt_effect_kind kt_effect_force = {.ends = 1, .functions = 3, .check = check, .push = push};
