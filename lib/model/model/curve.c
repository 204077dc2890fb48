/* Curves, which are compiled functions of time: their values with two derivatives, and their breakpoints.
 *
 *   constant    y = a
 *   sine        y = a + b sin(c t + d),  c = 2 pi frequency
 *   ramp        y = a + (b - a) s^2 (3 - 2 s),  s = (t - c) / (d - c) limited to [0, 1].
 *               The slope of this cubic is zero at both ends: y and y' are continuous, and y'' jumps at the ends.
 *   polynomial  y = c0 + c1 t + c2 t^2 + ..., by Horner's rule for y, y' and y''/2
 *   bump        y = a (4 s (1 - s))^3,  s = (t - c) / (d - c) limited to [0, 1]
 *   table       between two rows, with h_k = t_{k+1} - t_k and s = t - t_k,
 *                 y = y_k + s (b_k + s (c_k + s d_k))
 *   sum         y = f + g,  y' = f' + g',  y'' = f'' + g''
 *   product     y = f g,  y' = f' g + f g',  y'' = f'' g + 2 f' g' + f g''
 *
 * The parts of a sum or product are functions of any type. The numbers of a sum or product are the curves of its parts,
 * and then the numbers of these parts. No number is a pointer, so that a model can be copied.
 *
 * Outside its rows a table keeps its first or last value, with zero slope. The first and the last row belong to the
 * inside of the table. Therefore a motion whose table begins at the start of the simulation starts with the table's
 * slope. The same is true at the end.
 * The coefficients of the interpolations are in expression/lookup.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/lookup.h"
#include "model/describe.h"
#include "model/function.h"
#include "model/function_formula.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* ---- compilation ------------------------------------------------------------------------------------------------- */

enum { CURVE_NUMBERS = sizeof(kt_curve) / sizeof(double) };
_Static_assert(sizeof(kt_curve) % sizeof(double) == 0, "curves lie among numbers");

static bool has_parts(kt_function_type type) { return (type == KT_FUNCTION_SUM || type == KT_FUNCTION_PRODUCT); }

static size_t number_count_of_parts(const kt_function *function) {
    size_t count = 0;
    for (int i = 0; i < function->part_count; i++)
        count += CURVE_NUMBERS + kt_curve_number_count(&function->parts[i]);
    return count;
}

size_t kt_curve_number_count(const kt_function *function) {
    if (function->type == KT_FUNCTION_POLYNOMIAL)
        return (size_t)function->number_count;
    if (function->type == KT_FUNCTION_TABLE)
        return (size_t)(function->number_count / 2) * KT_PIECE_SIZE;
    if (has_parts(function->type))
        return number_count_of_parts(function);
    return kt_curve_formula_numbers(function);
}

/* Compiles the parts of a sum or a product. Their curves come first, then the numbers of each part. */
static void compile_parts(const kt_function *function, double *numbers, kt_curve *curve) {
    size_t at = curve->first + (size_t)function->part_count * CURVE_NUMBERS;
    curve->count = function->part_count;
    for (int i = 0; i < function->part_count; i++) {
        const kt_curve part = kt_curve_compile(&function->parts[i], numbers, at);
        memcpy(numbers + curve->first + (size_t)i * CURVE_NUMBERS, &part, sizeof part);
        at += kt_curve_number_count(&function->parts[i]);
    }
}

