/* a_p, the derivative of the accelerations of a stage with respect to a parameter. With r the forces that the motion
 * requires minus the acting forces,
 *
 *     r(q, v, a; p) = A' lambda,   A a = b''(p)
 *     da = a_tau (-dr/dp - M m) + m,   A m = db''/dp
 *
 * since a_tau is M^-1 for accelerations that the loops allow. m is any acceleration that satisfies the changed loops.
 * The acceleration m is zero unless p is a loop's own function of time. The projection is described in projection.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "linear/cholesky.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* Computes m, and adds -M m to w->force. */
static kt_status move_loops(kt_step_work *step, int k, const kt_parameter_point *at, kt_error *error) {
    kt_parameter_work *w = step->parameter;
    kt_status status = kt_parameter_drift(w, k, at, w->gap, error);
    if (status == KT_OK)
        status = kt_projection_least(&step->projection, at->t, at->q, at->v, w->gap, w->moved, error);
    const kt_parameter_point moved = {.q = at->q, .a = w->moved};
    if (status == KT_OK)
        status = kt_parameter_inertia(step->model, w->data, &moved, w->value, error);
    for (size_t i = 0; i < w->n && status == KT_OK; i++)
        w->force[i] -= w->value[i];
    return status;
}

kt_status kt_parameter_stage(kt_step_work *step, double t, const double *y, const double *a, kt_error *error) {
    kt_parameter_work *w = step->parameter;
    const size_t n = w->n;
    const kt_parameter_point at = {t, y, y + step->model->n.q, a, step->step->external};
    const bool loop = w->parameter->kind == KT_PARAMETER_LOOP_CURVE;
    memset(w->moved, 0, n * sizeof *w->moved);
    for (int k = 0; k < w->parameter->count; k++) {
        double *out = w->by_parameter + (size_t)k * n;
        memset(w->force, 0, n * sizeof *w->force);
        kt_status status = loop ? move_loops(step, k, &at, error) : kt_parameter_residual(w, k, &at, w->force, error);
        if (status != KT_OK)
            return status;
        for (size_t j = 0; j < n && !loop; j++)
            w->force[j] = -w->force[j];
        kt_dense_apply(step->by_tau, (int)n, (int)n, w->force, out);
        for (size_t j = 0; j < n; j++)
            out[j] += w->moved[j];
    }
    return KT_OK;
}
