/* Operational-space inertia (Khatib 1987): with X = M^-1 J' and J X = L L',
 *     Lambda = (J M^-1 J')^-1,   consistent inverse of J = X Lambda
 *
 * Three ratios measure the mobility of a row of J. The first is its size over its largest possible size. The second is
 * its remainder with the loops over its value without them. The third is its pivot in L over the value without the rows
 * before it. The reciprocal condition number is the least product of the three over all rows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/levenberg_marquardt.h"
#include "control/mass_inverse.h"
#include "linear/cholesky.h"

#include <float.h>
#include <string.h>

/* The part of a row of J X that must be independent of the rows before it, as in cholesky.h. The bound is a square. */
#define KT_TASK_RANK 1e-14

/* ---- the free fraction of a row ---------------------------------------------------------------------------------- */

/* Returns the size of a row, which is the largest motion of the task while a coordinate moves by one unit. The size is
 * relative to the smaller of a radian and a length of the mechanism, and at most 1. Sizes within rounding become 0. */
static double task_row_size(const kt_mass_inverse *w, int rows, int r, const double *jacobian) {
    const double could_be = fmin(1.0, kt_model_extent(w->model));
    double most = 0.0;
    for (size_t i = 0; i < w->model->n.v; i++)
        most = fmax(most, fabs(jacobian[i * (size_t)rows + (size_t)r]) * w->unit[i]);
    return most > 8.0 * DBL_EPSILON * could_be ? fmin(1.0, most / could_be) : 0.0;
}

/* Returns the free fraction of a row, using the basis Z of the null space. The fraction is the largest entry of J_r Z
 * over the largest sum of the absolute values of its terms. */
static double free_fraction_by_basis(const kt_mass_inverse *w, int rows, int r, const double *jacobian) {
    const size_t nv = w->model->n.v;
    double left = 0.0, whole = 0.0;
    for (int c = 0; c < w->dofs; c++) {
        double sum = 0.0, size = 0.0;
        for (size_t i = 0; i < nv; i++) {
            const double term = w->basis[(size_t)c * nv + i] * jacobian[i * (size_t)rows + (size_t)r];
            sum += term;
            size += fabs(term);
        }
        left = fmax(left, fabs(sum));
        whole = fmax(whole, size);
    }
    return left > KT_RANK_TOLERANCE * whole ? left / whole : 0.0;
}

/* Returns the free fraction without a basis: J_r M^-1 J_r' compared with that of a row whose entries are as large, in
 * other proportions. Both are squares. */
static double free_fraction_by_generic(kt_mass_inverse *w, int rows, int r, const double *jacobian) {
    const size_t nv = w->model->n.v;
    double left = 0.0, whole = 0.0;
    for (size_t i = 0; i < nv; i++)
        w->generic[i] = jacobian[i * (size_t)rows + (size_t)r] * (1.0 + 0.5 * kt_generic(i));
    kt_mass_inverse_columns(w, 1, w->generic);
    for (size_t i = 0; i < nv; i++) {
        const double entry = jacobian[i * (size_t)rows + (size_t)r];
        left += entry * w->column[(size_t)r * nv + i];
        whole += entry * (1.0 + 0.5 * kt_generic(i)) * w->generic[i];
    }
    return left > KT_TASK_RANK * whole ? fmin(1.0, sqrt(left / whole)) : 0.0;
}

/* Factors J X, whose lower triangle is in w->task. Returns the row whose pivot vanishes, or `rows`. *rcond receives the
 * reciprocal condition number. */
static int factor_task_inertia(kt_mass_inverse *w, int rows, double *rcond) {
    double *l = w->task;
    *rcond = 1.0;
    for (int n = 0; n < rows; n++) {
        double pivot = l[n * (rows + 1)];
        const double whole = pivot;
        for (int k = 0; k < n; k++)
            pivot -= l[k * rows + n] * l[k * rows + n];
        if (!(pivot > KT_TASK_RANK * whole) || w->free_fraction[n] == 0.0)
            return n;
        *rcond = fmin(*rcond, w->free_fraction[n] * sqrt(pivot / whole));
        l[n * (rows + 1)] = sqrt(pivot);
        for (int i = n + 1; i < rows; i++) {
            for (int k = 0; k < n; k++)
                l[n * rows + i] -= l[k * rows + i] * l[k * rows + n];
            l[n * rows + i] /= l[n * (rows + 1)];
        }
    }
    return rows;
}

