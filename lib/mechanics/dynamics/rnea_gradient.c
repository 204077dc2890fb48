/* The passes of rnea_gradient.h: motion and terms of each link from the root to the tips, sums back to the root. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/rnea_gradient.h"
#include "dynamics/dof.h"

#include <assert.h>

/* I W, F and 2B' W of the link alone. */
KT_INLINE void set_link_wrenches(const kt_link *link, const kt_link_motion *m, kt_real3 acceleration,
                                 kt_gradient_link *x) {
    kt_real3 j[3];
    kt_rotate_inertia3(m->axes, &link->inertia, j);
    const kt_real3 h = kt_const_apply3(m->axes, link->moment), mass = kt_const_same3(link->mass), w = m->omega;
    const kt_real3 spin = x->w[0], shift = x->w[1], turned = kt_cross3(spin, w), around = kt_cross3(w, h);
    const kt_real1 half = 0.5 * (KT_PART3(j[0], 0) + KT_PART3(j[1], 1) + KT_PART3(j[2], 2));
    const kt_real3 p = kt_add3(kt_mul3(mass, x->velocity), around);
    const kt_real3 along = kt_sub3(kt_scale3(kt_dot3(x->velocity, h), spin), kt_scale3(kt_dot3(x->velocity, spin), h));
    x->f[0] = kt_add3(kt_add3(kt_apply3(j, m->alpha), kt_cross3(w, kt_apply3(j, w))), kt_cross3(h, acceleration));
    x->f[1] = kt_add3(kt_add3(kt_mul3(mass, acceleration), kt_cross3(m->alpha, h)), kt_cross3(w, around));
    x->h[0] = kt_add3(kt_apply3(j, spin), kt_cross3(h, shift));
    x->h[1] = kt_add3(kt_mul3(mass, shift), kt_cross3(spin, h));
    x->n = kt_scale3(kt_real1_splat(2.0),
                     kt_add3(kt_add3(kt_sub_scaled3(along, half, turned), kt_apply3(j, turned)), kt_cross3(p, shift)));
    x->y = kt_zero3();
}

/* From the root: velocities of the motion, W of the direction w, and the terms of each link alone. */
KT_INLINE void forward_pass(const kt_model *model, const kt_link_motion *motion, kt_real3 gravity, const kt_real1 *v,
                            const kt_real1 *w, kt_gradient_link *links) {
    const kt_real3 none = kt_zero3();
    links[0] = (kt_gradient_link){.velocity = none, .linear = kt_minus3(gravity), .w = {none, none}};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i], *up = &motion[link->parent];
        const kt_gradient_link *px = &links[link->parent];
        kt_gradient_link *x = &links[i];
        kt_real3 angular, linear, spin, shift;
        kt_joint_twist(link, up, m, v, &angular, &linear);
        kt_joint_twist(link, up, m, w, &spin, &shift);
        const kt_real3 acceleration = kt_sub3(m->linear, gravity);
        x->velocity = kt_add3(kt_add3(px->velocity, kt_cross3(up->omega, m->offset)), linear);
        x->linear = kt_sub3(acceleration, kt_cross3(m->omega, x->velocity));
        x->w[0] = kt_add3(px->w[0], spin);
        x->w[1] = kt_add3(kt_add3(px->w[1], kt_cross3(px->w[0], m->offset)), shift);
        set_link_wrenches(link, m, acceleration, x);
    }
}

/* Subtracts external wrenches from F, and sets X' W. */
KT_INLINE void load(const kt_model *model, const kt_link_motion *motion, const kt_external *external,
                    kt_gradient_link *links) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if (body->link == 0)
            continue;
        kt_gradient_link *x = &links[body->link];
        const kt_real3 c = kt_apply3(motion[body->link].axes, kt_const_from3(body->in_link.position));
        const kt_real3 n = kt_of_external3(external[b].moment), f = kt_of_external3(external[b].force);
        const kt_real3 shift = kt_add3(x->w[1], kt_cross3(x->w[0], c));
        x->f[0] = kt_sub3(x->f[0], kt_add3(n, kt_cross3(c, f)));
        x->f[1] = kt_sub3(x->f[1], f);
        x->y = kt_add3(x->y, kt_add3(kt_cross3(n, x->w[0]), kt_cross3(f, shift)));
    }
}

