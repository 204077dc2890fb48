/* Functions of time: constants, sines, ramps, polynomials, tables, bumps, formulas, and their sums and products.
 *
 * A description uses them for drives, forces, lengths and masses that change with time (description.h).
 *
 * Units: SI and radians.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_FUNCTION_H
#define KINETREE_FUNCTION_H

#include "kinetree/lookup.h"
#include "kinetree/status.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* How a kt_function depends on time. */
typedef enum kt_function_type {
    KT_FUNCTION_NONE = 0,   /* not given: the default of the member that has it */
    KT_FUNCTION_CONSTANT,   /* always `value` */
    KT_FUNCTION_SINE,       /* about an offset */
    KT_FUNCTION_RAMP,       /* from one value to another, smoothly */
    KT_FUNCTION_POLYNOMIAL, /* coefficients of powers of t */
    KT_FUNCTION_TABLE,      /* interpolated between rows */
    KT_FUNCTION_BUMP,       /* rises once and falls back, smoothly */
    KT_FUNCTION_SUM,        /* of other functions */
    KT_FUNCTION_PRODUCT,    /* of other functions */
    KT_FUNCTION_EXPRESSION, /* a formula of t in text */
} kt_function_type;

/* A scalar function of time. Only the members of its type are used. */
typedef struct kt_function {
    kt_function_type type;                      /* KT_FUNCTION_NONE: not given */
    double value;                               /* constant */
    double amplitude, frequency, phase, offset; /* offset + amplitude sin(2 pi frequency t + phase); Hz, rad */
    double from, to, start, end;                /* C1 ramp: `from` up to t = start, `to` from t = end on */
    const double *numbers;                      /* polynomial: c0, c1, ... of t; table: t0, y0, t1, y1, ... */
    int number_count;                           /* length of numbers */
    kt_interpolation interpolation;             /* of a table */
    bool has_slopes;                            /* cubic table: `slopes` contains y' at the ends */
    double slopes[2];                           /* at the first row and at the last */
    const struct kt_function *parts;            /* sum, product */
    int part_count;                             /* length of parts */
    const char *text;                           /* expression */
} kt_function;

/* Returns a function of the type in its name.
 *   "constant": the value at all times.
 *   "sine": offset + amplitude sin(2 pi frequency t + phase), with the frequency in Hz and the phase in rad.
 *   "ramp": `from` until t = start, and `to` from t = end on. Between start and end, the value is from + (to - from) (3
 * s^2 - 2 s^3),
 *     with the share s of the time between start and end. Value and slope are continuous; the second derivative jumps
 *     at both ends.
 *   "polynomial": coefficients[0] + coefficients[1] t + ..., with as many powers as there are coefficients.
 *   "table": rows t0, y0, t1, y1, ... with increasing t. The argument number_count is twice the number of rows, which
 *     is at least two. Before its first row a table has its first value, after its last row its last value, both with
 *     slope zero. At the first and the last row, the slope is the limit from inside the table.
 *   "bump": height (4 s (1 - s))^3 between start and end, and zero elsewhere, with s as for a ramp. Value, slope and
 *     second derivative are continuous; the third derivative jumps at both ends.
 *   "sum", "product": of at least one function of any type. At most KT_FUNCTION_DEPTH_MAX sums and products may be
 * nested.
 *   "expression": a formula (expression.h) with t as its only name, such as "0.5*(1 - cos(2*t))". Steps end at its
 *     breakpoints, and at times at which one of its first three derivatives changes sign.
 * The rows of a table are interpolated in one of three ways.
 *   Linear: straight lines.
 *   Cubic: the natural cubic spline, which is twice continuously differentiable and has no curvature at its ends. With
 * slopes given at the ends, the clamped spline. A spline overshoots: two rows of zero followed by two rows of 90
 * degrees, a second apart, give an overshoot of 11.5 degrees on both sides.
 *   Monotone: cubics with continuous slope that remain between the values of their two rows. The second derivative
 *     jumps at rows. Source: Fritsch and Butland 1984.
 * Ownership: lists remain the caller's until kt_model_compile copies them. */
KT_API kt_function kt_function_constant(double value);
KT_API kt_function kt_function_sine(double amplitude, double frequency, double phase, double offset);
KT_API kt_function kt_function_ramp(double from, double to, double start, double end);
KT_API kt_function kt_function_polynomial(const double *coefficients, int count);
KT_API kt_function kt_function_table(const double *rows, int number_count, kt_interpolation interpolation);
KT_API kt_function kt_function_bump(double height, double start, double end);
KT_API kt_function kt_function_sum(const kt_function *parts, int part_count);
KT_API kt_function kt_function_product(const kt_function *parts, int part_count);
KT_API kt_function kt_function_expression(const char *text);

/* Computes the value, the first and the second derivative of a function at time t. Meant for programs that prepare a
 * description, since the call compiles the function and allocates memory.
 * Errors: KT_ERROR_MODEL with the fault of the function, KT_ERROR_MEMORY; `out` is then unchanged.
 * Cost: O(size of the function). */
KT_API KT_CHECKED kt_status kt_function_evaluate(const kt_function *function, double t, double out[3], kt_error *error);

/* Bounds of functions. */
enum { KT_FUNCTION_DEPTH_MAX = 4 /* sums and products within one another */ };

#ifdef __cplusplus
}
#endif
#endif
