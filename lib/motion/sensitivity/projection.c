/* The derivative of the projection onto the loops. An iteration of the positions moves q by x. Finally, the velocities
 * are moved by x:
 *
 *     W x = J' lambda,   J x = -r            r = phi, W = 1 or M; r = A v - b', W = M
 *
 * Along a change xi of q (and dv of v), at fixed x and lambda,
 *
 *     W dx - J' dlambda = G xi,   G = d(J' lambda - W x)/dq
 *     J dx = E xi - J dv,         E = -d(r + J x)/dq
 *
 * For a parameter, -(dW/dp) x and -dr/dp are added to the right. With J' P = [Q1 Z] [R1; 0] as for the accelerations
 * [MSD 7.33, 7.34]
 *
 *     dx = Q1 y + Z z,   R1' y = right-hand side,   (Z' W Z) z = Z' G xi - (W Z)' Q1 y
 *
 * This form serves few loops (jacobian_qr.h). Otherwise the equations are solved along the tree (kkt.h), in O(bodies) a
 * column except the products with G, E and J. Each loop's equations have entries in these matrices only at the
 * coordinates on its paths. For positions, d phi/dq = J, so that E = -J - d(J x)/dq. After the last iteration x = 0,
 * and an iteration without a move projects the changes. For velocities, r + A x = A v+ - b' at the new velocities.
 *
 * Next to a singular position, the manifold bends as x y = d (evaluate/singular_crossing.c). Let s be the size of the
 * smallest direction. A residual c turns the tangent by c / s^2. The projection of velocities changes with the
 * curvature of the path, 2 d / s^3. A residual c changes its derivative with respect to q by 2 c / s^3 for each unit of
 * speed. Derivatives are rejected if their error exceeds KT_KNOWN of the largest derivative.
 *
 * d(J' lambda)/dq, d(J x)/dq and d(A v - b')/dq are exact, in closed form or by dual numbers (gradient.h). The matrix
 * d(M x)/dq is the derivative of inverse dynamics at rest with the accelerations x and without gravity. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/project.h"
#include "constraint/gradient.h"
#include "derivative/loop_response.h"
#include "derivative/stiffness.h"
#include "evaluate/evaluate.h"
#include "kinetree/joint.h"
#include "linear/cholesky.h"
#include "sensitivity/sensitivity.h"

#include <math.h>
#include <string.h>

/* The largest residuals after a projection, relative to their scales. */
#define LEFT (4.0 * KT_CLOSED)

KT_ARENA_ARRAYS(place_arrays, kt_projection_work, KT_PROJECTION_FIELDS, const kt_model *model, size_t n, size_t p,
                size_t m, size_t factors)

/* Initialises w with its arrays in `memory`, unless that is NULL. Returns the bytes of the arrays. */
size_t kt_projection_place(kt_projection_work *w, void *memory, const kt_model *model) {
    const size_t p = model->n.row, n = p ? model->n.v : 0;
    const bool dense = kt_linearized_is_dense(model);
    const size_t dense_factors = dense ? kt_jacobian_qr_init(NULL, NULL, n, p) : 0;
    const size_t factors = dense || !p ? dense_factors : kt_kkt_init(NULL, NULL, model, NULL);
    if (memory)
        *w = (kt_projection_work){.model = model, .n = n, .p = p, .dense = dense};
    const size_t bytes = place_arrays(w, memory, model, n, p, dense ? n : 0, factors);
    if (memory && dense)
        (void)kt_jacobian_qr_init(&w->qr, w->factors, n, p);
    return bytes;
}

/* ---- the linear equations ---------------------------------------------------------------------------------------- */

