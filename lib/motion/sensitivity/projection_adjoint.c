/* The adjoint of the projection onto the loops (projection.c). For one linear step and a gradient y with respect to dx,
 *
 *     W g - J' e = y,   J g = 0
 *
 * is the response to y with its multipliers, and
 *
 *     y . dx = g . G xi + e . (E xi - J dv) = d(lambda . J g - g . W x - e . (r + J x))     at constant g, e, lambda, x
 *
 * so that no matrix is formed. M x, M g and the gradient of g . M x come from inverse dynamics at rest without gravity.
 * The part of the loops is the gradient of a sum of their equations. For velocities, dv = -J' e adds up to M g. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/gradient.h"
#include "derivative/loop_response.h"
#include "kinetree/joint.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* Computes the gradient of g . M x, M x and M g. */
static kt_status differentiate_inertia(kt_projection_work *w, const double *q, kt_error *error) {
    const kt_model *model = w->model;
    const kt_gradient gradient = {w->by_inertia, w->residue, w->by_x, w->by_g, w->links};
    const kt_dynamic_state rest = {.q = q, .v = model->zero};
    const kt_status status = kt_gradient_evaluate(
        model, w->data, &rest, w->x, KT_GRADIENT_POSED | KT_GRADIENT_WEIGHTLESS, w->response, &gradient, error);
    for (size_t i = 0; i < w->n && status == KT_OK; i++) {
        w->by_x[i] += model->armature[i] * w->x[i];
        w->by_g[i] += model->armature[i] * w->response[i];
    }
    return status;
}

/* Adds d(lambda . J g - e . J z) to by_xi, with J' lambda = W x and J' e = y - W g. */
static kt_status add_loop_gradients(kt_projection_work *w, const double *q, const double *z, const double *y,
                                    double *by_xi, kt_error *error) {
    const kt_loop_sum sum = {.lambda = {w->lambda, w->residual}, .p = {w->response, z}};
    for (size_t i = 0; i < w->n; i++)
        w->work[i] = w->by_g[i] - y[i];
    kt_status status = kt_loops_multipliers_of(w->model, w->data, w->by_x, w->lambda, error);
    if (status == KT_OK)
        status = kt_loops_multipliers_of(w->model, w->data, w->work, w->residual, error);
    if (status == KT_OK)
        status = kt_sweep_pose(w->model, w->data, q, error);
    const kt_dual_motion at = {.model = w->model, .data = w->data, .t = w->t, .q = q, .dof = w->dof, .chain = w->chain};
    if (status == KT_OK)
        kt_loop_gradient(&at, &sum, by_xi, w->work);
    return status;
}

/* Turns the gradient by the velocities after the projection, y, into the gradient before the projection; adds to
 * by_xi. */
static kt_status pull_velocities(kt_projection_work *w, const double *q, const double *v, double *y, double *by_xi,
                                 kt_error *error) {
    const kt_model *model = w->model;
    kt_status status = kt_loops_factor(model, w->data, w->t, q, KT_ROWS_ALL, error);
    if (status == KT_OK)
        status = kt_loops_respond(model, w->data, KT_METRIC_MASS, NULL, y, w->response, error);
    for (size_t i = 0; i < w->n; i++)
        w->x[i] = v[i] - w->v[i];
    if (status == KT_OK)
        status = differentiate_inertia(w, q, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->n; i++)
        by_xi[i] -= w->by_inertia[i];
    status = add_loop_gradients(w, q, v, y, by_xi, error);
    memcpy(y, w->by_g, w->n * sizeof *y);
    return status;
}

/* Computes x of an iteration at q, whose equations are factored. In the last iteration, nothing moves and x is zero. */
static kt_status find_projection_step(kt_projection_work *w, bool last, kt_error *error) {
    memset(w->x, 0, w->n * sizeof *w->x);
    if (last)
        return KT_OK;
    kt_loops_residuals(w->model, w->data, w->residual);
    for (size_t i = 0; i < w->p; i++)
        w->residual[i] = -w->residual[i];
    return kt_loops_respond(w->model, w->data, w->model->metric, w->residual, w->model->zero, w->x, error);
}

/* Computes g, W g and W x for the gradient y. In the metric of the coordinates, g = y - (least z with J z = J y). */
static kt_status respond_to_gradient(kt_projection_work *w, const double *q, const double *y, kt_error *error) {
    const kt_model *model = w->model;
    kt_status status;
    if (model->metric == KT_METRIC_MASS) {
        status = kt_loops_respond(model, w->data, KT_METRIC_MASS, NULL, y, w->response, error);
        return status == KT_OK ? differentiate_inertia(w, q, error) : status;
    }
    kt_loops_apply(model, w->data, y, w->residual);
    status = kt_loops_respond(model, w->data, KT_METRIC_IDENTITY, w->residual, model->zero, w->response, error);
    for (size_t i = 0; i < w->n; i++) {
        w->by_g[i] = w->response[i] = y[i] - w->response[i];
        w->by_x[i] = w->x[i];
        w->by_inertia[i] = 0.0;
    }
    return status;
}

/* Turns the gradient by the positions after an iteration at q into the gradient before the iteration. The last
 * iteration follows pull_velocities at the same positions. */
static kt_status pull_positions(kt_projection_work *w, const double *q, bool last, double *by_xi, kt_error *error) {
    kt_status status = last ? kt_loops_factor_again(w->model, w->data, KT_ROWS_CLOSED, error)
                            : kt_loops_factor(w->model, w->data, w->t, q, KT_ROWS_CLOSED, error);
    if (status == KT_OK)
        status = find_projection_step(w, last, error);
    if (status != KT_OK)
        return status;
    kt_tangent_add_transposed(w->model, w->x, by_xi, w->before, w->change);
    status = respond_to_gradient(w, q, w->change, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < w->n; i++)
        w->before[i] += w->by_g[i] - w->change[i] - (last ? 0.0 : w->by_inertia[i]);
    if (!last)
        status = add_loop_gradients(w, q, w->x, w->change, w->before, error);
    memcpy(by_xi, w->before, w->n * sizeof *by_xi);
    return status;
}

/* Computes the positions of all iterations except the first, which w->q has, and the last. */
static kt_status find_iterations(kt_projection_work *w, kt_error *error) {
    kt_status status = KT_OK;
    for (uint32_t i = 0; i + 1 < w->iterations && status == KT_OK; i++) {
        const double *q = w->q + i * w->model->n.q;
        status = kt_loops_factor(w->model, w->data, w->t, q, KT_ROWS_CLOSED, error);
        if (status == KT_OK)
            status = find_projection_step(w, false, error);
        if (status == KT_OK)
            kt_position_add(w->model, q, w->x, w->q + (i + 1) * w->model->n.q);
    }
    return status;
}

/* The steps in reverse: velocities (which also depend on q), the iteration that only projects changes, and the
 * iterations that moved positions, from the last to the first. */
kt_status kt_projection_transposed(kt_projection_work *w, const double *q, const double *v, double *x,
                                   kt_error *error) {
    kt_status status = find_iterations(w, error);
    if (status == KT_OK)
        status = pull_velocities(w, q, v, x + w->n, x, error);
    for (uint32_t i = w->iterations + 1; i-- > 0 && status == KT_OK;)
        status = pull_positions(w, i == w->iterations ? q : w->q + i * w->model->n.q, i == w->iterations, x, error);
    return status;
}
