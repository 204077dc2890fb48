/* Functions of time, compiled for evaluation. */
#ifndef KT_MODEL_FUNCTION_H
#define KT_MODEL_FUNCTION_H

#include "base/small.h"
#include "kinetree/model.h"

#include <stdbool.h>
#include <stddef.h>

/* A compiled function. Its numbers lie in an array that the caller keeps for all functions (`numbers` below), from
 * numbers[first] on, so that a curve contains no pointer. */
typedef struct kt_curve {
    kt_function_type type;
    int count;         /* polynomial: coefficients; table: rows; sum, product: parts */
    size_t first;      /* where its numbers begin; those of a sum or product begin with its parts' curves */
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

/* The size of the terms that the first derivative at t consists of: its rounding error is a small part of this, even
 * where they cancel, as at the crest of a sine. */
double kt_curve_speed(const kt_curve *curve, const double *numbers, double t);

/* A corner: a time at which a derivative jumps. */
typedef struct kt_corner {
    double time; /* HUGE_VAL: there is none */
    int order;   /* the lowest derivative that jumps: 0 the value, 1 the slope; above 2: a higher one, or none */
} kt_corner;

/* At corners above this order nothing jumps: they are where steps end so that they see what a formula does. */
enum { KT_CORNER_ORDER_MAX = 3 };

/* Whether the function has corners: a ramp's start and end, and rows of a table at which its pieces differ. Between two
 * corners it is one polynomial, one sine, or a formula that is monotone with its first two derivatives. */
bool kt_curve_has_corners(const kt_curve *curve);

/* The first corner after t; those of formulas are sought up to `until`. O(1); of a table O(log rows), and 1 for each row
 * without a corner; of a formula some hundred evaluations. */
kt_corner kt_curve_next_corner(const kt_curve *curve, const double *numbers, double t, double until);

/* The longest step whose stages cannot miss what the function does between two corners: a quarter of a sine's period,
 * of a product of sines that of the sum of their frequencies; HUGE_VAL for all others. */
double kt_curve_longest_step(const kt_curve *curve, const double *numbers);

#endif