/* Computes W = M, W Z, and the factors of Z' W Z. In the identity metric, W = 1 and Z'Z = 1 need no matrices. */
static kt_status apply_mass_to_basis(kt_projection_work *w, const double *q, kt_metric metric, kt_error *error) {
    const size_t n = w->n, r = (size_t)w->qr.rank, f = n - r;
    if (metric != KT_METRIC_MASS)
        return KT_OK;
    const kt_status status = kt_dynamics_mass(w->model, w->data, q, w->metric, error);
    if (status != KT_OK)
        return status;
    for (size_t c = 0; c < f; c++) {
        double *half = w->half + c * n;
        kt_dense_apply(w->metric, (int)n, (int)n, w->qr.basis + (r + c) * n, half);
        for (size_t i = 0; i < f; i++)
            w->reduced[c * f + i] = kt_dense_dot(w->qr.basis + (r + i) * n, half, (int)n);
    }
    if (kt_dense_cholesky(w->reduced, f, (int)f, NULL))
        return KT_OK;
    return kt_inertia_reject("derivatives", error);
}

/* Factors the equations at q for the derivatives of a projection. Rejects a singular position, where there are no
 * derivatives. */
static kt_status factor_along(kt_projection_work *w, kt_rows rows, const double *q, kt_metric metric, kt_error *error) {
    const kt_model *model = w->model;
    (void)kt_kkt_init(&w->kkt, w->factors, model, w->data);
    const kt_status status = kt_kkt_factor(&w->kkt, rows, metric, w->t, q, error);
    for (size_t g = 0; g < model->n.group && status == KT_OK; g++)
        if (w->data->rank[g] < model->group[g].rank[rows])
            return kt_jacobian_singular(error);
    return status;
}

/* Factors the equations of one kind, and W. */
static kt_status factor_projected(kt_projection_work *w, kt_rows rows, const double *q, kt_metric metric,
                                  kt_error *error) {
    if (!w->dense)
        return factor_along(w, rows, q, metric, error);
    const kt_status status = kt_jacobian_qr_factor(&w->qr, w->model, rows, w->jacobian, error);
    return status == KT_OK ? apply_mass_to_basis(w, q, metric, error) : status;
}

/* Replaces x by the solution with A x = e that is nearest to x in the metric. */
static void solve_dense(const kt_projection_work *w, kt_metric metric, const double *e, double *x) {
    const size_t n = w->n, r = (size_t)w->qr.rank;
    double *y = w->work, *z = y + r, *across = w->work + n;
    kt_jacobian_qr_solve_lower(&w->qr, e, y);
    if (metric == KT_METRIC_MASS)
        kt_dense_apply(w->qr.basis, (int)n, (int)r, y, across);
    for (size_t k = 0; k < n - r; k++) {
        z[k] = kt_dense_dot(w->qr.basis + (r + k) * n, x, (int)n);
        if (metric == KT_METRIC_MASS)
            z[k] -= kt_dense_dot(w->half + k * n, across, (int)n);
    }
    if (metric == KT_METRIC_MASS)
        kt_dense_solve(w->reduced, (int)(n - r), z);
    kt_dense_apply(w->qr.basis, (int)n, (int)n, y, x);
}

/* Overwrites columns g in x with x of W x - J' lambda = g, J x = e. */
static void solve_projected(const kt_projection_work *w, kt_metric metric, size_t columns, const double *e, double *x) {
    if (!w->dense)
        kt_kkt_solve(&w->kkt, columns, x, e);
    for (size_t c = 0; c < columns && w->dense; c++)
        solve_dense(w, metric, e + c * w->p, x + c * w->n);
}

/* Computes lambda from J' lambda = W x. `momentum` is M x. */
static kt_status find_projection_multipliers(kt_projection_work *w, const double *momentum, kt_error *error) {
    if (!w->dense)
        return kt_loops_multipliers_of(w->model, w->data, momentum, w->lambda, error);
    kt_jacobian_qr_multipliers(&w->qr, momentum, w->lambda);
    return KT_OK;
}

/* ---- their derivatives ------------------------------------------------------------------------------------------- */

