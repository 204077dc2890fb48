/* Derivatives of the accelerations of whole mechanisms.
 *
 * With everything on one side the equations are
 *     r(q, v, a) = tau_tree(q, v, a) - tau - f(q, v) = 0       tau_tree: inverse dynamics with external wrenches
 *     f = forces of effects + A' lambda
 *     A a = b''
 * At the a and lambda of the motion, for x any q_j or v_j,
 *     M da - A' dlambda = -D,   D = d(tau_tree)/dx - df/dx     at fixed a and lambda
 *     A da = E,                 E = d(b'' - A a)/dx            at fixed a
 * With A' P = [Q1 Q2] [R1; 0], as for the accelerations themselves [MSD 7.33, 7.34],
 *     da = Q1 y + Q2 z
 *     R1' y = E                                                of the independent equations
 *     (Q2' M Q2) z = -Q2' (D + M Q1 y)
 * M and d(tau_tree)/dx are analytic, and the terms of the loops and of the library's effects are exact (support.h).
 * Only the forces of a caller's own effects are differentiated numerically, by central differences of order eight with
 * the step h = KT_STEP: the truncation error is h^8 / 630 times the ninth derivative, and rounding errors are some
 * eps / h of the forces.
 */
#include "dynamics/dynamics.h"
#include "kinetree/dynamics.h"
#include "kinetree/joint.h"
#include "reduction/dual.h"
#include "reduction/evaluate.h"
#include "reduction/householder.h"

#include "base/arena.h"

#include <string.h>

#define KT_STEP 0.002 /* rad or m, and of their rates */

/* Every array: type, name, count, meaning; p equations in the order of the loops, of n coordinates. */
#define FIELDS(X)                                                                                                      \
    X(double, tree, kt_derivative_work_size(model) / sizeof(double), "of the derivatives of the tree")                 \
    X(double, q, model->n.q, "positions")                                                                              \
    X(double, v, n, "velocities")                                                                                      \
    X(double, a, n, "accelerations")                                                                                   \
    X(double, lambda, p, "multipliers")                                                                                \
    X(double, force, n, "joint forces of the effects")                                                                 \
    X(double, weight, n, "joint forces of external wrenches")                                                          \
    X(double, jacobian, n *p, "A, p x n")                                                                              \
    X(double, factor, n *p, "A' factored")                                                                             \
    X(double, reflector, n + p, "scales of the reflectors")                                                            \
    X(double, norm, p, "squared lengths of the equations")                                                             \
    X(int32_t, pivot, p, "order of the equations")                                                                     \
    X(double, mass, n *n, "M")                                                                                         \
    X(double, basis, n *n, "orthogonal factor Q")                                                                      \
    X(double, half, n *n, "Q' M Q")                                                                                    \
    X(double, reduced, n *n, "M Q; then M in the null space, factored")                                                \
    X(double, change, n, "differences, and a right-hand side")                                                         \
    X(kt_support_dof, dof, n, "of a loop")                                                                             \
    X(int32_t, chain, model->n.link, "of a loop")                                                                      \
    X(double, d_q, n *n, "result by positions")                                                                        \
    X(double, d_v, n *n, "result by velocities")                                                                       \
    X(double, d_tau, n *n, "result by joint forces")                                                                   \
    X(double, e_q, n *p, "of the equations by positions")                                                              \
    X(double, e_v, n *p, "of the equations by velocities")

typedef struct work {
    const kt_model *model;
    kt_data *data;
    double t;
    size_t n, p;
    int rank;
    KT_ARENA_DECLARE(FIELDS)
} work;

KT_ARENA_ARRAYS(place_arrays, work, FIELDS, const kt_model *model, size_t n, size_t p)

size_t kt_acceleration_work_size(const kt_model *model) {
    return place_arrays(NULL, NULL, model, model->n.v, model->n.row);
}

static bool has_own_effects(const kt_model *model) {
    for (size_t i = 0; i < model->n.batch; i++)
        if (model->batch[i].type == KT_EFFECT_CUSTOM)
            return true;
    return false;
}

