/* Closed contacts as rows in range space. The mechanism is its tree, and the n rows of the closed contacts hold it:
 *
 *     J a = b'',   a = a0 + M^-1 (f + J' lambda)
 *
 * with a0 the accelerations of the tree, and f further joint forces, such as those of friction that slips. With the
 * response Y = M^-1 J' and K = J Y = L L' follow
 *
 *     lambda = K^-1 (b'' - J a0 - Y' f)
 *
 * M^-1 is that of the articulated-body recursion, O(nv) a column (dynamics/aba_inverse.h). Other forces change the
 * result without another recursion. The elimination in the recursion (lib/reduction) makes one group of all links
 * between contacts, and costs O(nv^3) for it.
 *
 * K has the condition of J squared. So rows have to be independent: in the metric of M^-1, the sine of the angle
 * between each row and the rows before must exceed 0.01. Otherwise the reduction decides, with its ranks and its
 * treatment of singular positions. One correction takes what rounding left in the rows, b'' - J a.
 */
#include "mechanism/range_space.h"

#include "algebra/finite.h"
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "linear/cholesky.h"
#include "mechanism/evaluate.h"
#include "reduction/kernel.h"

/* The least square of the sine. */
static const double independent_part = 1e-4;

KT_ARENA_LAYOUT(lay_out_range, kt_range, KT_RANGE_FIELDS, const kt_counts *n)

size_t kt_range_size(const kt_counts *n) { return lay_out_range(NULL, n); }

kt_range *kt_range_init(const kt_model *model, void *memory) {
    kt_range *r = memory;
    (void)lay_out_range(memory, &model->n);
    (void)kt_inverse_layout(&r->terms, r->inverse, &model->n);
    r->rows = 0;
    r->nv = (int)model->n.v;
    return r;
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static bool has_contacts_alone(const kt_model *model) {
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &model->loop[i];
        if (loop->group >= 0 && loop->side == KT_SIDE_NONE && loop->friction == 0)
            return false;
    }
    for (size_t g = 0; g < model->n.group; g++)
        if (kt_group_has_fronts(&model->group[g]) ||
            model->group[g].rank[KT_ROWS_ALL] != model->group[g].count[KT_ROWS_ALL])
            return false;
    return !(KT_HAS_QUASI_STATICS && model->n.massless > 0);
}

int kt_range_row(const kt_model *model, const kt_loop_record *loop) {
    int row = kt_rows_slots(model, &model->group[loop->group], loop)[0];
    for (int32_t g = 0; g < loop->group; g++)
        row += model->group[g].count[KT_ROWS_ALL];
    return row;
}

static void take_rows(const kt_model *model, const kt_data *data, kt_range *r) {
    r->rows = 0;
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        for (int k = 0; k < w.k; k++, r->rows++) {
            double *row = r->jacobian + (size_t)r->rows * model->n.v;
            kt_clear(row, model->n.v * sizeof *row);
            for (int i = 0; i < w.m; i++)
                row[model->group_v[group->v + i]] = w.a[(size_t)k * (size_t)w.m + (size_t)i];
            r->right[r->rows] = w.right[k];
        }
    }
}

static size_t count_rows(const kt_model *model) {
    size_t rows = 0;
    for (size_t g = 0; g < model->n.group; g++)
        rows += (size_t)model->group[g].count[KT_ROWS_ALL];
    return rows;
}

/* Finds Y and L. Returns false unless the rows are independent. */
static bool factor_rows(const kt_model *model, kt_range *r) {
    const size_t nv = model->n.v, rows = (size_t)r->rows;
    kt_copy(r->response, r->jacobian, rows * nv * sizeof *r->response);
    for (size_t k = 0; k < rows; k++)
        kt_inverse_apply(model, &r->terms, r->response + k * nv);
    for (size_t k = 0; k < rows; k++) {
        for (size_t i = k; i < rows; i++)
            r->factor[k * rows + i] = kt_dense_dot(r->jacobian + i * nv, r->response + k * nv, r->nv);
        r->diagonal[k] = r->factor[k * rows + k];
    }
    if (!kt_dense_cholesky(r->factor, rows, r->rows, NULL))
        return false;
    bool apart = true;
    for (size_t k = 0; k < rows; k++)
        apart = apart && r->factor[k * (rows + 1)] * r->factor[k * (rows + 1)] > independent_part * r->diagonal[k];
    return apart;
}

