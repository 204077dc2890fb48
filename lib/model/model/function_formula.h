/* The functions that function.c calls for bumps and formulas of time. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_FUNCTION_FORMULA_H
#define KT_MODEL_FUNCTION_FORMULA_H

#include "base/inner.h"
#include "kinetree/expression.h"
#include "model/function.h"

/* Bump, sum, product, expression. */
static inline bool kt_curve_is_formula(const kt_curve *curve) {
    return curve->type >= KT_FUNCTION_BUMP && curve->type <= KT_FUNCTION_EXPRESSION;
}

/* The parts of kt_curve_* for bumps and expressions; sums and products are in function.c. */
size_t kt_curve_formula_numbers(const kt_function *function);
void kt_curve_formula_compile(const kt_function *function, double *numbers, kt_curve *curve);
void kt_curve_formula_evaluate(const kt_curve *curve, const double *numbers, double t, double out[3]);
double kt_curve_formula_speed(const kt_curve *curve, const double *numbers, double t);
kt_breakpoint kt_curve_formula_breakpoint(const kt_curve *curve, const double *numbers, double t, double until,
                                          int64_t *left);

/* The symbols of kt_expression_parse for formulas of time, whose only symbol is t, and a parsed formula of time. */
KT_INNER kt_symbols kt_time_symbols(void);
KT_CHECKED kt_status kt_formula_of_time(const char *text, void *memory, size_t size, const kt_expression **expression,
                                        int *column, kt_error *error);

#endif
