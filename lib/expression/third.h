/* The third derivative of a formula along a line. */
#ifndef KT_EXPRESSION_THIRD_H
#define KT_EXPRESSION_THIRD_H

#include "base/inner.h"
#include "expression/expression.h"

/* d^3/ds^3 of the formula with the values `values + s rates`, at s = 0: exact, as those of kt_expression_taylor.
 * O(length). */
KT_INNER double kt_expression_third(const kt_expression *expression, const double *values, const double *rates);

#endif
