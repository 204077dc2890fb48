/* All velocities or accelerations from those of chosen coordinates. Z is the basis of the null space (nv x f), and Z_s
 * are its rows of the chosen coordinates s. With x0 a particular solution of A x = b,
 *     x = x0 + Z z,   Z_s z = x_s - x0_s,      basis B = Z Z_s^-1
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/control.h"

#include "base/where.h"
#include "linear/cholesky.h"
#include "reduction/kernel.h"

#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_actuation_work, KT_ACTUATION_FIELDS, const kt_counts *n)

size_t kt_actuation_work_size(const kt_model *model) { return model ? place_arrays(NULL, NULL, &model->n) : 0; }

/* ---- the list, and the rows of Z --------------------------------------------------------------------------------- */

kt_status kt_actuation_begin(const kt_model *model, void *memory, size_t size, kt_coordinate_list list,
                             kt_actuation_work *w, kt_error *error) {
    const int nv = (int)model->n.v;
    const kt_status status =
        kt_arena_check("work", "kt_actuation_work_size", memory, size, kt_actuation_work_size(model), error);
    if (status != KT_OK)
        return status;
    *w = (kt_actuation_work){.model = model};
    (void)place_arrays(w, memory, &model->n);
    if (list.count < 0 || list.count > nv)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "coordinates",
                            "the list has %d coordinates, but the model has %d", list.count, nv);
    if (list.count > 0 && list.index == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "coordinates", "the list of %d coordinates is NULL", list.count);
    memset(w->chosen, 0, model->n.v * sizeof *w->chosen);
    kt_model_units(model, w->unit);
    for (int i = 0; i < list.count; i++) {
        const int v = list.index[i];
        if (v < 0 || v >= nv)
            return kt_error_set(error, KT_ERROR_ARGUMENT, "coordinates",
                                "entry %d of the list is %d: velocity coordinates are 0 to %d", i, v, nv - 1);
        if (w->chosen[v])
            return kt_error_set(error, KT_ERROR_ARGUMENT, "coordinates", "coordinate %d is twice in the list", v);
        w->chosen[v] = true;
    }
    return KT_OK;
}

/* The coordinate that moves most in Z z, in units. */
static int most_moved(const kt_actuation_work *w, const double *z) {
    const size_t nv = w->model->n.v;
    double best = -1.0;
    int most = 0;
    for (size_t i = 0; i < nv; i++) {
        double x = 0.0;
        for (int c = 0; c < w->dofs; c++)
            x += w->basis[(size_t)c * nv + i] * z[c];
        x = fabs(x) / w->unit[i];
        if (x > best) {
            best = x;
            most = (int)i;
        }
    }
    return most;
}

double kt_actuation_amplification(const kt_actuation_work *w, const double *x, int i) {
    double most = 0.0;
    for (size_t k = 0; k < w->model->n.v; k++)
        most = fmax(most, fabs(x[k]) * (w->unit[i] / w->unit[k]));
    return most;
}

/* Returns a reference size for the rows of the list, in units. The size is the least size of a row whose coordinate
 * moves as much as the one that moves most. At a dead point of all coordinates in the list all rows are rounding
 * errors. Only this size reveals it. */
static double could_be(const kt_actuation_work *w, kt_coordinate_list list, const double *scale) {
    const size_t nv = w->model->n.v;
    double most = 0.0, least = list.count > 0 ? HUGE_VAL : 0.0;
    for (int c = 0; c < w->dofs; c++)
        for (size_t i = 0; i < nv; i++)
            most = fmax(most, fabs(w->basis[(size_t)c * nv + i]) / w->unit[i]);
    for (int i = 0; i < list.count; i++)
        least = fmin(least, w->unit[list.index[i]] * (scale ? scale[i] : 1.0));
    return most * least;
}

kt_status kt_actuation_factor(kt_actuation_work *w, kt_data *data, double t, const double *q, kt_coordinate_list list,
                              const double *scale, const char *lack, kt_error *error) {
    const kt_model *model = w->model;
    const kt_status status = kt_loop_nullspace(model, data, t, q, w->basis, &w->dofs, error);
    if (status != KT_OK)
        return status;
    for (int c = 0; c < w->dofs; c++)
        for (int i = 0; i < list.count; i++)
            w->factor[(size_t)c * (size_t)list.count + (size_t)i] =
                w->basis[(size_t)c * model->n.v + (size_t)list.index[i]] * (scale ? scale[i] : 1.0);
    w->least = (kt_least){.qr = {.m = list.count,
                                 .k = w->dofs,
                                 .factor = w->factor,
                                 .reflector_scale = w->reflector_scale,
                                 .pivot = w->pivot},
                          .norm = w->norm,
                          .sum = w->sum};
    kt_least_factor(&w->least, could_be(w, list, scale));
    if (w->least.rank == w->dofs)
        return KT_OK;
    kt_least_null(&w->least, w->solution);
    const int body = kt_velocity_body(model, most_moved(w, w->solution));
    return kt_error_set(error, KT_ERROR_SINGULAR, kt_where_format("joint '%.100s'", kt_joint_name(model, body)).text,
                        "it moves most in a motion %s: %d of the %d coordinates in the list are independent at this "
                        "position, and the mechanism has %d degrees of freedom; list a coordinate that moves there",
                        lack, w->least.rank, list.count, w->dofs);
}

/* ---- the basis --------------------------------------------------------------------------------------------------- */

