/* A caller's own effect: callbacks in its record; who sums the effects calls them, since they can fail. */
#include "effect/effect.h"

static void check(kt_checker *checker, const kt_effect *effect) {
    if (!effect->push == !effect->drive) {
        kt_checker_fault(checker, "push", -1, "%s; give one of them",
                         effect->push ? "both push and drive are given" : "neither push nor drive is given");
        return;
    }
    if (effect->drive) {
        kt_checker_scalar_joint(checker, "joint", -1, effect->joint);
        return;
    }
    if (effect->end_count == 1)
        kt_checker_end(checker, "at", &effect->between[0]);
    else if (effect->end_count == 2)
        kt_checker_ends(checker, effect->between);
    else
        kt_checker_fault(checker, "end_count", -1, "end_count is %d; give 1 or 2", effect->end_count);
}

static kt_energetics energetics(const kt_effect_record *effect) {
    (void)effect;
    return KT_ENERGY_SUPPLIED;
}

const kt_effect_kind KT_EFFECT(kt_effect_custom) = {.check = check, .energetics = energetics};
