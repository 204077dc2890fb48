/* Numbers in decimal, as scene files and command lines write them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_DECIMAL_H
#define KT_BASE_DECIMAL_H

#include "base/inner.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

/* Returns the text behind a sign, or the text itself if it begins without a sign. */
static inline const char *kt_decimal_skip_sign(const char *text) {
    return *text == '+' || *text == '-' ? text + 1 : text;
}

/* Returns the end of the number that the text begins with, or the text itself if it does not begin with a number. The
 * grammar is that of the core schema of YAML 1.2 (section 10.3.2), less its hexadecimal and octal forms:
 *
 *     [-+]? ( . [0-9]+ | [0-9]+ ( . [0-9]* )? ) ( [eE] [-+]? [0-9]+ )? */
const char *kt_decimal_end(const char *text);

/* Reads the number that the text begins with into *value, and sets *end to where it ends. Returns false, and leaves
 * both unset, if there is no number or the number exceeds the range of double. Rounded to nearest; no locale has an
 * influence. */
bool kt_decimal_read(const char *text, double *value, const char **end);

/* Writes the shortest of `%.15g`, `%.16g` and `%.17g` that reads back to the same bits, with a point in every locale.
 * Every reader of YAML takes the text for a number, such as 8.0e-6. `text` has KT_NUMBER_SIZE bytes. */
enum { KT_NUMBER_SIZE = 32 };
KT_INNER void kt_number_format(char *text, double value);

/* Receives a piece of a text: a part of the format, or the text of an argument. */
typedef void kt_print_piece(void *to, const char *text, size_t length, bool is_argument);

/* Prints as printf does, but with three conversions alone: %s, %d, and %g, which is the text of kt_number_format. */
KT_INNER void kt_print_pieces(kt_print_piece *put, void *to, const char *format, va_list arguments);

#endif