/* The rows of exactly as many coordinates as there are degrees of freedom. */
static kt_status factor_basis(kt_actuation_work *w, kt_data *data, double t, const double *q, kt_coordinate_list list,
                              kt_error *error) {
    const kt_status status = kt_actuation_factor(w, data, t, q, list, NULL, "in which all of the list rest", error);
    if (status == KT_OK && list.count != w->dofs)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "coordinates",
                            "the list has %d, and the mechanism %d degrees of freedom at this position", list.count,
                            w->dofs);
    return status;
}

kt_status kt_independent_basis(const kt_model *model, kt_data *data, void *work, size_t work_size, double t,
                               const double *q, kt_coordinate_list independent, double *basis, double *rcond,
                               kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, basis || independent.count <= 0))
        return KT_ERROR_ARGUMENT;
    const size_t nv = model->n.v;
    double most = 1.0;
    kt_actuation_work w;
    kt_status status = kt_actuation_begin(model, work, work_size, independent, &w, error);
    if (status == KT_OK)
        status = factor_basis(&w, data, t, q, independent, error);
    if (status != KT_OK)
        return status;
    for (int j = 0; j < w.dofs; j++) {
        memset(w.right, 0, nv * sizeof *w.right);
        w.right[j] = 1.0;
        kt_least_solve(&w.least, w.right, w.solution);
        kt_dense_apply(w.basis, (int)nv, w.dofs, w.solution, basis + (size_t)j * nv);
        for (int i = 0; i < w.dofs; i++) /* to the last bit */
            basis[(size_t)j * nv + (size_t)independent.index[i]] = i == j ? 1.0 : 0.0;
        most = fmax(most, kt_actuation_amplification(&w, basis + (size_t)j * nv, independent.index[j]));
    }
    if (rcond)
        *rcond = 1.0 / most;
    return KT_OK;
}

void kt_loop_jacobian(const kt_model *model, int rows, const double *jacobian, int columns, const double *basis,
                      double *reduced) {
    if (!model || !jacobian || !basis || !reduced || rows < 0)
        return;
    for (int c = 0; c < columns; c++)
        kt_dense_apply(jacobian, rows, (int)model->n.v, basis + (size_t)c * model->n.v,
                       reduced + (size_t)c * (size_t)rows);
}

/* ---- completion -------------------------------------------------------------------------------------------------- */

/* Writes a particular solution of A x = b' into w->force, or if v is given that of A x = b''. Coordinates that are in
 * no loop become zero. */
static kt_status solve_particular(kt_actuation_work *w, kt_data *data, double t, const double *q, const double *v,
                                  kt_error *error) {
    const kt_model *model = w->model;
    memset(w->force, 0, model->n.v * sizeof *w->force);
    if (!model->n.group)
        return KT_OK;
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
    kt_violation violation;
    if (v)
        kernels->fill(model, data, t, q, v);
    else
        (void)kernels->residuals(model, data, t, q, model->zero, NULL, &violation);
    if (kernels->factor(model, data, KT_ROWS_ALL, false) &&
        kernels->least_step(model, data, KT_METRIC_IDENTITY, model->zero, w->force) &&
        kt_all_finite(w->force, model->n.v))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL,
                        "the loops' equations overflow: look for a position or velocity that is huge");
}

/* x = x0 + Z z. */
static kt_status complete_solution(kt_actuation_work *w, kt_data *data, double t, const double *q, const double *v,
                                   kt_coordinate_list list, double *x, kt_error *error) {
    const size_t nv = w->model->n.v;
    kt_status status = factor_basis(w, data, t, q, list, error);
    if (status == KT_OK)
        status = solve_particular(w, data, t, q, v, error);
    if (status != KT_OK)
        return status;
    for (int i = 0; i < list.count; i++)
        w->right[i] = x[list.index[i]] - w->force[list.index[i]];
    kt_least_solve(&w->least, w->right, w->solution);
    kt_dense_apply(w->basis, (int)nv, w->dofs, w->solution, w->right);
    for (size_t i = 0; i < nv; i++)
        w->right[i] = w->chosen[i] ? x[i] : w->right[i] + w->force[i];
    return kt_commit(w->model, NULL, w->right, x, v ? "acceleration" : "velocity", error);
}

/* Whether the chosen numbers, out of n, are finite. */
static kt_status check_independent_values(const kt_actuation_work *w, double t, const double *q, const double *v,
                                          const double *x, const char *what, kt_error *error) {
    const kt_input input = {.q = q, .v = v, .x = w->right, .what = what};
    for (size_t i = 0; i < w->model->n.v; i++)
        w->right[i] = w->chosen[i] ? x[i] : 0.0;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    return kt_input_check(w->model, &input, error);
}

kt_status kt_velocity_complete(const kt_model *model, kt_data *data, void *work, size_t work_size, double t,
                               const double *q, kt_coordinate_list independent, double *v, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, v || !model->n.v))
        return KT_ERROR_ARGUMENT;
    kt_actuation_work w;
    kt_status status = kt_actuation_begin(model, work, work_size, independent, &w, error);
    if (status == KT_OK)
        status = check_independent_values(&w, t, q, NULL, v, "velocity", error);
    return status == KT_OK ? complete_solution(&w, data, t, q, NULL, independent, v, error) : status;
}

kt_status kt_acceleration_complete(const kt_model *model, kt_data *data, void *work, size_t work_size, double t,
                                   const double *q, const double *v, kt_coordinate_list independent, double *a,
                                   kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, a || !model->n.v))
        return KT_ERROR_ARGUMENT;
    kt_actuation_work w;
    kt_status status = kt_actuation_begin(model, work, work_size, independent, &w, error);
    if (status == KT_OK)
        status = check_independent_values(&w, t, q, v, a, "acceleration", error);
    return status == KT_OK ? complete_solution(&w, data, t, q, v ? v : model->zero, independent, a, error) : status;
}
