/* The passes of aba_inverse.h. */
#include "dynamics/aba.h"
#include "dynamics/aba_inverse.h"

/* ---- terms ------------------------------------------------------------------------------------------------------- */

typedef struct filling {
    kt_inverse_terms *terms;
    size_t dof; /* the first of the link that was eliminated last */
} filling;

/* Sets the terms of one degree of freedom and projects it out; `size` is what rounding errors are proportional to. */
KT_INLINE bool project(kt_v4 angular, kt_v4 linear, double armature, double size, kt_articulated *x, kt_inverse_dof *to,
                       double *d) {
    const kt_v4 un = kt_articulated_moment(x, angular, linear), uf = kt_articulated_force(x, angular, linear);
    const double inertia = kt_v4_dot2(angular, un, linear, uf) + armature;
    if (!(inertia > KT_NO_INERTIA * size))
        return false;
    *d = 1.0 / inertia;
    const kt_v4 dd = kt_v4_splat(*d);
    kt_articulated_subtract_square(x, *d, un, uf);
    *to = (kt_inverse_dof){.s = {angular, linear}, .gain = {un * dd, uf * dd}};
    return true;
}

/* All degrees of freedom of a link. A free link's translations are judged by its mass alone, as in aba.h. */
KT_INLINE kt_elimination eliminate(const kt_model *model, kt_data *data, size_t i, const double *tau, kt_articulated *x,
                                   void *context) {
    const kt_link *link = &model->link[i];
    const kt_v4 turn = kt_diagonal3(x->j), slide = kt_diagonal3(x->m);
    filling *f = context;
    kt_subspace s;
    (void)tau;
    kt_link_subspace(link, &data->motion[link->parent], &data->motion[i], &s);
    f->dof -= (size_t)s.count;
    for (int k = s.count - 1; k >= 0; k--) {
        const kt_v4 a = s.angular[k], l = s.linear[k];
        const bool by_mass = s.count == KT_DOF_MAX && k < kt_link_lengths(link);
        const double size = kt_v4_dot2(a * a, turn, l * l, slide) + (by_mass ? 0.0 : link->size);
        if (!project(a, l, model->armature[link->v + k], size, x, &f->terms->dof[f->dof + (size_t)k],
                     &f->terms->reciprocal[f->dof + (size_t)k]))
            return KT_ELIMINATION_SINGULAR;
    }
    f->terms->offset[i] = data->motion[i].offset;
    return KT_ELIMINATION_PASSED;
}

size_t KT_KERNEL(kt_inverse_compute)(const kt_model *model, kt_data *data, const double *q, kt_inverse_terms *terms) {
    filling f = {.terms = terms, .dof = model->n.v};
    kt_articulated_motion(model, data, q, model->zero, model->n.link);
    return kt_articulated_backward(model, data, model->zero, model->n.link, eliminate, &f);
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

KT_INLINE void backward_pass(const kt_model *model, const kt_inverse_terms *w, double *x) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_inverse_flow carried = {none, none};
    size_t dof = model->n.v;
    for (size_t i = 1; i < model->n.link; i++)
        if (model->link[i].branches)
            w->flow[i] = carried;
    for (size_t i = model->n.link - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        kt_v4 moment = link->leads ? carried.angular : none, force = link->leads ? carried.linear : none;
        if (link->branches) {
            moment += w->flow[i].angular;
            force += w->flow[i].linear;
        }
        for (int k = kt_link_dofs(link) - 1; k >= 0; k--) {
            const kt_inverse_dof *t = &w->dof[--dof];
            const double left = x[link->v + k] - kt_v4_dot2(t->s[0], moment, t->s[1], force);
            x[link->v + k] = left * w->reciprocal[dof];
            moment += t->gain[0] * kt_v4_splat(left);
            force += t->gain[1] * kt_v4_splat(left);
        }
        if (link->parent == 0)
            continue;
        moment += kt_v4_cross(w->offset[i], force);
        if (link->follows) {
            carried = (kt_inverse_flow){moment, force};
        } else {
            w->flow[link->parent].angular += moment;
            w->flow[link->parent].linear += force;
        }
    }
}

KT_INLINE void forward_pass(const kt_model *model, const kt_inverse_terms *w, double *x) {
    const kt_v4 none = kt_v4_splat(0.0);
    size_t dof = 0;
    w->flow[0] = (kt_inverse_flow){none, none};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_inverse_flow *up = &w->flow[link->parent];
        const int count = kt_link_dofs(link);
        kt_v4 alpha = up->angular, linear = up->linear + kt_v4_cross(up->angular, w->offset[i]);
        for (int k = 0; k < count; k++, dof++) {
            const kt_inverse_dof *t = &w->dof[dof];
            const double a = x[link->v + k] - kt_v4_dot2(t->gain[0], alpha, t->gain[1], linear);
            x[link->v + k] = a;
            alpha += t->s[0] * kt_v4_splat(a);
            linear += t->s[1] * kt_v4_splat(a);
        }
        w->flow[i] = (kt_inverse_flow){alpha, linear};
    }
}

void KT_KERNEL(kt_inverse_apply)(const kt_model *model, const kt_inverse_terms *terms, double *x) {
    backward_pass(model, terms, x);
    forward_pass(model, terms, x);
}