kt_curve kt_curve_compile(const kt_function *function, double *numbers, size_t first) {
    static const double two_pi = 6.283185307179586476925286766559;
    kt_curve curve = {.type = function->type, .first = first};
    switch (function->type) {
    case KT_FUNCTION_NONE:
        break;
    case KT_FUNCTION_CONSTANT:
        curve.a = function->value;
        break;
    case KT_FUNCTION_SINE:
        curve.a = function->offset;
        curve.b = function->amplitude;
        curve.c = two_pi * function->frequency;
        curve.d = function->phase;
        break;
    case KT_FUNCTION_RAMP:
        curve.a = function->from;
        curve.b = function->to;
        curve.c = function->start;
        curve.d = function->end;
        break;
    case KT_FUNCTION_POLYNOMIAL:
        curve.count = function->number_count;
        for (int k = 0; k < curve.count; k++)
            numbers[first + (size_t)k] = function->numbers[k];
        break;
    case KT_FUNCTION_TABLE:
        curve.count = function->number_count / 2;
        kt_rows_compile(function->numbers, curve.count, function->interpolation,
                        function->has_slopes ? KT_ROW_ENDS_GIVEN : KT_ROW_ENDS_FREE, function->slopes, numbers + first);
        break;
    default:
        if (has_parts(function->type))
            compile_parts(function, numbers, &curve);
        else
            kt_curve_formula_compile(function, numbers, &curve);
    }
    return curve;
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static void set_derivatives(double out[3], double value, double first, double second) {
    out[0] = value;
    out[1] = first;
    out[2] = second;
}

/* A ramp from a to b between the times c and d: a cubic whose slope vanishes at both ends. out: the value and its first
 * two derivatives. */
static void evaluate_ramp(const kt_curve *curve, double t, double out[3]) {
    const double step = curve->b - curve->a, length = curve->d - curve->c;
    const double s = (t - curve->c) / length;
    if (s <= 0.0)
        set_derivatives(out, curve->a, 0.0, 0.0);
    else if (s >= 1.0)
        set_derivatives(out, curve->b, 0.0, 0.0);
    else
        set_derivatives(out, curve->a + step * (s * s * (3.0 - 2.0 * s)), step * (6.0 * s * (1.0 - s)) / length,
                        step * (6.0 - 12.0 * s) / (length * length));
}

/* Horner's rule for p, p' and p''/2 of p = ((c_n t + c_{n-1}) t + ...) t + c_0. */
static void evaluate_polynomial(const double *c, int count, double t, double out[3]) {
    double p = 0.0, d1 = 0.0, d2 = 0.0;
    for (int k = count - 1; k >= 0; k--) {
        d2 = d2 * t + d1;
        d1 = d1 * t + p;
        p = p * t + c[k];
    }
    set_derivatives(out, p, d1, 2.0 * d2);
}

/* The cubic piece at t and its first two derivatives. Outside of the rows, the first or last value holds. */
static void evaluate_table(const double *rows, int count, double t, double out[3]) {
    const double *last = rows + (size_t)(count - 1) * KT_PIECE_SIZE;
    if (t < rows[KT_PIECE_X]) {
        set_derivatives(out, rows[KT_PIECE_Y], 0.0, 0.0);
        return;
    }
    if (t > last[KT_PIECE_X]) {
        set_derivatives(out, last[KT_PIECE_Y], 0.0, 0.0);
        return;
    }
    const double *row = rows + (size_t)kt_rows_find(rows, count, t) * KT_PIECE_SIZE;
    const double s = t - row[KT_PIECE_X], b = row[KT_PIECE_B], c = row[KT_PIECE_C], d = row[KT_PIECE_D];
    set_derivatives(out, row[KT_PIECE_Y] + s * (b + s * (c + s * d)), b + s * (2.0 * c + 3.0 * s * d),
                    2.0 * c + 6.0 * s * d);
    if (t == last[KT_PIECE_X]) /* exactly the value that follows */
        out[0] = last[KT_PIECE_Y];
}

static kt_curve curve_part_of(const kt_curve *curve, const double *numbers, int i) {
    kt_curve part;
    memcpy(&part, numbers + curve->first + (size_t)i * CURVE_NUMBERS, sizeof part);
    return part;
}

/* The sum or the product of the parts, and its first two derivatives by the product rule. */
static void evaluate_parts(const kt_curve *curve, const double *numbers, double t, double out[3]) {
    const bool is_sum = curve->type == KT_FUNCTION_SUM;
    double f[3] = {is_sum ? 0.0 : 1.0, 0.0, 0.0}, g[3];
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = curve_part_of(curve, numbers, i);
        kt_curve_evaluate(&part, numbers, t, g);
        f[2] = is_sum ? f[2] + g[2] : f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2];
        f[1] = is_sum ? f[1] + g[1] : f[1] * g[0] + f[0] * g[1];
        f[0] = is_sum ? f[0] + g[0] : f[0] * g[0];
    }
    memcpy(out, f, sizeof f);
}

