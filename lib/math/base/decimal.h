/* Numbers in decimal, as scene files and command lines write them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_DECIMAL_H
#define KT_BASE_DECIMAL_H

#include <stdbool.h>

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

#endif
