/* Parts of a formula that depend on one of its symbols alone (part.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_PART_H
#define KT_EXPRESSION_PART_H

#include "base/inner.h"
#include "expression/expression.h"

/* Is given the terms of a part, in postfix order. */
typedef void kt_expression_part(void *user, const kt_expression_term *term, size_t count);

/* Reports the largest parts of a formula in which this symbol is the only symbol, in the order of the text. The symbol
 * itself is not a part. The parts have no terms in common. Cost: O(length). */
KT_INNER void kt_expression_parts(const kt_expression *expression, int32_t symbol, kt_expression_part *found,
                                  void *user);

/* The bytes of such a part as a formula of one symbol, and the formula. memory: aligned to kt_expression. */
KT_INNER size_t kt_expression_part_size(size_t count);
KT_INNER void kt_expression_part_copy(const kt_expression_term *term, size_t count, void *memory);

#endif
