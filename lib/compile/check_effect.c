/* Rules of the effects: those of names and types; the rest is said by each type's file in lib/effect. */
#include "compile/compile.h"
#include "effect/effect.h"

#include <stddef.h>

void kt_checker_effect(kt_checker *checker, const kt_effect *effect) {
    kt_checker_name(checker, KT_SCOPE_EFFECT, "effects", effect->name, true);
    if (kt_effect_type_name(effect->type) == NULL)
        kt_checker_fault(checker, "type", -1,
                         "type is %d, and there is no effect of that number; take one of kt_effect_type",
                         (int)effect->type);
    else
        kt_effect_check(checker, effect);
}
