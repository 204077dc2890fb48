/* Ticks at multiples of one, two or five times a power of ten; on a logarithmic axis at powers of ten. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>

/* Returns the smallest round step of which at most `most` fit into the range. */
static double choose_tick_step(double range, int most) {
    static const double factors[] = {1.0, 2.0, 5.0, 10.0};
    double power = pow(10.0, floor(log10(range / most)));
    for (int i = 0; i < 4; i++)
        if (range / (factors[i] * power) <= most)
            return factors[i] * power;
    return 10.0 * power;
}

/* Chooses the power of ten and the decimals of labels, of which none exceeds `largest`. */
static void choose_digits(kt_axis *axis, double largest) {
    int magnitude = (int)floor(log10(largest) + 1e-9);
    axis->exponent = magnitude >= 4 || magnitude <= -3 ? magnitude : 0;
    double places = -floor(log10(axis->step) + 1e-9) + axis->exponent;
    axis->decimals = places > 0.0 ? (int)places : 0;
}

kt_axis kt_axis_make(double low, double high, int most) {
    kt_axis axis = {.low = low, .high = high};
    /* n steps have n + 1 ticks. */
    axis.step = choose_tick_step(high - low, most > 2 ? most - 1 : 1);
    double first = ceil(low / axis.step - 1e-9), last = floor(high / axis.step + 1e-9);
    axis.first = first * axis.step;
    axis.count = (int)(last - first) + 1;
    choose_digits(&axis, fmax(fabs(low), fabs(high)));
    return axis;
}

void kt_axis_shift(kt_axis *axis) {
    enum { DIGITS = 7 };
    if (axis->is_log || axis->count < 1 || axis->decimals < DIGITS)
        return;
    const double unit = 10.0 * axis->step;
    axis->offset = unit * floor(axis->first / unit + 1e-9);
    choose_digits(axis, fabs(axis->first - axis->offset) + (axis->count - 1) * axis->step);
}

kt_axis kt_axis_make_log(double low, double high, int most) {
    double first = ceil(log10(low) - 1e-9), last = floor(log10(high) + 1e-9);
    if (last < first + 1.0) {
        first = floor(log10(low) + 1e-9);
        last = fmax(first + 1.0, ceil(log10(high) - 1e-9));
    }
    kt_axis axis = {.low = fmin(low, pow(10.0, first)), .high = fmax(high, pow(10.0, last)), .is_log = true};
    axis.step = ceil((last - first) / (most > 2 ? most - 1 : 1));
    axis.first = ceil(first / axis.step) * axis.step;
    axis.count = (int)floor((last - axis.first) / axis.step) + 1;
    return axis;
}

double kt_axis_tick(const kt_axis *axis, int i) {
    double tick = axis->first + i * axis->step;
    if (axis->is_log)
        return pow(10.0, tick);
    return fabs(tick) < 1e-9 * axis->step ? 0.0 : tick;
}

double kt_axis_place(const kt_axis *axis, double value) {
    if (!axis->is_log)
        return (value - axis->low) / (axis->high - axis->low);
    return value > 0.0 ? log(value / axis->low) / log(axis->high / axis->low) : (double)NAN;
}

void kt_axis_text(const kt_axis *axis, int i, char *text, size_t size) {
    double tick = axis->is_log ? axis->first + i * axis->step : kt_axis_tick(axis, i);
    if (axis->offset != 0.0) /* a whole number of steps */
        tick = axis->step * rint((tick - axis->offset) / axis->step);
    tick /= axis->is_log ? 1.0 : pow(10.0, axis->exponent);
    snprintf(text, size, "%s%.*f", tick < 0.0 ? "\u2212" : "", axis->decimals, fabs(tick));
}
