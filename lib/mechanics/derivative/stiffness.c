/* The linearised equations of motion of whole mechanisms: mass, stiffness and damping matrices.
 *
 * With everything on one side the equations are
 *     r(q, v, a) = tau_tree(q, v, a) - tau - f(q, v) = 0       tau_tree: inverse dynamics with external wrenches
 *     f = forces of effects + A' lambda
 *     A a = b''
 * At the a and lambda of the motion, for x any q_j or v_j,
 *     M da - A' dlambda = -D,   D = d(tau_tree)/dx - df/dx     at fixed a and lambda
 *     A da = E,                 E = d(b'' - A a)/dx            at fixed a
 * Without loops D_q = -M a_q is the stiffness matrix and D_v = -M a_v the damping matrix. With A' P = [Q1 Q2] [R1; 0],
 * as for the accelerations themselves [MSD 7.33, 7.34],
 *     da = Q1 y + Z z,   Z = Q2
 *     R1' y = E                                                of the independent equations
 *     (Z' M Z) z = -Z' (D + M Q1 y)
 * so that the stiffness or damping matrix, for any dx, the loops violated or not, is
 *     -(Z' M Z) (Z' a_x) = Z' D + (Z' M Q1) R1^-T E,
 * and for dx = Z ds, which the loops allow, this times Z. With many loops, the matrix is computed as Z' (D + M w),
 * where w = Q1 R1^-T E is the least solution of A w = E. All three factors are computed along the tree, in O(bodies) a
 * column (kkt.h). M and d(tau_tree)/dx are analytic, and the terms of the loops and of the library's effects are exact
 * (support.h). Numerical differentiation is used only for a caller's own effects without derivatives
 * (effect_differences.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/stiffness.h"

#include "assembly/project.h"
#include "base/copy.h"
#include "constraint/gradient.h"
#include "derivative/kkt.h"
#include "derivative/loop_response.h"
#include "dynamics/dynamics.h"
#include "dynamics/dynamics_derivative.h"
#include "evaluate/load_friction.h"
#include "linear/cholesky.h"

#include <math.h>
#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_linearized, KT_STIFFNESS_FIELDS, const kt_model *model, size_t n, size_t p, size_t l,
                size_t m, size_t k)

size_t kt_linearized_init(kt_linearized *w, void *memory, const kt_model *model, kt_data *data, double t, bool dense) {
    const size_t n = model->n.v, p = model->n.row, l = p ? n : 0;
    if (memory && model->n.varying) {
        data->mass_time[0] = t;
        model = kt_model_of_instant(model, data);
    }
    if (memory)
        *w = (kt_linearized){.model = model, .data = data, .t = t, .n = n, .p = p, .dense = dense && p > 0};
    const size_t bytes = place_arrays(w, memory, model, n, p, l, dense ? l : 0, dense ? p : 0);
    if (memory && w->dense)
        (void)kt_jacobian_qr_init(&w->qr, w->factors, n, p);
    return bytes;
}

/* ---- the linear equations ---------------------------------------------------------------------------------------- */

/* half = Q' M Z */
static void reduce_mass(kt_linearized *w) {
    const size_t n = w->n, r = (size_t)w->qr.rank;
    for (size_t c = 0; c < n - r; c++) {
        kt_dense_apply(w->mass, (int)n, (int)n, w->qr.basis + (r + c) * n, w->product);
        for (size_t i = 0; i < n; i++)
            w->half[c * n + i] = kt_dense_dot(w->qr.basis + i * n, w->product, (int)n);
    }
}

/* ---- all terms --------------------------------------------------------------------------------------------------- */

/* Factors the loops' equations. Near singular positions, the error is measured, or the equations are rejected. */
static kt_status reject_singular_equations(kt_linearized *w, const kt_dynamic_state *at, kt_error *error) {
    if (!w->model->n.group)
        return KT_OK;
    if (w->estimates)
        return kt_loops_derivative_error(w->model, w->data, at, w->change, &w->error, error);
    const kt_reduction_kernels *kernels = w->model->group_kernels;
    kt_violation violation;
    (void)(kernels->residuals(w->model, w->data, at->t, at->q, at->v, NULL, &violation) &&
           kernels->factor(w->model, w->data, KT_ROWS_ALL, false));
    return kt_loops_reject_near(w->model, w->data, error);
}

/* Whether the derivatives of loops and effects (fill_loop_stiffness and the functions below) read motions of links in
 * space, which planar models otherwise do not compute: effects with ends and formulas of markers read motions in
 * space, and equations of auxiliary states are formulas. */
static bool reads_space(const kt_model *model) {
    bool reads = model->n.x > 0 || (model->n.row && kt_loop_gradient_reads_space(model));
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        reads = reads || effect->ends || effect->type == KT_EFFECT_CUSTOM || effect->type == KT_EFFECT_EXPRESSION;
    }
    return reads;
}

