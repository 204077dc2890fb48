/* Drag on a point that moves with v through a medium at rest: f = -(c1 + c2 |v|) v, dissipated = (c1 + c2 |v|) |v|^2.
 * Stokes' law for slow flow and Newton's for fast; f is continuously differentiable, at rest too. */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_end(checker, "on", &effect->between[0]);
    kt_checker_not_negative(checker, "linear", "", effect->linear);
    kt_checker_not_negative(checker, "quadratic", "", effect->quadratic);
}

static void push(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end, double t,
                 kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple v = end[0].velocity;
    const kt_real square = kt_triple_dot(v, v), c = effect->linear + effect->quadratic * kt_sqrt(square);
    wrench[0] = (kt_effect_wrench){.moment = {0.0, 0.0, 0.0}, .force = kt_triple_scale(-c, v)};
    if (balance)
        *balance = (kt_effect_power){.dissipated = c * square};
}

static kt_energetics energetics(const kt_effect_record *effect) {
    return kt_energetics_of(effect->linear > 0.0 || effect->quadratic > 0.0);
}

const kt_effect_kind KT_EFFECT(kt_effect_drag) = {.ends = 1, .check = check, .energetics = energetics, .push = push};
