/* The margin of a condition: a continuous function that is positive where the condition holds (margin.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_MARGIN_H
#define KT_EXPRESSION_MARGIN_H

#include "base/inner.h"
#include "expression/expression.h"

/* Writes the margin of a formula to `to`, which has room for kt_expression_size of the formula's text. Returns false if
 * the formula is no condition of comparisons with <, <=, > and >=; `to` may then be incomplete. */
KT_INNER bool kt_expression_margin(const kt_expression *expression, kt_expression *to);

/* The first term of the operand that ends before term `end`. */
KT_INNER size_t kt_expression_operand(const kt_expression_term *term, size_t end);

#endif
