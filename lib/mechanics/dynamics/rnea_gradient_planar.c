/* The passes of rnea_gradient.h in a plane.
 *
 * When the position of a joint changes, all links that it carries move as one rigid body. Therefore the gradient needs
 * only sums over the particles that the joint carries. The velocities of the motion are v, the velocities along w are
 * u. With accelerations a less gravity, and J a rotation by a right angle,
 *     w . tau = sum m u . a - (external forces . u + moments w)
 * A revolute joint at o turns u - u_o, v - v_o and a - a_o, and J u . a + u . J a = 0, so that
 *     F = sum m a - f,   P = sum m u,   N = 2 sum m u . J v,   Y = -sum f . J u
 *     w . dtau/dq = Y - J u_o . F - P . J a_o,   w . dtau/dv = N - 2 P . J v_o        (a changes by 2 J (v - v_o))
 * A prismatic joint along e is carried at omega and alpha. The joint adds w J e to u, and alpha J e - omega^2 e and 2
 * omega J e to a:
 *     w . dtau/dq = w J e . F + P . (alpha J e - omega^2 e),   w . dtau/dv = 2 omega P . J e
 * The joints' parts of F and P are tau itself and M w.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba_planar.h"
#include "dynamics/rnea_gradient.h"

#include <assert.h>

/* x = M^-1 tau: the accelerations without velocities and gravity */
size_t KT_KERNEL(kt_planar_respond)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *zero,
                                    const kt_real1 *tau, kt_real1 *x) {
    assert(kt_data_serve(model, data));
    const kt_const1 no_gravity[2] = {kt_real1_splat(0.0), kt_real1_splat(0.0)};
    kt_planar_articulated_motion(model, data, q, zero, NULL);
    return model->has_armature
               ? kt_planar_articulated_solve(model, data, tau, kt_planar_eliminate_armature, no_gravity, x)
               : kt_planar_articulated_solve(model, data, tau, kt_planar_eliminate_joint, no_gravity, x);
}

/* Sets the sums of a link to the link's own part. Its children add theirs later. */
KT_INLINE void set_link_wrenches(const kt_planar_link *link, const kt_planar_motion *m, kt_planar_gradient_link *x) {
    const kt_real2 first = kt_planar_const_sum(kt_load2(m->rotation), link->moment); /* m c */
    const kt_real2 h = kt_across2(first), a = kt_load2(m->linear), mass = kt_const_same2(link->mass);
    x->force = kt_add2(kt_mul2(mass, a), kt_sub2(kt_scale2(m->alpha, h), kt_scale2(m->omega * m->omega, first)));
    x->moment = link->inertia * m->alpha + kt_dot2(h, a);
    x->p = kt_add_scaled2(kt_mul2(mass, x->u), x->w, h);
    x->spin = link->inertia * x->w + kt_dot2(h, x->u);
    x->n = 2.0 * (x->w * kt_dot2(first, x->velocity) - m->omega * kt_dot2(first, x->u) -
                  link->mass * kt_cross2(x->u, x->velocity));
    x->y = kt_real1_splat(0.0);
}

/* Velocities and accelerations of a plane's links, their velocities (w, u) in the direction w, and the sums of each
 * link alone. The poses are in the data. */
KT_INLINE void forward_pass(const kt_model *model, kt_data *data, const kt_plane *plane, const kt_gradient_state *at,
                            const kt_real1 *w, kt_planar_gradient_link *links) {
    const kt_const1 no_gravity[2] = {kt_real1_splat(0.0), kt_real1_splat(0.0)};
    const kt_real2 none = kt_make2(kt_real1_splat(0.0), kt_real1_splat(0.0));
    kt_planar_motion *motion = data->planar;
    kt_planar_ground_set(at->weightless ? no_gravity : plane->gravity, &motion[0]);
    links[0] = (kt_planar_gradient_link){.velocity = none, .u = none};
    for (int32_t k = plane->first; k < plane->last; k++) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_motion *up = &motion[link->parent];
        const kt_planar_gradient_link *px = &links[link->parent];
        kt_planar_motion *m = &motion[k];
        kt_planar_gradient_link *x = &links[k];
        const kt_real2 r = kt_across2(kt_load2(m->offset));
        (void)kt_planar_velocity(link, up->omega, at->v, m);
        kt_planar_acceleration(link, up, at->a, m);
        x->velocity = kt_add_scaled2(px->velocity, up->omega, r);
        x->u = kt_add_scaled2(px->u, px->w, r);
        x->w = px->w;
        if (link->revolute) {
            x->w += link->sign * w[link->v];
        } else {
            const kt_real2 e = kt_planar_const_sum(kt_load2(m->rotation), link->along);
            x->velocity = kt_add_scaled2(x->velocity, at->v[link->v], e);
            x->u = kt_add_scaled2(x->u, w[link->v], e);
        }
        set_link_wrenches(link, m, x);
    }
}