/* Adds d(M x)/dq to w->force, row by row, as the gradients of (M x)_k. Writes M x into w->by_x. */
static kt_status differentiate_momentum(kt_projection_work *w, const double *q, kt_error *error) {
    const kt_gradient row = {w->by_inertia, w->residue, w->by_x, w->by_g, w->links};
    const kt_dynamic_state rest = {.q = q, .v = w->model->zero};
    kt_status status = KT_OK;
    for (size_t k = 0; k < w->n && status == KT_OK; k++) {
        w->unit[k] = 1.0;
        status = kt_gradient_evaluate(w->model, w->data, &rest, w->x, KT_GRADIENT_POSED | KT_GRADIENT_WEIGHTLESS,
                                      w->unit, &row, error);
        w->unit[k] = 0.0;
        for (size_t j = 0; j < w->n && status == KT_OK; j++)
            w->force[j * w->n + k] += w->by_inertia[j];
    }
    for (size_t i = 0; i < w->n && status == KT_OK; i++)
        w->by_x[i] += w->model->armature[i] * w->x[i];
    return status;
}

/* Computes lambda, G and E (in w->force and, negated, in w->equation). v: the velocities after the projection. NULL:
 * positions, for which r + J x has the derivative J + d(J x)/dq. */
static kt_status differentiate_projected(kt_projection_work *w, const double *q, kt_metric metric, const double *v,
                                         kt_error *error) {
    const size_t n = w->n;
    kt_status status = KT_OK;
    memset(w->force, 0, n * n * sizeof *w->force);
    memset(w->unit, 0, n * sizeof *w->unit);
    if (metric == KT_METRIC_MASS)
        status = differentiate_momentum(w, q, error);
    if (status == KT_OK && kt_loop_gradient_reads_space(w->model))
        status = kt_motion_update(w->model, w->data, q, NULL, NULL, error);
    if (status == KT_OK)
        status = find_projection_multipliers(w, metric == KT_METRIC_MASS ? w->by_x : w->x, error);
    if (status != KT_OK)
        return status;
    const kt_dual_motion at = {.model = w->model,
                               .data = w->data,
                               .t = w->t,
                               .q = q,
                               .v = v ? v : w->x,
                               .a = w->model->zero,
                               .dof = w->dof,
                               .chain = w->chain};
    kt_loop_matrices(&at, w->lambda, false, w->force, w->equation, NULL);
    for (size_t i = 0; i < n * n; i++)
        w->force[i] = -w->force[i];
    for (size_t i = 0; i < n * w->p && !v; i++)
        w->equation[i] += w->jacobian[i];
    return KT_OK;
}

/* Lists the nonzero entries of a matrix. */
static kt_sparse find_entries(size_t rows, size_t columns, const double *value, size_t *begin, int32_t *row) {
    size_t count = 0;
    for (size_t j = 0; j < columns; j++) {
        begin[j] = count;
        for (size_t i = 0; i < rows; i++)
            if (value[j * rows + i] != 0.0)
                row[count++] = (int32_t)i;
    }
    begin[columns] = count;
    return (kt_sparse){rows, columns, value, begin, row};
}

/* The kind of a linear step. */
typedef struct linear_step {
    kt_metric metric; /* W: M or 1 */
    bool moves;       /* x is not zero: there are G and E; otherwise G = 0 and E = J */
    bool fast;        /* velocities: dv is closed, too */
} linear_step;

/* Lists the nonzero entries of the matrices that the products use. */
static void find_matrices(kt_projection_work *w, linear_step step) {
    const size_t n = w->n, p = w->p;
    if (step.moves) {
        w->force_of = find_entries(n, n, w->force, w->begin, w->row);
        w->equation_of = find_entries(p, n, w->equation, w->begin + n + 1, w->row + n * n);
    }
    if (step.fast || !step.moves)
        w->jacobian_of = find_entries(p, n, w->jacobian, w->begin + 2 * (n + 1), w->row + n * n + n * p);
}

/* to = eight columns of n numbers, `stride` apart; missing columns are zero. */
static void gather_eight_columns(size_t columns, size_t n, size_t stride, const double *from, kt_v8 *to) {
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < KT_LANES; c++)
            to[i][c] = c < columns ? from[c * stride + i] : 0.0;
}

static void apply_sparse(const kt_model *model, const kt_sparse *a, const kt_v8 *x, kt_v8 *y) {
    (void)model; /* unused in a library with one instruction set */
    KT_BY_ISA(model->isa, , kt_sparse_apply, (a, x, y));
}

/* The part of a parameter in a column, or NULL. */
typedef struct gain {
    const double *inertia, *gap;
} gain;