void kt_curve_evaluate(const kt_curve *curve, const double *numbers, double t, double out[3]) {
    switch (curve->type) {
    case KT_FUNCTION_NONE:
    case KT_FUNCTION_CONSTANT:
        set_derivatives(out, curve->a, 0.0, 0.0);
        break;
    case KT_FUNCTION_SINE: {
        const double sine = curve->b * sin(curve->c * t + curve->d), cosine = curve->b * cos(curve->c * t + curve->d);
        set_derivatives(out, curve->a + sine, curve->c * cosine, -curve->c * curve->c * sine);
        break;
    }
    case KT_FUNCTION_RAMP:
        evaluate_ramp(curve, t, out);
        break;
    case KT_FUNCTION_POLYNOMIAL:
        evaluate_polynomial(numbers + curve->first, curve->count, t, out);
        break;
    case KT_FUNCTION_TABLE:
        evaluate_table(numbers + curve->first, curve->count, t, out);
        break;
    default: { /* KT_CURVE_FOLLOWS, and formulas */
        const double s = t - curve->d;
        if (has_parts(curve->type))
            evaluate_parts(curve, numbers, t, out);
        else if (kt_curve_is_formula(curve))
            kt_curve_formula_evaluate(curve, numbers, t, out);
        else
            set_derivatives(out, curve->a + s * (curve->b + 0.5 * s * curve->c), curve->b + s * curve->c, curve->c);
    }
    }
}

/* A bound of the sizes of the terms of the slope at t, which may cancel. */
static double table_speed(const double *rows, int count, double t) {
    const double *last = rows + (size_t)(count - 1) * KT_PIECE_SIZE;
    if (t < rows[KT_PIECE_X] || t > last[KT_PIECE_X])
        return 0.0;
    const double *row = rows + (size_t)kt_rows_find(rows, count, t) * KT_PIECE_SIZE;
    const double s = t - row[KT_PIECE_X];
    return fabs(row[KT_PIECE_B]) + s * (2.0 * fabs(row[KT_PIECE_C]) + 3.0 * s * fabs(row[KT_PIECE_D]));
}

/* A bound of the sizes of the terms of the slope of a sum or a product. */
static double parts_speed(const kt_curve *curve, const double *numbers, double t) {
    double y[3], size = 1.0, speed = 0.0;
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = curve_part_of(curve, numbers, i);
        const double of_part = kt_curve_speed(&part, numbers, t);
        kt_curve_evaluate(&part, numbers, t, y);
        speed = curve->type == KT_FUNCTION_SUM ? speed + of_part : speed * fabs(y[0]) + size * of_part;
        size *= fabs(y[0]);
    }
    return speed;
}

double kt_curve_speed(const kt_curve *curve, const double *numbers, double t) {
    double speed = 0.0;
    switch (curve->type) {
    case KT_FUNCTION_NONE:
    case KT_FUNCTION_CONSTANT:
        return 0.0;
    case KT_FUNCTION_SINE:
        return fabs(curve->b * curve->c);
    case KT_FUNCTION_RAMP:
        return t < curve->c || t > curve->d ? 0.0 : 6.0 * fabs((curve->b - curve->a) / (curve->d - curve->c));
    case KT_FUNCTION_POLYNOMIAL:
        for (int k = curve->count - 1; k > 0; k--)
            speed = speed * fabs(t) + k * fabs(numbers[curve->first + (size_t)k]);
        return speed;
    case KT_FUNCTION_TABLE:
        return table_speed(numbers + curve->first, curve->count, t);
    default: /* KT_CURVE_FOLLOWS, and formulas */
        if (has_parts(curve->type))
            return parts_speed(curve, numbers, t);
        return kt_curve_is_formula(curve) ? kt_curve_formula_speed(curve, numbers, t)
                                          : fabs(curve->b) + fabs((t - curve->d) * curve->c);
    }
}

/* ---- breakpoints ------------------------------------------------------------------------------------------------- */

/* Derivatives of a table's pieces that differ by no more than this part of their size are equal but for rounding. */
static const double equal = 64.0 * DBL_EPSILON;

