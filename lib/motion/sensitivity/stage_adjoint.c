/* The adjoint of an evaluation of accelerations: mu . da for all changes at once.
 *
 * Let effects act in joints only, with dQ_j = Q_q dq_j + Q_v dv_j. The motion's equations
 *
 *     M a + h - tau - Q = J' lambda,   J a = b''
 *
 * and the response w to mu with its multipliers pi,
 *
 *     M w - J' pi = mu,   J w = 0
 *
 * give
 *
 *     mu . da = w . (dtau + dQ) - d(w . inverse dynamics) + d(lambda . J w + pi . (J a - b''))
 *
 * at constant w, a, lambda and pi. This needs one solution, one sweep and one gradient. The sweep computes the gradient
 * of w times inverse dynamics (dynamics/rnea_gradient.h), and also M w and inverse dynamics. With loops, the gradient
 * of a sum of the loops' equations is added (constraint/gradient.h). With other effects, the derivatives themselves are
 * multiplied.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/dual_effect.h"
#include "linear/cholesky.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

const char *kt_sweep_rejected(const kt_model *model) {
    if (model->n.loaded > 0)
        return "it has friction that is proportional to a reaction";
    for (size_t i = 0; i < model->n.effect; i++) {
        if (model->effect[i].ends)
            return "it has effects that act on bodies";
        if (model->effect[i].type == KT_EFFECT_CUSTOM || model->effect[i].type == KT_EFFECT_EXPRESSION)
            return "it has effects by formulas or of the caller's";
    }
    return NULL;
}

void kt_joint_effects_add(const kt_model *model, double t, size_t stride, const double *q, const double *v,
                          const double *by_tau, double *by_xi, double *by_v) {
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
        const kt_link *link = &model->link[effect->link[0]];
        const size_t at = (size_t)link->v * stride;
        double derivative[2] = {0.0, 0.0};
        (kind->joint_derivatives ? kind->joint_derivatives : kt_dual_joint_derivatives)(
            effect, model->number, q[(size_t)link->q * stride], v[at], t, derivative);
        by_xi[at] += by_tau[at] * derivative[0];
        by_v[at] += by_tau[at] * derivative[1];
    }
}

/* Computes w = M^-1 mu, or with loops the response, into by_tau. */
static kt_status respond_to_stage(kt_step_work *w, double t, const double *q, const double *mu, double *by_tau,
                                  kt_error *error) {
    if (w->model->n.group)
        return kt_stage_respond(w, t, q, mu, by_tau, error);
    memcpy(by_tau, mu, w->model->n.v * sizeof *mu);
    return kt_tree_respond(w->model, w->data, q, w->inverse, by_tau, error);
}

/* The gradient of mu . a of one stage by positions, velocities and joint forces, by one backward sweep over the
 * links: a gradient of inverse dynamics with the weights M^-1 mu. */
static kt_status sweep_stage(kt_step_work *w, size_t stage, const double *mu, kt_error *error) {
    const size_t nq = w->model->n.q, n = w->model->n.v, N = nq + n;
    const double *q = w->stage + stage * N, *v = q + nq, *a = w->slope + stage * N + nq;
    const double t = kt_step_time(w->step, stage);
    double *by_xi = w->tangent, *by_v = by_xi + n, *by_tau = by_v + n;
    const kt_gradient gradient = {by_xi, by_v, w->inverse_force, w->momentum, w->links};
    const kt_dynamic_state at = {.t = t, .q = q, .v = v, .external = w->step->external};
    kt_status status = respond_to_stage(w, t, q, mu, by_tau, error);
    if (status == KT_OK)
        status = kt_gradient_evaluate(w->model, w->data, &at, a, KT_GRADIENT_POSED, by_tau, &gradient, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < 2 * n; i++)
        by_xi[i] = -by_xi[i];
    kt_joint_effects_add(w->model, t, 1, q, v, by_tau, by_xi, by_v);
    if (w->model->n.group)
        status = kt_stage_add_loops(w, stage, mu, error);
    return status;
}

/* The same as sweep_stage by columns: multiplies mu by the stage's Jacobians. */
static kt_status multiply_stage_adjoint(kt_step_work *w, size_t stage, const double *mu, kt_error *error) {
    const size_t n = w->model->n.v;
    const kt_status status = kt_step_differentiate(w, stage, true, NULL, error);
    for (size_t j = 0; j < n && status == KT_OK; j++) {
        w->tangent[j] = kt_dense_dot(w->by_q + j * n, mu, (int)n);
        w->tangent[n + j] = kt_dense_dot(w->by_v + j * n, mu, (int)n);
        w->tangent[2 * n + j] = kt_dense_dot(w->by_tau + j * n, mu, (int)n);
    }
    return status;
}

kt_status kt_stage_adjoint(kt_step_work *w, size_t i, const double *mu, kt_error *error) {
    return kt_sweep_rejected(w->model) ? multiply_stage_adjoint(w, i, mu, error) : sweep_stage(w, i, mu, error);
}
