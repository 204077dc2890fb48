/* The equations of all loops as matrices, and their null space, for callers that need them explicitly. */
#include "base/copy.h"
#include "closure/rejected_loops.h"
#include "dynamics/dynamics.h"
#include "kinetree/mechanism.h"
#include "reduction/kernel.h"

#include <stdio.h>
#include <string.h>

/* Rows are numbered in the order of the description; void rows, which the group leaves out, are zero. */
typedef struct kt_outputs {
    double *jacobian, *residual, *rate, *drift;
} kt_outputs;

static void write_equation_row(const kt_model *model, const kt_group *group, const kt_group_work *w, int r, size_t row,
                               const kt_outputs *out) {
    for (int i = 0; i < w->m && out->jacobian && !kt_group_has_fronts(group); i++)
        out->jacobian[(size_t)model->group_v[group->v + i] * model->n.row + row] =
            w->a[(size_t)r * (size_t)w->m + (size_t)i];
    if (out->residual)
        out->residual[row] = w->residual[r];
    if (out->rate)
        out->rate[row] = -w->rate[r];
    if (out->drift)
        out->drift[row] = w->right[r];
}

/* Writes the columns of A, one by one, of a group that is reduced by fronts; data->delta is zero. */
static void write_front_columns(const kt_model *model, kt_data *data, size_t g, double *jacobian) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    for (int c = 0; c < group->v_count; c++) {
        const int32_t v = model->group_v[group->v + c];
        data->delta[v] = 1.0;
        model->group_kernels->apply(model, data, g, KT_ROWS_ALL, data->delta, kt_group_products(&w), NULL);
        data->delta[v] = 0.0;
        kt_rows_scatter(model, group, w.k, kt_group_products(&w), jacobian + (size_t)v * model->n.row);
    }
}

static void write_group_equations(const kt_model *model, kt_data *data, size_t g, const kt_outputs *out) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    memset(data->delta, 0, model->n.v * sizeof *data->delta);
    if (kt_group_has_fronts(group) && out->jacobian)
        write_front_columns(model, data, g, out->jacobian);
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const int32_t *slot = kt_rows_slots(model, group, loop);
        for (int r = 0; r < loop->row_count; r++)
            if (slot[r] >= 0)
                write_equation_row(model, group, &w, slot[r], (size_t)loop->equation + (size_t)r, out);
    }
}

/* Whether all numbers of a group's equations are finite. If fronts reduce a group, its columns are found one by one.
 * Then one product with ones is checked instead: a number that is not finite stays so in every sum. */
static bool group_is_finite(const kt_model *model, kt_data *data, size_t g, bool with_jacobian) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const size_t k = (size_t)w.k;
    if (!kt_all_finite(w.residual, k) || !kt_all_finite(w.rate, k) || !kt_all_finite(w.right, k))
        return false;
    if (!with_jacobian)
        return true;
    if (!kt_group_has_fronts(group))
        return kt_all_finite(w.a, k * (size_t)w.m);
    memset(data->delta, 0, model->n.v * sizeof *data->delta);
    for (int c = 0; c < group->v_count; c++)
        data->delta[model->group_v[group->v + c]] = 1.0;
    model->group_kernels->apply(model, data, g, KT_ROWS_ALL, data->delta, kt_group_products(&w), NULL);
    return kt_all_finite(kt_group_products(&w), k);
}

static kt_status reject_group(const kt_model *model, size_t g, double t, kt_error *error) {
    char where[KT_WHERE_SIZE];
    const int loop = model->group_loop[model->group[g].loop];
    (void)snprintf(where, sizeof where, "loop '%.100s', t = %.9g s", kt_loop_name(model, loop), t);
    return kt_error_set(error, KT_ERROR_NOT_FINITE, where,
                        "its equations, or those of loops that share links with it, overflow: look for a position or "
                        "velocity that is huge");
}

kt_status kt_loop_equations(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            double *jacobian, double *residual, double *rate, double *drift, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q))
        return KT_ERROR_ARGUMENT;
    const kt_outputs out = {jacobian, residual, rate, drift};
    double *vectors[3] = {residual, rate, drift};
    const kt_input input = {.q = q, .v = v};
    const kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    if (KT_HAS_LOOPS)
        model->group_kernels->fill(model, data, t, q, v ? v : model->zero);
    for (size_t g = 0; KT_HAS_LOOPS && g < model->n.group; g++)
        if (!group_is_finite(model, data, g, jacobian != NULL))
            return kt_loops_explain(model, data, t, q, v, reject_group(model, g, t, error), error);
    if (jacobian)
        memset(jacobian, 0, model->n.row * model->n.v * sizeof *jacobian);
    for (int k = 0; k < 3; k++)
        if (vectors[k])
            memset(vectors[k], 0, model->n.row * sizeof *vectors[k]);
    for (size_t g = 0; KT_HAS_LOOPS && g < model->n.group; g++)
        write_group_equations(model, data, g, &out);
    return KT_OK;
}

/* ---- the null space ---------------------------------------------------------------------------------------------- */

/* Writes the columns of a group, from `column` on, and marks its coordinates. Returns the number of columns. */
static size_t write_group_basis(const kt_model *model, kt_data *data, size_t g, double *column, double *mark) {
    const size_t nv = model->n.v;
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const size_t m = (size_t)w.m, count = m - (size_t)data->rank[g];
    for (size_t i = 0; i < m; i++) {
        const size_t row = (size_t)model->group_v[(size_t)group->v + i];
        mark[row] = 1.0;
        for (size_t c = 0; c < count && !kt_group_has_fronts(group); c++)
            column[c * nv + row] = w.basis[c * m + i];
    }
    for (size_t c = 0; c < count && kt_group_has_fronts(group); c++)
        kt_reduction_kernels_in_space(model)->nullspace(model, data, g, (int)c, column + c * nv);
    return count;
}

kt_status kt_loop_nullspace(const kt_model *model, kt_data *data, double t, const double *q, double *basis,
                            int *columns, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, basis || !model->n.v, columns))
        return KT_ERROR_ARGUMENT;
    const size_t nv = model->n.v;
    const kt_input input = {.q = q};
    size_t count = 0;
    const kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    if (KT_HAS_LOOPS && model->n.group) {
        const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
        kernels->fill(model, data, t, q, model->zero);
        if (!kernels->factor(model, data, KT_ROWS_ALL, false))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL,
                                "the loops' equations overflow: look for a position that is huge");
        kernels->basis(model, data);
    }
    kt_clear(basis, nv * nv * sizeof *basis);
    memset(data->delta, 0, nv * sizeof *data->delta); /* 1 for coordinates of a group */
    for (size_t g = 0; KT_HAS_LOOPS && g < model->n.group; g++)
        count += write_group_basis(model, data, g, basis + count * nv, data->delta);
    for (size_t i = 0; i < nv; i++)
        if (data->delta[i] == 0.0)
            basis[count++ * nv + i] = 1.0;
    *columns = (int)count;
    return KT_OK;
}