/* ---- Lambda ------------------------------------------------------------------------------------------------------ */

/* Computes X, J X, and the free fraction of each row. */
static void fill_task_responses(kt_mass_inverse *w, int rows, const double *jacobian) {
    const size_t nv = w->model->n.v;
    for (size_t i = 0; i < nv; i++)
        for (int r = 0; r < rows; r++)
            w->column[(size_t)r * nv + i] = jacobian[i * (size_t)rows + (size_t)r];
    kt_mass_inverse_columns(w, rows, w->column);
    for (int c = 0; c < rows; c++) {
        for (int r = c; r < rows; r++) {
            double sum = 0.0;
            for (size_t i = 0; i < nv; i++)
                sum += jacobian[i * (size_t)rows + (size_t)r] * w->column[(size_t)c * nv + i];
            w->task[c * rows + r] = sum;
        }
        w->free_fraction[c] = task_row_size(w, rows, c, jacobian);
        if (w->model->n.group > 0)
            w->free_fraction[c] *= w->kkt.data ? free_fraction_by_generic(w, rows, c, jacobian)
                                               : free_fraction_by_basis(w, rows, c, jacobian);
    }
}

/* Lambda, and X Lambda in place of X. Returns whether all of it is finite. */
static bool invert_task_inertia(kt_mass_inverse *w, int rows) {
    const size_t nv = w->model->n.v, square = (size_t)rows * (size_t)rows;
    memset(w->inertia, 0, square * sizeof *w->inertia);
    for (int c = 0; c < rows; c++) {
        double *x = w->inertia + (size_t)c * (size_t)rows;
        x[c] = 1.0;
        kt_dense_solve(w->task, rows, x);
    }
    for (int c = 0; c < rows; c++) /* symmetric to the last bit */
        for (int r = c + 1; r < rows; r++)
            w->inertia[r * rows + c] = w->inertia[c * rows + r];
    for (size_t i = 0; i < nv; i++) {
        for (int c = 0; c < rows; c++) {
            w->generic[c] = 0.0;
            for (int r = 0; r < rows; r++)
                w->generic[c] += w->column[(size_t)r * nv + i] * w->inertia[c * rows + r];
        }
        for (int c = 0; c < rows; c++)
            w->column[(size_t)c * nv + i] = w->generic[c];
    }
    return kt_all_finite(w->inertia, square) && kt_all_finite(w->column, (size_t)rows * nv);
}

kt_status kt_operational_inertia(kt_mass_inverse *inverse, int rows, const double *jacobian, double *inertia,
                                 double *consistent, double *rcond, kt_error *error) {
    if (KT_IS_MISSING(error, inverse, jacobian || rows <= 0 || !inverse->model->n.v, inertia || rows <= 0))
        return KT_ERROR_ARGUMENT;
    kt_mass_inverse *w = inverse;
    const size_t nv = w->model->n.v;
    double least;
    if (!w->has_terms)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "inverse",
                            "it holds no terms: kt_mass_inverse_compute has not succeeded before");
    if (rows < 0 || rows > w->rows)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "jacobian", "it has %d rows: the object was made for up to %d",
                            rows, w->rows);
    const kt_status status = kt_columns_check(nv, rows, jacobian, error);
    if (status != KT_OK)
        return status;
    fill_task_responses(w, rows, jacobian);
    const int failed = factor_task_inertia(w, rows, &least);
    if (failed < rows)
        return kt_error_set(
            error, KT_ERROR_SINGULAR, "jacobian",
            "no motion is left along row %d that the rows before it leave free: the position is singular for this "
            "task, or it has more rows than the mechanism has degrees of freedom; leave the row out",
            failed);
    if (!invert_task_inertia(w, rows))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, "jacobian",
                            "the inertia overflows: look for a row of the Jacobian that is tiny or huge");
    memcpy(inertia, w->inertia, (size_t)rows * (size_t)rows * sizeof *inertia);
    if (consistent)
        memcpy(consistent, w->column, (size_t)rows * nv * sizeof *consistent);
    if (rcond)
        *rcond = least;
    return KT_OK;
}
