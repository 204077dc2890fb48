/* The part of loops in the adjoint of an evaluation of accelerations (stage_adjoint.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/gradient.h"
#include "derivative/loop_response.h"
#include "evaluate/evaluate.h"
#include "sensitivity/sensitivity.h"

#include <math.h>

/* Rejects derivatives that are too uncertain next to a singular position. The error of the derivatives is compared with
 * accelerations, in units of their coordinates. A gradient does not form the derivatives themselves, which are larger
 * where the path bends. */
static kt_status reject_unknown_stage(kt_step_work *w, double t, const double *q, double *a, kt_error *error) {
    const kt_model *model = w->model;
    const double *v = q + model->n.q;
    double size, most = 0.0;
    const kt_dynamic_state at = {t, q, v, w->step->tau, w->step->external};
    const kt_status status = kt_loops_derivative_error(model, w->data, &at, a, &size, error);
    if (status != KT_OK || size == 0.0)
        return status;
    for (size_t i = 0; i < model->n.group_v; i++) {
        const double speed = v[model->group_v[i]] / model->unit[i];
        most = fmax(most, fmax(fabs(a[model->group_v[i]]) / model->unit[i], speed * speed));
    }
    return kt_derivatives_reject_unknown(t, size, most, error);
}

kt_status kt_stage_respond(kt_step_work *w, double t, const double *q, const double *mu, double *by_tau,
                           kt_error *error) {
    kt_status status = reject_unknown_stage(w, t, q, by_tau, error);
    if (status == KT_OK)
        status = kt_loops_factor(w->model, w->data, t, q, KT_ROWS_ALL, error);
    return status == KT_OK ? kt_loops_respond(w->model, w->data, KT_METRIC_MASS, NULL, mu, by_tau, error) : status;
}

kt_status kt_sweep_pose(const kt_model *model, kt_data *data, const double *q, kt_error *error) {
    return model->sweep == KT_SWEEP_PLANAR && kt_loop_gradient_reads_space(model)
               ? kt_motion_update(model, data, q, NULL, NULL, error)
               : KT_OK;
}

/* The multipliers of the motion and of the response follow from inverse dynamics and from momentum,
 *
 *     J' lambda = M a + h - tau - Q,   J' pi = M w - mu
 *
 * and then the gradient of lambda . J w + pi . (J a - b'') (stage_adjoint.c). */
kt_status kt_stage_add_loops(kt_step_work *w, size_t stage, const double *mu, kt_error *error) {
    const kt_model *model = w->model;
    const size_t nq = model->n.q, n = model->n.v, N = nq + n;
    const double *q = w->stage + stage * N, *v = q + nq, *a = w->slope + stage * N + nq, *by_tau = w->tangent + 2 * n;
    const double t = kt_step_time(w->step, stage);
    kt_projection_work *p = &w->projection;
    kt_dynamic_state loaded = {t, q, v, w->step->tau, w->step->external};
    kt_status status = model->n.effect ? kt_effects_apply(model, w->data, &loaded, error) : KT_OK;
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < n; i++) {
        w->inverse_force[i] += model->armature[i] * a[i] - (loaded.tau ? loaded.tau[i] : 0.0);
        w->momentum[i] += model->armature[i] * by_tau[i] - mu[i];
    }
    status = kt_loops_multipliers_of(model, w->data, w->inverse_force, p->lambda, error);
    if (status == KT_OK)
        status = kt_loops_multipliers_of(model, w->data, w->momentum, p->residual, error);
    if (status == KT_OK)
        status = kt_sweep_pose(model, w->data, q, error);
    if (status != KT_OK)
        return status;
    const kt_loop_sum sum = {.lambda = {p->lambda}, .p = {by_tau}, .pi = p->residual, .v = v, .a = a};
    const kt_dual_motion at = {.model = model, .data = w->data, .t = t, .q = q, .dof = p->dof, .chain = p->chain};
    kt_loop_gradient(&at, &sum, w->tangent, w->tangent + n);
    return KT_OK;
}
