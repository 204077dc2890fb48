/* Frames and points of bodies, from the kinematics of their links (point.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/point.h"

#include "dynamics/dynamics.h"
#include "kinetree/dynamics.h"

#include <string.h>

typedef struct carried {
    kt_v4 arm;                      /* from the link's origin to the point, world axes */
    const kt_link_kinematics *link; /* the link that carries it */
} carried;

/* A point given in the body frame; links: kinematics of all links. */
KT_INLINE carried carry(const kt_model *model, const kt_link_kinematics *links, int body, kt_vec3 at) {
    const kt_body_record *b = &model->body[body];
    const kt_link_kinematics *link = &links[b->link];
    kt_v4 axes[3];
    kt_v4_from_mat3(link->axes, axes);
    return (carried){.arm = kt_point_arm(b, axes, kt_v4_from(at)), .link = link};
}

static const kt_vec3 origin = {0.0, 0.0, 0.0};

static kt_vec3 velocity(const carried *c) {
    return kt_v4_vec3(kt_point_transport(kt_v4_from(c->link->velocity), kt_v4_from(c->link->omega), c->arm));
}

kt_vec3 kt_links_acceleration(const kt_model *model, const kt_link_kinematics *links, int body, kt_vec3 at) {
    const carried c = carry(model, links, body, at);
    const kt_v4 w = kt_v4_from(c.link->omega), alpha = kt_v4_from(c.link->alpha);
    return kt_v4_vec3(kt_point_accelerate(kt_v4_from(c.link->linear), alpha, w, c.arm));
}

kt_twist kt_links_twist(const kt_model *model, const kt_link_kinematics *links, int body) {
    const carried c = carry(model, links, body, origin);
    return (kt_twist){.angular = c.link->omega, .linear = velocity(&c)};
}

kt_vec3 kt_point_position(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    const carried c = carry(model, data->kinematics, body, at);
    return kt_v4_vec3(kt_v4_from(c.link->position) + c.arm);
}

kt_vec3 kt_point_velocity(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    const carried c = carry(model, data->kinematics, body, at);
    return velocity(&c);
}

kt_vec3 kt_point_acceleration(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
    return kt_links_acceleration(model, data->kinematics, body, at);
}

kt_pose kt_body_pose(const kt_model *model, const kt_data *data, int body) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return (kt_pose){{{(double)NAN, (double)NAN, (double)NAN},
                          {(double)NAN, (double)NAN, (double)NAN},
                          {(double)NAN, (double)NAN, (double)NAN}},
                         {(double)NAN, (double)NAN, (double)NAN}};
    const kt_body_record *b = &model->body[body];
    kt_pose pose;
    pose.rotation = kt_mat3_multiply(data->kinematics[b->link].axes, b->in_link.rotation);
    pose.position = kt_point_position(model, data, body, origin);
    return pose;
}

kt_twist kt_body_twist(const kt_model *model, const kt_data *data, int body) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return (kt_twist){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    return kt_links_twist(model, data->kinematics, body);
}

kt_twist kt_body_acceleration(const kt_model *model, const kt_data *data, int body) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body))
        return (kt_twist){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    kt_twist twist;
    twist.angular = data->kinematics[model->body[body].link].alpha;
    twist.linear = kt_point_acceleration(model, data, body, origin);
    return twist;
}

void kt_point_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, double *jacobian) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body) || !jacobian)
        return;
    memset(jacobian, 0, 6 * model->n.v * sizeof *jacobian);
    kt_point_columns c = {.arm = carry(model, data->kinematics, body, at).arm};
    kt_v4 axes[3], parent[3] = {{0.0}};
    for (int32_t i = model->body[body].link; i > 0; i = model->link[i].parent) {
        const kt_link *link = &model->link[i];
        const kt_link_kinematics *m = &data->kinematics[i];
        kt_v4_from_mat3(m->axes, axes);
        if (kt_link_dofs(link) > 1) /* one degree of freedom has its own axis, and does not read the parent's */
            kt_v4_from_mat3(data->kinematics[link->parent].axes, parent);
        c.first = jacobian + 6 * (size_t)link->v;
        kt_dofs_visit(link, parent, axes, kt_point_column, &c);
        c.arm += kt_v4_from(m->offset);
    }
}
