/* Numbers in decimal.
 *
 * strtod rounds correctly, but reads more than the grammar (hexadecimal, infinity, leading blanks) and takes the
 * decimal point of the process's locale. Therefore the grammar is checked first, and strtod receives the digits as a
 * whole number with an exponent in proportion, 125e-2 for 1.25. No double and no midpoint of two has more than 767
 * significant digits; subnormal numbers reach this count. The source is Goldberg (ACM Computing Surveys 23, 1991). All
 * further digits matter only by not being 0.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/decimal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *skip_digits(const char *c) { return c + strspn(c, "0123456789"); }

const char *kt_decimal_end(const char *text) {
    const char *const whole = kt_decimal_skip_sign(text), *c = skip_digits(whole);
    bool has_digits = c > whole;
    if (*c == '.') {
        const char *const fraction = c + 1;
        c = skip_digits(fraction);
        has_digits = has_digits || c > fraction;
    }
    if (!has_digits)
        return text;
    if (*c == 'e' || *c == 'E') {
        const char *const exponent = kt_decimal_skip_sign(c + 1), *const end = skip_digits(exponent);
        c = end > exponent ? end : c;
    }
    return c;
}

enum { DIGITS_MOST = 768 }; /* the last of them represents all that follow */

/* The digits before the exponent, without leading zeros; *exponent is the power of ten of the last digit. */
static int collect_digits(const char *at, char digits[DIGITS_MOST], long *exponent) {
    int count = 0;
    for (bool fraction = false; (*at >= '0' && *at <= '9') || *at == '.'; at++) {
        if (*at == '.') {
            fraction = true;
            continue;
        }
        const bool counts = count > 0 || *at != '0';
        if (counts && count < DIGITS_MOST)
            digits[count++] = *at;
        else if (counts) {
            ++*exponent;
            digits[DIGITS_MOST - 1] = *at != '0' ? '1' : digits[DIGITS_MOST - 1];
        }
        *exponent -= fraction;
    }
    return count;
}

/* Returns the exponent before `end`, or 0 if the text has none. Far beyond the range of double, the returned exponent
 * no longer grows. */
static long read_exponent(const char *text, const char *end) {
    const char *at = text + strcspn(text, "eE");
    if (at >= end)
        return 0;
    const bool negative = at[1] == '-';
    long value = 0;
    for (at = kt_decimal_skip_sign(at + 1); at < end; at++)
        value = value < 100000000 ? 10 * value + (*at - '0') : value;
    return negative ? -value : value;
}

bool kt_decimal_read(const char *text, double *value, const char **end) {
    const char *const after = kt_decimal_end(text);
    char digits[DIGITS_MOST] = "0", whole[DIGITS_MOST + 32];
    if (after == text)
        return false;
    long exponent = read_exponent(text, after);
    const int count = collect_digits(kt_decimal_skip_sign(text), digits, &exponent);
    (void)snprintf(whole, sizeof whole, "%s%.*se%ld", *text == '-' ? "-" : "", count > 0 ? count : 1, digits, exponent);
    const double number = strtod(whole, NULL);
    if (!isfinite(number))
        return false;
    *value = number;
    *end = after;
    return true;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

/* Replaces the decimal point of the locale, of one byte or several. */
static void set_point(char *text) {
    char *at = text + strspn(text, "+-0123456789");
    const size_t length = strcspn(at, "0123456789e");
    if (length == 0 || *at == 'e' || *at == 'i' || *at == 'n')
        return;
    *at = '.';
    memmove(at + 1, at + length, strlen(at + length) + 1);
}

/* `1e-05` becomes `1.0e-5`. Readers of YAML 1.1 take a number with an exponent for a text unless it has a point, and a
 * sign of the exponent. */
static void shape_exponent(char *text) {
    char exponent[8];
    char *at = strchr(text, 'e');
    if (at == NULL)
        return;
    const char *digits = at + 2 + strspn(at + 2, "0");
    (void)snprintf(exponent, sizeof exponent, "e%c%.4s", at[1], digits);
    *at = '\0';
    (void)snprintf(at, KT_NUMBER_SIZE - (size_t)(at - text), "%s%s", strchr(text, '.') == NULL ? ".0" : "", exponent);
}

void kt_number_format(char *text, double value) {
    for (int digits = 15; digits <= 17; digits++) {
        (void)snprintf(text, KT_NUMBER_SIZE, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            break;
    }
    set_point(text);
    shape_exponent(text);
}

void kt_print_pieces(kt_print_piece *put, void *to, const char *format, va_list arguments) {
    for (const char *at = format; *at != '\0';) {
        const size_t length = strcspn(at, "%");
        char number[KT_NUMBER_SIZE];
        const char *text = number;
        put(to, at, length, false);
        at += length;
        if (*at == '\0')
            return;
        if (at[1] == 's')
            text = va_arg(arguments, const char *);
        else if (at[1] == 'd')
            (void)snprintf(number, sizeof number, "%d", va_arg(arguments, int));
        else
            kt_number_format(number, va_arg(arguments, double));
        put(to, text, strlen(text), true);
        at += 2;
    }
}
