/* The formula f of a coupling: phi = c . q + f(q) - offset, with
 *     phi' = (c_k + f_k) v_k,   phi'' = (c_k + f_k) a_k + f_kl v_k v_l
 * so that f_kl v_k v_l is the drift. Derivatives along a line q + s x are exact (kt_expression_taylor); derivatives
 * along two lines give the mixed derivatives,
 *     2 f_kl = D2(e_k + e_l) - D2(e_k) - D2(e_l),   D2(x) = f_kl x_k x_l
 * and third derivatives likewise (kt_expression_third) those of the drift, with any s,
 *     6 s f_jkl v_k v_l = D3(v + s e_j) - D3(v - s e_j) - 2 D3(s e_j)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/formula_row.h"

#include "expression/third.h"

#include <math.h>

enum { MOST = KT_FORMULA_VARIABLE_MAX };

static const kt_link *term_link_of(const kt_model *model, const kt_loop_record *loop, int k) {
    return &model->link[model->term[loop->term + k].link];
}

/* Copies the numbers of the terms' joints from those of all joints: positions, or velocities and accelerations. */
static void gather_terms(const kt_model *model, const kt_loop_record *loop, bool of_positions, const double *from,
                         double to[MOST]) {
    for (int k = 0; k < loop->term_count; k++) {
        const kt_link *link = term_link_of(model, loop, k);
        to[k] = from[of_positions ? link->q : link->v];
    }
}

void kt_formula_row_evaluate(const kt_model *model, const kt_loop_record *loop, const double *q, const double *v,
                             kt_formula_row *row) {
    const kt_expression *f = kt_loop_formula(model, loop);
    double at[MOST], along[MOST] = {0.0}, y[3];
    gather_terms(model, loop, true, q, at);
    row->value = kt_expression_evaluate(f, at);
    for (int k = 0; k < loop->term_count; k++) {
        along[k] = 1.0;
        kt_expression_taylor(f, at, along, NULL, y);
        along[k] = 0.0;
        row->by[k] = y[1];
        row->twice[k] = y[2];
    }
    y[2] = 0.0;
    if (v) {
        gather_terms(model, loop, false, v, along);
        kt_expression_taylor(f, at, along, NULL, y);
    }
    row->drift = y[2];
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

static double twice_along(const kt_expression *f, const double at[MOST], const double x[MOST]) {
    double y[3];
    kt_expression_taylor(f, at, x, NULL, y);
    return y[2];
}

/* Writes the second derivatives h[k][l] = f_kl of a formula in n variables. */
static void find_hessian(const kt_expression *f, int n, const double at[MOST], double h[MOST][MOST]) {
    double x[MOST] = {0.0};
    for (int k = 0; k < n; k++) {
        x[k] = 1.0;
        h[k][k] = twice_along(f, at, x);
        for (int l = 0; l < k; l++) {
            x[l] = 1.0;
            h[k][l] = h[l][k] = 0.5 * (twice_along(f, at, x) - h[k][k] - h[l][l]);
            x[l] = 0.0;
        }
        x[k] = 0.0;
    }
}

/* f_jkl v_k v_l; s has the size of v, so that no digits are lost. */
static double rate_of_drift(const kt_expression *f, int n, const double at[MOST], const double v[MOST], int j) {
    double x[MOST] = {0.0}, s = 0.0;
    for (int k = 0; k < n; k++)
        s = fmax(s, fabs(v[k]));
    if (!(s > 0.0))
        return 0.0;
    x[j] = s;
    double sum = -2.0 * kt_expression_third(f, at, x);
    for (int side = -1; side <= 1; side += 2) {
        for (int k = 0; k < n; k++)
            x[k] = v[k] + (k == j ? side * s : 0.0);
        sum += side * kt_expression_third(f, at, x);
    }
    return sum / (6.0 * s);
}

static double row_product(const double row[MOST], const double x[MOST], int n) {
    double sum = 0.0;
    for (int k = 0; k < n; k++)
        sum += row[k] * x[k];
    return sum;
}

void kt_formula_row_gradient(const kt_dual_motion *at, const kt_loop_record *loop, const kt_loop_sum *sum, double *by_q,
                             double *by_v) {
    const kt_model *model = at->model;
    const kt_expression *f = kt_loop_formula(model, loop);
    const int n = loop->term_count;
    double q[MOST] = {0.0}, x[MOST], a[MOST], h[MOST][MOST];
    gather_terms(model, loop, true, at->q, q);
    find_hessian(f, n, q, h);
    for (int i = 0; i < 2; i++) {
        if (!sum->lambda[i])
            continue;
        gather_terms(model, loop, false, sum->p[i], x);
        for (int j = 0; j < n; j++)
            by_q[term_link_of(model, loop, j)->v] += sum->lambda[i][loop->equation] * row_product(h[j], x, n);
    }
    if (!sum->pi)
        return;
    const double pi = sum->pi[loop->equation];
    gather_terms(model, loop, false, sum->v ? sum->v : model->zero, x);
    gather_terms(model, loop, false, sum->a ? sum->a : model->zero, a);
    for (int j = 0; j < n; j++) {
        const int32_t to = term_link_of(model, loop, j)->v;
        by_q[to] += pi * (rate_of_drift(f, n, q, x, j) + row_product(h[j], a, n));
        by_v[to] += pi * 2.0 * row_product(h[j], x, n);
    }
}

void kt_formula_row_matrices(const kt_dual_motion *at, const kt_loop_record *loop, const double *lambda, bool moving,
                             double *d_q, double *by_q, double *by_v) {
    const kt_model *model = at->model;
    const kt_expression *f = kt_loop_formula(model, loop);
    const int n = loop->term_count;
    const size_t nv = model->n.v, p = model->n.row, row = (size_t)loop->equation;
    double q[MOST] = {0.0}, v[MOST], a[MOST], h[MOST][MOST];
    gather_terms(model, loop, true, at->q, q);
    gather_terms(model, loop, false, at->v, v);
    gather_terms(model, loop, false, moving ? at->a : model->zero, a);
    find_hessian(f, n, q, h);
    for (int j = 0; j < n; j++) {
        const size_t to = (size_t)term_link_of(model, loop, j)->v;
        const double rate = row_product(h[j], v, n);
        by_q[to * p + row] = rate;
        if (moving) {
            by_q[to * p + row] = -rate_of_drift(f, n, q, v, j) - row_product(h[j], a, n);
            by_v[to * p + row] = -2.0 * rate;
        }
        for (int k = 0; k < n && d_q; k++)
            d_q[to * nv + (size_t)term_link_of(model, loop, k)->v] -= lambda[row] * h[k][j];
    }
}
