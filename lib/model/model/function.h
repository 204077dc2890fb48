/* Functions of time, compiled for evaluation. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_FUNCTION_H
#define KT_MODEL_FUNCTION_H

#include "kinetree/model.h"

#include <stdbool.h>
#include <stddef.h>

/* A compiled function. The caller keeps one array for the numbers of all functions (`numbers` below). The numbers of
 * this function begin at numbers[first]. Thus a curve contains no pointer. */
typedef struct kt_curve {
    kt_function_type type;
    int count;         /* polynomial: coefficients; table: rows; sum, product: parts */
    size_t first;      /* first of its numbers; for a sum or product, these begin with the curves of its parts */
    double a, b, c, d; /* constant: a; sine: a + b sin(c t + d); ramp: from a to b between t = c and t = d; bump: of
                          height a between t = c and t = d */
} kt_curve;

/* Returns how many of the caller's numbers the compiled function takes. */
size_t kt_curve_number_count(const kt_function *function);

/* Compiles a function that kt_description_check accepts, and fills kt_curve_number_count(function) numbers from
 * numbers[first] on. O(length of its list). */
kt_curve kt_curve_compile(const kt_function *function, double *numbers, size_t first);

/* A parameter that has been set (kinetree/model.h): a + b s + c s^2 / 2 with s = t - d. */
#define KT_CURVE_FOLLOWS ((kt_function_type)(KT_FUNCTION_EXPRESSION + 1))
static inline bool kt_curve_follows(const kt_curve *curve) { return curve->type == KT_CURVE_FOLLOWS; }

/* Whether the function keeps one value, which is curve->a. */
static inline bool kt_curve_rests(const kt_curve *curve) {
    return curve->type == KT_FUNCTION_NONE || curve->type == KT_FUNCTION_CONSTANT;
}

/* out = value, first and second derivative at time t. O(1); for a polynomial O(degree), for a table O(log rows). A
 * function that is not given (KT_FUNCTION_NONE) is zero. */
void kt_curve_evaluate(const kt_curve *curve, const double *numbers, double t, double out[3]);

/* The size of the terms whose sum is the first derivative at t. The rounding error of the sum is a small part of this
 * size, even if the terms cancel, as at the crest of a sine. */
double kt_curve_speed(const kt_curve *curve, const double *numbers, double t);

/* A breakpoint: a time at which a derivative jumps. */
typedef struct kt_breakpoint {
    double time; /* HUGE_VAL: there is none */
    int order;   /* the lowest derivative that jumps, from 0 for the value; above 2: a higher derivative, or none */
} kt_breakpoint;

/* At breakpoints above this order, no derivative of interest jumps. Steps end at such breakpoints to resolve the shape
 * of a formula. */
enum { KT_BREAKPOINT_ORDER_MAX = 3 };

/* Whether the function has breakpoints: a ramp's start and end, and rows of a table at which its pieces differ. Between
 * two breakpoints, the function is one polynomial, one sine, or a formula that is monotone with its first two
 * derivatives. */
bool kt_curve_has_breakpoints(const kt_curve *curve);

/* Returns the first breakpoint after t; the breakpoints of formulas are sought up to `until`. *left is reduced by the
 * operations of the search (expression/formula_breakpoint.h).
 * Cost: O(1). For a table O(log rows), plus 1 for each row without a breakpoint. For a formula some hundred
 * evaluations. */
kt_breakpoint kt_curve_next_breakpoint(const kt_curve *curve, const double *numbers, double t, double until,
                                       int64_t *left);

/* The longest step whose stages resolve the function between two breakpoints. For a sine, a quarter of the period. A
 * product of sines counts as a sine with the sum of their frequencies. For all other functions, HUGE_VAL. */
double kt_curve_longest_step(const kt_curve *curve, const double *numbers);

#endif
