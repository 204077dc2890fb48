/* Derivatives of the accelerations of whole mechanisms: the linearised equations (stiffness.c) solved for da. If loops
 * are few,
 *     da = Q1 y + Z z,   R1' y = E,   (Z' M Z) z = -Z' (D + M Q1 y)
 * Otherwise M da - A' dlambda = -D, A da = E is solved along the tree (kkt.h). Without loops M da = -D is solved with
 * the factors of M along the tree. With respect to joint forces D = -1 and E = 0. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "derivative/stiffness.h"

#include "derivative/kkt.h"
#include "derivative/loop_response.h"
#include "dynamics/dynamics.h"
#include "dynamics/dynamics_derivative.h"
#include "evaluate/evaluate.h"
#include "linear/cholesky.h"

#include <math.h>
#include <string.h>

static size_t kkt_size(const kt_model *model) {
    if (!model->n.row || kt_linearized_is_dense(model))
        return 0;
    return kt_kkt_init(NULL, NULL, model, NULL);
}

/* Every array: type, name, count, meaning. With loops and dense factors m is n, otherwise 0. */
#define FIELDS(X)                                                                                                      \
    X(double, reduced, m *m, "Z' M Z, factored")                                                                       \
    X(double, solution, m, "y, z")                                                                                     \
    X(char, factors, model->n.row ? 0 : kt_mass_factor_size(model), "of M: L'DL")                                      \
    X(char, along, kkt_size(model), "of `kkt`")                                                                        \
    X(double, d_tau, n *n, "result by joint forces")

typedef struct work {
    kt_linearized of;
    kt_mass_factor *factor;
    kt_kkt kkt;
    KT_ARENA_DECLARE(FIELDS)
} work;

KT_ARENA_ARRAYS(place_arrays, work, FIELDS, const kt_model *model, size_t n, size_t m)

static size_t lay_out_derivatives(work *w, void *memory, const kt_model *model) {
    const size_t n = model->n.v;
    return place_arrays(w, memory, model, n, kt_linearized_is_dense(model) ? n : 0);
}

size_t kt_acceleration_work_size(const kt_model *model) {
    return model ? kt_linearized_init(NULL, NULL, model, NULL, 0.0, kt_linearized_is_dense(model)) +
                       lay_out_derivatives(NULL, NULL, model)
                 : 0;
}

/* The factors of M, those of kkt.h, or reduced = Cholesky of Z' M Z. */
static kt_status factor_reduced_mass(work *w, const double *q, kt_error *error) {
    const kt_model *model = w->of.model;
    const size_t n = w->of.n, r = (size_t)w->of.qr.rank, f = n - r;
    if (!w->of.p) {
        const kt_status status = kt_mass_factor_init(model, w->factors, kt_mass_factor_size(model), &w->factor, error);
        return status == KT_OK ? kt_mass_factor_compute(w->factor, w->of.mass, error) : status;
    }
    if (!w->of.dense) {
        (void)kt_kkt_init(&w->kkt, w->along, model, w->of.data);
        return kt_kkt_factor(&w->kkt, KT_ROWS_ALL, KT_METRIC_MASS, w->of.t, q, error);
    }
    for (size_t j = 0; j < f; j++)
        memcpy(w->reduced + j * f, w->of.half + j * n + r, f * sizeof *w->reduced);
    if (kt_dense_cholesky(w->reduced, f, (int)f, NULL))
        return KT_OK;
    return kt_inertia_reject("derivatives", error);
}

/* Overwrites column d, which holds D, with da. e: the p entries of E, or NULL for zero. */
static void solve_closed(work *w, double *d, const double *e) {
    const size_t n = w->of.n, rank = (size_t)w->of.qr.rank;
    double *y = w->solution, *z = y + rank;
    memset(y, 0, rank * sizeof *y);
    if (e)
        kt_jacobian_qr_solve_lower(&w->of.qr, e, y);
    for (size_t k = rank; k < n; k++) {
        z[k - rank] = -kt_dense_dot(w->of.qr.basis + k * n, d, (int)n);
        for (size_t l = 0; l < rank; l++)
            z[k - rank] -= w->of.half[(k - rank) * n + l] * y[l];
    }
    kt_dense_solve(w->reduced, (int)(n - rank), z);
    kt_dense_apply(w->of.qr.basis, (int)n, (int)n, y, d);
}

/* Overwrites `columns` columns of D with da. */
static kt_status solve_derivative_columns(work *w, size_t columns, double *d, const double *e, kt_error *error) {
    const size_t n = w->of.n, p = w->of.p;
    for (size_t j = 0; j < columns && w->of.dense; j++)
        solve_closed(w, d + j * n, e ? e + j * p : NULL);
    for (size_t i = 0; i < n * columns && !w->of.dense; i++)
        d[i] = -d[i];
    if (p && !w->of.dense)
        kt_kkt_solve(&w->kkt, columns, d, e);
    const kt_status status = p ? KT_OK : kt_mass_factor_solve(w->factor, (int)columns, d, error);
    return status == KT_OK && !kt_all_finite(d, n * columns) ? kt_derivatives_overflow(error) : status;
}