static gain gain_of(const kt_projection_work *w, const kt_parameter_work *parameter, size_t column) {
    return parameter ? (gain){parameter->inertia + column * w->n, parameter->gap + column * w->p} : (gain){NULL, NULL};
}

/* Computes dx of up to eight columns of changes (xi, dv), from column `first` on, into w->moved. */
static void change_eight_columns(kt_projection_work *w, linear_step step, size_t columns, const double *x,
                                 const kt_parameter_work *parameter, size_t first) {
    const size_t n = w->n, p = w->p;
    kt_v8 *xi = w->columns, *dv = xi + n, *g = dv + n, *e = g + n;
    gather_eight_columns(columns, n, 2 * n, x, xi);
    memset(g, 0, (n + p) * sizeof *g);
    if (step.moves)
        apply_sparse(w->model, &w->force_of, xi, g);
    apply_sparse(w->model, step.moves ? &w->equation_of : &w->jacobian_of, xi, e);
    if (step.fast) {
        gather_eight_columns(columns, n, 2 * n, x + n, dv);
        apply_sparse(w->model, &w->jacobian_of, dv, e);
    }
    for (size_t c = 0; c < columns; c++) {
        const gain by = gain_of(w, parameter, first + c);
        for (size_t i = 0; i < n; i++)
            w->moved[c * n + i] =
                g[i][c] - (by.inertia && step.metric == KT_METRIC_MASS && step.moves ? by.inertia[i] : 0.0);
        for (size_t i = 0; i < p; i++)
            w->closed[c * p + i] = -e[i][c] - (by.gap ? by.gap[i] : 0.0);
    }
    solve_projected(w, step.metric, columns, w->closed, w->moved);
}

/* ---- iterations -------------------------------------------------------------------------------------------------- */

/* Factors the equations of positions at q, and computes phi. */
static kt_status factor_positions(kt_projection_work *w, const double *q, kt_error *error) {
    const kt_status status =
        kt_loop_equations(w->model, w->data, w->t, q, NULL, w->jacobian, w->residual, NULL, NULL, error);
    return status == KT_OK ? factor_projected(w, KT_ROWS_CLOSED, q, w->model->metric, error) : status;
}

/* Factors along the tree again, since other evaluations overwrite the data of the factors. */
static kt_status factor_again(kt_projection_work *w, kt_rows rows, const double *q, kt_metric metric, kt_error *error) {
    return w->dense ? KT_OK : factor_along(w, rows, q, metric, error);
}

/* Prepares one iteration of the positions at q: x, and the matrices of its change. */
static kt_status prepare_positions(kt_projection_work *w, const double *q, kt_error *error) {
    const kt_metric metric = w->model->metric;
    kt_status status = factor_positions(w, q, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->p; i++)
        w->residual[i] = -w->residual[i];
    memset(w->x, 0, w->n * sizeof *w->x);
    solve_projected(w, metric, 1, w->residual, w->x);
    status = differentiate_projected(w, q, metric, NULL, error);
    return status == KT_OK ? factor_again(w, KT_ROWS_CLOSED, q, metric, error) : status;
}

/* Prepares the step of the velocities, from w->v (before) to v, at q. */
static kt_status prepare_velocities(kt_projection_work *w, const double *q, const double *v, kt_error *error) {
    kt_status status = kt_loop_equations(w->model, w->data, w->t, q, v, w->jacobian, NULL, NULL, NULL, error);
    if (status == KT_OK)
        status = factor_projected(w, KT_ROWS_ALL, q, KT_METRIC_MASS, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->n; i++)
        w->x[i] = v[i] - w->v[i];
    status = differentiate_projected(w, q, KT_METRIC_MASS, v, error);
    return status == KT_OK ? factor_again(w, KT_ROWS_ALL, q, KT_METRIC_MASS, error) : status;
}

