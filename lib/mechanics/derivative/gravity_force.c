/* Gravity forces in joints (dynamics/force_frames.c) and their derivatives.
 *
 * With m_i and h_i the mass and first moment of all bodies that degree of freedom i carries, about the origin of its
 * link,
 *     G_i = -S_i . (h_i x g, m_i g)
 * If i moves along with k, only gravity changes in the frame of i, by -s_k x g. If k is after i's node, the masses
 * that k carries move, with j_k the velocity of the origin of k's link:
 *     dG_i / dq_k = S_i . (h_i x (s_k x g), m_i (s_k x g))              k in i's node or before it
 *     dG_i / dq_k = -s_i . ((s_k x h_k + m_k j_k) x g)                  k after i's node
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/gravity_force.h"

/* From the composite inertia of a link, whose block from rotations to forces is -[h]x. */
static kt_carried_mass carried_by(const kt_derivative_work *w, int32_t link) {
    const kt_articulated *inertia = &w->link[link].inertia;
    return (kt_carried_mass){.moment = {inertia->g[2][1], inertia->g[0][2], inertia->g[1][0]},
                             .mass = inertia->m[0][0]};
}

int32_t kt_gravity_dof_of(const kt_model *model, const kt_derivative_work *w, const kt_variable_record *variable) {
    const kt_link *link = &model->link[variable->link];
    const kt_derivative_node *last = &w->node[w->link[variable->link].last];
    return last->first + last->count - kt_link_dofs(link) + variable->v - link->v;
}

/* -S . (h x g, m g) */
static double balance_weight(const kt_dof_motion *dof, kt_carried_mass carried, kt_v4 gravity) {
    return -kt_v4_dot2(dof->s[0], kt_v4_cross(carried.moment, gravity), dof->s[1], kt_v4_splat(carried.mass) * gravity);
}

double kt_gravity_force_of(const kt_model *model, const kt_derivative_work *w, const kt_variable_record *variable) {
    const kt_dof_motion *dof = &w->motion[kt_gravity_dof_of(model, w, variable)];
    return balance_weight(dof, carried_by(w, variable->link), model->gravity);
}

double kt_gravity_force_by(const kt_model *model, const kt_derivative_work *w, const kt_variable_record *variable,
                           int32_t k) {
    const int32_t own = kt_gravity_dof_of(model, w, variable);
    const kt_derivative_node *node = &w->node[w->row[own].node];
    const kt_dof_motion *i = &w->motion[own], *moving = &w->motion[k];
    if (k < node->first + node->count)
        return -balance_weight(i, carried_by(w, variable->link), kt_v4_cross(moving->s[0], model->gravity));
    const kt_carried_mass moved = carried_by(w, w->node[w->row[k].node].link);
    const kt_v4 rate = kt_v4_cross(moving->s[0], moved.moment) + kt_v4_splat(moved.mass) * moving->s[1];
    return -kt_v4_dot(i->s[0], kt_v4_cross(rate, model->gravity));
}
