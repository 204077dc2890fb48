/* Numbers of records against those of printf. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/digits.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

/* Counts the numbers whose bytes are others than those of printf, and notes the first ones. */
static void compare(double value, int *wrong, int *count) {
    char text[KT_DIGITS_SIZE], expected[64];
    const int length = kt_digits_write(text, value), wanted = snprintf(expected, sizeof expected, "%.17g", value);
    ++*count;
    if (length == wanted && strcmp(text, expected) == 0)
        return;
    if (++*wrong <= 5)
        kt_note("%a is '%s' of %d bytes, not '%s'", value, text, length, expected);
}

static void compare_both_signs(double value, int *wrong, int *count) {
    compare(value, wrong, count);
    compare(-value, wrong, count);
}

static double number_of(uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

KT_TEST(random_numbers_have_the_bytes_of_printf) {
    enum { NUMBERS = 400000 };
    kt_random random = kt_random_of_test();
    int wrong = 0, count = 0;
    for (int i = 0; i < NUMBERS; i++) {
        const double size = exp(kt_random_uniform(&random, -32.0, 42.0)); /* 1e-14 to 1e18 */
        compare_both_signs(size, &wrong, &count);
        compare(number_of(kt_random_bits(&random)), &wrong, &count);
        compare_both_signs(ldexp((double)kt_random_int(&random, 0, 1 << 20), kt_random_int(&random, -60, 40)), &wrong,
                           &count);
        compare((double)kt_random_int(&random, -100000, 100000) * 1e-3, &wrong, &count);
    }
    kt_check_equal_int("compared", count, 6 * NUMBERS);
    kt_check_equal_int("other bytes", wrong, 0);
}

/* Powers of two and ten with their neighbours; numbers halfway between two of 17 digits. */
KT_TEST(special_numbers_have_the_bytes_of_printf) {
    static const double special[] = {
        0.0,  (double)NAN,          HUGE_VAL, DBL_MIN, DBL_MAX, 5e-324, 9999999999999999.0, 99999999999999984.0, 0.1,
        1e-4, 9.9999999999999991e-5};
    int wrong = 0, count = 0;
    for (size_t i = 0; i < sizeof special / sizeof *special; i++)
        compare_both_signs(special[i], &wrong, &count);
    for (int k = -330; k <= 310; k++) {
        char text[16];
        (void)snprintf(text, sizeof text, "1e%d", k);
        const double ten = strtod(text, NULL);
        const double numbers[] = {ten, ldexp(1.0, k), 2.5 * ten};
        for (int i = 0; i < 3; i++) {
            compare_both_signs(numbers[i], &wrong, &count);
            compare_both_signs(nextafter(numbers[i], 0.0), &wrong, &count);
            compare_both_signs(nextafter(numbers[i], HUGE_VAL), &wrong, &count);
        }
    }
    for (int i = 0; i < 100000; i++) { /* 18 digits, of which the last is 5: 2^56 < 1e17 has steps of 16 */
        compare_both_signs((double)(INT64_C(1000000000000) + 2 * i + 1) / 131072.0, &wrong, &count);
        compare_both_signs((double)(INT64_C(4503599627370497) + 2 * i) / 32.0, &wrong, &count);
    }
    kt_check_equal_int("other bytes", wrong, 0);
}