/* Computes the size of the smallest direction after the step. Errors: a singular position. */
static kt_status measure_smallest(kt_projection_work *w, const double *q, kt_error *error) {
    const kt_reduction_kernels *kernels = w->model->group_kernels;
    kt_violation violation;
    w->smallest = 1.0;
    if (!kt_is_near_singular(w->model, w->data))
        return KT_OK;
    if (kernels->residuals(w->model, w->data, w->t, q, NULL, NULL, &violation) &&
        kernels->factor(w->model, w->data, KT_ROWS_ALL, false))
        w->smallest = kt_smallest_direction(w->model, w->data, KT_ROWS_ALL);
    return w->smallest > 0.0
               ? KT_OK
               : kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                              "the loops are at a singular position after the step; take a shorter or a longer one");
}

/* Let s be the size of the smallest direction after the projection. A residual of the size LEFT shifts positions by
 * LEFT / s, and their derivatives by about LEFT / s^2, in units. The derivatives of velocities change with the
 * velocity v along the path, too: by about 2 LEFT / s^2 times |v| / s. */
kt_status kt_projection_reject_unknown(const kt_projection_work *w, const double *v, double by_q, double v_by_q,
                                       kt_error *error) {
    double speed = 0.0;
    if (w->smallest >= KT_NEAR_SINGULAR)
        return KT_OK;
    for (size_t k = 0; k < w->model->n.group_v; k++)
        speed = fmax(speed, fabs(v[w->model->group_v[k]]) / w->model->unit[k]);
    const double s = w->smallest, off = LEFT / (s * s);
    const kt_status status = kt_derivatives_reject_unknown(w->t, off, by_q, error);
    return status == KT_OK ? kt_derivatives_reject_unknown(w->t, 2.0 * off * speed / s, v_by_q, error) : status;
}

kt_status kt_projection_begin(kt_projection_work *w, const double *q, const double *v, kt_error *error) {
    memcpy(w->q, q, w->model->n.q * sizeof *q);
    memcpy(w->v, v, w->n * sizeof *v);
    return kt_unit_quaternions(w->model, w->q)
               ? KT_OK
               : kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a quaternion has become zero");
}

kt_status kt_projection_run(kt_projection_work *w, double *q, double *v, kt_error *error) {
    kt_status status = kt_projection_begin(w, q, v, error);
    if (status == KT_OK)
        status = kt_state_project(w->model, w->data, w->t, q, v, NULL, error);
    w->iterations = w->data->closing.position;
    return status == KT_OK ? measure_smallest(w, q, error) : status;
}

/* Changes columns with the correction `by` of positions; NULL: with the correction of velocities. */
static void change_columns(kt_projection_work *w, linear_step step, const double *by, size_t columns, double *x,
                           const kt_parameter_work *parameter) {
    const size_t n = w->n;
    find_matrices(w, step);
    for (size_t from = 0; from < columns; from += KT_LANES) {
        const size_t count = columns - from < KT_LANES ? columns - from : KT_LANES;
        double *first = x + 2 * n * from;
        change_eight_columns(w, step, count, first, parameter, from);
        for (size_t c = 0; c < count; c++, first += 2 * n) {
            const double *moved = w->moved + n * c;
            if (by != NULL)
                kt_tangent_add(w->model, by, first, moved, first);
            for (size_t i = 0; i < n && by == NULL; i++)
                first[n + i] += moved[i];
        }
    }
}

static void change_velocities(kt_projection_work *w, size_t columns, double *x, const kt_parameter_work *parameter) {
    change_columns(w, (linear_step){.metric = KT_METRIC_MASS, .moves = true, .fast = true}, NULL, columns, x,
                   parameter);
}

/* The iterations that move positions. */
static kt_status propagate_positions(kt_projection_work *w, size_t columns, double *x, kt_parameter_work *parameter,
                                     kt_error *error) {
    const linear_step step = {.metric = w->model->metric, .moves = true};
    kt_status status = KT_OK;
    for (uint32_t i = 0; i < w->iterations && status == KT_OK; i++) {
        double *q = w->q + i * w->model->n.q;
        status = prepare_positions(w, q, error);
        if (status == KT_OK && parameter)
            status = kt_parameter_project(parameter, w->t, q, NULL, w->x, error);
        if (status == KT_OK && parameter)
            status = factor_again(w, KT_ROWS_CLOSED, q, step.metric, error);
        if (status == KT_OK)
            change_columns(w, step, w->x, columns, x, parameter);
        if (status == KT_OK)
            kt_position_add(w->model, q, w->x, q + w->model->n.q);
    }
    return status;
}

