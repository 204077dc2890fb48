/* Formulas that are written piece by piece. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/formula_text.h"

#include "base/decimal.h"

#include <string.h>

/* After a piece that does not fit, nothing more is written. */
static void put_formula_piece(void *user, const char *text, size_t length, bool is_argument) {
    kt_formula_text *to = user;
    (void)is_argument;
    to->whole = to->whole && to->length + length < sizeof to->text;
    if (!to->whole)
        return;
    memcpy(to->text + to->length, text, length);
    to->length += length;
    to->text[to->length] = '\0';
}

void kt_formula_put(kt_formula_text *to, const char *text) { put_formula_piece(to, text, strlen(text), true); }

void kt_formula_print(kt_formula_text *to, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    kt_print_pieces(put_formula_piece, to, format, arguments);
    va_end(arguments);
}
