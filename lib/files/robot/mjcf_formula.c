/* Formulas of a scene, written piece by piece, for features of MJCF that effects and loops do not have as numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"
#include "robot/robot.h"

#include <string.h>

void kt_mjcf_put_coordinate(kt_formula_text *to, double factor, const char *quantity, const char *joint) {
    if (factor != 1.0)
        kt_formula_print(to, "%g*", factor);
    to->whole = to->whole && strlen(quantity) + 1 + strlen(joint) <= KT_EXPRESSION_NAME_MAX;
    kt_formula_print(to, "%s.%s", quantity, joint);
}

const char *kt_mjcf_keep_formula(kt_mjcf *m, const kt_formula_text *formula) {
    const char *text = formula->whole ? kt_reader_text(m->r, &m->r->keep, formula->text, formula->length) : NULL;
    return text;
}

void kt_mjcf_name_effect(kt_mjcf *m, const char *name) {
    kt_effect *effects = m->draft.effects.items;
    if (name != NULL && *name != '\0')
        effects[m->draft.effects.count - 1].name = kt_namer_make(&m->effects_named, name);
}

const kt_mjcf_term *kt_mjcf_terms_of(const kt_mjcf *m, int tendon, const kt_mjcf_term *own, int *count) {
    const kt_mjcf_tendon *t = tendon >= 0 ? kt_mjcf_tendon_at(m, tendon) : NULL;
    *count = t != NULL ? t->count : 1;
    return t != NULL ? kt_mjcf_term_at(m, t->first) : own;
}
