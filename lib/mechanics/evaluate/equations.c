/* The equations of all loops as matrices, and their null space, for callers that need explicit matrices. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/rejected_loops.h"
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "reduction/kernel.h"

#include <string.h>

/* Rows are numbered in the order of the description; void rows, which the group leaves out, are zero. */
typedef struct kt_outputs {
    double *jacobian; /* equations x nv, column by column, or by groups (kt_loop_entries) */
    bool by_groups;
    double *residual, *rate, *drift;
} kt_outputs;

/* The place in the jacobian of row r of a loop and coordinate i of its group. */
static size_t place_of_entry(const kt_model *model, const kt_outputs *out, const kt_loop_record *loop, int r, int i) {
    const kt_group *group = &model->group[loop->group];
    return out->by_groups ? kt_loop_entry(group, loop, r) + (size_t)i
                          : (size_t)model->group_v[group->v + i] * model->n.row + (size_t)loop->equation + (size_t)r;
}

/* Writes the row of a group that dense matrices reduce. */
static void write_dense_row(const kt_model *model, const kt_loop_record *loop, int r, const double *a,
                            const kt_outputs *out) {
    const kt_group *group = &model->group[loop->group];
    if (out->by_groups)
        memcpy(out->jacobian + kt_loop_entry(group, loop, r), a, (size_t)group->v_count * sizeof *a);
    for (int i = 0; i < group->v_count && !out->by_groups; i++)
        out->jacobian[place_of_entry(model, out, loop, r, i)] = a[i];
}

/* Writes equation r of a loop, in a slot of its group. */
static void write_equation_row(const kt_model *model, const kt_loop_record *loop, int r, int slot,
                               const kt_group_work *w, const kt_outputs *out) {
    const size_t row = (size_t)loop->equation + (size_t)r;
    if (out->jacobian && !model->group[loop->group].has_fronts)
        write_dense_row(model, loop, r, w->a + (size_t)slot * (size_t)w->m, out);
    if (out->residual)
        out->residual[row] = w->residual[slot];
    if (out->rate)
        out->rate[row] = -w->rate[slot];
    if (out->drift)
        out->drift[row] = w->right[slot];
}

/* Writes the columns of A, one by one, of a group that is reduced by fronts. */
static void write_front_columns(const kt_model *model, kt_data *data, size_t g, const kt_outputs *out) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const double *column = kt_group_products(&w);
    memset(data->delta, 0, model->n.v * sizeof *data->delta);
    for (int c = 0; c < group->v_count; c++) {
        const int32_t v = model->group_v[group->v + c];
        data->delta[v] = 1.0;
        model->group_kernels->apply(model, data, g, KT_ROWS_ALL, data->delta, kt_group_products(&w), NULL);
        data->delta[v] = 0.0;
        for (int i = 0; i < group->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
            const int32_t *slot = model->slot + loop->slot;
            for (int r = 0; r < loop->row_count; r++)
                if (slot[r] >= 0)
                    out->jacobian[place_of_entry(model, out, loop, r, c)] = column[slot[r]];
        }
    }
}

/* Writes the equations of a group's loops. Equations that vanish everywhere have no slot; their rows are zero. */
static void write_group_equations(const kt_model *model, kt_data *data, size_t g, const kt_outputs *out) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    if (group->has_fronts && out->jacobian)
        write_front_columns(model, data, g, out);
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const int32_t *slot = model->slot + loop->slot;
        for (int r = 0; r < loop->row_count; r++)
            if (slot[r] >= 0)
                write_equation_row(model, loop, r, slot[r], &w, out);
            else if (out->jacobian && out->by_groups)
                memset(out->jacobian + kt_loop_entry(group, loop, r), 0,
                       (size_t)group->v_count * sizeof *out->jacobian);
    }
}

/* Whether all numbers of a group's equations are finite; A counts only with_jacobian. If fronts reduce a group, its
 * columns would have to be computed one by one. Therefore the product with a vector of ones is checked instead, because
 * a number that is not finite makes every sum not finite. */
static bool group_is_finite(const kt_model *model, kt_data *data, size_t g, bool with_jacobian) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    const size_t k = (size_t)w.k;
    if (!kt_all_finite(w.residual, k) || !kt_all_finite(w.rate, k) || !kt_all_finite(w.right, k))
        return false;
    if (!with_jacobian)
        return true;
    if (!group->has_fronts)
        return kt_all_finite(w.a, k * (size_t)w.m);
    memset(data->delta, 0, model->n.v * sizeof *data->delta);
    for (int c = 0; c < group->v_count; c++)
        data->delta[model->group_v[group->v + c]] = 1.0;
    model->group_kernels->apply(model, data, g, KT_ROWS_ALL, data->delta, kt_group_products(&w), NULL);
    return kt_all_finite(kt_group_products(&w), k);
}

