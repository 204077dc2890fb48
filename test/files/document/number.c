/* Numbers: the accepted forms, and the conversion to text and back. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/number.h"
#include "algebra/angle.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "check.h"
#include "files/scene/collect.h"

typedef struct reading {
    const char *text;
    kt_scalar scalar;
    double value;
} reading;

static const reading scalars[] = {
    {"0", KT_SCALAR_NUMBER, 0.0},
    {"-0", KT_SCALAR_NUMBER, -0.0},
    {"+12", KT_SCALAR_NUMBER, 12.0},
    {"1.5", KT_SCALAR_NUMBER, 1.5},
    {".5", KT_SCALAR_NUMBER, 0.5},
    {"5.", KT_SCALAR_NUMBER, 5.0},
    {"1e3", KT_SCALAR_NUMBER, 1000.0},
    {"1E-3", KT_SCALAR_NUMBER, 0.001},
    {"-1.25e+2", KT_SCALAR_NUMBER, -125.0},
    {"0.017", KT_SCALAR_NUMBER, 0.017},
    {"00.5", KT_SCALAR_NUMBER, 0.5},
    {"1.7976931348623157e308", KT_SCALAR_NUMBER, DBL_MAX},
    {"4.9406564584124654e-324", KT_SCALAR_NUMBER, 4.9406564584124654e-324},
    {"1e-400", KT_SCALAR_NUMBER, 0.0},
    {"9007199254740993", KT_SCALAR_NUMBER, 9007199254740992.0},
    {"180 deg", KT_SCALAR_ANGLE, 3.14159265358979323846},
    {"-90 deg", KT_SCALAR_ANGLE, -1.57079632679489661923},
    {"1e1\t deg", KT_SCALAR_ANGLE, 0.17453292519943295769},
    {"2 rad", KT_SCALAR_ANGLE, 2.0},
    {"1e309", KT_SCALAR_TOO_LARGE, 0.0},
    {"-1e309", KT_SCALAR_TOO_LARGE, 0.0},
    {"1e308 deg", KT_SCALAR_TOO_LARGE, 0.0},
    {".inf", KT_SCALAR_NOT_FINITE, 0.0},
    {"-.Inf", KT_SCALAR_NOT_FINITE, 0.0},
    {".NaN", KT_SCALAR_NOT_FINITE, 0.0},
    {"inf", KT_SCALAR_INF_WORD, 0.0},
    {"-Infinity", KT_SCALAR_INF_WORD, 0.0},
    {"NaN", KT_SCALAR_INF_WORD, 0.0},
    {"0x1F", KT_SCALAR_HEX, 0.0},
    {"0o17", KT_SCALAR_HEX, 0.0},
    {"0X1F", KT_SCALAR_HEX, 0.0},
    {"0O17", KT_SCALAR_HEX, 0.0},
    {"0x", KT_SCALAR_TEXT, 0.0},
    {"-0x1p3", KT_SCALAR_TEXT, 0.0},
    {"017", KT_SCALAR_OCTAL, 0.0},
    {"09", KT_SCALAR_OCTAL, 0.0},
    {"", KT_SCALAR_NULL, 0.0},
    {"~", KT_SCALAR_NULL, 0.0},
    {"Null", KT_SCALAR_NULL, 0.0},
    {"TRUE", KT_SCALAR_BOOL, 0.0},
    {"false", KT_SCALAR_BOOL, 0.0},
    {"1,5", KT_SCALAR_TEXT, 0.0},
    {"1_000", KT_SCALAR_TEXT, 0.0},
    {"1:30", KT_SCALAR_TEXT, 0.0},
    {"1 2", KT_SCALAR_TEXT, 0.0},
    {"1e", KT_SCALAR_TEXT, 0.0},
    {"1e+", KT_SCALAR_TEXT, 0.0},
    {".", KT_SCALAR_TEXT, 0.0},
    {"-", KT_SCALAR_TEXT, 0.0},
    {".e5", KT_SCALAR_TEXT, 0.0},
    {"1.2.3", KT_SCALAR_TEXT, 0.0},
    {"--1", KT_SCALAR_TEXT, 0.0},
    {"1f", KT_SCALAR_TEXT, 0.0},
    {"30deg", KT_SCALAR_TEXT, 0.0},
    {"30 Deg", KT_SCALAR_TEXT, 0.0},
    {"30 deg ", KT_SCALAR_TEXT, 0.0},
    {"30 degrees", KT_SCALAR_TEXT, 0.0},
    {"deg", KT_SCALAR_TEXT, 0.0},
    {" 1", KT_SCALAR_TEXT, 0.0},
    {"yes", KT_SCALAR_TEXT, 0.0},
    {"pi", KT_SCALAR_TEXT, 0.0},
    {"tRUE", KT_SCALAR_TEXT, 0.0},
};

KT_TEST(plain_scalars_are_what_yaml_1_2_says) {
    for (size_t i = 0; i < sizeof scalars / sizeof *scalars; i++) {
        double value = 0.0;
        kt_check_equal_int(scalars[i].text, kt_scalar_classify(scalars[i].text, &value), scalars[i].scalar);
        kt_check_equal_bits(scalars[i].text, &value, &scalars[i].value, 1);
    }
}

/* Against x pi / 180 in long double (64 bits of mantissa): one rounding leaves half a unit in the last place. The
 * reference's own error is 2^-11 of a unit at most. The bound has 1e-3 of a unit for it. */
