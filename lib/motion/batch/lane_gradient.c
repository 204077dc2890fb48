/* The adjoint of forward dynamics of trees, for several states at once; sensitivity/stage_adjoint.c has the adjoint for
 * one state. With w = M^-1 mu, the adjoint is the gradient of w . (tau - inverse dynamics) with respect to positions,
 * velocities and tau. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "base/copy.h"
#include "dynamics/aba_inverse.h"
#include "dynamics/rnea_gradient.h"

#define KT_LANE_ADJOINT_FIELDS(X)                                                                                      \
    X(kt_real1, zero, n->v, "zeros")                                                                                   \
    X(kt_real1, force, n->v, "of kt_inverse_gradient")                                                                 \
    X(kt_real1, momentum, n->v, "likewise")                                                                            \
    X(kt_gradient_link, links, n->link, "likewise")

typedef struct adjoint_work {
    kt_inverse_terms terms;
    KT_ARENA_DECLARE(KT_LANE_ADJOINT_FIELDS)
} adjoint_work;

KT_ARENA_LAYOUT(lay_out, adjoint_work, KT_LANE_ADJOINT_FIELDS, const kt_counts *n)
KT_ARENA_ARRAYS(place_terms, kt_inverse_terms, KT_INVERSE_FIELDS, const kt_counts *n)

size_t KT_KERNEL(kt_adjoint_layout)(const kt_model *model, void *memory) {
    const size_t own = lay_out(memory, &model->n);
    adjoint_work *w = memory;
    if (!w)
        return own + place_terms(NULL, NULL, &model->n);
    kt_clear(w->zero, model->n.v * sizeof *w->zero);
    return own + place_terms(&w->terms, (char *)memory + own, &model->n);
}

/* Models with spatial and planar links are computed in space, as by kt_tree_respond and kt_gradient_evaluate. */
kt_condition KT_KERNEL(kt_tree_adjoint)(const kt_model *model, kt_data *data, void *memory, const kt_lane_state *at,
                                        const double *a, double *gradient) {
    const adjoint_work *w = memory;
    const size_t n = model->n.v;
    const kt_real1 *q = (const void *)at->q;
    kt_real1 *by_q = (void *)gradient, *by_v = by_q + n, *by_tau = by_v + n;
    const kt_gradient_state in = {.v = (const void *)at->v, .a = (const void *)a};
    const kt_gradient out = {by_q, by_v, w->force, w->momentum, w->links};
    kt_inverse_terms terms = w->terms;
    data->sound = kt_condition_true();
    if (model->sweep == KT_SWEEP_PLANAR) {
        (void)KT_KERNEL(kt_planar_respond)(model, data, q, w->zero, by_tau, by_tau);
        KT_KERNEL(kt_planar_gradient)(model, data, &in, by_tau, &out);
    } else {
        (void)KT_KERNEL(kt_inverse_compute)(model, data, q, w->zero, &terms);
        KT_KERNEL(kt_inverse_apply)(model, &terms, by_tau);
        if (model->sweep == KT_SWEEP_SPATIAL) {
            (void)KT_KERNEL(kt_follow)(model, data, q, in.v, in.a);
        } else {
            (void)KT_KERNEL(kt_kinematics)(model, data, q, in.v, in.a);
            (void)KT_KERNEL(kt_planar_kinematics)(model, data, q, in.v, in.a);
        }
        KT_KERNEL(kt_inverse_gradient)(model, data, &in, by_tau, &out);
    }
    for (size_t i = 0; i < n; i++) {
        by_q[i] = -by_q[i];
        by_v[i] = -by_v[i];
    }
    return data->sound;
}
