/* Inverse dynamics: the recursive Newton-Euler algorithm, in world axes about each link's own origin.
 *
 * Source: Luh, Walker & Paul 1980. See also Featherstone 2008, 5.3.
 *
 * Forward pass: the motion of each link from its parent's (sweep.h), with a_0 = -gravity. Then, with J about the
 * origin, h = m c, and external wrenches subtracted,
 *   n = J alpha + w x J w + h x a
 *   f = m a + alpha x h + w x (w x h)
 * Backward pass:
 *   tau = s . n or s . f,   n_p += n + r x f,   f_p += f
 * The wrench passes in registers to the previous link, if this link is its child. A load right after the store of the
 * same number waits for the store, in each link.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/angles.h"
#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"

#include <assert.h>

/* J u = R (Jb (R' u)) for two vectors would cost more than rotating J once. */
KT_INLINE void inertial_wrench(const kt_link *link, const kt_link_motion *m, kt_link_origin *load) {
    kt_real3 j[3];
    kt_rotate_inertia3(m->axes, &link->inertia, j);
    const kt_real3 h = kt_const_apply3(m->axes, link->moment);
    load->moment =
        kt_add3(kt_add3(kt_apply3(j, m->alpha), kt_cross3(m->omega, kt_apply3(j, m->omega))), kt_cross3(h, m->linear));
    load->force = kt_add3(kt_add3(kt_scale3(kt_const_real1(link->mass), m->linear), kt_cross3(m->alpha, h)),
                          kt_cross3(m->omega, kt_cross3(m->omega, h)));
}

/* Adds the wrench that a link passes to its parent. */
KT_INLINE void add_carried_wrench(kt_link_origin *to, kt_real3 moment, kt_real3 force) {
    to->moment = kt_add3(to->moment, moment);
    to->force = kt_add3(to->force, force);
}

void KT_KERNEL(kt_inverse)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                           /* NOLINTNEXTLINE(readability-non-const-parameter): the joints' macros write tau */
                           const kt_real1 *a, const kt_external *external, kt_real1 *tau) {
    assert(kt_data_serve(model, data));
    const size_t count = model->n.spatial;
    kt_link_motion *motion = data->motion;
    kt_link_origin *load = data->origin;
    const bool far = model->exceeds_caches;
    kt_angles_gather(model, data, q, 0, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(kt_gravity3(model, data), &motion[0]);
    memset(&load[0], 0, sizeof load[0]);
    for (size_t i = 1; i < count; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        if (far) {
            kt_link_fetch(model, data, kt_ahead(i, count));
            kt_fetch(&load[kt_ahead(i, count)], sizeof *load);
        }
        kt_link_pose(link, parent, q, data->cosine, data->sine, &motion[i]);
        kt_link_velocity(link, parent, v, &motion[i]);
        kt_link_acceleration(link, parent, a, &motion[i]);
        inertial_wrench(link, &motion[i], &load[i]);
    }
    if (external)
        kt_external_subtract(model, data, external);
    kt_real3 moment = kt_zero3(), force = moment;
    for (size_t i = count - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &motion[i];
        if (far) {
            kt_link_fetch(model, data, kt_ahead_down(i));
            kt_fetch(&load[kt_ahead_down(i)], sizeof *load);
        }
        kt_link_origin *own = &load[i];
        if (link->leads)
            add_carried_wrench(own, moment, force);
        moment = own->moment;
        force = own->force;
        kt_dof_projection p = {.load = own, .tau = &tau[link->v]};
        kt_dofs_visit(link, motion[link->parent].axes, m->axes, kt_project_wrench, &p);
        moment = kt_add3(moment, kt_cross3(m->offset, force));
        if (!link->follows)
            add_carried_wrench(&load[link->parent], moment, force);
    }
}
