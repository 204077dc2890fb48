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
 * dynamics at rest with the accelerations x and without gravity. */
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

/* Adds d(M x)/dq to w->force, row by row: the gradients of (M x)_k. */
static kt_status differentiate_inertia(kt_projection_work *w, const double *q, kt_error *error) {
    const kt_gradient row = {w->by_inertia, w->by_x, w->by_g, w->before};
    kt_status status = KT_OK;
    for (size_t k = 0; k < w->n && status == KT_OK; k++) {
        w->unit[k] = 1.0;
        status = kt_gradient_evaluate(w->model, w->data, q, w->model->zero, w->x, NULL,
                                      KT_GRADIENT_POSED | KT_GRADIENT_WEIGHTLESS, w->unit, w->links, &row, error);
        w->unit[k] = 0.0;
        for (size_t j = 0; j < w->n && status == KT_OK; j++)
            w->force[j * w->n + k] += w->by_inertia[j];
    }
    return status;
}

/* G and -E, with z = x of positions, of which d phi/dq = J is added, and z = v of velocities. */
static kt_status differentiate(kt_projection_work *w, const double *q, bool mass, const double *v, kt_error *error) {
    const size_t n = w->n;
    kt_status status = KT_OK;
    memset(w->force, 0, n * n * sizeof *w->force);
    memset(w->unit, 0, (n + w->p) * sizeof *w->unit);
    if (mass)
        status = differentiate_inertia(w, q, error);
    if (status == KT_OK && w->model->sweep != KT_SWEEP_PLANAR) /* otherwise the equations have left poses */
        status = kt_links_update(w->model, w->data, q, NULL, NULL, false, NULL, error);
    if (status != KT_OK)
        return status;
    kt_loop_matrices(w->model, w->data, w->t, q, w->lambda, v ? v : w->x, w->dof, w->chain, w->unit, w->work, w->force,
                     w->equation);
    for (size_t i = 0; i < n * n; i++)
        w->force[i] = -w->force[i];
    for (size_t i = 0; i < n * w->p && !v; i++)
        w->equation[i] += w->jacobian[i];
    return KT_OK;
}

/* What a parameter adds to a column, or NULL. */
typedef struct gain {
    const double *inertia, *gap;
} gain;

static gain gain_of(const kt_projection_work *w, const kt_parameter_work *parameter, size_t column) {
    return parameter ? (gain){parameter->inertia + column * w->n, parameter->gap + column * w->p} : (gain){NULL, NULL};
}

/* dx of one column, into `out`. dv: NULL for positions. force: NULL for zero. */
static void change(const kt_projection_work *w, bool mass, const double *force, const double *equation,
                   const double *xi, const double *dv, gain by, double *out) {
    const size_t n = w->n, p = w->p;
    double *g = w->work + 2 * n, *e = g + n, *moved = e + p;
    if (force)
        kt_dense_apply(force, (int)n, (int)n, xi, g);
    kt_dense_apply(equation, (int)p, (int)n, xi, e);
    for (size_t i = 0; i < p; i++)
        e[i] = -e[i] - (by.gap ? by.gap[i] : 0.0);
    for (size_t i = 0; i < n && force && by.inertia && mass; i++)
        g[i] -= by.inertia[i];
    if (dv) {
        kt_dense_apply(w->jacobian, (int)p, (int)n, dv, moved);
        for (size_t i = 0; i < p; i++)
            e[i] -= moved[i];
    }
    solve(w, mass, force ? g : NULL, e, out);
}

/* ---- iterations -------------------------------------------------------------------------------------------------- */

/* The equations of positions at q, factored, and phi. */
static kt_status factor_positions(kt_projection_work *w, const double *q, kt_error *error) {
    kt_status status = kt_loop_equations(w->model, w->data, w->t, q, NULL, w->jacobian, w->residual, NULL, NULL, error);
    if (status == KT_OK)
        status = factor(w, KT_ROWS_CLOSED, error);
    return status == KT_OK ? weigh_basis(w, q, w->model->metric == KT_METRIC_MASS, error) : status;
}

