/* Operational-space inertia (Khatib 1987): with X = M^-1 J' and J X = L L',
 *     Lambda = (J M^-1 J')^-1,   consistent inverse of J = X Lambda
 */
#include "control/mass_inverse.h"
#include "linear/cholesky.h"

#include <string.h>

/* The part of a row of J X that must be left beside the rows before it, as in maggi_kane.h. */
#define KT_TASK_RANK 1e-14

/* Factors J X, whose lower triangle is in w->task. Returns the row whose pivot vanishes, or `rows`. */
static int factor(kt_mass_inverse *w, int rows) {
    for (int n = 0; n < rows; n++) {
        double *l = w->task;
        double pivot = l[n * (rows + 1)];
        const double whole = pivot;
        for (int k = 0; k < n; k++)
            pivot -= l[k * rows + n] * l[k * rows + n];
        if (!(pivot > KT_TASK_RANK * whole))
            return n;
        l[n * (rows + 1)] = sqrt(pivot);
        for (int i = n + 1; i < rows; i++) {
            for (int k = 0; k < n; k++)
                l[n * rows + i] -= l[k * rows + i] * l[k * rows + n];
            l[n * rows + i] /= l[n * (rows + 1)];
        }
    }
    return rows;
}

static kt_status fill(kt_mass_inverse *w, int rows, const double *jacobian, kt_error *error) {
    const size_t nv = w->model->n.v;
    for (size_t i = 0; i < nv; i++)
        for (int r = 0; r < rows; r++)
            w->column[(size_t)r * nv + i] = jacobian[i * (size_t)rows + (size_t)r];
    const kt_status status = kt_mass_inverse_apply(w, rows, w->column, error);
    for (int c = 0; c < rows && status == KT_OK; c++)
        for (int r = c; r < rows; r++) {
            double sum = 0.0;
            for (size_t i = 0; i < nv; i++)
                sum += jacobian[i * (size_t)rows + (size_t)r] * w->column[(size_t)c * nv + i];
            w->task[c * rows + r] = sum;
        }
    return status;
}

kt_status kt_operational_inertia(kt_mass_inverse *inverse, int rows, const double *jacobian, double *inertia,
                                 double *consistent, kt_error *error) {
    const int nv = (int)inverse->model->n.v;
    if (rows < 0 || rows > inverse->rows)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "jacobian", "it has %d rows: the object was made for up to %d",
                            rows, inverse->rows);
    const kt_status status = fill(inverse, rows, jacobian, error);
    if (status != KT_OK)
        return status;
    const int failed = factor(inverse, rows);
    if (failed < rows)
        return kt_error_set(
            error, KT_ERROR_SINGULAR, "jacobian",
            "no motion is left along row %d beside the rows before it: the position is singular for this "
            "task, or it has more rows than the mechanism has degrees of freedom; leave the row out",
            failed);
    for (int c = 0; c < rows; c++) {
        double *x = inertia + (size_t)c * (size_t)rows;
        memset(inverse->unit, 0, (size_t)rows * sizeof *x);
        inverse->unit[c] = 1.0;
        kt_dense_solve(inverse->task, rows, inverse->unit);
        for (int r = c; r < rows; r++)
            x[r] = inertia[(size_t)r * (size_t)rows + (size_t)c] = inverse->unit[r];
    }
    for (int c = 0; c < rows && consistent; c++)
        kt_dense_apply(inverse->column, nv, rows, inertia + (size_t)c * (size_t)rows,
                       consistent + (size_t)c * (size_t)nv);
    return KT_OK;
}
