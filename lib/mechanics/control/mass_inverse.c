/* The response of accelerations to joint forces. For a tree it is M^-1 (dynamics/aba_inverse.h), and with loops Z (Z' M
 * Z)^-1 Z'. If loops are few, these matrices are used, otherwise the factors along the tree (derivative/kkt.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/mass_inverse.h"

#include "derivative/dense_or_tree.h"
#include "derivative/stiffness.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "linear/cholesky.h"

/* ---- memory ------------------------------------------------------------------------------------------------------ */

typedef struct sizes {
    size_t v, closed, along, data, rows, terms;
} sizes;

static bool has_closed_loops(const kt_model *model) { return model->n.group > 0; }

static sizes mass_inverse_sizes_of(const kt_model *model, int rows) {
    const bool closed = has_closed_loops(model), along = kt_mass_inverse_is_along(model);
    return (sizes){.v = model->n.v,
                   .closed = closed && !along ? model->n.v : 0,
                   .along = along ? kt_kkt_init(NULL, NULL, model, NULL) : 0,
                   .data = along ? kt_data_size(model) : 0,
                   .rows = (size_t)rows,
                   .terms = closed ? 0 : kt_inverse_layout(NULL, NULL, &model->n)};
}

KT_ARENA_LAYOUT(lay_out, kt_mass_inverse, KT_MASS_INVERSE_FIELDS, const sizes *s)

/* Whether the product of two numbers of rows can be a number of bytes. */
static bool rows_are_fine(int rows) { return rows >= 0 && (rows == 0 || (size_t)rows < SIZE_MAX / 64 / (size_t)rows); }

size_t kt_mass_inverse_size(const kt_model *model, int rows) {
    if (!model || !rows_are_fine(rows))
        return 0;
    const sizes s = mass_inverse_sizes_of(model, rows);
    return lay_out(NULL, &s);
}

kt_status kt_mass_inverse_init(const kt_model *model, int rows, void *memory, size_t size, kt_mass_inverse **inverse,
                               kt_error *error) {
    if (KT_IS_MISSING(error, model, inverse))
        return KT_ERROR_ARGUMENT;
    if (!rows_are_fine(rows))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "rows",
                            "a Jacobian has no %d rows; give the most that kt_operational_inertia will have, or 0",
                            rows);
    const sizes s = mass_inverse_sizes_of(model, rows);
    kt_status status = kt_massless_reject(model, "kt_mass_inverse_init", "the mass matrix has no inverse", error);
    if (status == KT_OK)
        status = kt_arena_begin("kt_mass_inverse_init", "kt_mass_inverse_size", memory, size, lay_out(NULL, &s), error);
    if (status != KT_OK)
        return status;
    (void)lay_out(memory, &s);
    kt_mass_inverse *w = (kt_mass_inverse *)memory;
    w->model = model;
    w->rows = (int)s.rows;
    if (s.terms)
        (void)kt_inverse_layout(&w->of_tree, w->terms, &model->n);
    if (rows > 0)
        kt_model_units(model, w->unit);
    if (s.along) {
        (void)kt_kkt_init(&w->kkt, w->along, model, NULL);
        const kt_status made = kt_data_init_followed(model, w->memory, s.data, &w->kkt.data, error);
        if (made != KT_OK) /* GCOVR_EXCL_BR_LINE: its memory has the layout that it requires */
            return made;   /* GCOVR_EXCL_LINE */
    }
    *inverse = w;
    return KT_OK;
}

kt_status kt_mass_inverse_create(const kt_model *model, int rows, kt_mass_inverse **inverse, kt_error *error) {
    if (KT_IS_MISSING(error, model, inverse))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_mass_inverse_size(model, rows);
    void *memory = kt_arena_allocate(size, "the inverse of a mass matrix", error);
    return memory ? kt_arena_own(memory, kt_mass_inverse_init(model, rows, memory, size, inverse, error))
                  : KT_ERROR_MEMORY;
}

void kt_mass_inverse_free(kt_mass_inverse *inverse) { kt_arena_free(inverse); }

/* ---- terms ------------------------------------------------------------------------------------------------------- */

