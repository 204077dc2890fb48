/* The derivative of the projection onto the loops. An iteration of the positions moves q by x, and the velocities are
 * moved by x at the end:
 *     W x = J' lambda,   J x = -r            r = phi, W = 1 or M; r = A v - b', W = M
 * Along a change xi of q (and dv of v), at fixed x and lambda,
 *     W dx - J' dlambda = G xi,   G = d(J' lambda - W x)/dq
 *     J dx = E xi - J dv,         E = -d(r + J x)/dq
 * and by a parameter -(dW/dp) x and -dr/dp are added to the right.
 * With J' P = [Q1 Z] [R1; 0] as for the accelerations [MSD 7.33, 7.34]
 *     dx = Q1 y + Z z,   R1' y = right-hand side,   (Z' W Z) z = Z' G xi - (W Z)' Q1 y.
 * Of positions d phi/dq = J, so that E = -J - d(J x)/dq. After the last iteration x = 0, and one that has nothing to move
 * projects the changes. Of velocities r + A x = A v+ - b' at the new velocities.
 *
 * d(J' lambda)/dq, d(J x)/dq and d(A v - b')/dq are exact, in closed form or by dual numbers (loop_gradient.h); d(M x)/dq is the derivative of inverse
 * dynamics at rest with the accelerations x, less that without. */
#include "kinetree/joint.h"
#include "reduction/householder.h"
#include "reduction/loop_gradient.h"
#include "reduction/project.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_projection_work, KT_PROJECTION_FIELDS, const kt_model *model, size_t n, size_t p)

size_t kt_projection_place(kt_projection_work *w, void *memory, const kt_model *model) {
    const size_t p = model->n.row, n = p ? model->n.v : 0;
    if (memory)
        *w = (kt_projection_work){.model = model, .n = n, .p = p};
    return place_arrays(w, memory, model, n, p);
}

/* ---- the linear equations ---------------------------------------------------------------------------------------- */

/* The weights by which the projection chooses among the equations of this kind, zero for others; returns their rank. */
static int weigh(kt_projection_work *w, kt_rows rows) {
    const kt_model *model = w->model;
    int rank = 0;
    memset(w->weight, 0, w->p * sizeof *w->weight);
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        rank += group->rank[rows];
        for (int i = 0; i < group->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
            for (int r = 0; r < loop->row_count; r++) {
                const int32_t slot = model->slot[group->row + loop->row + r];
                if (slot >= 0 && slot < group->count[rows])
                    w->weight[loop->equation + r] =
                        model->weight[(size_t)rows * model->n.row + (size_t)(group->row + slot)];
            }
        }
    }
    return rank;
}

/* J' P = Q R of the equations of one kind, as lib/reduction/qr.c factors them. */
static kt_status factor(kt_projection_work *w, kt_rows rows, kt_error *error) {
    const size_t n = w->n, p = w->p;
    const kt_group_work g = {
        .m = (int)n, .k = (int)p, .factor = w->factor, .pivot = w->pivot, .reflector = w->reflector};
    w->rank = weigh(w, rows);
    for (size_t r = 0; r < p; r++) {
        for (size_t i = 0; i < n; i++)
            w->factor[r * n + i] = w->weight[r] * w->jacobian[i * p + r];
        w->pivot[r] = (int32_t)r;
        w->norm[r] = kt_squares(w->factor + r * n, 0, (int)n);
    }
    for (int j = 0; j < w->rank; j++) {
        double all;
        const int best = kt_longest_column(w->norm, j, (int)p, &all);
        if (!(w->norm[best] > 0.0 && isfinite(all)))
            return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                                "fewer equations of the loops are independent here than elsewhere");
        if (best != j) {
            const double norm = w->norm[j];
            kt_swap_columns(&g, (int)n, j, best);
            w->norm[j] = w->norm[best];
            w->norm[best] = norm;
        }
        kt_eliminate(&g, (int)n, j, w->norm);
    }
    for (int c = 0; c < w->rank; c++)
        for (int i = 0; i <= c; i++)
            w->factor[(size_t)c * n + (size_t)i] /= w->weight[w->pivot[c]];
    memset(w->basis, 0, n * n * sizeof *w->basis);
    for (size_t c = 0; c < n; c++) {
        w->basis[c * n + c] = 1.0;
        for (int j = w->rank - 1; j >= 0; j--)
            kt_reflect(w->factor + (size_t)j * n, w->reflector[j], j, (int)n, w->basis + c * n);
    }
    return KT_OK;
}

/* W = M, W Z, and the factors of Z' W Z; or W = 1, where all of them are left out. */
static kt_status weigh_basis(kt_projection_work *w, const double *q, bool mass, kt_error *error) {
    const size_t n = w->n, r = (size_t)w->rank, f = n - r;
    if (!mass)
        return KT_OK;
    const kt_status status = kt_dynamics_mass(w->model, w->data, q, w->metric, error);
    if (status != KT_OK)
        return status;
    for (size_t c = 0; c < f; c++) {
        double *half = w->half + c * n;
        kt_dense_apply(w->metric, (int)n, (int)n, w->basis + (r + c) * n, half);
        for (size_t i = 0; i < f; i++)
            w->reduced[c * f + i] = kt_dense_dot(w->basis + (r + i) * n, half, (int)n);
    }
    if (kt_dense_cholesky(w->reduced, (int)f, NULL))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                        "the mechanism has no inertia along one of the degrees of freedom that its loops leave");
}

