/* Motion of the links that carry forces, and of no others: the forward pass of sweep.h, without accelerations. For one
 * state, and for several at once (algebra/real3.h).
 *
 * If formulas read gravity forces, these follow in a backward pass. With m and h the mass and first moment of all that
 * a link carries, about the link's origin, and r the offset of a child,
 *     h = R hb + sum (h_child + m_child r),   tau = -S . (h x g, m g)
 * which is the derivative of the potential energy along S. The links below such a joint are all among these links. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/angles.h"
#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"

#include <assert.h>

/* Sines and cosines of the angles of these links, each at its index among all. */
KT_INLINE void rotate_force_links(const kt_model *model, kt_data *data, const kt_real1 *q) {
    const size_t count = model->n.force_link_angle;
    if (count == model->n.angle) { /* all angles, in the same order */
        kt_angles_gather(model, data, q, 0, count, data->sine, data->cosine);
        return;
    }
    kt_force_angles_gather(model, data, q, data->force_link_sine, data->force_link_cosine);
    for (size_t i = 0; i < count; i++) {
        data->sine[model->force_link_angle_index[i]] = data->force_link_sine[i];
        data->cosine[model->force_link_angle_index[i]] = data->force_link_cosine[i];
    }
}

/* Finds the joint forces that balance gravity, from the mass and the first moment that each link carries. */
static void balance_gravity(const kt_model *model, kt_data *data) {
    const kt_real3 up = kt_minus3(kt_gravity3(model, data));
    kt_carried_mass *carried = data->carried;
    for (size_t i = 0; i < model->n.force_link; i++) {
        const kt_link *link = &model->link[model->force_link[i].link];
        carried[i].mass = kt_const_real1(link->mass);
        carried[i].moment = kt_const_apply3(data->force_link[i].link.axes, link->moment);
    }
    for (size_t i = model->n.force_link - 1; i > 0; i--) {
        const kt_force_link *b = &model->force_link[i];
        const kt_link *link = &model->link[b->link];
        const kt_link_motion *m = &data->force_link[i].link;
        const kt_carried_mass own = carried[i];
        kt_carried_mass *parent = &carried[b->parent];
        const kt_link_origin load = {.moment = kt_cross3(own.moment, up), .force = kt_scale3(own.mass, up)};
        kt_dof_projection p = {.load = &load, .tau = &data->gravity_force[link->v]};
        kt_dofs_visit(link, data->force_link[b->parent].link.axes, m->axes, kt_project_wrench, &p);
        parent->moment = kt_add3(parent->moment, kt_add_scaled3(own.moment, own.mass, m->offset));
        parent->mass += own.mass;
    }
}

/* Forward pass over the links on which forces act. The position of a link is base + local (kt_force_frame). */
void KT_KERNEL(kt_force_links)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v) {
    assert(kt_data_serve(model, data));
    const kt_real3 none = kt_zero3();
    kt_force_frame *motion = data->force_link;
    rotate_force_links(model, data, q);
    kt_ground_set(none, &motion[0].link);
    motion[0].base = motion[0].local = motion[0].velocity = none;
    for (size_t i = 1; i < model->n.force_link; i++) {
        const kt_force_link *b = &model->force_link[i];
        const kt_link *link = &model->link[b->link];
        const kt_force_frame *parent = &motion[b->parent];
        kt_force_frame *m = &motion[i];
        kt_real3 angular, linear;
        kt_link_pose(link, &parent->link, q, data->cosine, data->sine, &m->link);
        kt_joint_twist(link, &parent->link, &m->link, v, &angular, &linear);
        m->link.omega = kt_add3(parent->link.omega, angular);
        m->base = b->base ? kt_add3(parent->base, m->link.offset) : parent->base;
        m->local = b->base ? none : kt_add3(parent->local, m->link.offset);
        m->velocity = kt_add3(kt_add3(parent->velocity, kt_cross3(parent->link.omega, m->link.offset)), linear);
    }
    if (model->n.gravity > 0)
        balance_gravity(model, data);
}
