/* Derivatives of the forces and of the equations of loops with respect to the state, one direction at a time
 * (support.h).
 *
 * A loop's equations depend only on the motion of its second end relative to the first: on the degrees of freedom
 * between the link that carries both, taken to be at rest, and the ends. The derivatives of its rows give those of
 *     phi'' = A a - b''
 *     W = sum lambda_r (moment_r + x_2 x force_r, force_r)
 * where W is the wrench on the second end; the first end receives the opposite. Those of
 *     phi' = A v - b'
 * give the change of the velocities that a change of the positions requires.
 */
#include "reduction/support.h"

/* Evaluates, along degree of freedom k, the derivative of b'' - A a (e), and the wrenches on the ends as dual
 * numbers. */
static void evaluate(const kt_support *w, const kt_loop_record *loop, int32_t k, kt_direction along,
                     const double *lambda, double *e, kt_end_wrench wrench[2]) {
    const kt_support_dof *by = &w->x->dof[k];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_loop_end end[2];
    for (int i = 0; i < 2; i++)
        end[i] = kt_support_end_dual(&w->end[i], by->end == i ? &by->motion : NULL, along);
    const int count = kt_loop_kinds_dual[loop->type]->evaluate(loop, w->x->model->number, end, w->x->t, rows);
    const kt_vector apart = end[1].point - end[0].point, alpha = end[1].alpha - end[0].alpha;
    const kt_vector linear = end[1].linear - end[0].linear - kt_cross(end[0].alpha, apart);
    kt_end_wrench sum = {kt_vector_zero(), kt_vector_zero()};
    for (int r = 0; r < count; r++) {
        e[r] = -kt_derivative_of(rows[r].drift + kt_dot(rows[r].moment, alpha) + kt_dot(rows[r].force, linear));
        sum.moment += kt_scale(lambda[r], rows[r].moment);
        sum.force += kt_scale(lambda[r], rows[r].force);
    }
    sum.moment += kt_cross(end[1].point, sum.force);
    wrench[0] = (kt_end_wrench){-sum.moment, -sum.force};
    wrench[1] = sum;
}

void kt_dual_loops(const kt_dual_motion *x, const double *lambda, double *d_q, double *e_q, double *e_v) {
    const kt_model *model = x->model;
    const size_t n = model->n.v, p = model->n.row;
    memset(e_q, 0, n * p * sizeof *e_q);
    memset(e_v, 0, n * p * sizeof *e_v);
    for (size_t l = 0; l < model->n.loop; l++) {
        const kt_loop_record *loop = &model->loop[l];
        const size_t row = (size_t)loop->equation;
        kt_support w = {.x = x};
        kt_end_wrench wrench[2];
        if (loop->term_count) /* a relation: A is constant, and b'' a function of time */
            continue;
        kt_support_find(&w, loop->ancestor, 2, loop->link, loop->frame);
        for (int32_t k = 0; k < w.count; k++) {
            const size_t j = (size_t)x->dof[k].v;
            evaluate(&w, loop, k, KT_BY_POSITION, lambda + row, e_q + j * p + row, wrench);
            kt_support_subtract(&w, k, KT_BY_POSITION, wrench, d_q + j * n);
            evaluate(&w, loop, k, KT_BY_RATE, lambda + row, e_v + j * p + row, wrench);
        }
    }
}

/* Writes the derivative of A v - b' along degree of freedom k to c. */
static void evaluate_rates(const kt_support *w, const kt_loop_record *loop, int32_t k, double *c) {
    const kt_support_dof *by = &w->x->dof[k];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_loop_end end[2];
    for (int i = 0; i < 2; i++)
        end[i] = kt_support_end_dual(&w->end[i], by->end == i ? &by->motion : NULL, KT_BY_POSITION);
    const int count = kt_loop_kinds_dual[loop->type]->evaluate(loop, w->x->model->number, end, w->x->t, rows);
    const kt_vector apart = end[1].point - end[0].point, omega = end[1].omega - end[0].omega;
    const kt_vector velocity = end[1].velocity - end[0].velocity - kt_cross(end[0].omega, apart);
    for (int r = 0; r < count; r++)
        c[r] = kt_derivative_of(rows[r].rate + kt_dot(rows[r].moment, omega) + kt_dot(rows[r].force, velocity));
}

void kt_dual_loop_rates(const kt_dual_motion *x, double *c_q) {
    const kt_model *model = x->model;
    const size_t p = model->n.row;
    memset(c_q, 0, model->n.v * p * sizeof *c_q);
    for (size_t l = 0; l < model->n.loop; l++) {
        const kt_loop_record *loop = &model->loop[l];
        kt_support w = {.x = x};
        if (loop->term_count) /* a relation: A is constant, and b' a function of time */
            continue;
        kt_support_find(&w, loop->ancestor, 2, loop->link, loop->frame);
        for (int32_t k = 0; k < w.count; k++)
            evaluate_rates(&w, loop, k, c_q + (size_t)x->dof[k].v * p + (size_t)loop->equation);
    }
}
