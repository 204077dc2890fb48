/* Derivatives of the accelerations of whole mechanisms: the linearised equations (stiffness.c) solved for da,
 *     da = Q1 y + Z z,   R1' y = E,   (Z' M Z) z = -Z' (D + M Q1 y)
 * and without loops M da = -D. With respect to joint forces D = -1 and E = 0.
 */
#include "reduction/stiffness.h"

#include "dynamics/dynamics.h"
#include "reduction/dense.h"

#include <string.h>

/* Every array: type, name, count, meaning. */
#define FIELDS(X)                                                                                                      \
    X(double, reduced, n *n, "Z' M Z, factored")                                                                       \
    X(double, d_tau, n *n, "result by joint forces")                                                                   \
    X(double, solution, n, "y, z")

typedef struct work {
    kt_linearized of;
    KT_ARENA_DECLARE(FIELDS)
} work;

KT_ARENA_ARRAYS(place_arrays, work, FIELDS, size_t n)

size_t kt_acceleration_work_size(const kt_model *model) {
    return kt_linearized_init(NULL, NULL, model, NULL, 0.0) + place_arrays(NULL, NULL, model->n.v);
}

/* reduced = Cholesky of Z' M Z, or without loops of M. */
static bool factor(work *w) {
    const size_t n = w->of.n, r = (size_t)w->of.rank, f = n - r;
    const double *whole = w->of.p ? w->of.half : w->of.mass;
    for (size_t j = 0; j < f; j++)
        memcpy(w->reduced + j * f, whole + (r + j) * n + r, f * sizeof *w->reduced);
    return kt_dense_cholesky(w->reduced, (int)f, NULL);
}

/* Overwrites column d, which holds D, with da. e: the p entries of E, or NULL for zero. */
static void solve_closed(work *w, double *d, const double *e) {
    const size_t n = w->of.n, rank = (size_t)w->of.rank;
    double *y = w->solution, *z = y + rank;
    memset(y, 0, rank * sizeof *y);
    if (e)
        kt_linearized_across(&w->of, e, y);
    for (size_t k = rank; k < n; k++) {
        z[k - rank] = -kt_dense_dot(w->of.basis + k * n, d, (int)n);
        for (size_t l = 0; l < rank; l++)
            z[k - rank] -= w->of.half[l * n + k] * y[l];
    }
    kt_dense_solve(w->reduced, (int)(n - rank), z);
    kt_dense_apply(w->of.basis, (int)n, (int)n, y, d);
}

static void solve(work *w, double *d, const double *e) {
    const size_t n = w->of.n, p = w->of.p;
    for (size_t j = 0; j < n; j++, d += n) {
        if (p) {
            solve_closed(w, d, e ? e + j * p : NULL);
            continue;
        }
        for (size_t i = 0; i < n; i++)
            d[i] = -d[i];
        kt_dense_solve(w->reduced, (int)n, d);
    }
}

/* da/dtau: D = -1. */
static void solve_forces(work *w) {
    const size_t n = w->of.n;
    memset(w->d_tau, 0, n * n * sizeof *w->d_tau);
    for (size_t j = 0; j < n; j++)
        w->d_tau[j * n + j] = -1.0;
    solve(w, w->d_tau, NULL);
}

static kt_status solve_all(work *w, bool forces, kt_error *error) {
    const size_t square = w->of.n * w->of.n;
    if (!factor(w))
        return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                            "the mechanism has no inertia along one of the degrees of freedom that its loops leave");
    solve(w, w->of.d_q, w->of.e_q);
    solve(w, w->of.d_v, w->of.e_v);
    if (forces)
        solve_forces(w);
    const bool finite = kt_all_finite(w->of.d_q, square) && kt_all_finite(w->of.d_v, square) &&
                        (!forces || kt_all_finite(w->d_tau, square));
    return finite ? KT_OK : kt_linearized_overflow(error);
}

kt_status kt_acceleration_derivatives(const kt_model *model, kt_data *data, void *memory, size_t memory_size, double t,
                                      const double *q, const double *v, const double *tau, const kt_wrench *external,
                                      double *da_dq, double *da_dv, double *da_dtau, kt_error *error) {
    const size_t bytes = model->n.v * model->n.v * sizeof(double);
    work w = {.reduced = NULL};
    kt_status status = kt_arena_check("work", "kt_acceleration_work_size", memory, memory_size,
                                      kt_acceleration_work_size(model), error);
    if (status != KT_OK)
        return status;
    const size_t used = kt_linearized_init(&w.of, memory, model, data, t);
    (void)place_arrays(&w, (char *)memory + used, model->n.v);
    status = kt_linearized_fill(&w.of, q, v, tau, external, NULL, error);
    if (status == KT_OK)
        status = solve_all(&w, da_dtau != NULL, error);
    if (status != KT_OK)
        return status;
    memcpy(da_dq, w.of.d_q, bytes);
    memcpy(da_dv, w.of.d_v, bytes);
    if (da_dtau)
        memcpy(da_dtau, w.d_tau, bytes);
    return KT_OK;
}
