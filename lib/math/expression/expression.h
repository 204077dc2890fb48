/* A formula as a list of terms in postfix order. Numbers and symbols are put on a stack. An operator replaces the one
 * or two values on top of the stack with its result. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_EXPRESSION_H
#define KT_EXPRESSION_EXPRESSION_H

#include "kinetree/expression.h"

#include <stdint.h>

#define KT_FUNCTION_OPERATOR(id, name, least, most) KT_OPERATOR_##id,
typedef enum kt_operator {
    KT_OPERATOR_NUMBER = 0,
    KT_OPERATOR_SYMBOL,
    KT_OPERATOR_NEGATE,
    KT_OPERATOR_ADD,
    KT_OPERATOR_SUBTRACT,
    KT_OPERATOR_MULTIPLY,
    KT_OPERATOR_DIVIDE,
    KT_OPERATOR_POWER,
    KT_OPERATOR_LESS,
    KT_OPERATOR_LESS_EQUAL,
    KT_OPERATOR_GREATER,
    KT_OPERATOR_GREATER_EQUAL,
    KT_OPERATOR_EQUAL,
    KT_OPERATOR_NOT_EQUAL,
    KT_EXPRESSION_FUNCTION_LIST(KT_FUNCTION_OPERATOR) /* and tables of one input and of two: */
    KT_OPERATOR_LOOKUP,
    KT_OPERATOR_LOOKUP2
} kt_operator;

typedef struct kt_expression_term {
    double number;  /* KT_OPERATOR_NUMBER; KT_OPERATOR_LOOKUP, _LOOKUP2: how far the table lies behind the term, in
                       doubles; 0: it was not compiled */
    int32_t symbol; /* KT_OPERATOR_SYMBOL, _LOOKUP, _LOOKUP2: index; KT_OPERATOR_NUMBER with a name: the column of the
                       name in the text, from 1; else 0 */
    int32_t code;   /* kt_operator */
} kt_expression_term;

struct kt_expression {
    size_t count;
    bool is_angle; /* the value is an angle, rad (parse.c) */
    kt_expression_term term[];
};

/* The result of an operator, which is no lookup table; y is not read if the operator takes one value. */
double kt_operator_value(kt_operator code, double x, double y);

/* Whether an operator takes two values from the stack; else it is unary. */
static inline bool kt_operator_is_binary(kt_operator code) {
    return (code >= KT_OPERATOR_ADD && code <= KT_OPERATOR_NOT_EQUAL) || code == KT_OPERATOR_ATAN2 ||
           code == KT_OPERATOR_MIN || code == KT_OPERATOR_MAX || code == KT_OPERATOR_HYPOT ||
           code == KT_OPERATOR_LOOKUP2;
}

/* Whether an operator is a lookup table. */
static inline bool kt_operator_is_lookup(kt_operator code) {
    return code == KT_OPERATOR_LOOKUP || code == KT_OPERATOR_LOOKUP2;
}

/* Whether a term is a number or a symbol, which is put on the stack. */
static inline bool kt_operator_is_leaf(kt_operator code) {
    return code == KT_OPERATOR_NUMBER || code == KT_OPERATOR_SYMBOL;
}

/* A walk over the terms of a formula. The stack is an array of the caller, with values of any kind. */
typedef struct kt_postfix {
    const kt_expression_term *term, *next, *end; /* term: the current one */
    kt_operator code;
    bool is_leaf, is_binary;
    int at, other; /* the place of the term's value on the stack, at first of its first operand; of its last operand */
} kt_postfix;

static inline kt_postfix kt_postfix_begin(const kt_expression *expression) {
    return (kt_postfix){.next = expression->term, .end = expression->term + expression->count, .at = -1};
}

/* Moves to the next term; returns false after the last term. */
static inline bool kt_postfix_next(kt_postfix *walk) {
    if (walk->next == walk->end)
        return false;
    walk->term = walk->next++;
    walk->code = (kt_operator)walk->term->code;
    walk->is_leaf = kt_operator_is_leaf(walk->code);
    walk->is_binary = kt_operator_is_binary(walk->code);
    walk->at += walk->is_leaf - walk->is_binary;
    walk->other = walk->at + walk->is_binary;
    return true;
}

/* The order that kt_expression_next_breakpoint (formula_breakpoint.h) returns with a time at which its search was cut.
 * */
enum { KT_BREAKPOINT_CUT = 5 };

/* The operations on bounds that all searches of a run may execute together. A processor of 2026 executes them within 2
 * s. */
enum { KT_BREAKPOINT_OPERATIONS = 8000000 };

#endif