/* Computes Z and the factors of Z' M Z. The rounding errors of its entries are proportional to sum z_i^2 M_ii. */
static kt_status compute_closed(kt_mass_inverse *w, kt_data *data, double t, const double *q, kt_error *error) {
    const kt_model *model = w->model;
    const int nv = (int)model->n.v;
    kt_status status = kt_dynamics_mass(model, data, q, w->mass, error);
    if (status == KT_OK)
        status = kt_loop_nullspace(model, data, t, q, w->basis, &w->dofs, error);
    if (status != KT_OK)
        return status;
    for (int c = 0; c < w->dofs; c++) {
        const double *z = w->basis + (size_t)c * model->n.v;
        kt_dense_apply(w->mass, nv, nv, z, w->half);
        w->size[c] = 0.0;
        for (int i = 0; i < nv; i++)
            w->size[c] += z[i] * z[i] * w->mass[(size_t)i * (size_t)(nv + 1)];
        for (int r = c; r < w->dofs; r++)
            w->reduced[(size_t)c * (size_t)w->dofs + (size_t)r] =
                kt_dense_dot(w->basis + (size_t)r * model->n.v, w->half, nv);
    }
    if (kt_dense_cholesky(w->reduced, (size_t)w->dofs, w->dofs, w->size))
        return KT_OK;
    return kt_inertia_reject("mass matrix", error);
}

/* Computes the factors along the tree. The factors have data of their own, because the caller may use its data for
 * other calls meanwhile. */
static kt_status compute_along(kt_mass_inverse *w, double t, const double *q, kt_error *error) {
    const kt_input input = {.q = q};
    const kt_status status = kt_input_check(w->model, &input, error);
    if (status != KT_OK)
        return status;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    return kt_kkt_factor(&w->kkt, KT_ROWS_ALL, KT_METRIC_MASS, t, q, error);
}

kt_status kt_mass_inverse_compute(kt_mass_inverse *inverse, kt_data *data, double t, const double *q, kt_error *error) {
    if (KT_IS_MISSING(error, inverse))
        return KT_ERROR_ARGUMENT;
    if (KT_IS_OTHER_DATA(error, inverse->model, data) || KT_IS_MISSING(error, q || !inverse->model->n.q))
        return KT_ERROR_ARGUMENT;
    const kt_model *model = inverse->model;
    kt_status status = kt_masses_update(model, data, t, error);
    inverse->has_terms = false;
    inverse->kkt.model = kt_model_now(model, data);
    if (status != KT_OK)
        return status;
    if (kt_mass_inverse_is_along(model))
        status = compute_along(inverse, t, q, error);
    else if (has_closed_loops(model))
        status = compute_closed(inverse, data, t, q, error);
    else
        status = kt_inverse_compute(model, data, q, &inverse->of_tree, error);
    inverse->has_terms = status == KT_OK;
    return status;
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

/* x becomes Z (Z' M Z)^-1 Z' x, with the factors in w->reduced. */
static void apply_closed(kt_mass_inverse *w, double *x) {
    const int nv = (int)w->model->n.v;
    for (int c = 0; c < w->dofs; c++)
        w->half[c] = kt_dense_dot(w->basis + (size_t)c * w->model->n.v, x, nv);
    kt_dense_solve(w->reduced, w->dofs, w->half);
    kt_dense_apply(w->basis, nv, w->dofs, w->half, x);
}

void kt_mass_inverse_columns(kt_mass_inverse *inverse, int columns, double *x) {
    if (kt_mass_inverse_is_along(inverse->model)) {
        kt_kkt_solve(&inverse->kkt, (size_t)columns, x, NULL);
        return;
    }
    const size_t nv = inverse->model->n.v;
    if (nv == 0)
        return;
    for (int c = 0; c < columns; c++, x += nv)
        if (has_closed_loops(inverse->model))
            apply_closed(inverse, x);
        else
            kt_inverse_apply(inverse->model, &inverse->of_tree, x);
}

kt_status kt_mass_inverse_apply(kt_mass_inverse *inverse, int columns, double *x, kt_error *error) {
    if (KT_IS_MISSING(error, inverse))
        return KT_ERROR_ARGUMENT;
    if (!inverse->has_terms)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "inverse",
                            "it holds no terms: kt_mass_inverse_compute has not succeeded before");
    const kt_status status = kt_columns_check(inverse->model->n.v, columns, x, error);
    if (status == KT_OK)
        kt_mass_inverse_columns(inverse, columns, x);
    return status;
}
