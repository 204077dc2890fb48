/* Parts of a formula that depend on a single symbol. For the symbol t in -k q + 3 step(t - 2) + v exp(-t), the parts
 * are 3 step(t - 2) and exp(-t). In postfix order the terms of a part are neighbours. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/part.h"
#include "expression/lookup.h"

/* The dependence of a value on the stack. */
typedef enum kt_source { OF_NOTHING, OF_SYMBOL, OF_OTHERS } kt_source;

typedef struct kt_value {
    size_t begin, end; /* its terms */
    kt_source source;
} kt_value;

typedef struct kt_search {
    const kt_expression *expression;
    kt_expression_part *found;
    void *user;
} kt_search;

static void hand_over_part(const kt_search *s, const kt_value *value) {
    const size_t count = value->end - value->begin;
    if (value->source == OF_SYMBOL && count > 1)
        s->found(s->user, s->expression->term + value->begin, count);
}

/* The value of an operator. If it depends on other symbols, the arguments that depend on the symbol alone are complete
 * parts, and are reported. */
static kt_value join_arguments(const kt_search *s, const kt_value *x, const kt_value *y, size_t end) {
    const kt_source source = x->source > y->source ? x->source : y->source;
    if (source == OF_OTHERS) {
        hand_over_part(s, x);
        if (y != x)
            hand_over_part(s, y);
    }
    return (kt_value){x->begin, end, source};
}

void kt_expression_parts(const kt_expression *expression, int32_t symbol, kt_expression_part *found, void *user) {
    const kt_search s = {expression, found, user};
    kt_value stack[KT_EXPRESSION_DEPTH_MAX] = {{0, 0, OF_NOTHING}};
    for (kt_postfix w = kt_postfix_begin(expression); kt_postfix_next(&w);) {
        const size_t end = (size_t)(w.next - expression->term);
        const kt_source source = w.code == KT_OPERATOR_NUMBER ? OF_NOTHING
                                 : w.term->symbol == symbol   ? OF_SYMBOL
                                                              : OF_OTHERS;
        stack[w.at] =
            w.is_leaf ? (kt_value){end - 1, end, source} : join_arguments(&s, &stack[w.at], &stack[w.other], end);
    }
    hand_over_part(&s, &stack[0]);
}

size_t kt_expression_part_size(size_t count) { return sizeof(kt_expression) + count * sizeof(kt_expression_term); }

void kt_expression_part_copy(const kt_expression_term *term, size_t count, void *memory) {
    kt_expression *to = memory;
    *to = (kt_expression){.count = count};
    kt_expression_copy_terms(term, count, to->term);
    for (size_t i = 0; i < count; i++)
        to->term[i].symbol = kt_operator_is_lookup((kt_operator)term[i].code) ? term[i].symbol : 0;
}
