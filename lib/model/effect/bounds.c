/* Checks of numbers that bound a coordinate or a force. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"

void kt_effect_report_neither(kt_checker *checker, const char *first, const char *second) {
    kt_checker_fault(checker, first, -1, "there is neither %s nor %s; give at least one of them", first, second);
}

void kt_effect_check_bounds(kt_checker *checker, const kt_effect *effect) {
    if (kt_number_is_fine(effect->lower) && kt_number_is_fine(effect->upper) && effect->lower > effect->upper)
        kt_checker_fault(checker, "lower", -1, "lower is %g, above upper, which is %g; exchange them", effect->lower,
                         effect->upper);
}