/* ---- numerical differences --------------------------------------------------------------------------------------- */

/* Computes f (n): the joint forces of all effects, or if `own` of a caller's own alone, including J' times their
 * wrenches. */
static kt_status sum_effects(work *w, const double *q, const double *v, bool own, double *f, kt_error *error) {
    const double *tau = NULL;
    const kt_wrench *external = NULL;
    memset(f, 0, w->n * sizeof *f);
    if (!w->model->n.effect)
        return KT_OK;
    kt_status status = own ? kt_effects_apply_own(w->model, w->data, w->t, q, v, &tau, &external, error)
                           : kt_effects_apply(w->model, w->data, w->t, q, v, &tau, &external, error);
    for (size_t i = 0; i < w->n && tau; i++)
        f[i] += tau[i];
    for (int with = 1; with >= 0 && external && status == KT_OK; with--) { /* J' w = g - (g - J' w) */
        status = kt_dynamics_inverse(w->model, w->data, q, NULL, NULL, with ? external : NULL, w->weight, error);
        for (size_t i = 0; i < w->n && status == KT_OK; i++)
            f[i] -= with ? w->weight[i] : -w->weight[i];
    }
    return status;
}

/* Subtracts df from column j of D. */
static kt_status difference(work *w, const double *q, const double *v, size_t j, bool rate, double *d,
                            kt_error *error) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    const size_t n = w->n;
    memset(w->change, 0, n * sizeof *w->change);
    for (int k = -4; k <= 4; k++) {
        if (k == 0)
            continue;
        const double c = (k < 0 ? -weight[-k - 1] : weight[k - 1]) / KT_STEP;
        memset(w->v, 0, n * sizeof *w->v);
        w->v[j] = rate ? 0.0 : k * KT_STEP;
        kt_position_add(w->model, q, w->v, w->q);
        memcpy(w->v, v, n * sizeof *w->v);
        w->v[j] += rate ? k * KT_STEP : 0.0;
        const kt_status status = sum_effects(w, w->q, w->v, true, w->force, error);
        if (status != KT_OK)
            return status;
        for (size_t i = 0; i < n; i++)
            w->change[i] += c * w->force[i];
    }
    for (size_t i = 0; i < n; i++)
        d[j * n + i] -= w->change[i];
    return KT_OK;
}

/* ---- the linear equations ---------------------------------------------------------------------------------------- */

/* basis = Q, of A' P = Q R; pivots. Without loops Q = 1. */
static kt_status factor(work *w, kt_error *error) {
    const size_t n = w->n, p = w->p;
    const kt_group_work g = {
        .m = (int)n, .k = (int)p, .factor = w->factor, .pivot = w->pivot, .reflector = w->reflector};
    memset(w->basis, 0, n * n * sizeof *w->basis);
    for (size_t i = 0; i < n; i++)
        w->basis[i * n + i] = 1.0;
    w->rank = kt_model_mobility(w->model).rank;
    for (size_t r = 0; r < p; r++) {
        for (size_t i = 0; i < n; i++)
            w->factor[r * n + i] = w->jacobian[i * p + r];
        w->pivot[r] = (int32_t)r;
        w->norm[r] = kt_squares(w->factor + r * n, 0, (int)n);
    }
    for (int j = 0; j < w->rank; j++) {
        double all;
        const int best = kt_longest_column(w->norm, j, (int)p, &all);
        if (!(w->norm[best] > 0.0 && isfinite(all)))
            return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                                "fewer equations of the loops are independent here than elsewhere");
        if (best != j) {
            const double norm = w->norm[j];
            kt_swap_columns(&g, (int)n, j, best);
            w->norm[j] = w->norm[best];
            w->norm[best] = norm;
        }
        kt_eliminate(&g, (int)n, j, w->norm);
    }
    for (size_t c = 0; c < n; c++)
        for (int j = w->rank - 1; j >= 0; j--)
            kt_reflect(w->factor + (size_t)j * n, w->reflector[j], j, (int)n, w->basis + c * n);
    return KT_OK;
}