/* One iteration of the positions at q: x, and what its change needs. */
static kt_status prepare_positions(kt_projection_work *w, const double *q, kt_error *error) {
    const bool mass = w->model->metric == KT_METRIC_MASS;
    const kt_status status = factor_positions(w, q, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->p; i++)
        w->residual[i] = -w->residual[i];
    solve(w, mass, NULL, w->residual, w->x);
    find_multipliers(w, mass);
    return differentiate(w, q, mass, NULL, error);
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
    return differentiate(w, q, true, v, error);
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

/* The iterations that move positions. */
static kt_status push_positions(kt_projection_work *w, size_t columns, double *x, kt_parameter_work *parameter,
                                kt_error *error) {
    const size_t n = w->n;
    const bool mass = w->model->metric == KT_METRIC_MASS;
    kt_status status = KT_OK;
    for (uint32_t i = 0; i < w->iterations && status == KT_OK; i++) {
        double *q = w->q + i * w->model->n.q;
        status = prepare_positions(w, q, error);
        if (status == KT_OK && parameter)
            status = kt_parameter_project(parameter, w->t, q, NULL, w->x, error);
        for (size_t c = 0; c < columns && status == KT_OK; c++) {
            double *xi = x + 2 * n * c;
            change(w, mass, w->force, w->equation, xi, NULL, gain_of(w, parameter, c), w->change);
            kt_tangent_add(w->model, w->x, xi, w->change, xi);
        }
        if (status == KT_OK)
            kt_position_add(w->model, q, w->x, q + w->model->n.q);
    }
    return status;
}

/* The last iteration only projects changes, as the equations J that are factored ask for: x, lambda and G are zero, and
 * -E = J. */
static kt_status push_changes(kt_projection_work *w, const double *q, size_t columns, double *x,
                              kt_parameter_work *parameter, kt_error *error) {
    const size_t n = w->n;
    const kt_status status = parameter ? kt_parameter_project(parameter, w->t, q, NULL, w->model->zero, error) : KT_OK;
    for (size_t c = 0; c < columns && status == KT_OK; c++) {
        double *xi = x + 2 * n * c;
        change(w, w->model->metric == KT_METRIC_MASS, NULL, w->jacobian, xi, NULL, gain_of(w, parameter, c), w->change);
        kt_tangent_add(w->model, w->model->zero, xi, w->change, xi);
    }
    return status;
}

/* Whether the equations of positions are those of velocities, all of them independent. */
static bool shares_equations(const kt_model *model) {
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        if (group->count[KT_ROWS_CLOSED] != group->count[KT_ROWS_ALL] ||
            group->rank[KT_ROWS_ALL] != group->count[KT_ROWS_ALL])
            return false;
    }
    return true;
}

kt_status kt_projection_columns(kt_projection_work *w, double *q, double *v, size_t columns, double *x,
                                kt_parameter_work *parameter, kt_error *error) {
    const size_t n = w->n;
    const bool shared = shares_equations(w->model);
    kt_status status = kt_projection_run(w, q, v, error);
    if (status == KT_OK)
        status = push_positions(w, columns, x, parameter, error);
    if (status == KT_OK)
        status = shared ? prepare_velocities(w, q, v, error) : factor_positions(w, q, error);
    if (status == KT_OK)
        status = push_changes(w, q, columns, x, parameter, error);
    if (status == KT_OK && !shared)
        status = prepare_velocities(w, q, v, error);
    if (status == KT_OK && parameter)
        status = kt_parameter_project(parameter, w->t, q, v, w->x, error);
    for (size_t c = 0; c < columns && status == KT_OK; c++) {
        double *xi = x + 2 * n * c, *dv = xi + n;
        change(w, true, w->force, w->equation, xi, dv, gain_of(w, parameter, c), w->change);
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
