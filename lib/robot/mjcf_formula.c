/* Formulas of a scene, written piece by piece, for features of MJCF that effects and loops do not have as numbers. */
#include "document/number.h"
#include "robot/mjcf.h"

#include <string.h>

void kt_mjcf_put(kt_mjcf_formula *to, const char *text) {
    const size_t length = strlen(text);
    to->whole = to->whole && to->length + length < sizeof to->text;
    if (!to->whole)
        return;
    memcpy(to->text + to->length, text, length + 1);
    to->length += length;
}

void kt_mjcf_put_number(kt_mjcf_formula *to, double value) {
    char number[KT_NUMBER_SIZE];
    kt_number_format(number, value);
    kt_mjcf_put(to, number);
}

void kt_mjcf_put_delayed(kt_mjcf_formula *to, double value, double delay) {
    kt_mjcf_put_number(to, value);
    if (!(delay > 0.0))
        return;
    kt_mjcf_put(to, "*step(t - ");
    kt_mjcf_put_number(to, delay);
    kt_mjcf_put(to, ")");
}

void kt_mjcf_put_coordinate(kt_mjcf_formula *to, double factor, const char *quantity, const char *joint) {
    if (factor != 1.0) {
        kt_mjcf_put_number(to, factor);
        kt_mjcf_put(to, "*");
    }
    to->whole = to->whole && strlen(quantity) + 1 + strlen(joint) <= KT_EXPRESSION_NAME_MAX;
    kt_mjcf_put(to, quantity);
    kt_mjcf_put(to, ".");
    kt_mjcf_put(to, joint);
}

const char *kt_mjcf_keep_formula(kt_mjcf *m, const kt_mjcf_formula *formula) {
    const char *text = formula->whole ? kt_robot_text(m->r, &m->r->keep, formula->text, formula->length) : NULL;
    return text;
}
