/* Text that is no formula is rejected with its column. Bounds of length, depth and memory; names with hyphens;
 * units. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/expression.h"

#include <math.h>
#include <stdalign.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "interpose.h"

static const char *const names[] = {"length", "tilt", "left-arm", "left", "arm", "position.left-arm", "ball[2]", "t"};
enum { NAMES = sizeof names / sizeof *names };

static bool find(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    for (int k = 0; k < NAMES; k++) {
        if (strcmp(name, names[k]) == 0) {
            *symbol = (kt_symbol){.index = k, .is_angle = strcmp(name, "tilt") == 0};
            return true;
        }
    }
    return false;
}
static const char *list(void *user, int k) {
    (void)user;
    return k < NAMES ? names[k] : NULL;
}
static const kt_symbols symbols = {.find = find, .list = list};
static const double values[NAMES] = {2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0};

static alignas(double) char memory[1 << 18];

static kt_status parse(const char *text, const kt_expression **formula, int *column, kt_error *error) {
    return kt_expression_parse(text, &symbols, memory, sizeof memory, formula, column, error);
}

static double value_of(const char *text) {
    const kt_expression *formula = NULL;
    kt_error error = {0};
    if (parse(text, &formula, NULL, &error) != KT_OK) {
        kt_note("'%s': %s: %s", text, error.where, error.message);
        return (double)NAN;
    }
    return kt_expression_evaluate(formula, values);
}

KT_TEST(faults_have_a_column_and_a_remedy) {
    static const struct {
        const char *text;
        int column;
        const char *says;
    } faults[] = {
        {"", 1, "empty"},
        {"   ", 4, "empty"},
        {"1 +", 4, "missing before the end"},
        {"1 + * 2", 5, "missing before '*'"},
        {"(1 + 2", 7, "a ')' is missing before the end"},
        {"1 + 2)", 6, "closes no '('"},
        {"2 length", 3, "write * for a product"},
        {"2length", 2, "write * for a product"},
        {"12 mm", 4, "SI units"},
        {"length 2", 8, "an operator is missing before '2'"},
        {"lenght", 1, "did you mean 'length'?"},
        {"position.left-arn", 1, "there is no name 'position.left'"},
        {"sine(1)", 1, "there is no function 'sine'; did you mean 'sin'?"},
        {"sin", 1, "there is no name 'sin'"},
        {"sin 1", 1, "there is no name 'sin'"},
        {"sin()", 5, "missing before ')'"},
        {"sin(1, 2)", 8, "sin takes 1 argument; remove this one"},
        {"atan2(1)", 8, "atan2 takes 2 arguments; 1 is missing"},
        {"min(1)", 6, "min takes at least 2 arguments"},
        {"clamp(1)", 8, "2 are missing"},
        {"2**3", 2, "write ^ for a power"},
        {"t = 3", 3, "write == to compare"},
        {"1e999", 1, "too large"},
        {".", 1, "digit"},
        {"1 < 2 < 3", 7, "an operator is missing before '<'"},
        {"length $ 2", 8, "an operator is missing before '$'"},
        {"2 \xC3\xA4", 3, "an operator is missing before"},
        {"1,5", 2, "an operator is missing before ','"},
        {"length and t > 1", 1, "'and' joins comparisons, and this is a number; write x != 0"},
        {"t > 1 or 2", 10, "'or' joins comparisons"},
        {"not t", 5, "'not' joins comparisons"},
        {"t > 1 and", 10, "missing before the end"},
        {"1or 2", 1, "'or' joins comparisons"},
        {"t > 1 nand t < 2", 7, "an operator is missing before 'nand'"},
    };
    for (size_t k = 0; k < sizeof faults / sizeof *faults; k++) {
        const kt_expression *formula = (const kt_expression *)memory;
        kt_error error = {0};
        int column = -1;
        const kt_status status = parse(faults[k].text, &formula, &column, &error);
        kt_check_equal_int(faults[k].text, status, KT_ERROR_SCENE);
        kt_check_equal_int("column", column, faults[k].column);
        kt_check_contains("message", error.message, faults[k].says);
        kt_check_true("formula is untouched", formula == (const kt_expression *)memory);
    }
}

KT_TEST(the_longest_known_name_with_hyphens_is_taken) {
    kt_check_near("left-arm", value_of("left-arm"), 5.0, 0.0);
    kt_check_near("left - arm", value_of("left - arm"), -4.0, 0.0);
    kt_check_near("left-length", value_of("left-length"), 5.0, 0.0);
    kt_check_near("left-arm-arm", value_of("left-arm-arm"), -6.0, 0.0);
    kt_check_near("arm-left-arm", value_of("arm-left-arm"), 6.0, 0.0);
    kt_check_near("position.left-arm", value_of("2*position.left-arm"), 26.0, 0.0);
    kt_check_near("ball[2]", value_of("ball[2]-1"), 16.0, 0.0);
}

KT_TEST(an_angle_is_known_by_its_units) {
    static const struct {
        const char *text;
        bool is_angle;
    } cases[] = {{"30 deg", true},      {"tilt", true},          {"-2*tilt", true},       {"tilt/2 + 1", true},
                 {"(tilt)", true},      {"+tilt", true},         {"1 rad - 1 deg", true}, {"tilt/tilt", false},
                 {"tilt*tilt", false},  {"sin(tilt)", false},    {"1/tilt", false},       {"tilt^1", false},
                 {"length", false},     {"tilt > 1", false},     {"2*3 + 1", false},      {"max(tilt, 1)", false},
                 {"length*tilt", true}, {"2*(1 + tilt)/3", true}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const kt_expression *formula = NULL;
        kt_error error = {0};
        if (kt_check_equal_int(cases[k].text, parse(cases[k].text, &formula, NULL, &error), KT_OK))
            kt_check_equal_int("is an angle", kt_expression_is_angle(formula), cases[k].is_angle);
    }
}

static char *repeat(char *text, const char *part, int count, const char *end) {
    *text = '\0';
    char *to = text;
    for (int i = 0; i < count; i++)
        to += sprintf(to, "%s", part);
    (void)sprintf(to, "%s", end);
    return text;
}

KT_TEST(length_and_depth_are_bounded) {
    static char text[8 * KT_EXPRESSION_LENGTH_MAX];
    const kt_expression *formula = NULL;
    kt_error error = {0};
    kt_check_equal_int(
        "longest", parse(repeat(text, "1+", KT_EXPRESSION_LENGTH_MAX / 2 - 1, "1 "), &formula, NULL, &error), KT_OK);
    kt_check_equal_int("too long", parse(repeat(text, "1+", KT_EXPRESSION_LENGTH_MAX / 2, "1"), &formula, NULL, &error),
                       KT_ERROR_SCENE);
    kt_check_contains("too long", error.message, "at most 4096 characters");
    static const char *const deep[] = {"(", "-", "2^", "sin(", "1+(", "min(1,"};
    for (size_t k = 0; k < sizeof deep / sizeof *deep; k++) {
        error = (kt_error){0};
        kt_check_equal_int(deep[k], parse(repeat(text, deep[k], 600, "1"), &formula, NULL, &error), KT_ERROR_SCENE);
        kt_check_contains(deep[k], error.message, "more than 64");
    }
    char name[700];
    kt_check_equal_int("long name", parse(repeat(name, "a", 601, ""), &formula, NULL, &error), KT_ERROR_SCENE);
    kt_check_contains("long name", error.message, "more than 600 characters");
}

KT_TEST(memory_is_the_callers_and_nothing_allocates) {
    const char *text = "1 + length*sin(2*pi*t) - max(1, tilt, t)^2";
    const kt_expression *formula = NULL;
    kt_error error = {0};
    double out[3] = {0.0, 0.0, 0.0};
    const size_t size = kt_expression_size(text);
    char *exact = aligned_alloc(16, (size + 15) / 16 * 16); /* whose end a sanitizer watches, but for the padding */
    kt_interpose_start();
    const kt_status status = kt_expression_parse(text, &symbols, exact, size, &formula, NULL, &error);
    const double value = formula != NULL ? kt_expression_evaluate(formula, values) : (double)NAN;
    if (formula != NULL)
        kt_expression_taylor(formula, values, values, NULL, out);
    const kt_status faulty = kt_expression_parse("1 + lenght", &symbols, memory, sizeof memory, &formula, NULL, &error);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    kt_check_equal_int("read", status, KT_OK);
    kt_check_equal_int("rejected", faulty, KT_ERROR_SCENE);
    kt_check_near("value", value, 1.0 + 2.0 * sin(38.0 * acos(-1.0)) - 361.0, 1e-12);
    kt_check_equal_int("one byte less", kt_expression_parse(text, &symbols, exact, size - 1, &formula, NULL, &error),
                       KT_ERROR_MEMORY);
    kt_check_equal_int("misaligned", kt_expression_parse(text, &symbols, memory + 1, size, &formula, NULL, &error),
                       KT_ERROR_MEMORY);
    kt_check_equal_int("no text", kt_expression_parse(NULL, &symbols, memory, size, &formula, NULL, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_equal_int("size of no text", (long long)kt_expression_size(NULL), 0);
    kt_check_equal_int("no names", kt_expression_parse("t", NULL, memory, sizeof memory, &formula, NULL, &error),
                       KT_ERROR_SCENE);
    free(exact);
}
