/* Factors of a mass matrix: memory, the calls of dynamics.h, and the order of velocity coordinates. */
#include "dynamics/dynamics.h"
#include "dynamics/factor.h"

#include <stdio.h>
#include <string.h>

typedef struct kernels {
    size_t (*compute)(kt_mass_factor *);
    void (*down)(kt_mass_factor *, kt_factor_use, double *);
    void (*up)(kt_mass_factor *, kt_factor_use, double *);
} kernels;

static kernels kernels_of(const kt_model *model) {
#ifdef KT_ISAS
    if (model->level == KT_ISA_V4)
        return (kernels){kt_factor_compute_v4, kt_factor_down_v4, kt_factor_up_v4};
    if (model->level == KT_ISA_V3)
        return (kernels){kt_factor_compute_v3, kt_factor_down_v3, kt_factor_up_v3};
#endif
    (void)model;
    return (kernels){kt_factor_compute_baseline, kt_factor_down_baseline, kt_factor_up_baseline};
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_mass_factor, KT_FACTOR_FIELDS, const kt_factor_sizes *s)

static size_t round_up(size_t n) { return (n + KT_FACTOR_ROUND - 1) / KT_FACTOR_ROUND * KT_FACTOR_ROUND; }

/* The rows together have an entry for each pair of a degree of freedom and one that it carries. */
static kt_factor_sizes sizes_of(const kt_model *model) {
    kt_factor_sizes s = {.v = model->n.v, .link = model->n.link};
    size_t dof = 0;
    for (size_t i = 1; i < model->n.link; i++)
        for (int k = 0; k < kt_link_dofs(&model->link[i]); k++, dof++)
            s.number += (size_t)model->link[i].end - dof - 1;
    s.number = round_up(s.number + (KT_FACTOR_ROUND - 1) * s.v);
    s.path = round_up(s.v + 1);
    return s;
}

size_t kt_mass_factor_size(const kt_model *model) {
    const kt_factor_sizes s = sizes_of(model);
    return lay_out(NULL, &s);
}

/* Finds where rows begin, how long they are, and what carries what. */
static void find_rows(kt_mass_factor *f) {
    const kt_model *model = f->model;
    size_t dof = 0, row = 0;
    f->last[0] = -1;
    for (size_t i = 1; i < model->n.link; i++) {
        int32_t parent = f->last[model->link[i].parent];
        for (int k = 0; k < kt_link_dofs(&model->link[i]); k++, dof++) {
            const int32_t depth = parent < 0 ? 0 : f->depth[parent] + 1;
            f->parent[dof] = parent;
            f->depth[dof] = depth;
            f->end[dof] = model->link[i].end;
            f->row[dof] = row;
            row += round_up((size_t)depth);
            if (f->path_length <= (size_t)depth)
                f->path_length = (size_t)depth + 1;
            parent = (int32_t)dof;
        }
        f->last[i] = parent;
    }
}

kt_status kt_mass_factor_init(const kt_model *model, void *memory, size_t size, kt_mass_factor **factor,
                              kt_error *error) {
    const kt_factor_sizes s = sizes_of(model);
    const kt_status status =
        kt_arena_begin("kt_mass_factor_init", "kt_mass_factor_size", memory, size, lay_out(NULL, &s), error);
    if (status != KT_OK)
        return status;
    (void)lay_out(memory, &s);
    *factor = (kt_mass_factor *)memory;
    (*factor)->model = model;
    find_rows(*factor);
    return KT_OK;
}

kt_status kt_mass_factor_create(const kt_model *model, kt_mass_factor **factor, kt_error *error) {
    const size_t size = kt_mass_factor_size(model);
    void *memory = kt_arena_allocate(size, "the factors of a mass matrix", error);
    return memory ? kt_arena_own(memory, kt_mass_factor_init(model, memory, size, factor, error)) : KT_ERROR_MEMORY;
}

void kt_mass_factor_free(kt_mass_factor *factor) { kt_arena_free(factor); }

/* ---- calls ------------------------------------------------------------------------------------------------------- */

/* The entries of M that are not zero whatever the position, from the columns of its lower triangle. */
static void load(kt_mass_factor *f, const double *mass) {
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
    const kt_model *model = factor->model;
    load(factor, mass);
    const size_t failed = kernels_of(model).compute(factor);
    factor->ready = failed == model->n.v;
    if (factor->ready)
        return KT_OK;
    const int body = kt_body_of_velocity(model, model->link_v[failed]);
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "joint '%.100s'", model->text + model->body[body].name);
    return kt_error_set(error, KT_ERROR_SINGULAR, where,
                        "the mass matrix is not positive definite: its pivot there is %g", factor->diagonal[failed]);
}

/* Which passes a call makes, in this order: up, D, down. For a product, the other way round. */
typedef struct passes {
    bool up, scale, down;
} passes;

static void solve(kt_mass_factor *f, passes p, double *x) {
    const kernels k = kernels_of(f->model);
    if (p.up)
        k.up(f, KT_FACTOR_SOLVE, x);
    for (size_t i = 0; p.scale && i < f->model->n.v; i++)
        x[i] /= f->diagonal[i];
    if (p.down)
        k.down(f, KT_FACTOR_SOLVE, x);
}

static void multiply(kt_mass_factor *f, passes p, double *x) {
    const kernels k = kernels_of(f->model);
    if (p.down)
        k.down(f, KT_FACTOR_MULTIPLY, x);
    for (size_t i = 0; p.scale && i < f->model->n.v; i++)
        x[i] *= f->diagonal[i];
    if (p.up)
        k.up(f, KT_FACTOR_MULTIPLY, x);
}

static kt_status apply(kt_mass_factor *f, void (*what)(kt_mass_factor *, passes, double *), passes p, int columns,
                       double *x, kt_error *error) {
    const kt_model *model = f->model;
    const size_t nv = model->n.v;
    if (!f->ready)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "factor",
                            "it holds no factors: kt_mass_factor_compute has not succeeded before");
    for (int c = 0; c < columns; c++, x += nv) {
        if (model->ordered) {
            what(f, p, x);
            continue;
        }
        for (size_t k = 0; k < nv; k++)
            f->x[k] = x[model->link_v[k]];
        what(f, p, f->x);
        for (size_t k = 0; k < nv; k++)
            x[model->link_v[k]] = f->x[k];
    }
    return KT_OK;
}

static const passes all = {true, true, true}, down = {.down = true}, up = {.up = true};

kt_status kt_mass_factor_solve(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, solve, all, columns, x, error);
}

kt_status kt_mass_factor_solve_lower(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, solve, down, columns, x, error);
}

kt_status kt_mass_factor_solve_upper(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, solve, up, columns, x, error);
}

kt_status kt_mass_factor_multiply(kt_mass_factor *factor, int columns, double *x, kt_error *error) {
    return apply(factor, multiply, all, columns, x, error);
}

void kt_mass_factor_diagonal(const kt_mass_factor *factor, double *d) {
    const kt_model *model = factor->model;
    for (size_t k = 0; k < model->n.v; k++)
        d[model->link_v[k]] = factor->diagonal[k];
}
