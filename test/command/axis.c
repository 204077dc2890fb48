/* Ticks of charts: round, within the axis, few, and written so that they read back. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void expect(double low, double high, int most, const char *texts, int exponent) {
    kt_axis axis = kt_axis_make(low, high, most);
    char all[256] = "", one[48];
    size_t used = 0;
    for (int i = 0; i < axis.count && used < sizeof all; i++) {
        kt_axis_text(&axis, i, one, sizeof one);
        used += (size_t)snprintf(all + used, sizeof all - used, "%s%s", i > 0 ? " " : "", one);
    }
    kt_check_text("ticks", all, texts);
    kt_check_equal_int("exponent", axis.exponent, exponent);
}

KT_TEST(ticks_of_known_ranges) {
    expect(0.0, 10.0, 11, "0 1 2 3 4 5 6 7 8 9 10", 0);
    expect(0.0, 1.0, 7, "0.0 0.2 0.4 0.6 0.8 1.0", 0);
    expect(-2.1, 3.3, 7, "\u22122 \u22121 0 1 2 3", 0);
    expect(-4.1e-7, 1e-7, 7, "\u22124 \u22123 \u22122 \u22121 0 1", -7);
    expect(0.0, 86400.0, 6, "0 2 4 6 8", 4);
    expect(0.037, 0.0412, 7, "0.037 0.038 0.039 0.040 0.041", 0);
    expect(0.0037, 0.00412, 7, "3.7 3.8 3.9 4.0 4.1", -3);
}

/* Nearly constant values: the labels are differences from a number with few digits. */
KT_TEST(labels_with_many_digits_are_differences) {
    kt_axis axis = kt_axis_make(84.0314, 84.0314 + 4.2e-9, 7);
    kt_axis_shift(&axis);
    char text[48];
    for (int i = 0; i < axis.count; i++) {
        kt_axis_text(&axis, i, text, sizeof text);
        kt_check_true("at most seven characters", strlen(text) <= 7);
        kt_check_near("tick", axis.offset + strtod(text, NULL) * pow(10.0, axis.exponent), kt_axis_tick(&axis, i),
                      1e-13);
    }
    kt_check_near("offset", axis.offset, 84.0314, 1e-8);
    axis = kt_axis_make(-84.0314 - 4.2e-9, -84.0314, 7);
    kt_axis_shift(&axis);
    kt_check_near("negative offset", axis.offset, -84.0314, 1e-7);
    kt_axis_text(&axis, 0, text, sizeof text);
    kt_check_true("not negative", text[0] >= '0' && text[0] <= '9');
    axis = kt_axis_make(84.0, 84.0001, 7);
    kt_axis_shift(&axis);
    kt_check_true("short labels stay", axis.offset == 0.0);
}

KT_TEST(ticks_of_any_range_are_few_round_and_within) {
    kt_random random = kt_random_of_test();
    int outside = 0, many = 0, few = 0, wrong_text = 0;
    for (int trial = 0; trial < 20000; trial++) {
        double scale = pow(10.0, kt_random_uniform(&random, -20.0, 20.0));
        double low = scale * kt_random_uniform(&random, -1.0, 1.0);
        double high = low + scale * kt_random_uniform(&random, 0.01, 1.0);
        kt_axis axis = kt_axis_make(low, high, 7);
        many += axis.count > 7;
        few += axis.count < 2;
        for (int i = 0; i < axis.count; i++) {
            char text[48], ascii[64];
            double tick = kt_axis_tick(&axis, i);
            outside += tick < low - 1e-8 * axis.step || tick > high + 1e-8 * axis.step;
            kt_axis_text(&axis, i, text, sizeof text);
            snprintf(ascii, sizeof ascii, "%s%s", tick < 0.0 ? "-" : "", text + (tick < 0.0 ? strlen("\u2212") : 0));
            double read = strtod(ascii, NULL) * pow(10.0, axis.exponent);
            wrong_text += !(fabs(read - tick) <= 1e-6 * axis.step);
        }
    }
    kt_check_equal_int("ticks outside", outside, 0);
    kt_check_equal_int("axes with more than was allowed", many, 0);
    kt_check_equal_int("axes with fewer than two", few, 0);
    kt_check_equal_int("texts that do not read back", wrong_text, 0);
}
