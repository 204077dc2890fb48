/* JSON that is written without a tree: jansson reads back the same values. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "text/json_writer.h"

#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The object with the written members between its braces; NULL: it is not JSON. */
static json_t *read_back(kt_json_writer *out) {
    kt_put_close(out, '}');
    json_t *root = json_loads(out->text, JSON_REJECT_DUPLICATES, NULL);
    kt_check_true("the text is whole and is JSON", !out->is_short && strlen(out->text) == out->used && root != NULL);
    return root;
}

static kt_json_writer begin(void) {
    kt_json_writer out = {0};
    kt_put_open(&out, NULL, '{');
    return out;
}

KT_TEST(numbers_have_nine_digits) {
    kt_random random = kt_random_of_test();
    kt_json_writer out = begin();
    enum { COUNT = 40000 };
    double *x = calloc(COUNT, sizeof *x), worst = 0.0;
    size_t longest = 0;
    for (int i = 0; i < COUNT; i++) {
        /* of all sizes, half of them short decimals */
        x[i] = pow(10.0, kt_random_uniform(&random, i % 4 == 0 ? -300.0 : -7.0, i % 4 == 0 ? 300.0 : 11.0)) *
               (i % 3 == 0 ? -1.0 : 1.0);
        if (i % 2 == 0)
            x[i] = round(x[i] * 1e3) / 1e3;
    }
    kt_json_put_numbers(&out, "x", x, COUNT);
    json_t *root = read_back(&out);
    for (int i = 0; i < COUNT; i++) {
        const json_t *one = json_array_get(json_object_get(root, "x"), (size_t)i);
        const double unit = x[i] != 0.0 ? pow(10.0, floor(log10(fabs(x[i]))) - 8.0) : 1.0;
        worst = fmax(worst, fabs(json_number_value(one) - x[i]) / unit);
        kt_json_writer alone = {0};
        kt_json_put_number(&alone, NULL, x[i]);
        longest = alone.used > longest ? alone.used : longest;
        free(alone.text);
    }
    /* Half a unit of the ninth digit, and the rounding of a product and a sum of nine digits. */
    kt_check_near("farthest, in units of the ninth digit", worst, 0.5, 1e-6);
    kt_check_below("characters of the longest", (double)longest, 16.0); /* "-1.23456789e-300" */
    json_decref(root);
    free(x);
    free(out.text);
}

KT_TEST(numbers_are_as_short_as_they_can_be) {
    static const struct {
        double x;
        const char *text;
    } cases[] = {{0.1, "0.1"},
                 {-0.25, "-0.25"},
                 {0.30000000000000004, "0.3"},
                 {1e-5, "0.00001"},
                 {123456.5, "123456.5"},
                 {0.99999999999, "1"},
                 {-3.0, "-3"},
                 {-0.0, "0"},
                 {999999999.0, "999999999"},
                 {1e9, "1e+09"},
                 {1.0 / 3.0, "0.333333333"},
                 {2.5e-6, "2.5e-06"},
                 {(double)NAN, "null"},
                 {(double)INFINITY, "null"},
                 {999999999.9, "1000000000"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        kt_json_writer out = {0};
        kt_json_put_number(&out, NULL, cases[i].x);
        kt_check_text("number", out.text, cases[i].text);
        free(out.text);
    }
}

KT_TEST(integers_are_exact) {
    static const long long cases[] = {0, 7, -7, 10, -1200, LLONG_MAX, LLONG_MIN};
    kt_json_writer out = begin();
    kt_put_open(&out, "n", '[');
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        kt_put_integer(&out, NULL, cases[i]);
    kt_put_close(&out, ']');
    json_t *root = read_back(&out);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        kt_check_equal_int("integer", json_integer_value(json_array_get(json_object_get(root, "n"), i)), cases[i]);
    json_decref(root);
    free(out.text);
}

KT_TEST(texts_read_back_and_hold_no_markup) {
    static const char *const texts[] = {"",
                                        "crank",
                                        "</script><img onerror=alert(1) src=x>",
                                        "a \"b\" \\ c",
                                        "tab\tline\nbell\a",
                                        "\xC3\xA4\xE2\x82\xAC",
                                        "<<!--<",
                                        "\u2028",
                                        "a,b]{:"};
    kt_json_writer out = begin();
    kt_put_text(&out, "none", NULL);
    kt_put_boolean(&out, "yes", true);
    kt_put_open(&out, "list", '[');
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        kt_put_text(&out, NULL, texts[i]);
    kt_put_close(&out, ']');
    kt_put_text(&out, "not UTF-8", "a\xFFz");
    kt_put_json(&out, "tree", "[{\"what\":\"<b>\"}]");
    kt_check_true("there is no <", strchr(out.text, '<') == NULL);
    json_t *root = read_back(&out), *tree = json_pack("[{s:s}]", "what", "<b>");
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        kt_check_text("text", json_string_value(json_array_get(json_object_get(root, "list"), i)), texts[i]);
    kt_check_text("text that is not UTF-8", json_string_value(json_object_get(root, "not UTF-8")), "a\\xffz");
    kt_check_true("null, true and the tree", json_is_null(json_object_get(root, "none")) &&
                                                 json_is_true(json_object_get(root, "yes")) &&
                                                 json_equal(json_object_get(root, "tree"), tree));
    json_decref(root);
    json_decref(tree);
    free(out.text);
}
