/* Linear damper in a joint: force = -c v, dissipated = c v^2. */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    kt_checker_scalar_joint(checker, "joint", -1, effect->joint);
    kt_checker_not_negative(checker, "damping", "", effect->damping);
}

static kt_real drive(const kt_effect_record *effect, const double *numbers, kt_real q, kt_real v, double t,
                     kt_effect_power *balance) {
    (void)numbers, (void)q, (void)t;
    if (balance)
        *balance = (kt_effect_power){.dissipated = effect->damping * v * v};
    return -effect->damping * v;
}

static kt_energetics energetics(const kt_effect_record *effect) { return kt_energetics_of(effect->damping > 0.0); }

const kt_effect_kind KT_EFFECT(kt_effect_joint_damper) = {.check = check, .energetics = energetics, .drive = drive};
