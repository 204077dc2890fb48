/* Formulas as nodes: a term that is a number or a variable is put on a stack, and an operator takes its operands from
 * the stack, as in expression/formula_value.c. Jumps and branches become choices. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"
#include "expression/lookup.h"

/* Powers with small whole exponents are products. */
static kt_op power_of(kt_graph *g, kt_op x, kt_op y) {
    const kt_op square = kt_op_multiply(g, x, x);
    if (kt_op_is(g, y, 1.0))
        return x;
    if (kt_op_is(g, y, 2.0))
        return square;
    return kt_op_is(g, y, 3.0) ? kt_op_multiply(g, square, x) : kt_op_call(g, KT_OP_POWER, x, y);
}

static kt_op operate_on_two(kt_graph *g, kt_operator code, kt_op x, kt_op y) {
    const kt_op zero = kt_op_number(g, 0.0), one = kt_op_number(g, 1.0);
    switch (code) {
    case KT_OPERATOR_ADD:
        return kt_op_add(g, x, y);
    case KT_OPERATOR_SUBTRACT:
        return kt_op_subtract(g, x, y);
    case KT_OPERATOR_MULTIPLY:
        return kt_op_multiply(g, x, y);
    case KT_OPERATOR_DIVIDE:
        return kt_op_divide(g, x, y);
    case KT_OPERATOR_POWER:
        return power_of(g, x, y);
    case KT_OPERATOR_LESS:
        return kt_op_choose_above(g, y, x, one, zero);
    case KT_OPERATOR_LESS_EQUAL:
        return kt_op_choose_above(g, x, y, zero, one);
    case KT_OPERATOR_GREATER:
        return kt_op_choose_above(g, x, y, one, zero);
    case KT_OPERATOR_GREATER_EQUAL:
        return kt_op_choose_above(g, y, x, zero, one);
    case KT_OPERATOR_EQUAL:
        return kt_op_choose_above(g, x, y, zero, kt_op_choose_above(g, y, x, zero, one));
    case KT_OPERATOR_NOT_EQUAL:
        return kt_op_choose_above(g, x, y, one, kt_op_choose_above(g, y, x, one, zero));
    case KT_OPERATOR_ATAN2:
        return kt_op_call(g, KT_OP_ATAN2, x, y);
    case KT_OPERATOR_MIN:
        return kt_op_choose_above(g, x, y, y, x);
    case KT_OPERATOR_MAX:
        return kt_op_choose_above(g, y, x, y, x);
    case KT_OPERATOR_HYPOT:
        return kt_op_call(g, KT_OP_HYPOT, x, y);
    default:
        return zero; /* unreachable: the others have one operand */
    }
}

static kt_op operate_on_one(kt_graph *g, kt_operator code, kt_op x) {
    static const kt_op_function function[] = {
        [KT_OPERATOR_SIN] = KT_OP_SIN,   [KT_OPERATOR_COS] = KT_OP_COS,   [KT_OPERATOR_TAN] = KT_OP_TAN,
        [KT_OPERATOR_ASIN] = KT_OP_ASIN, [KT_OPERATOR_ACOS] = KT_OP_ACOS, [KT_OPERATOR_ATAN] = KT_OP_ATAN,
        [KT_OPERATOR_SINH] = KT_OP_SINH, [KT_OPERATOR_COSH] = KT_OP_COSH, [KT_OPERATOR_TANH] = KT_OP_TANH,
        [KT_OPERATOR_EXP] = KT_OP_EXP,   [KT_OPERATOR_LOG] = KT_OP_LOG,   [KT_OPERATOR_SQRT] = KT_OP_SQRT,
        [KT_OPERATOR_ABS] = KT_OP_ABS};
    const kt_op zero = kt_op_number(g, 0.0), one = kt_op_number(g, 1.0);
    if (code == KT_OPERATOR_NEGATE)
        return kt_op_negate(g, x);
    if (code == KT_OPERATOR_STEP)
        return kt_op_choose_above(g, zero, x, zero, one);
    if (code == KT_OPERATOR_SIGN)
        return kt_op_choose_above(g, x, zero, one, kt_op_choose_above(g, zero, x, kt_op_number(g, -1.0), zero));
    return kt_op_call(g, function[code], x, -1);
}

kt_op kt_code_formula(kt_graph *g, const kt_expression *formula, const kt_op *value) {
    kt_op stack[KT_EXPRESSION_DEPTH_MAX + 1] = {0};
    for (kt_postfix w = kt_postfix_begin(formula); kt_postfix_next(&w);)
        stack[w.at] = w.code == KT_OPERATOR_NUMBER ? kt_op_number(g, w.term->number)
                      : w.is_leaf                  ? value[w.term->symbol]
                      : kt_operator_is_lookup(w.code)
                          ? kt_code_lookup(g, kt_lookup_of(w.term), stack[w.at], stack[w.other])
                      : w.is_binary ? operate_on_two(g, w.code, stack[w.at], stack[w.other])
                                    : operate_on_one(g, w.code, stack[w.at]);
    return stack[0];
}

void kt_code_hash_formula(const kt_expression *formula, kt_code_hash *hash, uint64_t *h) {
    for (size_t i = 0; i < formula->count; i++) {
        const kt_expression_term *term = &formula->term[i];
        const int32_t symbol = term->code == KT_OPERATOR_SYMBOL ? term->symbol : 0;
        const double number = term->code == KT_OPERATOR_NUMBER ? term->number : 0.0;
        const double *table = kt_operator_is_lookup((kt_operator)term->code) ? kt_lookup_of(term) : NULL;
        hash(h, &term->code, sizeof term->code);
        hash(h, &symbol, sizeof symbol);
        hash(h, &number, sizeof number);
        if (table != NULL)
            hash(h, table, kt_lookup_size(table) * sizeof *table);
    }
}
