/* The passes of aba_inverse.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba.h"
#include "dynamics/aba_inverse.h"

#include <assert.h>

/* ---- terms ------------------------------------------------------------------------------------------------------- */

typedef struct filling {
    kt_inverse_terms *terms;
    size_t dof; /* the first of the link that was eliminated last */
} filling;

/* Sets the terms of one degree of freedom, and projects this degree of freedom out. Rounding errors are proportional to
 * `size`. */
KT_INLINE kt_condition project(kt_real3 angular, kt_real3 linear, double armature, kt_real1 size, kt_articulated *x,
                               kt_inverse_dof *to, kt_real1 *d) {
    const kt_real3 un = kt_articulated_moment(x, angular, linear), uf = kt_articulated_force(x, angular, linear);
    const kt_real1 inertia = kt_dots3(angular, un, linear, uf) + armature;
    kt_condition has_inertia = kt_condition_true();
    if (kt_fails(&has_inertia, inertia > KT_NO_INERTIA * size))
        return kt_condition_false();
    *d = 1.0 / inertia;
    kt_articulated_subtract_square(x, *d, un, uf);
    *to = (kt_inverse_dof){.s = {angular, linear}, .gain = {kt_scale3(*d, un), kt_scale3(*d, uf)}};
    return has_inertia;
}

/* Eliminates all degrees of freedom s of a link, last first. The pivot s'Js must exceed KT_NO_INERTIA times
 * sum s_i^2 J_ii + link->size (aba.h), where link->size has the magnitude of the rigid inertia that the link carries
 * along s. For a free link, link->size is a moment of inertia. Therefore it is left out for the translations, whose
 * pivot is a mass. */
KT_INLINE kt_elimination eliminate(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                   kt_articulated *x, void *context) {
    const kt_link *link = &model->link[i];
    const kt_real3 turn = kt_diagonal3(x->j), slide = kt_diagonal3(x->m);
    filling *f = context;
    kt_subspace s;
    (void)tau;
    kt_link_subspace(link, &data->motion[link->parent], &data->motion[i], &s);
    f->dof -= (size_t)s.count;
    for (int k = s.count - 1; k >= 0; k--) {
        const kt_real3 a = s.angular[k], l = s.linear[k];
        const bool by_mass = s.count == KT_DOF_MAX && k < kt_link_lengths(link);
        const kt_real1 own = kt_dots3(kt_mul3(a, a), turn, kt_mul3(l, l), slide),
                       size = by_mass ? own : own + link->size;
        if (kt_is_rejected(data,
                           project(a, l, model->armature[link->v + k], size, x, &f->terms->dof[f->dof + (size_t)k],
                                   &f->terms->reciprocal[f->dof + (size_t)k])))
            return KT_ELIMINATION_SINGULAR;
    }
    f->terms->offset[i] = data->motion[i].offset;
    return KT_ELIMINATION_PASSED;
}

size_t KT_KERNEL(kt_inverse_compute)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *zero,
                                     kt_inverse_terms *terms) {
    assert(kt_data_serve(model, data));
    filling f = {.terms = terms, .dof = model->n.v};
    kt_articulated_motion(model, data, q, zero, model->n.link);
    return kt_articulated_backward(model, data, zero, model->n.link, eliminate, &f);
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

/* Whether x is zero at a link. Columns of contacts are zero at most bodies, and so is M^-1 of these columns at bodies
 * that neither carry nor are carried. */
KT_INLINE bool is_zero_at(const kt_link *link, const kt_real1 *x) {
#ifndef KT_LANES
    int k = 0;
    while (k < kt_link_dofs(link) && x[link->v + k] == 0.0)
        k++;
    return k == kt_link_dofs(link);
#else
    (void)link, (void)x;
    return false;
#endif
}

/* First pass of M^-1 x, tips first: for each degree of freedom s, left = x - s . W with the wrench W of the
 * children. Then x becomes left / D, and W grows by left times the gain. */
KT_INLINE void backward_pass(const kt_model *model, const kt_inverse_terms *w, kt_real1 *x) {
    const kt_real3 none = kt_zero3();
    kt_inverse_flow carried = {none, none};
    size_t dof = model->n.v;
    for (size_t i = 1; i < model->n.link; i++)
        if (model->link[i].branches)
            w->flow[i] = carried;
    for (size_t i = model->n.link - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        kt_real3 moment = link->leads ? carried.angular : none, force = link->leads ? carried.linear : none;
        if (link->parent == 0 && !link->leads && !link->branches && is_zero_at(link, x)) {
            dof -= (size_t)kt_link_dofs(link);
            continue;
        }
        if (link->branches) {
            moment = kt_add3(moment, w->flow[i].angular);
            force = kt_add3(force, w->flow[i].linear);
        }
        for (int k = kt_link_dofs(link) - 1; k >= 0; k--) {
            const kt_inverse_dof *t = &w->dof[--dof];
            const kt_real1 left = x[link->v + k] - kt_dots3(t->s[0], moment, t->s[1], force);
            x[link->v + k] = left * w->reciprocal[dof];
            moment = kt_add_scaled3(moment, left, t->gain[0]);
            force = kt_add_scaled3(force, left, t->gain[1]);
        }
        if (link->parent == 0)
            continue;
        moment = kt_add3(moment, kt_cross3(w->offset[i], force));
        if (link->follows) {
            carried = (kt_inverse_flow){moment, force};
        } else {
            kt_inverse_flow *up = &w->flow[link->parent];
            up->angular = kt_add3(up->angular, moment);
            up->linear = kt_add3(up->linear, force);
        }
    }
}

/* Second pass of M^-1 x, from the root: x = y - gain . A, with y = left / D of the first pass and the acceleration A
 * before the degree of freedom, and A grows by s x. */
KT_INLINE void forward_pass(const kt_model *model, const kt_inverse_terms *w, kt_real1 *x) {
    const kt_real3 none = kt_zero3();
    size_t dof = 0;
    kt_real3 alpha = none, linear = none; /* of the previous link, in registers as in aba.h */
    w->flow[0] = (kt_inverse_flow){none, none};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const int count = kt_link_dofs(link);
        if (link->parent == 0 && is_zero_at(link, x)) {
            w->flow[i] = w->flow[0];
            alpha = linear = none;
            dof += (size_t)count;
            continue;
        }
        if (!link->follows) {
            alpha = w->flow[link->parent].angular;
            linear = w->flow[link->parent].linear;
        }
        linear = kt_add3(linear, kt_cross3(alpha, w->offset[i]));
        for (int k = 0; k < count; k++, dof++) {
            const kt_inverse_dof *t = &w->dof[dof];
            const kt_real1 a = x[link->v + k] - kt_dots3(t->gain[0], alpha, t->gain[1], linear);
            x[link->v + k] = a;
            alpha = kt_add_scaled3(alpha, a, t->s[0]);
            linear = kt_add_scaled3(linear, a, t->s[1]);
        }
        w->flow[i] = (kt_inverse_flow){alpha, linear};
    }
}

void KT_KERNEL(kt_inverse_apply)(const kt_model *model, const kt_inverse_terms *terms, kt_real1 *x) {
    backward_pass(model, terms, x);
    forward_pass(model, terms, x);
}
