/* Functions of time as nodes, with the formulas of model/curve.c. The rates of functions follow by the chain rule. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/recursion.h"
#include "expression/expression.h"
#include "expression/lookup.h"
#include "model/function_formula.h"

#include <string.h>

static const kt_expression *formula_of_time(const kt_model *model, const kt_curve *curve) {
    return (const kt_expression *)(const void *)(model->number + curve->first);
}

static kt_curve part_of_curve(const kt_model *model, const kt_curve *curve, int i) {
    kt_curve part;
    memcpy(&part, model->number + curve->first + (size_t)i * (sizeof part / sizeof(double)), sizeof part);
    return part;
}

/* How many parts a curve has; a sum or a product. */
static int count_parts(const kt_curve *curve) {
    return curve->type == KT_FUNCTION_SUM || curve->type == KT_FUNCTION_PRODUCT ? curve->count : 0;
}

bool kt_code_has_curve(const kt_model *model, const kt_curve *curve) {
    for (int i = 0; i < count_parts(curve); i++) {
        const kt_curve part = part_of_curve(model, curve, i);
        if (!kt_code_has_curve(model, &part))
            return false;
    }
    return !kt_curve_follows(curve) && !(curve->type == KT_FUNCTION_TABLE && curve->count > KT_CODE_TABLE_ROWS);
}

void kt_code_hash_curve(const kt_model *model, const kt_curve *curve, kt_code_hash *hash, uint64_t *h) {
    const int type = (int)curve->type, numbers = curve->type == KT_FUNCTION_TABLE        ? KT_PIECE_SIZE * curve->count
                                                 : curve->type == KT_FUNCTION_POLYNOMIAL ? curve->count
                                                                                         : 0;
    const double fixed[4] = {curve->a, curve->b, curve->c, curve->d};
    const int is_zero = curve->a == 0.0;
    hash(h, &type, sizeof type);
    if (kt_curve_rests(curve))
        hash(h, &is_zero, sizeof is_zero);
    else
        hash(h, fixed, sizeof fixed);
    hash(h, model->number + curve->first, (size_t)numbers * sizeof(double));
    if (curve->type == KT_FUNCTION_EXPRESSION)
        kt_code_hash_formula(formula_of_time(model, curve), hash, h);
    for (int i = 0; i < count_parts(curve); i++) {
        const kt_curve part = part_of_curve(model, curve, i);
        kt_code_hash_curve(model, &part, hash, h);
    }
}

/* s = (t - c) / (d - c) */
static kt_op share_of_time(kt_graph *g, const kt_curve *curve, kt_op t) {
    const kt_op range = kt_op_number(g, curve->d - curve->c);
    return kt_op_divide(g, kt_op_subtract(g, t, kt_op_number(g, curve->c)), range);
}

/* a + (b - a) s^2 (3 - 2 s), and a and b outside */
static kt_op ramp_of_time(kt_graph *g, const kt_curve *curve, kt_op t) {
    const kt_op s = share_of_time(g, curve, t), one = kt_op_number(g, 1.0);
    const kt_op twice = kt_op_scale(g, 2.0, s), slope = kt_op_subtract(g, kt_op_number(g, 3.0), twice);
    const kt_op shape = kt_op_multiply(g, kt_op_multiply(g, s, s), slope);
    const kt_op first = kt_op_number(g, curve->a), last = kt_op_number(g, curve->b);
    const kt_op inside = kt_op_add(g, first, kt_op_scale(g, curve->b - curve->a, shape));
    return kt_op_choose(g, s, kt_op_choose(g, kt_op_subtract(g, one, s), inside, last), first);
}

/* a (4 s (1 - s))^3, and 0 outside */
static kt_op bump_of_time(kt_graph *g, const kt_curve *curve, kt_op t) {
    const kt_op s = share_of_time(g, curve, t), zero = kt_op_number(g, 0.0);
    const kt_op left = kt_op_subtract(g, kt_op_number(g, 1.0), s);
    const kt_op u = kt_op_scale(g, 4.0, kt_op_multiply(g, s, left));
    const kt_op cube = kt_op_multiply(g, u, kt_op_multiply(g, u, u));
    const kt_op inside = kt_op_scale(g, curve->a, cube);
    return kt_op_choose(g, s, kt_op_choose(g, left, inside, zero), zero);
}

static kt_op polynomial_of_time(kt_graph *g, const double *c, int count, kt_op t) {
    kt_op sum = kt_op_number(g, 0.0);
    for (int k = count - 1; k >= 0; k--) {
        const kt_op constant = kt_op_number(g, c[k]);
        sum = kt_op_add(g, kt_op_multiply(g, sum, t), constant);
    }
    return sum;
}

/* Any function but a constant. */
static kt_op function_of_time(const kt_model *model, kt_graph *g, const kt_curve *curve) {
    const kt_op t = kt_op_input(g, KT_OP_TIME, 0);
    const bool is_sum = curve->type == KT_FUNCTION_SUM;
    const double *numbers = model->number + curve->first;
    kt_op angle, all = kt_op_number(g, is_sum ? 0.0 : 1.0);
    switch (curve->type) {
    case KT_FUNCTION_SINE:
        angle = kt_op_number(g, curve->d);
        angle = kt_op_add(g, kt_op_scale(g, curve->c, t), angle);
        all = kt_op_scale(g, curve->b, kt_op_call(g, KT_OP_SIN, angle, -1));
        return kt_op_add(g, kt_op_number(g, curve->a), all);
    case KT_FUNCTION_RAMP:
        return ramp_of_time(g, curve, t);
    case KT_FUNCTION_POLYNOMIAL:
        return polynomial_of_time(g, numbers, curve->count, t);
    case KT_FUNCTION_TABLE:
        return kt_code_rows(g, numbers, curve->count, t);
    case KT_FUNCTION_BUMP:
        return bump_of_time(g, curve, t);
    case KT_FUNCTION_EXPRESSION:
        return kt_code_formula(g, formula_of_time(model, curve), &t);
    default: /* sums and products */
        for (int i = 0; i < count_parts(curve); i++) {
            const kt_curve part = part_of_curve(model, curve, i);
            const kt_op value = kt_curve_rests(&part) ? kt_op_number(g, part.a) : function_of_time(model, g, &part);
            all = is_sum ? kt_op_add(g, all, value) : kt_op_multiply(g, all, value);
        }
        return all;
    }
}

kt_op kt_code_curve(kt_code_tree *tree, const kt_curve *curve, const char *prefix, const char *key,
                    const char *meaning) {
    return kt_curve_rests(curve) ? kt_code_number(tree, prefix, key, meaning, curve->a)
                                 : function_of_time(tree->model, tree->graph, curve);
}
