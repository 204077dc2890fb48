/* What joint forces do to accelerations: M^-1 of a tree (dynamics/mass_inverse.h), or with loops Z (Z' M Z)^-1 Z'. */
#include "control/mass_inverse.h"

#include "reduction/dense.h"

#include <string.h>

/* ---- memory ------------------------------------------------------------------------------------------------------ */

typedef struct sizes {
    size_t v, closed, rows, terms;
} sizes;

static sizes sizes_of(const kt_model *model, int rows) {
    const bool closed = KT_HAS_LOOPS && model->n.group > 0;
    return (sizes){.v = model->n.v,
                   .closed = closed ? model->n.v : 0,
                   .rows = rows > 0 ? (size_t)rows : 0,
                   .terms = closed ? 0 : kt_inverse_layout(NULL, NULL, &model->n)};
}

KT_ARENA_LAYOUT(lay_out, kt_mass_inverse, KT_MASS_INVERSE_FIELDS, const sizes *s)

size_t kt_mass_inverse_size(const kt_model *model, int rows) {
    const sizes s = sizes_of(model, rows);
    return lay_out(NULL, &s);
}

kt_status kt_mass_inverse_init(const kt_model *model, int rows, void *memory, size_t size, kt_mass_inverse **inverse,
                               kt_error *error) {
    const sizes s = sizes_of(model, rows);
    const kt_status status =
        kt_arena_begin("kt_mass_inverse_init", "kt_mass_inverse_size", memory, size, lay_out(NULL, &s), error);
    if (status != KT_OK)
        return status;
    (void)lay_out(memory, &s);
    *inverse = (kt_mass_inverse *)memory;
    (*inverse)->model = model;
    (*inverse)->rows = (int)s.rows;
    if (!s.closed)
        (void)kt_inverse_layout(&(*inverse)->of_tree, (*inverse)->terms, &model->n);
    return KT_OK;
}

kt_status kt_mass_inverse_create(const kt_model *model, int rows, kt_mass_inverse **inverse, kt_error *error) {
    const size_t size = kt_mass_inverse_size(model, rows);
    void *memory = kt_arena_allocate(size, "the inverse of a mass matrix", error);
    return memory ? kt_arena_own(memory, kt_mass_inverse_init(model, rows, memory, size, inverse, error))
                  : KT_ERROR_MEMORY;
}

void kt_mass_inverse_free(kt_mass_inverse *inverse) { kt_arena_free(inverse); }

/* ---- terms ------------------------------------------------------------------------------------------------------- */

/* Z and the factors of Z' M Z, whose entries' rounding errors are proportional to sum z_i^2 M_ii. */
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
    if (kt_dense_cholesky(w->reduced, w->dofs, w->size))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_SINGULAR, "mass matrix",
                        "the mechanism has no inertia along one of the degrees of freedom that its loops leave");
}

static bool is_closed(const kt_mass_inverse *w) { return KT_HAS_LOOPS && w->model->n.group > 0; }

kt_status kt_mass_inverse_compute(kt_mass_inverse *inverse, kt_data *data, double t, const double *q, kt_error *error) {
    inverse->ready = false;
    const kt_status status = is_closed(inverse) ? compute_closed(inverse, data, t, q, error)
                                                : kt_inverse_compute(inverse->model, data, q, &inverse->of_tree, error);
    inverse->ready = status == KT_OK;
    return status;
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

static void apply_closed(kt_mass_inverse *w, double *x) {
    const int nv = (int)w->model->n.v;
    for (int c = 0; c < w->dofs; c++)
        w->half[c] = kt_dense_dot(w->basis + (size_t)c * w->model->n.v, x, nv);
    kt_dense_solve(w->reduced, w->dofs, w->half);
    kt_dense_apply(w->basis, nv, w->dofs, w->half, x);
}

kt_status kt_mass_inverse_apply(kt_mass_inverse *inverse, int columns, double *x, kt_error *error) {
    if (!inverse->ready)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "inverse",
                            "it holds no terms: kt_mass_inverse_compute has not succeeded before");
    for (int c = 0; c < columns; c++, x += inverse->model->n.v)
        if (is_closed(inverse))
            apply_closed(inverse, x);
        else
            kt_inverse_apply(inverse->model, &inverse->of_tree, x);
    return KT_OK;
}
