/* The text of a formula while it is written. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_FORMULA_TEXT_H
#define KT_EXPRESSION_FORMULA_TEXT_H

#include "base/inner.h"
#include "kinetree/expression.h"

#include <stdbool.h>
#include <stddef.h>

/* Begins as {.whole = true}; `whole` becomes false if the text has no room. */
typedef struct kt_formula_text {
    char text[KT_EXPRESSION_LENGTH_MAX + 1];
    size_t length;
    bool whole;
} kt_formula_text;

/* Puts a text behind the others. */
KT_INNER void kt_formula_put(kt_formula_text *to, const char *text);

/* Puts a text with %s, %d and %g (kt_print_pieces). */
KT_INNER void kt_formula_print(kt_formula_text *to, const char *format, ...) KT_PRINTF(2, 3);

#endif
