/* Derivatives of the forces and of the equations of loops with respect to the state, one direction at a time
 * (support.h).
 *
 * A loop's equations depend only on the motion of its second end relative to the first. Thus the equations depend on
 * the degrees of freedom between the ends and the link that carries both ends, which counts as at rest. The derivatives
 * of the loop's rows give those of
 *     phi'' = A a - b''
 *     W = sum lambda_r (moment_r + x_2 x force_r, force_r)
 * where W is the wrench on the second end; the first end receives the opposite. The derivatives of
 *     phi' = A v - b'
 * give the change of the velocities that a change of the positions requires.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/formula_row.h"
#include "constraint/rejecting_loop.h"
#include "constraint/support.h"

/* Evaluates the rows as dual numbers along degree of freedom k; returns their number. */
static int evaluate_rows(const kt_support *w, const kt_loop_record *loop, int32_t k, kt_direction along,
                         kt_loop_end end[2], kt_loop_row *rows) {
    const kt_support_dof *by = &w->x->dof[k];
    for (int i = 0; i < 2; i++)
        end[i] = kt_support_end_dual(&w->end[i], by->end == i ? &by->motion : NULL, along);
    const int count = kt_loop_kinds_dual[loop->kind]->evaluate(loop, w->x->model->number, end, w->x->t, rows);
    if (loop->equations != NULL)
        kt_stop_store_code(w->x->model, w->x->data, loop, kt_value(rows[0].rate));
    return count;
}

/* The wrenches that the multipliers lambda exert on the ends. */
static void sum_wrenches(const kt_loop_end end[2], const kt_loop_row *rows, int count, const double *lambda,
                         kt_end_wrench wrench[2]) {
    kt_end_wrench sum = {kt_vector_zero(), kt_vector_zero()};
    for (int r = 0; r < count; r++) {
        sum.moment += kt_scale(lambda[r], rows[r].moment);
        sum.force += kt_scale(lambda[r], rows[r].force);
    }
    sum.moment += kt_cross(end[1].point, sum.force);
    wrench[0] = (kt_end_wrench){-sum.moment, -sum.force};
    wrench[1] = sum;
}

/* The derivatives of A a - b''. */
static void write_accelerations(const kt_loop_end end[2], const kt_loop_row *rows, int count, double *e) {
    const kt_vector apart = end[1].point - end[0].point, alpha = end[1].alpha - end[0].alpha;
    const kt_vector linear = end[1].linear - end[0].linear - kt_cross(end[0].alpha, apart);
    for (int r = 0; r < count; r++)
        e[r] = kt_derivative_of(rows[r].drift + kt_dot(rows[r].moment, alpha) + kt_dot(rows[r].force, linear));
}

/* Writes the rates of the rows, and the derivatives of A v. */
static void write_row_rates(const kt_loop_end end[2], const kt_loop_row *rows, int count, double *c) {
    const kt_vector apart = end[1].point - end[0].point, omega = end[1].omega - end[0].omega;
    const kt_vector velocity = end[1].velocity - end[0].velocity - kt_cross(end[0].omega, apart);
    for (int r = 0; r < count; r++)
        c[r] = kt_derivative_of(kt_dot(rows[r].moment, omega) + kt_dot(rows[r].force, velocity));
}

/* Writes the derivative of A v - b' along degree of freedom k to c. */
static void evaluate_rates(const kt_support *w, const kt_loop_record *loop, int32_t k, double *c) {
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_loop_end end[2];
    const int count = evaluate_rows(w, loop, k, KT_BY_POSITION, end, rows);
    write_row_rates(end, rows, count, c);
    for (int r = 0; r < count; r++)
        c[r] += kt_derivative_of(rows[r].rate);
}

void kt_dual_loop_rates(const kt_dual_motion *x, double *c_q) {
    const kt_model *model = x->model;
    const size_t p = model->n.row;
    memset(c_q, 0, model->n.v * p * sizeof *c_q);
    for (size_t l = 0; l < model->n.loop; l++) {
        const kt_loop_record *loop = &model->loop[l];
        kt_support w = {.x = x};
        if (kt_has_formula_row(loop))
            kt_formula_row_matrices(x, loop, NULL, false, NULL, c_q, NULL);
        if (loop->term_count) /* a relation: A is constant else, and b' a function of time; or off */
            continue;
        kt_support_find(&w, loop->ancestor, 2, loop->link, loop->frame);
        for (int32_t k = 0; k < w.count; k++)
            evaluate_rates(&w, loop, k, c_q + (size_t)x->dof[k].v * p + (size_t)loop->equation);
    }
}

/* ---- of sums ----------------------------------------------------------------------------------------------------- */

static double weighted_sum(const double *weight, const double *x, int count) {
    double sum = 0.0;
    for (int r = 0; r < count && weight; r++)
        sum += weight[r] * x[r];
    return sum;
}

static const double *weights_of(const double *weight, const kt_loop_record *loop) {
    return weight ? weight + loop->equation : NULL;
}

