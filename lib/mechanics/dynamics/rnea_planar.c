/* Inverse dynamics of planar trees: the recursive Newton-Euler algorithm of rnea.c in the plane.
 *
 * Forward pass: the motion (sweep_planar.h), with a_0 = -gravity; then, with h = m c rotated by a right angle, J about
 * the origin, and external wrenches subtracted,
 *   n = J alpha + h . a
 *   f = m a + h alpha - w^2 m c
 * Backward pass, with p = r rotated by a right angle:
 *   tau = +-n or u . f,   n_p += n + p . f,   f_p += f
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics.h"
#include "dynamics/sweep_planar.h"

#include <assert.h>

KT_INLINE void inertial_wrench(const kt_planar_link *link, kt_planar_motion *m) {
    const kt_real2 first = kt_planar_const_sum(kt_load2(m->rotation), link->moment); /* m c */
    const kt_real2 h = kt_across2(first), linear = kt_load2(m->linear);
    m->moment = link->inertia * m->alpha + kt_dot2(h, linear);
    kt_store2(m->force, kt_add2(kt_scale2(kt_const_real1(link->mass), linear),
                                kt_sub2(kt_scale2(m->alpha, h), kt_scale2(m->omega * m->omega, first))));
}

/* The motion of a plane's links, and the wrench (n, f) that each link alone requires. */
static inline void forward_pass(const kt_model *model, kt_data *data, const kt_plane *plane, const kt_real1 *q,
                                const kt_real1 *v, const kt_real1 *a) {
    const kt_real1 *cosine = data->planar_cosine, *sine = data->planar_sine;
    const kt_planar_link *link = &model->planar[plane->first], *last = &model->planar[plane->last];
    kt_planar_motion *motion = data->planar, *m = &motion[plane->first];
    kt_planar_ground_set(plane->gravity, &motion[0]);
    for (; link < last; link++, m++) {
        const kt_planar_motion *parent = link->follows ? m - 1 : &motion[link->parent];
        (void)kt_planar_pose(link, kt_load2(parent->rotation), q, cosine, sine, m);
        (void)kt_planar_velocity(link, parent->omega, v, m);
        kt_planar_acceleration(link, parent, a, m);
        inertial_wrench(link, m);
    }
}

/* Backward pass: the joint force of each link, from the wrench about the link's origin, which passes on to the parent:
 * in registers to the previous link, as in rnea.c. */
static inline void backward_pass(const kt_model *model, kt_data *data, kt_real1 *tau) {
    const kt_planar_link *link = &model->planar[model->n.planar] - 1;
    kt_planar_motion *motion = data->planar, *m = &motion[model->n.planar] - 1;
    kt_real1 moment = kt_real1_splat(0.0);
    kt_real2 force = kt_same2(0.0);
    for (; m > motion; link--, m--) {
        if (link->leads) {
            m->moment += moment;
            kt_store2(m->force, kt_add2(kt_load2(m->force), force));
        }
        moment = m->moment;
        force = kt_load2(m->force);
        if (link->revolute)
            tau[link->v] = link->sign * moment;
        else
            tau[link->v] = kt_dot2(force, kt_planar_const_sum(kt_load2(m->rotation), link->along));
        moment += kt_dot2(kt_across2(kt_load2(m->offset)), force);
        if (!link->follows) {
            kt_planar_motion *parent = &motion[link->parent];
            parent->moment += moment;
            kt_store2(parent->force, kt_add2(kt_load2(parent->force), force));
        }
    }
}

void KT_KERNEL(kt_planar_inverse)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                  const kt_real1 *a, const kt_external *external, kt_real1 *tau) {
    assert(kt_data_serve(model, data));
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        forward_pass(model, data, &model->plane[p], q, v, a);
    if (external)
        kt_planar_external(model, data->planar, external);
    backward_pass(model, data, tau);
}
