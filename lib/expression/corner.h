/* Formulas of time alone, whose only symbol is t: corners and features (corner.c). */
#ifndef KT_EXPRESSION_CORNER_H
#define KT_EXPRESSION_CORNER_H

#include "base/inner.h"
#include "expression/jet.h"

/* The first time after t at which a branch changes (*order: the lowest derivative that may jump there, 0 the value), or
 * at which f', f'' or f''' change their sign (4), or at which the search was cut (KT_CORNER_CUT); HUGE_VAL: there is none
 * up to `until`. Costs some hundred evaluations of the formula, and some thousand where it is cut. */
KT_INNER double kt_expression_next_corner(const kt_expression *expression, double t, double until, int *order);

/* The size of the terms of the first derivative at t, as far as it is known from what they lose by rounding. */
double kt_expression_speed(const kt_expression *expression, double t);

/* Which branches the operations that are not smooth take, as one number (evaluate.c). */
uint64_t kt_expression_branches(const kt_expression *expression, const double *values);

#endif