/* Computes the multipliers of the independent equations from A' lambda = f: R1 lambda = Q1' f. */
static void find_multipliers(work *w, const double *f) {
    const int32_t *pivot = w->pivot;
    memset(w->lambda, 0, w->p * sizeof *w->lambda);
    for (int k = w->rank - 1; k >= 0; k--) {
        double sum = 0.0;
        for (size_t i = 0; i < w->n; i++)
            sum += w->basis[(size_t)k * w->n + i] * f[i];
        for (int l = k + 1; l < w->rank; l++)
            sum -= w->factor[(size_t)l * w->n + (size_t)k] * w->lambda[pivot[l]];
        w->lambda[pivot[k]] = sum / w->factor[(size_t)k * w->n + (size_t)k];
    }
}

/* out = A' B for n x n matrices */
static void multiply_transposed(size_t n, const double *a, const double *b, double *out) {
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            out[j * n + i] = kt_dense_dot(a + i * n, b + j * n, (int)n);
}

/* half = Q' M Q, reduced = Cholesky of Q2' M Q2. */
static bool reduce(work *w) {
    const size_t n = w->n, r = (size_t)w->rank, f = n - r;
    for (size_t j = 0; j < n; j++)
        kt_dense_apply(w->mass, (int)n, (int)n, w->basis + j * n, w->reduced + j * n);
    multiply_transposed(n, w->basis, w->reduced, w->half);
    for (size_t j = 0; j < f; j++)
        for (size_t i = 0; i < f; i++)
            w->reduced[j * f + i] = w->half[(r + j) * n + r + i];
    return kt_dense_cholesky(w->reduced, (int)f, NULL);
}

/* Overwrites column d, which holds D, with da. e: the p entries of E, or NULL for zero. */
static void solve_column(work *w, double *d, const double *e) {
    const int32_t *pivot = w->pivot;
    const size_t n = w->n, rank = (size_t)w->rank;
    double *y = w->change, *z = y + rank;
    for (size_t k = 0; k < rank; k++) { /* R1' y = E */
        y[k] = e ? e[pivot[k]] : 0.0;
        for (size_t l = 0; l < k; l++)
            y[k] -= w->factor[k * n + l] * y[l];
        y[k] /= w->factor[k * n + k];
    }
    for (size_t k = rank; k < n; k++) {
        z[k - rank] = -kt_dense_dot(w->basis + k * n, d, (int)n);
        for (size_t l = 0; l < rank; l++)
            z[k - rank] -= w->half[l * n + k] * y[l];
    }
    kt_dense_solve(w->reduced, (int)(n - rank), z);
    kt_dense_apply(w->basis, (int)n, (int)n, y, d);
}

/* ---- the public function ----------------------------------------------------------------------------------------- */

/* Refuses singular positions: the acceleration there may be interpolated from neighbouring states. */
static kt_status refuse_singular(const work *w, const double *q, const double *v, kt_error *error) {
    if (!KT_HAS_LOOPS || !w->model->n.group)
        return KT_OK;
    const kt_reduction_kernels *kernels = kt_reduction_kernels_of(w->model);
    kt_violation violation;
    (void)(kernels->look(w->model, w->data, w->t, q, v, NULL, &violation) &&
           kernels->factor(w->model, w->data, KT_ROWS_ALL, false));
    for (size_t g = 0; g < w->model->n.group; g++)
        if (w->data->near[g])
            return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                                "the loops are at a singular position, or next to one, where accelerations have no "
                                "defined derivative; take a neighbouring one");
    return KT_OK;
}

/* Computes the quantities of the motion at which the derivatives are taken: a, lambda, M, the factors, and the tree's
 * part of D. */
