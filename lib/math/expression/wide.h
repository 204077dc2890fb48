/* Formulas with intermediate values above the largest or below the smallest double. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_WIDE_H
#define KT_EXPRESSION_WIDE_H

#include "expression/expression.h"

/* Writes the value and the derivatives up to the third one along a curve, with numbers of any exponent. The results
 * equal those of kt_expression_taylor and kt_expression_third. The highest derivative that is computed is `order`, and
 * out has order + 1 numbers. The arguments rates and second may be NULL (zero). An undefined result is infinite or NaN.
 * Cost: O(length). */
void kt_expression_wide(const kt_expression *expression, const double *values, const double *rates,
                        const double *second, int order, double *out);

/* Writes the operation that makes a formula infinite or NaN, with its numbers: "exp(8000) exceeds the largest number",
 * "log(-2) is not defined". Returns false, and writes nothing, if there is none. Cost: O(length). */
bool kt_expression_fault(const kt_expression *expression, const double *values, char *text, size_t size);

#endif