/* The derivative of lambda . A p along degree of freedom k, from the wrenches of lambda: the rates p times the
 * derivatives of the joint forces. */
static double differentiate_power(const kt_support *w, int32_t k, const kt_end_wrench wrench[2], const double *p) {
    double sum = 0.0;
    for (int32_t i = 0; i < w->count; i++)
        sum += p[w->x->dof[i].v] * kt_support_derivative(w, i, k, KT_BY_POSITION, wrench);
    return sum;
}

/* Adds the derivatives of the sum (kt_loop_sum) by positions to by_q and, if `moving`, by velocities to by_v. The sum
 * has the terms
 *     lambda_0 . A p_0      from the wrenches of lambda_0
 *     lambda_1 . A p_1      not `moving`: from the rows' rates with p_1 as velocities
 *     pi . (A v)'           `moving`: from the rows' accelerations
 * For each degree of freedom, the rows are evaluated with derivatives by its position, and if `moving` once more with
 * derivatives by its rate. */
static void add_sum_derivatives(kt_support *w, const kt_loop_record *loop, const kt_loop_sum *sum, bool moving,
                                double *by_q, double *by_v) {
    const double *lambda = moving || !sum->pi ? weights_of(sum->lambda[0], loop) : NULL;
    for (int32_t k = 0; k < w->count; k++) {
        const int32_t j = w->x->dof[k].v;
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        kt_loop_end end[2];
        kt_end_wrench wrench[2];
        double x[KT_LOOP_ROW_MAX] = {0.0};
        int count = evaluate_rows(w, loop, k, KT_BY_POSITION, end, rows);
        (moving ? write_accelerations : write_row_rates)(end, rows, count, x);
        by_q[j] += weighted_sum(weights_of(moving ? sum->pi : sum->lambda[1], loop), x, count);
        if (lambda) {
            sum_wrenches(end, rows, count, lambda, wrench);
            by_q[j] += differentiate_power(w, k, wrench, sum->p[0]);
        }
        if (!moving)
            continue;
        count = evaluate_rows(w, loop, k, KT_BY_RATE, end, rows);
        write_accelerations(end, rows, count, x);
        by_v[j] += weighted_sum(weights_of(sum->pi, loop), x, count);
    }
}

/* NOLINTBEGIN(readability-non-const-parameter): the chain is written by way of the support */
void kt_dual_loop_gradient(const kt_dual_motion *at, int32_t index, const kt_loop_sum *sum, double *by_q,
                           double *by_v) {
    const kt_model *model = at->model;
    const kt_loop_record *loop = &model->loop[index];
    for (int moving = 0; moving < 2; moving++) {
        if (moving ? !sum->pi : sum->pi && !sum->lambda[1])
            continue;
        const double *v = moving ? sum->v : sum->p[1];
        kt_dual_motion x = *at;
        x.v = v ? v : model->zero;
        x.a = moving ? sum->a : model->zero;
        kt_support w = {.x = &x};
        kt_support_find(&w, loop->ancestor, 2, loop->link, loop->frame);
        add_sum_derivatives(&w, loop, sum, moving, by_q, by_v);
    }
}

/* The derivatives of b'' - A a. */
static void write_slack(const kt_loop_end end[2], const kt_loop_row *rows, int count, double *e) {
    write_accelerations(end, rows, count, e);
    for (int r = 0; r < count; r++)
        e[r] = -e[r];
}

/* Along each degree of freedom on the loop's paths: d_q -= d(A' lambda)/dq. If `moving`, by_q and by_v receive the
 * derivatives of b'' - A a, otherwise by_q receives d(A v)/dq. Other columns are untouched. */
void kt_dual_loop_matrices(const kt_dual_motion *at, int32_t index, const double *lambda, bool moving, double *d_q,
                           double *by_q, double *by_v) {
    const kt_model *model = at->model;
    const kt_loop_record *loop = &model->loop[index];
    const size_t row = (size_t)loop->equation;
    kt_support w = {.x = at};
    kt_support_find(&w, loop->ancestor, 2, loop->link, loop->frame);
    for (int32_t k = 0; k < w.count; k++) {
        const size_t j = (size_t)at->dof[k].v;
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        kt_loop_end end[2];
        kt_end_wrench wrench[2];
        int count = evaluate_rows(&w, loop, k, KT_BY_POSITION, end, rows);
        (moving ? write_slack : write_row_rates)(end, rows, count, by_q + j * model->n.row + row);
        sum_wrenches(end, rows, count, lambda + row, wrench);
        kt_support_subtract(&w, k, KT_BY_POSITION, wrench, d_q + j * model->n.v);
        if (!moving)
            continue;
        count = evaluate_rows(&w, loop, k, KT_BY_RATE, end, rows);
        write_slack(end, rows, count, by_v + j * model->n.row + row);
    }
}
/* NOLINTEND(readability-non-const-parameter) */
