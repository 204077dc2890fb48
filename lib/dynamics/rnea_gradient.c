/* The passes of rnea_gradient.h: motion and terms of each link from the root to the tips, sums back to the root. */
#include "dynamics/rnea_gradient.h"
#include "dynamics/dof.h"

/* I W, F and 2B' W of the link alone. */
KT_INLINE void set_link_wrenches(const kt_link *link, const kt_link_motion *m, kt_v4 acceleration,
                                 kt_gradient_link *x) {
    kt_v4 j[3];
    kt_rotate_inertia3(m->axes, &link->inertia, j);
    const kt_v4 h = kt_v4_apply_to(m->axes, link->moment), mass = kt_v4_splat(link->mass), w = m->omega;
    const kt_v4 spin = x->w[0], shift = x->w[1], turned = kt_v4_cross(spin, w), around = kt_v4_cross(w, h);
    const kt_v4 half = kt_v4_splat(0.5 * (j[0][0] + j[1][1] + j[2][2])), p = mass * x->velocity + around;
    x->f[0] = kt_v4_apply(j, m->alpha) + kt_v4_cross(w, kt_v4_apply(j, w)) + kt_v4_cross(h, acceleration);
    x->f[1] = mass * acceleration + kt_v4_cross(m->alpha, h) + kt_v4_cross(w, around);
    x->h[0] = kt_v4_apply(j, spin) + kt_v4_cross(h, shift);
    x->h[1] = mass * shift + kt_v4_cross(spin, h);
    x->n = kt_v4_splat(2.0) *
           (kt_v4_splat(kt_v4_dot(x->velocity, h)) * spin - kt_v4_splat(kt_v4_dot(x->velocity, spin)) * h -
            half * turned + kt_v4_apply(j, turned) + kt_v4_cross(p, shift));
    x->y = kt_v4_splat(0.0);
}

KT_INLINE void forward_pass(const kt_model *model, const kt_link_motion *motion, kt_v4 gravity, const double *v,
                            const double *w, kt_gradient_link *links) {
    const kt_v4 none = kt_v4_splat(0.0);
    links[0] = (kt_gradient_link){.velocity = none, .linear = -gravity, .w = {none, none}};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i], *up = &motion[link->parent];
        const kt_gradient_link *px = &links[link->parent];
        kt_gradient_link *x = &links[i];
        kt_v4 angular, linear, spin, shift;
        kt_joint_twist(link, up, m, v, &angular, &linear);
        kt_joint_twist(link, up, m, w, &spin, &shift);
        const kt_v4 acceleration = m->linear - gravity;
        x->velocity = px->velocity + kt_v4_cross(up->omega, m->offset) + linear;
        x->linear = acceleration - kt_v4_cross(m->omega, x->velocity);
        x->w[0] = px->w[0] + spin;
        x->w[1] = px->w[1] + kt_v4_cross(px->w[0], m->offset) + shift;
        set_link_wrenches(link, m, acceleration, x);
    }
}

/* Subtracts external wrenches from F, and sets X' W. */
KT_INLINE void load(const kt_model *model, const kt_link_motion *motion, const kt_wrench *external,
                    kt_gradient_link *links) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if (body->link == 0)
            continue;
        kt_gradient_link *x = &links[body->link];
        const kt_v4 c = kt_v4_apply(motion[body->link].axes, kt_v4_from(body->in_link.position));
        const kt_v4 n = kt_v4_from(external[b].moment), f = kt_v4_from(external[b].force);
        x->f[0] -= n + kt_v4_cross(c, f);
        x->f[1] -= f;
        x->y += kt_v4_cross(n, x->w[0]) + kt_v4_cross(f, x->w[1] + kt_v4_cross(x->w[0], c));
    }
}

/* Degree of freedom i; b: W_b. */
KT_INLINE void write_dof(const kt_dof_motion *m, const kt_gradient_link *x, const kt_v4 b[2], int i,
                         const kt_gradient *out) {
    const kt_v4 s = m->s[0], moment = kt_v4_cross(s, x->f[0]) + kt_v4_cross(m->s[1], x->f[1]);
    out->force[i] = kt_v4_dot2(s, x->f[0], m->s[1], x->f[1]);
    out->momentum[i] = kt_v4_dot2(s, x->h[0], m->s[1], x->h[1]);
    out->by_q[i] = kt_v4_dot2(m->rate[0], x->h[0], m->rate[1], x->h[1]) + kt_v4_dot2(m->psi[0], x->n, s, x->y) +
                   kt_v4_dot2(b[0], moment, b[1], kt_v4_cross(s, x->f[1]));
    out->by_v[i] = kt_v4_dot2(m->phi[0], x->h[0], m->phi[1], x->h[1]) + kt_v4_dot(s, x->n);
}

KT_INLINE void backward_pass(const kt_model *model, const kt_link_motion *motion, const double *v, const double *a,
                             const double *w, kt_gradient_link *links, const kt_gradient *out) {
    for (size_t i = model->n.link - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i], *up = &motion[link->parent];
        const kt_gradient_link *x = &links[i];
        kt_gradient_link *px = &links[link->parent];
        const kt_v4 alpha = up->alpha, r = m->offset;
        kt_carried c = {.omega = up->omega,
                        .velocity = px->velocity + kt_v4_cross(up->omega, r),
                        .alpha = alpha,
                        .linear = px->linear + kt_v4_cross(alpha, r)};
        kt_dof_motion dof[KT_DOF_MAX];
        kt_v4 b[2] = {px->w[0], px->w[1] + kt_v4_cross(px->w[0], r)};
        kt_dof_motions_set(link, up, m, v, a, &c, dof);
        const int count = kt_link_dofs(link), translations = kt_link_first_node(link);
        for (int k = 0; k < count; k++) {
            for (int l = 0; l < translations && k == translations; l++) /* they carry the rotations */
                b[1] += kt_v4_splat(w[link->v + l]) * dof[l].s[1];
            write_dof(&dof[k], x, b, link->v + k, out);
        }
        px->h[0] += x->h[0] + kt_v4_cross(r, x->h[1]);
        px->h[1] += x->h[1];
        px->f[0] += x->f[0] + kt_v4_cross(r, x->f[1]);
        px->f[1] += x->f[1];
        px->n += x->n;
        px->y += x->y;
    }
}

void KT_KERNEL(kt_inverse_gradient)(const kt_model *model, const kt_data *data, const kt_dynamic_state *at,
                                    const double *a, bool weightless, const double *w, const kt_gradient *out) {
    const kt_v4 gravity = weightless ? kt_v4_splat(0.0) : model->gravity;
    kt_gradient_link *links = out->links;
    forward_pass(model, data->motion, gravity, at->v, w, links);
    if (at->external)
        load(model, data->motion, at->external, links);
    links[0] = (kt_gradient_link){.velocity = kt_v4_splat(0.0), .linear = -gravity};
    backward_pass(model, data->motion, at->v, a, w, links, out);
}