/* Subtracts external wrenches. The components of such wrenches out of the plane move nothing. */
KT_INLINE void load(const kt_model *model, const kt_planar_motion *motion, const kt_external *external,
                    kt_planar_gradient_link *links) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        if (body->link == 0)
            continue;
        const kt_planar_external_wrench l = kt_planar_external_of(model, motion, body, &external[b]);
        kt_planar_gradient_link *x = &links[l.link];
        x->moment -= l.moment + kt_cross2(l.x, l.force);
        x->force = kt_sub2(x->force, l.force);
        x->y -= kt_cross2(x->u, l.force) - x->w * kt_dot2(l.x, l.force);
    }
}

/* Degree of freedom i. */
KT_INLINE void write_dof(const kt_planar_link *link, const kt_planar_motion *m, const kt_planar_gradient_link *x,
                         int32_t i, const kt_gradient *out) {
    const kt_real2 a = kt_load2(m->linear);
    if (link->revolute) {
        out->by_q[i] = link->sign * (x->y - kt_cross2(x->u, x->force) - kt_cross2(a, x->p));
        out->by_v[i] = link->sign * (x->n - 2.0 * kt_cross2(x->velocity, x->p));
        out->force[i] = link->sign * x->moment;
        out->momentum[i] = link->sign * x->spin;
        return;
    }
    const kt_real2 e = kt_planar_const_sum(kt_load2(m->rotation), link->along);
    const kt_real1 turned = kt_cross2(e, x->p);
    out->by_q[i] = x->w * kt_cross2(e, x->force) + m->alpha * turned - m->omega * m->omega * kt_dot2(e, x->p);
    out->by_v[i] = 2.0 * m->omega * turned;
    out->force[i] = kt_dot2(e, x->force);
    out->momentum[i] = kt_dot2(e, x->p);
}

/* From the tips: the results of each joint from the sums over all that its link carries, which then pass to the parent.
 * The moments of F and P are shifted to the parent's origin; N and Y need no shift. */
KT_INLINE void backward_pass(const kt_model *model, const kt_planar_motion *motion, kt_planar_gradient_link *links,
                             const kt_gradient *out) {
    for (size_t k = model->n.planar - 1; k > 0; k--) {
        const kt_planar_link *link = &model->planar[k];
        const kt_planar_gradient_link *x = &links[k];
        kt_planar_gradient_link *px = &links[link->parent];
        const kt_real2 r = kt_load2(motion[k].offset);
        write_dof(link, &motion[k], x, link->v, out);
        px->force = kt_add2(px->force, x->force);
        px->moment += x->moment + kt_cross2(r, x->force);
        px->p = kt_add2(px->p, x->p);
        px->spin += x->spin + kt_cross2(r, x->p);
        px->n += x->n;
        px->y += x->y;
    }
}

void KT_KERNEL(kt_planar_gradient)(const kt_model *model, kt_data *data, const kt_gradient_state *at, const kt_real1 *w,
                                   const kt_gradient *out) {
    assert(kt_data_serve(model, data));
    kt_planar_gradient_link *links = (kt_planar_gradient_link *)(void *)out->links;
    for (size_t p = 0; p < model->n.plane; p++)
        forward_pass(model, data, &model->plane[p], at, w, links);
    if (at->external)
        load(model, data->planar, at->external, links);
    backward_pass(model, data->planar, links, out);
}
