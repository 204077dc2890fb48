/* Numbers in decimal: rounded as by the C library in the C locale, independently of the current locale. Only the
 * grammar is accepted. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/decimal.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

static double read_all(const char *text) {
    double value = (double)NAN;
    const char *end = NULL;
    if (!kt_decimal_read(text, &value, &end) || *end != '\0')
        kt_note("'%s' is not read", text);
    return value;
}

/* Numbers of all magnitudes, with any number of digits, and midpoints of neighbouring doubles with a digit after
 * them. */
KT_TEST(numbers_are_rounded_as_the_c_library_does) {
    kt_random random = kt_random_of_test();
    long different = 0;
    for (int k = 0; k < 100000; k++) {
        char text[80];
        const int digits = kt_random_int(&random, 1, 20), exponent = kt_random_int(&random, -330, 310);
        int length = snprintf(text, sizeof text, "%s", kt_random_int(&random, 0, 3) ? "" : "-");
        const int point = kt_random_int(&random, -1, digits);
        for (int i = 0; i < digits; i++)
            length += snprintf(text + length, sizeof text - (size_t)length, "%s%d", i == point ? "." : "",
                               kt_random_int(&random, 0, 9));
        (void)snprintf(text + length, sizeof text - (size_t)length, "e%d", exponent);
        const double expected = strtod(text, NULL);
        double observed = (double)NAN;
        const char *end = NULL;
        const bool read = kt_decimal_read(text, &observed, &end);
        different += isinf(expected) ? read : memcmp(&observed, &expected, sizeof observed) != 0;
    }
    kt_check_equal_int("numbers with other bits", different, 0);
}

KT_TEST(digits_beyond_all_precision_still_decide_a_midpoint) {
    static char text[4000];
    const double one = 1.0, next = 1.0 + DBL_EPSILON;
    char *const end = text + snprintf(text, sizeof text, "1.00000000000000011102230246251565404236316680908203125");
    double observed = read_all(text);
    kt_check_equal_bits("the midpoint goes to even", &observed, &one, 1);
    memset(end, '0', 3000);
    end[3000] = '1';
    end[3001] = '\0';
    observed = read_all(text);
    kt_check_equal_bits("a digit far behind it", &observed, &next, 1);
    end[3000] = '0';
    observed = read_all(text);
    kt_check_equal_bits("zeros behind it", &observed, &one, 1);
    memset(text, '0', 3000);
    (void)snprintf(text + 3000, sizeof text - 3000, "12.5e-1");
    observed = read_all(text);
    const double expected = 1.25;
    kt_check_equal_bits("zeros before", &observed, &expected, 1);
}

KT_TEST(no_more_than_the_grammar_is_read) {
    static const struct {
        const char *text;
        int length; /* of the number; 0: none */
    } cases[] = {{"1", 1},     {"1.", 2},  {".5", 2},    {"-.5e3", 5}, {"+1E+2", 5}, {"1e", 1},  {"1e+", 1},
                 {"1.5.2", 3}, {".", 0},   {"e5", 0},    {"-", 0},     {"", 0},      {" 1", 0},  {"0x1F", 1},
                 {"inf", 0},   {"nan", 0}, {"1_000", 1}, {"1e2.5", 3}, {"--1", 0},   {"1 e5", 1}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        kt_check_equal_int(cases[k].text, kt_decimal_end(cases[k].text) - cases[k].text, cases[k].length);
    double value = 7.0;
    const char *end = NULL;
    kt_check_true("beyond the range", !kt_decimal_read("1e999999999999", &value, &end) && value == 7.0 && end == NULL);
    kt_check_true("none", !kt_decimal_read("x", &value, &end) && value == 7.0 && end == NULL);
    kt_check_near("too small", read_all("1e-999999999999"), 0.0, 0.0);
    kt_check_near("zero of any exponent", read_all("0e999999999999"), 0.0, 0.0);
}

KT_TEST(no_locale_has_an_influence) {
    static const char *const locales[] = {"de_DE.UTF-8", "fr_FR.UTF-8"};
    for (size_t i = 0; i < sizeof locales / sizeof *locales; i++) {
        if (setlocale(LC_ALL, locales[i]) == NULL)
            kt_skip(locales[i], "this machine does not have this locale");
        else
            kt_check_near(locales[i], read_all("1.25"), 1.25, 0.0);
    }
    (void)setlocale(LC_ALL, "C");
}