/* x of W x - J' lambda = g, J x = e; g may be NULL: zero. */
static void solve(const kt_projection_work *w, bool mass, const double *g, const double *e, double *x) {
    const size_t n = w->n, r = (size_t)w->rank;
    double *y = w->work, *z = y + r, *across = w->work + n;
    for (size_t k = 0; k < r; k++) {
        y[k] = e[w->pivot[k]];
        for (size_t l = 0; l < k; l++)
            y[k] -= w->factor[k * n + l] * y[l];
        y[k] /= w->factor[k * n + k];
    }
    kt_dense_apply(w->basis, (int)n, (int)r, y, across);
    for (size_t k = 0; k < n - r; k++) {
        z[k] = g ? kt_dense_dot(w->basis + (r + k) * n, g, (int)n) : 0.0;
        if (mass)
            z[k] -= kt_dense_dot(w->half + k * n, across, (int)n);
    }
    if (mass)
        kt_dense_solve(w->reduced, (int)(n - r), z);
    kt_dense_apply(w->basis, (int)n, (int)n, y, x);
}

/* lambda of J' lambda = W x: R1 lambda = Q1' W x. */
static void find_multipliers(kt_projection_work *w, bool mass) {
    const size_t n = w->n;
    double *f = w->work;
    if (mass)
        kt_dense_apply(w->metric, (int)n, (int)n, w->x, f);
    else
        memcpy(f, w->x, n * sizeof *f);
    memset(w->lambda, 0, w->p * sizeof *w->lambda);
    for (int k = w->rank - 1; k >= 0; k--) {
        double sum = kt_dense_dot(w->basis + (size_t)k * n, f, (int)n);
        for (int l = k + 1; l < w->rank; l++)
            sum -= w->factor[(size_t)l * n + (size_t)k] * w->lambda[w->pivot[l]];
        w->lambda[w->pivot[k]] = sum / w->factor[(size_t)k * n + (size_t)k];
    }
}

/* ---- their derivatives ------------------------------------------------------------------------------------------- */

/* G and -E, with z = x of positions, of which d phi/dq = J is added, and z = v of velocities. Of the last iteration of
 * positions, where x and lambda are zero, G = 0 and -E = J. */
static kt_status differentiate(kt_projection_work *w, const double *q, bool mass, bool last, const double *v,
                               kt_error *error) {
    const size_t n = w->n, bytes = kt_derivative_work_size(w->model);
    kt_status status = KT_OK;
    memset(w->force, 0, n * n * sizeof *w->force);
    if (last) {
        memcpy(w->equation, w->jacobian, n * w->p * sizeof *w->equation);
        return KT_OK;
    }
    for (int with = 1; with >= 0 && mass && status == KT_OK; with--) {
        status = kt_dynamics_inverse_derivatives(w->model, w->data, w->derivative, bytes, q, NULL, with ? w->x : NULL,
                                                 NULL, w->other, w->spare, error);
        for (size_t i = 0; i < n * n && status == KT_OK; i++)
            w->force[i] += with ? w->other[i] : -w->other[i];
    }
    if (status == KT_OK &&
        w->model->sweep != KT_SWEEP_PLANAR) /* otherwise the equations have left poses in the plane */
        status = kt_links_update(w->model, w->data, q, NULL, NULL, false, NULL, error);
    if (status != KT_OK)
        return status;
    memset(w->unit, 0, (n + w->p) * sizeof *w->unit);
    kt_loop_matrices(w->model, w->data, w->t, q, w->lambda, v ? v : w->x, w->dof, w->chain, w->unit, w->work, w->force,
                     w->equation);
    for (size_t i = 0; i < n * n; i++)
        w->force[i] = -w->force[i];
    for (size_t i = 0; i < n * w->p && !v; i++)
        w->equation[i] += w->jacobian[i];
    return KT_OK;
}

/* dx of one column, into `out`. dv: NULL for positions. inertia, gap: what the column of a parameter gains, or NULL. */
static void change(const kt_projection_work *w, bool mass, const double *xi, const double *dv, const double *inertia,
                   const double *gap, double *out) {
    const size_t n = w->n, p = w->p;
    double *g = w->work + 2 * n, *e = g + n, *moved = e + p;
    kt_dense_apply(w->force, (int)n, (int)n, xi, g);
    kt_dense_apply(w->equation, (int)p, (int)n, xi, e);
    for (size_t i = 0; i < p; i++)
        e[i] = -e[i] - (gap ? gap[i] : 0.0);
    for (size_t i = 0; i < n && inertia && mass; i++)
        g[i] -= inertia[i];
    if (dv) {
        kt_dense_apply(w->jacobian, (int)p, (int)n, dv, moved);
        for (size_t i = 0; i < p; i++)
            e[i] -= moved[i];
    }
    solve(w, mass, g, e, out);
}

