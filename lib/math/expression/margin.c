/* The margin of a condition, whose changes of sign are events. A comparison becomes the difference of its sides, and
 *
 *     a and b = a b        margin min(A, B)
 *     a or b = max(a, b)   margin max(A, B)
 *     not a = (a == 0)     margin -A; negations of `and` and `or` are moved to the comparisons (de Morgan)
 *
 * where A is the margin of a. A comparison may take one term more than before, x - y and a minus. There is room for it:
 * a text of n bytes has n + 1 terms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/margin.h"
#include "expression/lookup.h"

static void add_margin_term(kt_expression *to, kt_operator code) {
    to->term[to->count++] = (kt_expression_term){.code = (int32_t)code};
}

size_t kt_expression_operand(const kt_expression_term *term, size_t end) {
    for (int missing = 1; missing > 0;) {
        const kt_operator code = (kt_operator)term[--end].code;
        missing += kt_operator_is_leaf(code) ? -1 : kt_operator_is_binary(code) ? 1 : 0;
    }
    return end;
}

static bool is_zero_term(const kt_expression_term *term) {
    return term->code == KT_OPERATOR_NUMBER && term->number == 0.0;
}

/* Adds the margin of the value that ends before term `end`, or of its negation (negated). Returns false if the value is
 * no condition. */
/* NOLINTNEXTLINE(misc-no-recursion): the parser bounds the depth */
static bool add_margin(const kt_expression_term *term, size_t end, bool negated, kt_expression *to) {
    const kt_operator code = (kt_operator)term[end - 1].code;
    const bool less = code == KT_OPERATOR_LESS || code == KT_OPERATOR_LESS_EQUAL;
    if (less || code == KT_OPERATOR_GREATER || code == KT_OPERATOR_GREATER_EQUAL) {
        const size_t first = kt_expression_operand(term, kt_expression_operand(term, end - 1));
        kt_expression_copy_terms(term + first, end - 1 - first, to->term + to->count);
        to->count += end - 1 - first;
        add_margin_term(to, KT_OPERATOR_SUBTRACT);
        if (less != negated)
            add_margin_term(to, KT_OPERATOR_NEGATE);
        return true;
    }
    if ((code == KT_OPERATOR_EQUAL || code == KT_OPERATOR_NOT_EQUAL) && is_zero_term(&term[end - 2]))
        return add_margin(term, end - 2, negated != (code == KT_OPERATOR_EQUAL), to);
    if (code != KT_OPERATOR_MULTIPLY && code != KT_OPERATOR_MAX)
        return false;
    if (!add_margin(term, kt_expression_operand(term, end - 1), negated, to) || !add_margin(term, end - 1, negated, to))
        return false;
    add_margin_term(to, (code == KT_OPERATOR_MAX) != negated ? KT_OPERATOR_MAX : KT_OPERATOR_MIN);
    return true;
}

bool kt_expression_margin(const kt_expression *expression, kt_expression *to) {
    *to = (kt_expression){.count = 0};
    return expression->count > 0 && add_margin(expression->term, expression->count, false, to);
}
