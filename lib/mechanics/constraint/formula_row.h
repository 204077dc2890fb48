/* The contribution of a coupling's formula to its equation: phi = c . q + f(q) - offset. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_FORMULA_ROW_H
#define KT_CONSTRAINT_FORMULA_ROW_H

#include "constraint/gradient.h"
#include "kinetree/expression.h"

/* At positions and, if v is not NULL, velocities; arrays in the order of the loop's terms. */
typedef struct kt_formula_row {
    double value, drift;                                                /* f, and v' f_qq v */
    double by[KT_FORMULA_VARIABLE_MAX], twice[KT_FORMULA_VARIABLE_MAX]; /* f_k, and f_kk */
} kt_formula_row;

/* Whether a relation has a formula. */
static inline bool kt_has_formula_row(const kt_loop_record *loop) {
    return loop->term_count > 0 && loop->type == KT_LOOP_COUPLING && loop->form > 0;
}

static inline const kt_expression *kt_loop_formula(const kt_model *model, const kt_loop_record *loop) {
    return (const kt_expression *)(const void *)(model->number + loop->number);
}

/* O(terms * length of the formula). */
void kt_formula_row_evaluate(const kt_model *model, const kt_loop_record *loop, const double *q, const double *v,
                             kt_formula_row *row);

/* Adds one loop's part of kt_loop_gradient, and of kt_loop_matrices, where d_q may be NULL. Requires at->q.
 * O(terms^2 * length of the formula). */
void kt_formula_row_gradient(const kt_dual_motion *at, const kt_loop_record *loop, const kt_loop_sum *sum, double *by_q,
                             double *by_v);
void kt_formula_row_matrices(const kt_dual_motion *at, const kt_loop_record *loop, const double *lambda, bool moving,
                             double *d_q, double *by_q, double *by_v);

#endif