/* da/dtau: D = -1, and the changes of friction from loads. */
static kt_status solve_force_derivatives(work *w, const kt_dynamic_state *at, kt_error *error) {
    const size_t n = w->of.n;
    memset(w->d_tau, 0, n * n * sizeof *w->d_tau);
    for (size_t j = 0; j < n; j++)
        w->d_tau[j * n + j] = -1.0;
    const kt_status status = kt_linearized_load_forces(&w->of, at, w->d_tau, error);
    if (status != KT_OK)
        return status;
    return solve_derivative_columns(w, n, w->d_tau, NULL, error);
}

/* Rejects derivatives that are too inaccurate next to a singular position. */
static kt_status reject_unknown_accelerations(const work *w, kt_error *error) {
    const kt_model *model = w->of.model;
    const size_t n = w->of.n;
    double most = 0.0;
    for (size_t i = 0; i < model->n.group_v; i++)
        for (size_t j = 0; j < model->n.group_v; j++) {
            const size_t row = (size_t)model->group_v[i], column = (size_t)model->group_v[j];
            most = fmax(most, fabs(w->of.d_q[column * n + row]) * model->unit[j] / model->unit[i]);
        }
    return kt_derivatives_reject_unknown(w->of.t, w->of.error, most, error);
}

kt_status
kt_acceleration_derivatives(const kt_model *model, kt_data *data, void *memory, size_t memory_size, double t,
                            const double *q, const double *v, const double *tau, const kt_wrench *external,
                            /* NOLINTNEXTLINE(readability-non-const-parameter): written by way of the matrices */
                            double *da_dq, double *da_dv, double *da_dtau, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, q || !model->n.q, da_dq || !model->n.v, da_dv || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {t, q, v ? v : model->zero, tau, external};
    const kt_acceleration_matrices to = {.by = {da_dq, da_dv, da_dtau}};
    const kt_status status = kt_open_contacts_reject(model, data, &at, error);
    return status == KT_OK ? kt_acceleration_derivatives_at(model, data, memory, memory_size, &at, NULL, &to, error)
                           : status;
}

kt_status kt_acceleration_derivatives_at(const kt_model *model, kt_data *data, void *memory, size_t memory_size,
                                         const kt_dynamic_state *at, const double *a,
                                         const kt_acceleration_matrices *to, kt_error *error) {
    const kt_state_derivatives *states = to->states;
    const size_t bytes = model->n.v * model->n.v * sizeof(double);
    work w = {.reduced = NULL};
    kt_status status = kt_arena_check("work", "kt_acceleration_work_size", memory, memory_size,
                                      kt_acceleration_work_size(model), error);
    if (status == KT_OK)
        status = kt_massless_reject(model, "derivatives", "its accelerations have none", error);
    if (status == KT_OK)
        status = kt_slip_reject(model, "derivatives", error);
    if (status != KT_OK)
        return status;
    const size_t used = kt_linearized_init(&w.of, memory, model, data, at->t, kt_linearized_is_dense(model));
    w.of.estimates = w.of.exact = true;
    (void)lay_out_derivatives(&w, (char *)memory + used, model);
    status = kt_linearized_fill(&w.of, at, a, error);
    if (status == KT_OK)
        status = factor_reduced_mass(&w, at->q, error);
    if (status == KT_OK)
        status = solve_derivative_columns(&w, w.of.n, w.of.d_q, w.of.e_q, error);
    if (status == KT_OK)
        status = solve_derivative_columns(&w, w.of.n, w.of.d_v, w.of.e_v, error);
    if (status == KT_OK && states && model->n.x > 0)
        status = solve_derivative_columns(&w, model->n.x, w.of.force_x, NULL, error);
    if (status == KT_OK && w.of.error > 0.0 && !to->uncertain)
        status = reject_unknown_accelerations(&w, error);
    if (status == KT_OK && to->by.tau)
        status = solve_force_derivatives(&w, at, error);
    if (status != KT_OK)
        return status;
    kt_copy(to->by.q, w.of.d_q, bytes);
    kt_copy(to->by.v, w.of.d_v, bytes);
    if (to->by.tau)
        memcpy(to->by.tau, w.d_tau, bytes);
    if (states) {
        kt_copy(states->force, w.of.force_x, w.of.n * model->n.x * sizeof(double));
        kt_linearized_copy_rates(&w.of, states);
    }
    return KT_OK;
}
