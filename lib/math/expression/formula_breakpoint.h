/* Formulas of time alone, whose only symbol is t: breakpoints and features (formula_breakpoint.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_FORMULA_BREAKPOINT_H
#define KT_EXPRESSION_FORMULA_BREAKPOINT_H

#include "expression/jet.h"

/* Returns the first breakpoint, feature or cut after t, or HUGE_VAL if there is none up to `until`. At a breakpoint a
 * branch changes. Then *order is the lowest derivative that may jump at the breakpoint, with 0 for the value. At a
 * feature f', f'' or f''' changes its sign, and *order is 4. If the search was cut, *order is KT_BREAKPOINT_CUT. Cost:
 * some hundred evaluations of the formula, and some thousand if the search is cut. *left is reduced by their
 * operations. From 0 on, every search is cut at once. */
double kt_expression_next_breakpoint(const kt_expression *expression, double t, double until, int64_t *left,
                                     int *order);

/* The size of the terms of the first derivative at t, estimated from their loss by rounding. */
double kt_expression_speed(const kt_expression *expression, double t);

/* The branches that the operations take that are not smooth, as one number (formula_value.c). */
uint64_t kt_expression_branches(const kt_expression *expression, const double *values);

#endif
