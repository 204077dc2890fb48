/* The third derivative of a formula along a line. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_THIRD_H
#define KT_EXPRESSION_THIRD_H

#include "base/inner.h"
#include "expression/expression.h"

/* The third derivative of the formula with the values `values + s rates` with respect to s, at s = 0. This derivative
 * is exact, like the derivatives of kt_expression_taylor. Cost: O(length). */
KT_INNER double kt_expression_third(const kt_expression *expression, const double *values, const double *rates);

#endif
