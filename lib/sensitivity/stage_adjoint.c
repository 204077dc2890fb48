/* The adjoint of an evaluation of accelerations: mu . da for all changes at once.
 *
 * Of a tree, whose effects act in joints alone, one solution for w = M^-1 mu and one sweep for the gradient of w times
 * inverse dynamics (dynamics/inverse_gradient.h):
 *     mu . da = w . (dtau + dQ) - d(w . inverse dynamics),   dQ_j = Q_q dq_j + Q_v dv_j
 * Otherwise the products with the derivatives themselves. */
#include "reduction/dense.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

/* Whether all effects are joint forces that the library can differentiate. */
static bool acts_in_joints(const kt_model *model) {
    for (size_t i = 0; i < model->n.effect; i++)
        if (model->effect[i].ends || model->effect[i].type == KT_EFFECT_CUSTOM)
            return false;
    return true;
}

/* Adds w . dQ. */
static void add_joint_effects(const kt_step_work *w, size_t stage, const double *q, const double *v, double *by_xi,
                              double *by_v, const double *by_tau) {
    const kt_model *model = w->model;
    for (size_t i = 0; i < model->n.effect; i++) {
        const kt_effect_record *effect = &model->effect[i];
        const kt_effect_kind *kind = kt_effect_kind_of(effect->type);
        const kt_link *link = &model->link[effect->link[0]];
        double slope[2] = {0.0, 0.0};
        (kind->joint_slopes ? kind->joint_slopes : kt_dual_joint_slopes)(effect, model->number, q[link->q], v[link->v],
                                                                         kt_step_time(w->step, stage), slope);
        by_xi[link->v] += by_tau[link->v] * slope[0];
        by_v[link->v] += by_tau[link->v] * slope[1];
    }
}

static kt_status sweep_tree(kt_step_work *w, size_t stage, const double *mu, kt_error *error) {
    const size_t nq = w->model->n.q, n = w->model->n.v, N = nq + n;
    const double *q = w->stage + stage * N, *v = q + nq, *a = w->slope + stage * N + nq;
    double *by_xi = w->tangent, *by_v = by_xi + n, *by_tau = by_v + n;
    memcpy(by_tau, mu, n * sizeof *mu);
    const kt_gradient gradient = {by_xi, by_v, w->inverse_force, w->momentum};
    kt_status status = kt_tree_respond(w->model, w->data, q, w->inverse, by_tau, error);
    if (status == KT_OK)
        status = kt_gradient_evaluate(w->model, w->data, q, v, a, w->step->external, true, by_tau, w->links, &gradient,
                                      error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < 2 * n; i++)
        by_xi[i] = -by_xi[i];
    add_joint_effects(w, stage, q, v, by_xi, by_v, by_tau);
    return KT_OK;
}

static kt_status multiply(kt_step_work *w, size_t stage, const double *mu, kt_error *error) {
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
    const bool is_tree = !w->model->n.group && acts_in_joints(w->model);
    return is_tree ? sweep_tree(w, i, mu, error) : multiply(w, i, mu, error);
}