KT_TEST(degrees_become_the_nearest_radians) {
    const long double pi = 3.14159265358979323846264338327950288L;
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("error of x degrees, units in the last place");
    for (int i = 0; i < 20000; i++) {
        double wide = kt_random_normal(&random) * pow(10.0, kt_random_uniform(&random, -9, 9));
        double x = i < 721 ? (double)(i - 360) : wide;
        double observed = kt_radians(x);
        long double expected = (long double)x * pi / 180.0L;
        double unit = nextafter(fabs(observed), (double)INFINITY) - fabs(observed);
        kt_worst_below(&error, fabs((double)(((long double)observed - expected) / (long double)unit)), 0.501, "%.17g",
                       x);
    }
}

static double random_bits(kt_random *random) {
    for (;;) {
        uint64_t bits = kt_random_bits(random);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (isfinite(value))
            return value;
    }
}

KT_TEST(written_numbers_read_back_to_the_same_bits) {
    static const double special[] = {0.0,     -0.0,    1.0,  0.1,         1e22,      1e23,    5e-324, -5e-324,
                                     DBL_MIN, DBL_MAX, 1e-5, 123456789.0, 1.0 / 3.0, 2.5e-17, 1e15,   1e16};
    kt_random random = kt_random_of_test();
    int different = 0, invalid = 0;
    for (int i = 0; i < 200000; i++) {
        double value = i < (int)(sizeof special / sizeof *special) ? special[i] : random_bits(&random), back = 7.0;
        char text[KT_NUMBER_SIZE];
        kt_number_format(text, value);
        if (kt_scalar_classify(text, &back) != KT_SCALAR_NUMBER)
            invalid++;
        different += !kt_same_bytes(&value, &back, sizeof value);
    }
    kt_check_equal_int("not read as numbers", invalid, 0);
    kt_check_equal_int("other bits", different, 0);
}

KT_TEST(written_numbers_are_short) {
    static const struct {
        double value;
        const char *text;
    } table[] = {{0.1, "0.1"},         {-9.81, "-9.81"},       {1e-9, "1.0e-9"},
                 {1e22, "1.0e+22"},    {-0.0, "-0"},           {100.0, "100"},
                 {1e-300, "1.0e-300"}, {-2.5e-17, "-2.5e-17"}, {2.0 / 3.0, "0.6666666666666666"},
                 {1e15, "1.0e+15"}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[KT_NUMBER_SIZE];
        kt_number_format(text, table[i].value);
        kt_check_text("number", text, table[i].text);
    }
}

/* ---- locales ----------------------------------------------------------------------------------------------------- */

/* A locale of glibc's with a comma for the decimal point, since none may be installed. The file LC_NUMERIC holds a
 * magic number, the number of entries and their offsets. The entries are the decimal point, the thousands separator and
 * the grouping. The first two follow once more as wide characters, and then the character set. */
static bool make_comma_locale(char *directory) {
    static const uint32_t head[] = {0x20031114, 6, 32, 34, 36, 40, 44, 48};
    static const char tail[] = {',', 0, '.', 0, 3, 3, 0, 0};
    static const uint32_t wide[] = {',', '.'};
    static const char set[] = "UTF-8";
    char path[128];
    if (mkdtemp(directory) == NULL)
        return false;
    snprintf(path, sizeof path, "%s/comma", directory);
    if (mkdir(path, 0700) != 0)
        return false;
    snprintf(path, sizeof path, "%s/comma/LC_NUMERIC", directory);
    FILE *file = fopen(path, "wb");
    if (file == NULL)
        return false;
    bool written = fwrite(head, sizeof head, 1, file) == 1 && fwrite(tail, sizeof tail, 1, file) == 1 &&
                   fwrite(wide, sizeof wide, 1, file) == 1 && fwrite(set, sizeof set, 1, file) == 1;
    return fclose(file) == 0 && written && setenv("LOCPATH", directory, 1) == 0 &&
           setlocale(LC_NUMERIC, "comma") != NULL;
}

static void remove_comma_locale(const char *directory) {
    char path[128];
    (void)setlocale(LC_NUMERIC, "C");
    (void)unsetenv("LOCPATH");
    snprintf(path, sizeof path, "%s/comma/LC_NUMERIC", directory);
    (void)unlink(path);
    snprintf(path, sizeof path, "%s/comma", directory);
    (void)rmdir(path);
    (void)rmdir(directory);
}

static void print_in_report(void *user, const kt_error *fault) {
    (void)fault;
    snprintf(user, 16, "%g", 1.5);
}

KT_TEST(locale_plays_no_part) {
    static const char text[] = "kinetree: 1\n\nbodies:\n  - name: a\n    mass: 1.5\n    com: [0.25, -1.0e-7, 0]\n";
    static const char wrong[] = "kinetree: 1,0";
    char directory[] = "/tmp/kinetree-locale-XXXXXX", sample[16];
    kt_scene rejected;
    kt_need(kt_check_true("a locale with a comma is in force", make_comma_locale(directory)));
    snprintf(sample, sizeof sample, "%g", 1.5);
    kt_check_text("printf in this locale", sample, "1,5");
    const kt_scene *scene = kt_test_scene(text);
    kt_check_near("mass", scene->description.bodies[0].mass, 1.5, 0.0);
    kt_check_text("written", kt_test_written(scene), text);
    sample[0] = '\0';
    kt_check_equal_int("a comma in the file",
                       kt_scene_parse(NULL, wrong, sizeof wrong - 1, &rejected, print_in_report, sample, NULL),
                       KT_ERROR_SCENE);
    kt_check_text("printf within the report", sample, "1,5");
    snprintf(sample, sizeof sample, "%g", 1.5);
    kt_check_text("printf after reading", sample, "1,5");
    remove_comma_locale(directory);
}