/* The lowest derivative that jumps at row k; 0: none. On both sides of the rows the table rests. */
static int jump_at_row(const double *rows, int count, int k) {
    const double *row = rows + (size_t)k * KT_PIECE_SIZE, *before = row - KT_PIECE_SIZE;
    double left[3] = {0.0, 0.0, 0.0}, right[3] = {0.0, 0.0, 0.0}, size[3] = {0.0, 0.0, 0.0};
    if (k > 0) {
        const double h = row[KT_PIECE_X] - before[KT_PIECE_X], b = before[KT_PIECE_B], c = before[KT_PIECE_C],
                     d = before[KT_PIECE_D];
        left[0] = b + h * (2.0 * c + 3.0 * h * d);
        left[1] = 2.0 * c + 6.0 * h * d;
        left[2] = 6.0 * d;
        size[0] = fabs(b) + h * (2.0 * fabs(c) + 3.0 * h * fabs(d));
        size[1] = 2.0 * fabs(c) + 6.0 * h * fabs(d);
        size[2] = 6.0 * fabs(d);
    }
    if (k + 1 < count) {
        right[0] = row[KT_PIECE_B];
        right[1] = 2.0 * row[KT_PIECE_C];
        right[2] = 6.0 * row[KT_PIECE_D];
    }
    for (int i = 0; i < 3; i++)
        if (fabs(right[i] - left[i]) > equal * (size[i] + fabs(right[i])))
            return i + 1;
    return 0;
}

bool kt_curve_has_breakpoints(const kt_curve *curve) {
    if (kt_curve_is_formula(curve))
        return true;
    return curve->type == KT_FUNCTION_TABLE || (curve->type == KT_FUNCTION_RAMP && curve->a != curve->b);
}

/* The first row after t at which some derivative jumps, and the order of that derivative. */
static kt_breakpoint next_row(const double *rows, int count, double t) {
    for (int k = t < rows[KT_PIECE_X] ? 0 : kt_rows_find(rows, count, t) + 1; k < count; k++) {
        const int order = jump_at_row(rows, count, k);
        if (order > 0 && rows[(size_t)k * KT_PIECE_SIZE + KT_PIECE_X] > t)
            return (kt_breakpoint){rows[(size_t)k * KT_PIECE_SIZE + KT_PIECE_X], order};
    }
    return (kt_breakpoint){HUGE_VAL, 0};
}

/* The first breakpoint of the parts. Of breakpoints at one time, the one of the lowest order counts, because lower
 * derivatives jump there. */
static kt_breakpoint breakpoint_of_parts(const kt_curve *curve, const double *numbers, double t, double until,
                                         int64_t *left) {
    kt_breakpoint first = {HUGE_VAL, KT_BREAKPOINT_ORDER_MAX};
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = curve_part_of(curve, numbers, i);
        const kt_breakpoint breakpoint = kt_curve_next_breakpoint(&part, numbers, t, until, left);
        if (breakpoint.time < first.time || (breakpoint.time == first.time && breakpoint.order < first.order))
            first = breakpoint;
    }
    return first;
}

kt_breakpoint kt_curve_next_breakpoint(const kt_curve *curve, const double *numbers, double t, double until,
                                       int64_t *left) {
    if (!kt_curve_has_breakpoints(curve))
        return (kt_breakpoint){HUGE_VAL, 0};
    if (curve->type == KT_FUNCTION_TABLE)
        return next_row(numbers + curve->first, curve->count, t);
    if (has_parts(curve->type))
        return breakpoint_of_parts(curve, numbers, t, until, left);
    if (kt_curve_is_formula(curve))
        return kt_curve_formula_breakpoint(curve, numbers, t, until, left);
    return t < curve->c   ? (kt_breakpoint){curve->c, 2}
           : t < curve->d ? (kt_breakpoint){curve->d, 2}
                          : (kt_breakpoint){HUGE_VAL, 0};
}

/* A product of sines of frequencies f and g contains the frequency f + g, whose quarter period is returned. */
static double longest_step_of_parts(const kt_curve *curve, const double *numbers) {
    double longest = HUGE_VAL, inverse = 0.0;
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = curve_part_of(curve, numbers, i);
        const double length = kt_curve_longest_step(&part, numbers);
        longest = fmin(longest, length);
        inverse += 1.0 / length;
    }
    return curve->type == KT_FUNCTION_PRODUCT && inverse > 0.0 ? 1.0 / inverse : longest;
}

double kt_curve_longest_step(const kt_curve *curve, const double *numbers) {
    static const double quarter_turn = 1.5707963267948966192313216916398;
    const bool is_sine = curve->type == KT_FUNCTION_SINE && curve->b != 0.0 && curve->c != 0.0;
    if (has_parts(curve->type))
        return longest_step_of_parts(curve, numbers);
    return is_sine ? quarter_turn / fabs(curve->c) : HUGE_VAL;
}