bool kt_range_prepare(const kt_model *model, kt_data *data, const kt_dynamic_state *at, kt_range *r) {
    if (!KT_HAS_LOOPS || !has_contacts_alone(model) || count_rows(model) > kt_range_most(&model->n))
        return false;
    model->group_kernels->fill(model, data, at->t, at->q, at->v);
    take_rows(model, data, r);
    if (kt_forward_tree(model, data, at, r->free, NULL) != KT_OK ||
        kt_inverse_compute(model, data, at->q, &r->terms, NULL) != KT_OK || !factor_rows(model, r))
        return false;
    for (size_t i = 1, dof = 0; i < model->n.link; i++) {
        r->first[i] = (int32_t)dof;
        dof += (size_t)kt_link_dofs(&model->link[i]);
    }
    for (int k = 0; k < r->rows; k++)
        r->multiplier[k] = r->right[k] - kt_dense_dot(r->jacobian + (size_t)k * model->n.v, r->free, r->nv);
    kt_dense_solve(r->factor, r->rows, r->multiplier);
    return kt_all_finite(r->multiplier, (size_t)r->rows);
}

/* ---- further forces ---------------------------------------------------------------------------------------------- */

void kt_range_add_wrench(const kt_model *model, const kt_range *r, int32_t link, kt_vec3 moment, kt_vec3 force,
                         double *x) {
    kt_real3 m = kt_from3(moment), f = kt_from3(force);
    for (int32_t i = link; i > 0; i = model->link[i].parent) {
        const kt_inverse_dof *dof = r->terms.dof + r->first[i];
        for (int k = 0; k < kt_link_dofs(&model->link[i]); k++)
            x[model->link[i].v + k] += kt_dots3(dof[k].s[0], m, dof[k].s[1], f);
        m = kt_add3(m, kt_cross3(r->terms.offset[i], f));
    }
}

void kt_range_respond(const kt_range *r, const double *force, double *change) {
    for (int k = 0; k < r->rows; k++)
        change[k] = -kt_dense_dot(r->response + (size_t)k * (size_t)r->nv, force, r->nv);
    kt_dense_solve(r->factor, r->rows, change);
}

void kt_range_add_rows(const kt_range *r, const double *lambda, double *force) {
    for (int k = 0; k < r->rows; k++)
        for (int i = 0; i < r->nv; i++)
            force[i] += lambda[k] * r->jacobian[(size_t)k * (size_t)r->nv + (size_t)i];
}

bool kt_range_accelerate(const kt_model *model, kt_range *r, const double *force, double *a) {
    const size_t nv = model->n.v;
    double *x = r->force;
    kt_range_respond(r, force, r->change);
    for (int k = 0; k < r->rows; k++)
        r->change[k] += r->multiplier[k];
    kt_copy(x, force, nv * sizeof *x);
    kt_range_add_rows(r, r->change, x);
    kt_inverse_apply(model, &r->terms, x);
    for (size_t i = 0; i < nv; i++)
        x[i] += r->free[i];
    for (int k = 0; k < r->rows; k++)
        r->change[k] = r->right[k] - kt_dense_dot(r->jacobian + (size_t)k * nv, x, r->nv);
    kt_dense_solve(r->factor, r->rows, r->change);
    for (int k = 0; k < r->rows; k++)
        for (size_t i = 0; i < nv; i++)
            x[i] += r->change[k] * r->response[(size_t)k * nv + i];
    if (!kt_all_finite(x, nv))
        return false;
    kt_copy(a, x, nv * sizeof *a);
    return true;
}