/* ---- iterations -------------------------------------------------------------------------------------------------- */

/* One iteration of the positions at q: x, and what its change needs. The last one only projects changes: x = 0. */
static kt_status prepare_positions(kt_projection_work *w, const double *q, bool last, kt_error *error) {
    const bool mass = w->model->metric == KT_METRIC_MASS;
    kt_status status = kt_loop_equations(w->model, w->data, w->t, q, NULL, w->jacobian, w->residual, NULL, NULL, error);
    if (status == KT_OK)
        status = factor(w, KT_ROWS_CLOSED, error);
    if (status == KT_OK)
        status = weigh_basis(w, q, mass, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->p; i++)
        w->residual[i] = last ? 0.0 : -w->residual[i];
    solve(w, mass, NULL, w->residual, w->x);
    find_multipliers(w, mass);
    return differentiate(w, q, mass, last, NULL, error);
}

/* The same of the velocities, from w->v (before) to v, at q. */
static kt_status prepare_velocities(kt_projection_work *w, const double *q, const double *v, kt_error *error) {
    kt_status status = kt_loop_equations(w->model, w->data, w->t, q, v, w->jacobian, NULL, NULL, NULL, error);
    if (status == KT_OK)
        status = factor(w, KT_ROWS_ALL, error);
    if (status == KT_OK)
        status = weigh_basis(w, q, true, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->n; i++)
        w->x[i] = v[i] - w->v[i];
    find_multipliers(w, true);
    return differentiate(w, q, true, false, v, error);
}

/* Refuses singular positions, next to which the projection leaves a direction out. */
static kt_status refuse_singular(const kt_projection_work *w, kt_error *error) {
    for (size_t g = 0; g < w->model->n.group; g++)
        if (w->data->near[g])
            return kt_error_set(error, KT_ERROR_SINGULAR, "derivatives",
                                "the loops are at a singular position, or next to one, after the step; take a shorter "
                                "or a longer one");
    return KT_OK;
}

kt_status kt_projection_begin(kt_projection_work *w, const double *q, const double *v, kt_error *error) {
    memcpy(w->q, q, w->model->n.q * sizeof *q);
    memcpy(w->v, v, w->n * sizeof *v);
    return kt_unit_quaternions(w->model, w->q)
               ? KT_OK
               : kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a quaternion has become zero");
}

kt_status kt_projection_run(kt_projection_work *w, double *q, double *v, kt_error *error) {
    kt_status status = kt_projection_begin(w, q, v, error);
    if (status == KT_OK)
        status = kt_state_project(w->model, w->data, w->t, q, v, NULL, error);
    w->iterations = w->data->closing.position;
    return status == KT_OK ? refuse_singular(w, error) : status;
}

kt_status kt_projection_columns(kt_projection_work *w, double *q, double *v, size_t columns, double *x,
                                kt_parameter_work *parameter, kt_error *error) {
    const size_t n = w->n, p = w->p;
    const bool mass = w->model->metric == KT_METRIC_MASS;
    const double *inertia = parameter ? parameter->inertia : NULL, *gap = parameter ? parameter->gap : NULL;
    kt_status status = kt_projection_run(w, q, v, error);
    const uint32_t iterations = w->iterations;
    for (uint32_t i = 0; i <= iterations && status == KT_OK; i++) {
        double *q_i = w->q + i * w->model->n.q;
        status = prepare_positions(w, q_i, i == iterations, error);
        if (status == KT_OK && parameter)
            status = kt_parameter_project(parameter, w->t, q_i, NULL, w->x, error);
        for (size_t c = 0; c < columns && status == KT_OK; c++) {
            change(w, mass, x + 2 * n * c, NULL, inertia ? inertia + c * n : NULL, gap ? gap + c * p : NULL, w->change);
            kt_tangent_add(w->model, w->x, x + 2 * n * c, w->change, x + 2 * n * c);
        }
        if (i < iterations && status == KT_OK)
            kt_position_add(w->model, q_i, w->x, q_i + w->model->n.q);
    }
    if (status == KT_OK)
        status = prepare_velocities(w, q, v, error);
    if (status == KT_OK && parameter)
        status = kt_parameter_project(parameter, w->t, q, v, w->x, error);
    for (size_t c = 0; c < columns && status == KT_OK; c++) {
        double *dv = x + 2 * n * c + n;
        change(w, true, x + 2 * n * c, dv, inertia ? inertia + c * n : NULL, gap ? gap + c * p : NULL, w->change);
        for (size_t i = 0; i < n; i++)
            dv[i] += w->change[i];
    }
    return status;
}

kt_status kt_projection_least(kt_projection_work *w, double t, const double *q, const double *v, const double *e,
                              double *x, kt_error *error) {
    kt_status status = kt_loop_equations(w->model, w->data, t, q, v, w->jacobian, NULL, NULL, NULL, error);
    if (status == KT_OK)
        status = factor(w, KT_ROWS_ALL, error);
    if (status == KT_OK)
        solve(w, false, NULL, e, x);
    return status;
}
