/* Formulas of a scene, written piece by piece, for features of MJCF that effects and loops do not have as numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"
#include "robot/robot.h"

#include <string.h>

static void put_formula_piece(void *user, const char *text, size_t length, bool is_argument) {
    kt_mjcf_formula *to = user;
    (void)is_argument;
    to->whole = to->whole && to->length + length < sizeof to->text;
    if (!to->whole)
        return;
    memcpy(to->text + to->length, text, length);
    to->length += length;
    to->text[to->length] = '\0';
}

void kt_mjcf_put(kt_mjcf_formula *to, const char *text) { put_formula_piece(to, text, strlen(text), true); }

void kt_mjcf_print(kt_mjcf_formula *to, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    kt_print_pieces(put_formula_piece, to, format, arguments);
    va_end(arguments);
}

void kt_mjcf_put_delayed(kt_mjcf_formula *to, double value, double delay) {
    kt_mjcf_print(to, "%g", value);
    if (delay > 0.0)
        kt_mjcf_print(to, "*step(t - %g)", delay);
}

void kt_mjcf_put_coordinate(kt_mjcf_formula *to, double factor, const char *quantity, const char *joint) {
    if (factor != 1.0)
        kt_mjcf_print(to, "%g*", factor);
    to->whole = to->whole && strlen(quantity) + 1 + strlen(joint) <= KT_EXPRESSION_NAME_MAX;
    kt_mjcf_print(to, "%s.%s", quantity, joint);
}

const char *kt_mjcf_keep_formula(kt_mjcf *m, const kt_mjcf_formula *formula) {
    const char *text = formula->whole ? kt_reader_text(m->r, &m->r->keep, formula->text, formula->length) : NULL;
    return text;
}

kt_effect *kt_mjcf_add_formula(kt_mjcf *m, const kt_element *e, const kt_mjcf_formula *formula, const char *too_long) {
    const char *text = kt_mjcf_keep_formula(m, formula);
    kt_effect *effect = text != NULL ? kt_draft_effect(&m->draft, e, KT_EFFECT_EXPRESSION) : NULL;
    if (effect != NULL)
        effect->formula[0] = text;
    else
        kt_unknown_count(&m->forces, too_long, e);
    return effect;
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