/* The tree's part of M and D, at the accelerations of the motion. */
static kt_status fill_tree_stiffness(kt_linearized *w, const kt_dynamic_state *at, kt_error *error) {
    const kt_status status =
        kt_inverse_derivatives_fill(w->model, w->data, w->tree, at, w->a, reads_space(w->model), &w->terms, error);
    w->mass = (double *)w->terms.dtau;
    w->d_q = (double *)w->terms.dq;
    w->d_v = (double *)w->terms.dv;
    return status;
}

/* Computes A and its factors, lambda, the loops' part of D, and E, in the letters of the file's head. The forces that
 * the loops have to supply, A' lambda = tau_tree - tau - (forces of effects), are in w->change. */
static kt_status fill_loop_stiffness(kt_linearized *w, const kt_dynamic_state *at, kt_error *error) {
    const double *q = at->q, *v = at->v;
    kt_status status = kt_linearized_sum_effects(w, q, v, false, w->force, error);
    if (status == KT_OK && w->dense)
        status = kt_loop_equations(w->model, w->data, w->t, q, v, w->jacobian, NULL, NULL, NULL, error);
    if (status == KT_OK && w->dense)
        status = kt_jacobian_qr_factor(&w->qr, w->model, KT_ROWS_ALL, w->jacobian, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(w->model, w->data, q, v, w->a, at->external, w->change, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->n; i++)
        w->change[i] -= (at->tau ? at->tau[i] : 0.0) + w->force[i];
    for (size_t k = 0; k < w->model->n.loaded; k++)
        w->change[w->model->link[kt_loaded_effect(w->model, k)->link[0]].v] -= w->load_friction[k];
    if (w->dense)
        kt_jacobian_qr_multipliers(&w->qr, w->change, w->lambda);
    else
        status = kt_loops_multipliers_of(w->model, w->data, w->change, w->lambda, error);
    if (status != KT_OK)
        return status;
    const kt_dual_motion motion = {
        .model = w->model, .data = w->data, .t = w->t, .q = q, .v = v, .a = w->a, .dof = w->dof, .chain = w->chain};
    kt_loop_matrices(&motion, w->lambda, true, w->d_q, w->e_q, w->e_v);
    if (w->dense)
        reduce_mass(w);
    return KT_OK;
}

kt_status kt_linearized_fill(kt_linearized *w, const kt_dynamic_state *at, const double *a, kt_error *error) {
    kt_status status = KT_OK;
    if (w->model->n.loaded > 0)
        status = kt_linearized_find_loads(w, at, error);
    else if (!a)
        status = kt_acceleration_trusted(w->model, w->data, at, w->a, error);
    if (a)
        memcpy(w->a, a, w->n * sizeof *w->a);
    if (status == KT_OK)
        status = reject_singular_equations(w, at, error);
    if (status == KT_OK)
        status = fill_tree_stiffness(w, at, error);
    if (status == KT_OK) /* first: the following steps leave other motions in data */
        status = kt_effects_differentiate(w->model, w->data, at, &w->terms, w->path,
                                          &(kt_state_derivatives){w->force_x, w->rate_q, w->rate_v, w->rate_x}, error);
    if (status == KT_OK && w->p)
        status = fill_loop_stiffness(w, at, error);
    if (status == KT_OK)
        status = kt_linearized_difference_effects(w, at->q, at->v, error);
    return status == KT_OK ? kt_linearized_subtract_loads(w, at, error) : status;
}

void kt_linearized_copy_rates(const kt_linearized *w, const kt_state_derivatives *to) {
    const size_t x = w->model->n.x;
    kt_copy(to->rate_q, w->rate_q, w->n * x * sizeof(double));
    kt_copy(to->rate_v, w->rate_v, w->n * x * sizeof(double));
    kt_copy(to->rate_x, w->rate_x, x * x * sizeof(double));
}

/* ---- the public function ----------------------------------------------------------------------------------------- */

/* Whether loops are treated by the factors along the tree (kkt.h), for which no dense matrix of A is needed. */
static bool is_along_tree(const kt_model *model) { return model->n.row && !kt_linearized_is_dense(model); }

size_t kt_stiffness_work_size(const kt_model *model) {
    if (!model)
        return 0;
    const bool by_tree = is_along_tree(model);
    return kt_linearized_init(NULL, NULL, model, NULL, 0.0, !by_tree) +
           (by_tree ? kt_kkt_init(NULL, NULL, model, NULL) : 0);
}

static bool stiffness_is_finite(const kt_linearized *w) {
    const size_t square = w->n * w->n, x = w->model->n.x;
    return kt_all_finite(w->mass, square) && kt_all_finite(w->d_q, square) && kt_all_finite(w->d_v, square) &&
           kt_all_finite(w->e_q, w->n * w->p) && kt_all_finite(w->e_v, w->n * w->p) &&
           kt_all_finite(w->force_x, w->n * x) && kt_all_finite(w->rate_q, w->n * x) &&
           kt_all_finite(w->rate_v, w->n * x) && kt_all_finite(w->rate_x, x * x);
}

/* out = Z' D + (Z' M Q1) R1^-T E, f x n */
static void write_reduced(kt_linearized *w, const double *d, const double *e, double *out) {
    const size_t n = w->n, r = (size_t)w->qr.rank, f = n - r;
    double *y = w->change;
    for (size_t c = 0; c < n; c++) {
        kt_jacobian_qr_solve_lower(&w->qr, e + c * w->p, y);
        for (size_t i = 0; i < f; i++) {
            double sum = kt_dense_dot(w->qr.basis + (r + i) * n, d + c * n, (int)n);
            for (size_t k = 0; k < r; k++)
                sum += w->half[i * n + k] * y[k];
            out[c * f + i] = sum;
        }
    }
}

/* Rejects derivatives that are too inaccurate next to a singular position. An error e of accelerations is an error |Z'
 * M Z| |Z'| e of these. */
static kt_status reject_unknown_stiffness(kt_linearized *w, size_t f, const double *basis, const double *mass,
                                          const double *stiffness, kt_error *error) {
    const kt_model *model = w->model;
    double size = 0.0, most = 0.0;
    if (w->error == 0.0)
        return KT_OK;
    for (size_t i = 0; i < f; i++) {
        double sum = 0.0;
        for (size_t l = 0; l < f; l++)
            for (size_t k = 0; k < model->n.group_v; k++)
                sum += fabs(mass[l * f + i] * basis[l * w->n + (size_t)model->group_v[k]]) * model->unit[k];
        size = fmax(size, sum * w->error);
        for (size_t k = 0; k < model->n.group_v; k++)
            most = fmax(most, fabs(stiffness[(size_t)model->group_v[k] * f + i]) * model->unit[k]);
    }
    return kt_derivatives_reject_unknown(w->t, size, most, error);
}

/* Z'x of the joint forces by auxiliary states. */
static void write_closed_forces(const kt_linearized *w, double *force) {
    const size_t n = w->n, r = (size_t)w->qr.rank, f = n - r;
    for (size_t c = 0; c < w->model->n.x; c++)
        for (size_t i = 0; i < f; i++)
            force[c * f + i] = kt_dense_dot(w->qr.basis + (r + i) * n, w->force_x + c * n, (int)n);
}

/* Z, Z' M Z and the reduced stiffness and damping matrices of a mechanism with loops. w->half has the f
 * rows of Z' M [Q1 Z], n numbers each. */
static void write_closed(kt_linearized *w, const kt_stiffness_matrices *to) {
    const size_t n = w->n, r = (size_t)w->qr.rank, f = n - r;
    if (f == 0) /* nothing can move: the matrices are empty, and may be NULL */
        return;
    memcpy(to->basis, w->qr.basis + r * n, n * f * sizeof *to->basis);
    for (size_t c = 0; c < f; c++)
        memcpy(to->mass + c * f, w->half + c * n + r, f * sizeof *to->mass);
    write_reduced(w, w->d_q, w->e_q, to->stiffness);
    write_reduced(w, w->d_v, w->e_v, to->damping);
}

/* D + M w in place of D; `e` is E, `x` as much memory as D. */
static void add_across(const kt_kkt *along, size_t n, const double *e, double *x, double *d) {
    memset(x, 0, n * n * sizeof *x);
    kt_kkt_solve(along, n, x, e);
    kt_kkt_apply_mass(along, n, x);
    for (size_t i = 0; i < n * n; i++)
        d[i] += x[i];
}

/* Z from Z' 1, n x f, and Z' M Z; x: n x n numbers. */
static void write_free_motions(const kt_kkt *along, size_t n, size_t f, double *x, double *basis, double *mass) {
    memset(x, 0, n * n * sizeof *x);
    for (size_t i = 0; i < n; i++)
        x[i * (n + 1)] = 1.0;
    kt_kkt_restrict(along, n, x, x);
    for (size_t j = 0; j < f; j++)
        for (size_t i = 0; i < n; i++)
            basis[j * n + i] = x[i * f + j];
    memcpy(x, basis, n * f * sizeof *x);
    kt_kkt_apply_mass(along, f, x);
    kt_kkt_restrict(along, f, x, mass);
}

/* Computes all results along the tree. */
static kt_status write_along(kt_linearized *w, void *memory, const double *q, const kt_stiffness_matrices *to,
                             double *force, kt_error *error) {
    const size_t n = w->n;
    double *x = w->mass; /* M is not needed: it is applied along the tree, too */
    kt_kkt along;
    (void)kt_kkt_init(&along, memory, w->model, w->data);
    const kt_status status = kt_kkt_factor(&along, KT_ROWS_ALL, KT_METRIC_IDENTITY, w->t, q, error);
    if (status != KT_OK)
        return status;
    const size_t f = kt_kkt_dofs(&along);
    if (f != (size_t)kt_model_mobility(w->model).minimal)
        return kt_jacobian_singular(error);
    if (f == 0)
        return KT_OK;
    add_across(&along, n, w->e_q, x, w->d_q);
    add_across(&along, n, w->e_v, x, w->d_v);
    if (!(kt_all_finite(w->d_q, n * n) && kt_all_finite(w->d_v, n * n)))
        return kt_derivatives_overflow(error);
    write_free_motions(&along, n, f, x, to->basis, to->mass);
    kt_kkt_restrict(&along, n, w->d_q, to->stiffness);
    kt_kkt_restrict(&along, n, w->d_v, to->damping);
    if (force)
        kt_kkt_restrict(&along, w->model->n.x, w->force_x, force);
    return KT_OK;
}

/* Without loops Z = 1. */
static void write_tree_matrices(const kt_linearized *w, const kt_stiffness_matrices *to) {
    const size_t n = w->n, bytes = n * n * sizeof(double);
    if (to->basis)
        memset(to->basis, 0, bytes);
    for (size_t i = 0; i < n && to->basis; i++)
        to->basis[i * (n + 1)] = 1.0;
    kt_copy(to->mass, w->mass, bytes);
    kt_copy(to->stiffness, w->d_q, bytes);
    kt_copy(to->damping, w->d_v, bytes);
}

/* The linearised equations at (q, v, a), reduced along the tree (by_tree), by the QR factors of A', or without loops
 * not at all. */
kt_status kt_stiffness_evaluate_at(const kt_model *model, kt_data *data, void *memory, size_t memory_size,
                                   const kt_dynamic_state *at, const double *a, const kt_stiffness_matrices *to,
                                   kt_error *error) {
    const kt_state_derivatives *states = to->states;
    double *force = states && model->n.x > 0 ? states->force : NULL;
    kt_linearized w;
    kt_status status =
        kt_arena_check("work", "kt_stiffness_work_size", memory, memory_size, kt_stiffness_work_size(model), error);
    if (status == KT_OK)
        status = kt_massless_reject(model, "derivatives", "its accelerations have none", error);
    if (status != KT_OK)
        return status;
    const bool by_tree = is_along_tree(model);
    const size_t used = kt_linearized_init(&w, memory, model, data, at->t, !by_tree);
    w.estimates = true;
    w.exact = to->exact;
    status = kt_linearized_fill(&w, at, a, error);
    if (status != KT_OK)
        return status;
    if (!stiffness_is_finite(&w))
        return kt_derivatives_overflow(error);
    if (by_tree)
        status = write_along(&w, (char *)memory + used, at->q, to, force, error);
    else if (w.p)
        write_closed(&w, to);
    else
        write_tree_matrices(&w, to);
    if (force && w.p && !by_tree)
        write_closed_forces(&w, force);
    else if (force && !w.p)
        kt_copy(force, w.force_x, w.n * model->n.x * sizeof *force);
    if (states && status == KT_OK)
        kt_linearized_copy_rates(&w, states);
    return status == KT_OK && w.p ? reject_unknown_stiffness(&w, (size_t)kt_model_mobility(model).minimal, to->basis,
                                                             to->mass, to->stiffness, error)
                                  : status;
}

kt_status kt_stiffness_evaluate(const kt_model *model, kt_data *data, void *memory, size_t memory_size, double t,
                                const double *q, const double *v, const double *tau, const kt_wrench *external,
                                /* NOLINTNEXTLINE(readability-non-const-parameter): written by way of the matrices */
                                const double *a, double *basis, double *mass, double *stiffness, double *damping,
                                kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, q || !model->n.q, mass || !model->n.v, stiffness || !model->n.v, damping || !model->n.v,
                      basis || !model->n.group))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {t, q, v ? v : model->zero, tau, external};
    const kt_stiffness_matrices to = {
        .basis = basis, .mass = mass, .stiffness = stiffness, .damping = damping, .exact = true};
    kt_status status = kt_slip_reject(model, "kt_stiffness_evaluate", error);
    if (status == KT_OK)
        status = kt_open_contacts_reject(model, data, &at, error);
    return status != KT_OK ? status : kt_stiffness_evaluate_at(model, data, memory, memory_size, &at, a, &to, error);
}