/* The last iteration only projects changes, with the factored equations J: x, lambda and G are zero, and -E = J. */
static kt_status propagate_changes(kt_projection_work *w, const double *q, size_t columns, double *x,
                                   kt_parameter_work *parameter, kt_error *error) {
    const linear_step step = {.metric = w->model->metric};
    kt_status status = parameter ? kt_parameter_project(parameter, w->t, q, NULL, w->model->zero, error) : KT_OK;
    if (status == KT_OK && parameter)
        status = factor_again(w, KT_ROWS_CLOSED, q, step.metric, error);
    if (status == KT_OK)
        change_columns(w, step, w->model->zero, columns, x, parameter);
    return status;
}

/* Whether positions and velocities have the same equations, all independent. */
static bool shares_equations(const kt_model *model) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (group->count[KT_ROWS_CLOSED] != group->count[KT_ROWS_ALL] ||
            group->rank[KT_ROWS_ALL] != group->count[KT_ROWS_ALL])
            return false;
    }
    return true;
}

/* Propagates columns of changes, of which the first `moving` columns move positions. */
static kt_status propagate_projection(kt_projection_work *w, const double *q, const double *v, size_t moving,
                                      size_t columns, double *x, kt_parameter_work *parameter, kt_error *error) {
    const bool shared = w->dense && shares_equations(w->model);
    kt_status status = propagate_positions(w, moving, x, parameter, error);
    if (status == KT_OK)
        status = shared ? prepare_velocities(w, q, v, error) : factor_positions(w, q, error);
    if (status == KT_OK)
        status = propagate_changes(w, q, moving, x, parameter, error);
    if (status == KT_OK && !shared)
        status = prepare_velocities(w, q, v, error);
    if (status == KT_OK && parameter)
        status = kt_parameter_project(parameter, w->t, q, v, w->x, error);
    if (status == KT_OK && parameter)
        status = factor_again(w, KT_ROWS_ALL, q, KT_METRIC_MASS, error);
    if (status == KT_OK)
        change_velocities(w, columns, x, parameter);
    return status;
}

/* Propagates through the changes of unit vectors. This solves for fewer columns than most steps have, and half of them
 * move no positions. */
static kt_status propagate_units(kt_projection_work *w, const double *q, const double *v, size_t columns, double *x,
                                 kt_error *error) {
    const size_t N = 2 * w->n;
    memset(w->map, 0, N * N * sizeof *w->map);
    for (size_t j = 0; j < N; j++)
        w->map[j * (N + 1)] = 1.0;
    const kt_status status = propagate_projection(w, q, v, w->n, N, w->map, NULL, error);
    for (size_t j = 0; j < columns && status == KT_OK; j++) {
        memcpy(w->work, x + j * N, N * sizeof *x);
        kt_dense_apply(w->map, (int)N, (int)N, w->work, x + j * N);
    }
    return status;
}

kt_status kt_projection_columns(kt_projection_work *w, double *q, double *v, size_t columns, double *x,
                                kt_parameter_work *parameter, kt_error *error) {
    const kt_status status = kt_projection_run(w, q, v, error);
    if (status != KT_OK)
        return status;
    return w->dense && !parameter && columns >= 2 * w->n
               ? propagate_units(w, q, v, columns, x, error)
               : propagate_projection(w, q, v, columns, columns, x, parameter, error);
}

kt_status kt_projection_least(kt_projection_work *w, double t, const double *q, const double *v, const double *e,
                              double *x, kt_error *error) {
    kt_status status = kt_loop_equations(w->model, w->data, t, q, v, w->jacobian, NULL, NULL, NULL, error);
    kt_projection_work then = *w;
    then.t = t;
    if (status == KT_OK)
        status = factor_projected(&then, KT_ROWS_ALL, q, KT_METRIC_IDENTITY, error);
    memset(x, 0, w->n * sizeof *x);
    if (status == KT_OK)
        solve_projected(&then, KT_METRIC_IDENTITY, 1, e, x);
    return status;
}