static kt_status reject_group(const kt_model *model, size_t g, double t, kt_error *error) {
    const int loop = model->group_loop[model->group[g].loop];
    return kt_error_set(error, KT_ERROR_NOT_FINITE,
                        kt_where_format("loop '%.100s', t = %.9g s", kt_loop_name(model, loop), t).text,
                        "its equations, or those of loops that share links with it, overflow: look for a position or "
                        "velocity that is huge");
}

/* Fills the equations at (t, q, v), and writes the requested outputs; v may be NULL (zero). Outputs are untouched if a
 * number is not finite. */
static kt_status find_equations(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                const kt_outputs *out, kt_error *error) {
    double *vectors[3] = {out->residual, out->rate, out->drift};
    const kt_input input = {.q = q, .v = v};
    const kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    model->group_kernels->fill(model, data, t, q, v ? v : model->zero);
    for (size_t g = 0; g < model->n.group; g++)
        if (!group_is_finite(model, data, g, out->jacobian != NULL))
            return kt_loops_explain(model, data, t, q, v, reject_group(model, g, t, error), error);
    if (out->jacobian && !out->by_groups) /* rows by groups are written as a whole */
        memset(out->jacobian, 0, model->n.row * model->n.v * sizeof *out->jacobian);
    for (int k = 0; k < 3; k++)
        if (vectors[k])
            memset(vectors[k], 0, model->n.row * sizeof *vectors[k]);
    for (size_t g = 0; g < model->n.group; g++)
        write_group_equations(model, data, g, out);
    return KT_OK;
}

/* NOLINTBEGIN(readability-non-const-parameter): results are written by way of the outputs */
kt_status kt_loop_equations(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            double *jacobian, double *residual, double *rate, double *drift, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q))
        return KT_ERROR_ARGUMENT;
    const kt_outputs out = {jacobian, false, residual, rate, drift};
    return find_equations(model, data, t, q, v, &out, error);
}

kt_status kt_loop_entries(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *entries,
                          double *residual, double *rate, double *drift, kt_error *error) {
    const kt_outputs out = {entries, true, residual, rate, drift};
    return find_equations(model, data, at->t, at->q, at->v, &out, error);
}

void kt_loop_entries_of(const kt_model *model, const kt_data *data, const kt_dynamic_state *at, int index,
                        double *entries, double *residual, double *rate, double *drift) {
    const kt_loop_record *loop = &model->loop[index];
    const kt_group *group = &model->group[loop->group];
    const int32_t *known = model->slot + loop->slot;
    double closes[KT_LOOP_ROW_MAX], scale[KT_LOOP_ROW_MAX];
    const size_t equation = (size_t)loop->equation;
    const kt_group_work w = {.m = group->v_count,
                             .k = loop->row_count,
                             .a = entries + kt_loop_entry(group, loop, 0),
                             .residual = residual + equation,
                             .rate = rate + equation,
                             .right = drift + equation,
                             .closes = closes,
                             .scale = scale};
    int32_t slot[KT_LOOP_ROW_MAX];
    for (int r = 0; r < loop->row_count; r++) {
        slot[r] = known[r] < 0 ? -1 : r;
        w.residual[r] = w.rate[r] = w.right[r] = 0.0;
    }
    model->group_kernels->fill_loop(model, data, at, index, slot, &w);
    for (int r = 0; r < loop->row_count; r++)
        w.rate[r] = slot[r] < 0 ? 0.0 : -w.rate[r];
}
/* NOLINTEND(readability-non-const-parameter) */

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
        for (size_t c = 0; c < count && !group->has_fronts; c++)
            column[c * nv + row] = w.basis[c * m + i];
    }
    for (size_t c = 0; c < count && group->has_fronts; c++)
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
    if (model->n.group) {
        const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
        kernels->fill(model, data, t, q, model->zero);
        if (!kernels->factor(model, data, KT_ROWS_ALL, false))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL,
                                "the loops' equations overflow: look for a position that is huge");
        kernels->basis(model, data);
    }
    kt_clear(basis, nv * nv * sizeof *basis);
    memset(data->delta, 0, nv * sizeof *data->delta); /* 1 for coordinates of a group */
    for (size_t g = 0; g < model->n.group; g++)
        count += write_group_basis(model, data, g, basis + count * nv, data->delta);
    for (size_t i = 0; i < nv; i++)
        if (data->delta[i] == 0.0)
            basis[count++ * nv + i] = 1.0;
    *columns = (int)count;
    return KT_OK;
}
