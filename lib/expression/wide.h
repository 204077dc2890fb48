/* Formulas whose intermediate values are beyond the largest number, or below the smallest one. */
#ifndef KT_EXPRESSION_WIDE_H
#define KT_EXPRESSION_WIDE_H

#include "expression/expression.h"

/* Value and derivatives up to the third one along a curve, as those of kt_expression_taylor and kt_expression_third, with numbers
 * of any exponent. order: of the highest derivative that is computed; out has order + 1 numbers. rates and second may be NULL
 * (zero). What is not defined is infinite or NaN. O(length). */
void kt_expression_wide(const kt_expression *expression, const double *values, const double *rates,
                        const double *second, int order, double *out);

/* Writes the operation that makes a formula infinite or NaN, with its numbers: "exp(8000) exceeds the largest number",
 * "log(-2) is not defined". Returns false, and writes nothing, if there is none. O(length). */
bool kt_expression_fault(const kt_expression *expression, const double *values, char *text, size_t size);

#endif
