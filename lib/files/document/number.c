/* Numbers and angles as a scene file writes them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/number.h"

#include "algebra/angle.h"
#include "base/decimal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_one_of(const char *text, const char *const *words) {
    for (; *words != NULL; words++)
        if (strcmp(text, *words) == 0)
            return true;
    return false;
}

bool kt_is_word_of(const char *text, const char *const *words) {
    char lower[sizeof "infinity"];
    size_t length = strlen(text);
    if (length >= sizeof lower)
        return false;
    for (size_t i = 0; i <= length; i++)
        lower[i] = (char)(text[i] >= 'A' && text[i] <= 'Z' ? text[i] - 'A' + 'a' : text[i]);
    return is_one_of(lower, words);
}

/* 0x1F, 0o17; also with a sign. */
static bool is_hex(const char *text) {
    const char *c = kt_decimal_skip_sign(text);
    if (c[0] != '0' || (c[1] != 'x' && c[1] != 'o' && c[1] != 'X' && c[1] != 'O') || c[2] == '\0')
        return false;
    return c[2 + strspn(c + 2, "0123456789abcdefABCDEF")] == '\0';
}

/* Whole numbers with a needless leading zero, such as 017. */
static bool is_octal(const char *text) {
    const char *c = kt_decimal_skip_sign(text);
    return c[0] == '0' && c[1] != '\0' && c[strspn(c, "0123456789")] == '\0';
}

static bool is_not_finite(const char *text) {
    static const char *const words[] = {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN", NULL};
    return is_one_of(kt_decimal_skip_sign(text), words);
}

static bool is_inf_word(const char *text) {
    static const char *const words[] = {"inf", "nan", "infinity", NULL};
    return kt_is_word_of(kt_decimal_skip_sign(text), words);
}

/* A number that ends the text, or is followed by blanks and a unit. */
static kt_scalar classify_number(const char *text, const char *end, double *value) {
    static const char *const degrees = "deg", *const radians = "rad";
    const char *unit = end + strspn(end, " \t");
    bool in_degrees = unit > end && strcmp(unit, degrees) == 0;
    bool in_radians = unit > end && strcmp(unit, radians) == 0;
    if (*end != '\0' && !in_degrees && !in_radians)
        return KT_SCALAR_TEXT;
    double x = 0.0;
    if (!kt_decimal_read(text, &x, &end))
        return KT_SCALAR_TOO_LARGE;
    const char *const after = text + strlen(text);
    x = in_degrees ? kt_radians(x) : x;
    if (!isfinite(x))
        return KT_SCALAR_TOO_LARGE;
    *value = x;
    return end == after ? KT_SCALAR_NUMBER : KT_SCALAR_ANGLE;
}

kt_scalar kt_scalar_classify(const char *text, double *value) {
    static const char *const nulls[] = {"", "~", "null", "Null", "NULL", NULL};
    static const char *const bools[] = {"true", "True", "TRUE", "false", "False", "FALSE", NULL};
    if (is_one_of(text, nulls))
        return KT_SCALAR_NULL;
    if (is_one_of(text, bools))
        return KT_SCALAR_BOOL;
    if (is_not_finite(text))
        return KT_SCALAR_NOT_FINITE;
    if (is_inf_word(text))
        return KT_SCALAR_INF_WORD;
    if (is_hex(text))
        return KT_SCALAR_HEX;
    if (is_octal(text))
        return KT_SCALAR_OCTAL;
    const char *end = kt_decimal_end(text);
    return end == text ? KT_SCALAR_TEXT : classify_number(text, end, value);
}