/* Degree of freedom i; b: W_b. */
KT_INLINE void write_dof(const kt_dof_motion *m, const kt_gradient_link *x, const kt_real3 b[2], int i,
                         const kt_gradient *out) {
    const kt_real3 s = m->s[0], moment = kt_add3(kt_cross3(s, x->f[0]), kt_cross3(m->s[1], x->f[1]));
    out->force[i] = kt_dots3(s, x->f[0], m->s[1], x->f[1]);
    out->momentum[i] = kt_dots3(s, x->h[0], m->s[1], x->h[1]);
    out->by_q[i] = kt_dots3(m->rate[0], x->h[0], m->rate[1], x->h[1]) + kt_dots3(m->psi[0], x->n, s, x->y) +
                   kt_dots3(b[0], moment, b[1], kt_cross3(s, x->f[1]));
    out->by_v[i] = kt_dots3(m->phi[0], x->h[0], m->phi[1], x->h[1]) + kt_dot3(s, x->n);
}

/* From the tips: the results of each degree of freedom from the sums over all that its link carries, which then pass to
 * the parent. H and F are shifted as wrenches. b is W_b, of the frame that carries the node. */
KT_INLINE void backward_pass(const kt_model *model, const kt_link_motion *motion, const kt_gradient_state *at,
                             const kt_real1 *w, kt_gradient_link *links, const kt_gradient *out) {
    for (size_t i = model->n.link - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i], *up = &motion[link->parent];
        const kt_gradient_link *x = &links[i];
        kt_gradient_link *px = &links[link->parent];
        const kt_real3 alpha = up->alpha, r = m->offset;
        kt_carried c = {.omega = up->omega,
                        .velocity = kt_add3(px->velocity, kt_cross3(up->omega, r)),
                        .alpha = alpha,
                        .linear = kt_add3(px->linear, kt_cross3(alpha, r))};
        kt_dof_motion dof[KT_DOF_MAX];
        kt_real3 b[2] = {px->w[0], kt_add3(px->w[1], kt_cross3(px->w[0], r))};
        kt_dof_motions_set(link, up, m, at->v, at->a, &c, dof);
        const int count = kt_link_dofs(link), translations = kt_link_first_node(link);
        for (int k = 0; k < count; k++) {
            for (int l = 0; l < translations && k == translations; l++) /* they carry the rotations */
                b[1] = kt_add_scaled3(b[1], w[link->v + l], dof[l].s[1]);
            write_dof(&dof[k], x, b, link->v + k, out);
        }
        px->h[0] = kt_add3(px->h[0], kt_add3(x->h[0], kt_cross3(r, x->h[1])));
        px->h[1] = kt_add3(px->h[1], x->h[1]);
        px->f[0] = kt_add3(px->f[0], kt_add3(x->f[0], kt_cross3(r, x->f[1])));
        px->f[1] = kt_add3(px->f[1], x->f[1]);
        px->n = kt_add3(px->n, x->n);
        px->y = kt_add3(px->y, x->y);
    }
}

void KT_KERNEL(kt_inverse_gradient)(const kt_model *model, const kt_data *data, const kt_gradient_state *at,
                                    const kt_real1 *w, const kt_gradient *out) {
    assert(kt_data_serve(model, data));
    const kt_real3 gravity = at->weightless ? kt_zero3() : kt_gravity3(model, data);
    kt_gradient_link *links = out->links;
    forward_pass(model, data->motion, gravity, at->v, w, links);
    if (at->external)
        load(model, data->motion, at->external, links);
    links[0] = (kt_gradient_link){.velocity = kt_zero3(), .linear = kt_minus3(gravity)};
    backward_pass(model, data->motion, at, w, links, out);
}