static kt_status prepare(work *w, const double *q, const double *v, const double *tau, const kt_wrench *external,
                         kt_error *error) {
    const kt_model *model = w->model;
    const size_t n = w->n, size = kt_derivative_work_size(model);
    kt_status status = kt_acceleration_evaluate(model, w->data, w->t, q, v, tau, external, w->a, error);
    if (status == KT_OK)
        status = refuse_singular(w, q, v, error);
    if (status == KT_OK)
        status = kt_dynamics_mass(model, w->data, q, w->mass, error);
    if (status == KT_OK)
        status =
            kt_dynamics_inverse_derivatives(model, w->data, w->tree, size, q, v, w->a, external, w->d_q, w->d_v, error);
    if (status == KT_OK)
        status = sum_effects(w, q, v, false, w->force, error);
    if (status == KT_OK && w->p)
        status = kt_loop_equations(model, w->data, w->t, q, v, w->jacobian, NULL, NULL, NULL, error);
    if (status == KT_OK)
        status = factor(w, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(model, w->data, q, v, w->a, external, w->change, error);
    for (size_t i = 0; i < n && status == KT_OK; i++)
        w->change[i] -= (tau ? tau[i] : 0.0) + w->force[i];
    if (status == KT_OK)
        find_multipliers(w, w->change);
    return status;
}

static kt_status solve(work *w, const double *q, const double *v, kt_error *error) {
    const size_t n = w->n;
    const kt_dual_motion at = {
        .model = w->model, .data = w->data, .t = w->t, .q = q, .v = v, .a = w->a, .dof = w->dof, .chain = w->chain};
    if (KT_HAS_LOOPS && w->p)
        kt_dual_loops(&at, w->lambda, w->d_q, w->e_q, w->e_v);
    kt_dual_effects(&at, w->d_q, w->d_v);
    for (size_t j = 0; j < n && has_own_effects(w->model); j++) {
        kt_status status = difference(w, q, v, j, false, w->d_q, error);
        if (status == KT_OK)
            status = difference(w, q, v, j, true, w->d_v, error);
        if (status != KT_OK)
            return status;
    }
    if (!reduce(w))
        return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                            "the mechanism has no inertia along one of the degrees of freedom that its loops leave");
    memset(w->d_tau, 0, n * n * sizeof *w->d_tau);
    for (size_t j = 0; j < n; j++) {
        w->d_tau[j * n + j] = -1.0;
        solve_column(w, w->d_q + j * n, w->rank ? w->e_q + j * w->p : NULL);
        solve_column(w, w->d_v + j * n, w->rank ? w->e_v + j * w->p : NULL);
        solve_column(w, w->d_tau + j * n, NULL);
    }
    if (!kt_all_finite(w->d_q, n * n) || !kt_all_finite(w->d_v, n * n) || !kt_all_finite(w->d_tau, n * n))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "derivatives",
                            "they overflow: look for a position, velocity, force or torque that is huge");
    return KT_OK;
}

kt_status kt_acceleration_derivatives(const kt_model *model, kt_data *data, void *memory, size_t memory_size, double t,
                                      const double *q, const double *v, const double *tau, const kt_wrench *external,
                                      double *da_dq, double *da_dv, double *da_dtau, kt_error *error) {
    const size_t needed = kt_acceleration_work_size(model), numbers = model->n.v * model->n.v;
    work w = {.model = model, .data = data, .t = t, .n = model->n.v, .p = model->n.row};
    kt_status status = kt_arena_check("work", "kt_acceleration_work_size", memory, memory_size, needed, error);
    if (status != KT_OK)
        return status;
    (void)place_arrays(&w, memory, model, w.n, w.p);
    status = prepare(&w, q, v, tau, external, error);
    if (status == KT_OK)
        status = solve(&w, q, v, error);
    if (status != KT_OK)
        return status;
    memcpy(da_dq, w.d_q, numbers * sizeof *da_dq);
    memcpy(da_dv, w.d_v, numbers * sizeof *da_dv);
    if (da_dtau)
        memcpy(da_dtau, w.d_tau, numbers * sizeof *da_dtau);
    return KT_OK;
}
