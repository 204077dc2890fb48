/* Factors of a mass matrix: memory, the calls of dynamics.h, and the order of velocity coordinates. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "dynamics/ltdl.h"

static const kt_factor_kernels *factor_kernels_of(const kt_model *model) {
    KT_BY_ISA(model->isa, return &, kt_factor_kernels, );
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_mass_factor, KT_FACTOR_FIELDS, const kt_factor_sizes *s)

static size_t round_up(size_t n) { return (n + KT_FACTOR_ROUND - 1) / KT_FACTOR_ROUND * KT_FACTOR_ROUND; }

/* The rows together have an entry for each pair of a degree of freedom and a degree of freedom that it carries. */
static kt_factor_sizes factor_sizes_of(const kt_model *model) {
    kt_factor_sizes s = {.v = model->n.v, .link = model->n.link};
    size_t dof = 0;
    for (size_t i = 1; i < model->n.link; i++)
        for (int k = 0; k < kt_link_dofs(&model->link[i]); k++, dof++)
            s.number += (size_t)model->link[i].end - dof - 1;
    s.number = round_up(s.number + (KT_FACTOR_ROUND - 1) * s.v) + KT_FACTOR_ROUND; /* a pass reads beyond a row */
    s.path = round_up(s.v + 1);
    return s;
}

size_t kt_mass_factor_size(const kt_model *model) {
    if (!model)
        return 0;
    const kt_factor_sizes s = factor_sizes_of(model);
    return lay_out(NULL, &s);
}

/* Finds the begin and the length of the rows, and the support of each degree of freedom. */
static void find_rows(kt_mass_factor *f) {
    const kt_model *model = f->model;
    size_t dof = 0, row = 0;
    f->last[0] = -1;
    f->is_short = true;
    for (size_t i = 1; i < model->n.link; i++) {
        int32_t parent = f->last[model->link[i].parent];
        for (int k = 0; k < kt_link_dofs(&model->link[i]); k++, dof++) {
            const int32_t depth = parent < 0 ? 0 : f->depth[parent] + 1;
            f->parent[dof] = parent;
            f->depth[dof] = depth;
            f->end[dof] = model->link[i].end;
            f->row[dof] = row;
            row += round_up((size_t)depth);
            f->is_short &= depth <= KT_FACTOR_SHORT;
            parent = (int32_t)dof;
        }
        f->last[i] = parent;
    }
}

kt_status kt_mass_factor_init(const kt_model *model, void *memory, size_t size, kt_mass_factor **factor,
                              kt_error *error) {
    if (KT_IS_MISSING(error, model, factor))
        return KT_ERROR_ARGUMENT;
    const kt_factor_sizes s = factor_sizes_of(model);
    const kt_status status =
        kt_arena_begin("kt_mass_factor_init", "kt_mass_factor_size", memory, size, lay_out(NULL, &s), error);
    if (status != KT_OK)
        return status;
    (void)lay_out(memory, &s);
    *factor = (kt_mass_factor *)memory;
    (*factor)->model = model;
    (*factor)->kernels = factor_kernels_of(model);
    find_rows(*factor);
    return KT_OK;
}

kt_status kt_mass_factor_create(const kt_model *model, kt_mass_factor **factor, kt_error *error) {
    if (KT_IS_MISSING(error, model, factor))
        return KT_ERROR_ARGUMENT;
    const size_t size = kt_mass_factor_size(model);
    void *memory = kt_arena_allocate(size, "the factors of a mass matrix", error);
    return memory ? kt_arena_own(memory, kt_mass_factor_init(model, memory, size, factor, error)) : KT_ERROR_MEMORY;
}

void kt_mass_factor_free(kt_mass_factor *factor) { kt_arena_free(factor); }

/* ---- calls ------------------------------------------------------------------------------------------------------- */

/* Copies the entries of M that are not zero for every position, from the columns of its lower triangle. */
static void take_mass(kt_mass_factor *f, const double *mass) {
    const int32_t *v = f->model->link_v;
    const size_t nv = f->model->n.v;
    for (size_t i = 0; i < nv; i++) {
        const double *column = mass + (size_t)v[i] * nv;
        double *entry = f->number + f->depth[i];
        f->diagonal[i] = column[v[i]];
        for (size_t k = i + 1; k < (size_t)f->end[i]; k++)
            entry[f->row[k]] = column[v[k]];
    }
}

kt_status kt_mass_factor_compute(kt_mass_factor *factor, const double *mass, kt_error *error) {
    if (KT_IS_MISSING(error, factor, mass || !factor->model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_model *model = factor->model;
    take_mass(factor, mass);
    const size_t failed = factor->kernels->compute(factor);
    factor->is_factored = failed == model->n.v;
    if (factor->is_factored)
        return KT_OK;
    const int body = kt_velocity_body(model, model->link_v[failed]);
    return kt_error_set(error, KT_ERROR_SINGULAR,
                        kt_where_format("joint '%.100s'", model->text + model->body[body].joint_name).text,
                        "the mass matrix is not positive definite: its pivot there is %g", factor->diagonal[failed]);
}

/* Applies a call if velocity coordinates have another order than the links. */
static void apply_sorted(kt_mass_factor *f, kt_factor_call call, int columns, double *x) {
    const size_t nv = f->model->n.v;
    const int32_t *v = f->model->link_v;
    for (int c = 0; c < columns; c++, x += nv) {
        for (size_t k = 0; k < nv; k++)
            f->x[k] = x[v[k]];
        f->kernels->apply[call](f, 1, f->x);
        for (size_t k = 0; k < nv; k++)
            x[v[k]] = f->x[k];
    }
}

/* Applies a call in place to columns in the order of the velocity coordinates, after a check of the arguments. */
KT_INLINE kt_status apply(kt_mass_factor *f, kt_factor_call call, int columns, double *x, kt_error *error) {
    if (!f || !f->is_factored)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "factor",
                            "it holds no factors: kt_mass_factor_compute has not succeeded before");
    const kt_status status = kt_columns_check(f->model->n.v, columns, x, error);
    if (status != KT_OK)
        return status;
    if (f->model->ordered)
        f->kernels->apply[call](f, columns, x);
    else
        apply_sorted(f, call, columns, x);
    return KT_OK;
}

kt_status kt_mass_factor_solve(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, KT_FACTOR_SOLVE, columns, x, error);
}

kt_status kt_mass_factor_solve_lower(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, KT_FACTOR_SOLVE_LOWER, columns, x, error);
}

kt_status kt_mass_factor_solve_upper(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, KT_FACTOR_SOLVE_UPPER, columns, x, error);
}

kt_status kt_mass_factor_multiply(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, KT_FACTOR_MULTIPLY, columns, x, error);
}

void kt_mass_factor_diagonal(const kt_mass_factor *factor, double *d) {
    if (!factor || !d)
        return;
    const kt_model *model = factor->model;
    for (size_t k = 0; k < model->n.v; k++)
        d[model->link_v[k]] = factor->diagonal[k];
}
