/* Motor: a joint's force (or torque) as a function of time, f(t); supplied = f v. */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_scalar_joint(checker, "joint", -1, effect->joint);
    if (effect->torque.type == KT_FUNCTION_NONE)
        kt_checker_fault(checker, "torque", -1, "torque is missing; give a number or a function of time");
    else
        kt_checker_function(checker, "torque", &effect->torque);
}

static kt_real drive(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, double t,
                     kt_effect_power *balance) {
    double f[3];
    (void)q;
    kt_curve_evaluate(&effect->curve[0], numbers, t, f);
    if (balance)
        *balance = (kt_effect_power){.supplied = f[0] * v};
    return f[0];
}

const kt_effect_kind KT_EFFECT(kt_effect_motor) = {
    .functions = 1, .check = check, .energetics = kt_effect_energetics_of_curves, .drive = drive};
