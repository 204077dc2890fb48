/* Ticks at round numbers: 1, 2 or 5 times a power of ten apart. */
#include "plot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The least round step of which at most `most` fit. */
static double choose_step(double range, int most) {
    static const double factors[] = {1.0, 2.0, 5.0, 10.0};
    double power = pow(10.0, floor(log10(range / most)));
    for (int i = 0; i < 4; i++)
        if (range / (factors[i] * power) <= most)
            return factors[i] * power;
    return 10.0 * power;
}

kt_axis kt_axis_make(double low, double high, int most) {
    kt_axis axis = {.low = low, .high = high};
    /* n steps have n + 1 ends. */
    axis.step = choose_step(high - low, most > 2 ? most - 1 : 1);
    double first = ceil(low / axis.step - 1e-9), last = floor(high / axis.step + 1e-9);
    axis.first = first * axis.step;
    axis.count = (int)(last - first) + 1;
    double largest = fmax(fabs(low), fabs(high));
    int magnitude = (int)floor(log10(largest) + 1e-9);
    axis.exponent = magnitude >= 4 || magnitude <= -3 ? magnitude : 0;
    double places = -floor(log10(axis.step) + 1e-9) + axis.exponent;
    axis.decimals = places > 0.0 ? (int)places : 0;
    return axis;
}

double kt_axis_tick(const kt_axis *axis, int i) {
    double tick = axis->first + i * axis->step;
    return fabs(tick) < 1e-9 * axis->step ? 0.0 : tick;
}

void kt_axis_text(const kt_axis *axis, int i, char *text, size_t size) {
    double tick = kt_axis_tick(axis, i) / pow(10.0, axis->exponent);
    snprintf(text, size, "%s%.*f", tick < 0.0 ? "\u2212" : "", axis->decimals, fabs(tick));
}
