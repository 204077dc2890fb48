/* Jacobians and bias accelerations of frames. The accelerations at rest of all joint rates are
 *     alpha = sum c_n,i                       c_n,i = w_p x (w_i - w_p)
 *     a     = sum (c_f,i + c_n,i x x_i) + w x (w x x)       c_f,i = w_p x (w_p x r_i) + 2 w_p x u_i
 * over the path to the root (dynamics/sweep.h). The last term is that of the body's own link.
 *
 * The link that carries link i has the angular velocity w_p. The linear part of the joint's velocity is u_i, and r_i is
 * the offset between their origins. The vector x_i leads from link i's origin to the point. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/control.h"

#include <string.h>

/* A twist at the point p in world axes, in another frame. axes: of the body. */
static kt_twist express_twist(kt_twist_frame frame, kt_mat3 axes, kt_vec3 p, kt_twist x) {
    if (frame == KT_TWIST_BODY)
        return (kt_twist){kt_mat3_apply_transposed(axes, x.angular), kt_mat3_apply_transposed(axes, x.linear)};
    return (kt_twist){x.angular, kt_vec3_add(x.linear, kt_vec3_cross(p, x.angular))};
}

void kt_frame_jacobian(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame,
                       double *jacobian) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body) || !kt_is_twist_frame(frame) || !jacobian)
        return;
    const kt_mat3 axes = kt_body_pose(model, data, body).rotation;
    const kt_vec3 p = kt_point_position(model, data, body, at);
    kt_point_jacobian(model, data, body, at, jacobian);
    for (size_t k = 0; k < model->n.v && frame != KT_TWIST_ALIGNED; k++) {
        kt_twist column;
        memcpy(&column, jacobian + 6 * k, sizeof column);
        column = express_twist(frame, axes, p, column);
        memcpy(jacobian + 6 * k, &column, sizeof column);
    }
}

/* Returns u_i. Revolute and spherical motions have none. For other motions it is the remainder of the links'
 * velocities. */
static kt_vec3 slide(const kt_link *link, const kt_link_kinematics *up, const kt_link_kinematics *m) {
    if (link->motion == KT_MOTION_REVOLUTE || link->motion == KT_MOTION_SPHERICAL)
        return kt_vec3_make(0.0, 0.0, 0.0);
    return kt_vec3_sub(kt_vec3_sub(m->velocity, up->velocity), kt_vec3_cross(up->omega, m->offset));
}

kt_twist kt_link_bias(const kt_model *model, const kt_link_kinematics *links, size_t i) {
    const kt_link *link = &model->link[i];
    const kt_link_kinematics *m = &links[i], *up = &links[link->parent];
    const kt_vec3 w = up->omega, twice = kt_vec3_scale(2.0, slide(link, up, m));
    kt_twist bias;
    bias.angular = kt_vec3_cross(w, kt_vec3_sub(m->omega, w));
    bias.linear = kt_vec3_cross(w, kt_vec3_add(kt_vec3_cross(w, m->offset), twice));
    return bias;
}

/* The acceleration of a point due to velocities alone, for twists of the type KT_TWIST_ALIGNED: world axes, about
 * the point. */
static kt_twist aligned_bias(const kt_model *model, const kt_data *data, int body, kt_vec3 at) {
    const kt_body_record *b = &model->body[body];
    const kt_link_kinematics *links = data->kinematics;
    const kt_vec3 w = links[b->link].omega;
    kt_vec3 arm = kt_mat3_apply(links[b->link].axes, kt_pose_apply(b->in_link, at));
    kt_twist sum = {.angular = {0.0, 0.0, 0.0}, .linear = kt_vec3_cross(w, kt_vec3_cross(w, arm))};
    for (int32_t i = b->link; i > 0; i = model->link[i].parent) {
        const kt_twist own = kt_link_bias(model, links, (size_t)i);
        sum.angular = kt_vec3_add(sum.angular, own.angular);
        sum.linear = kt_vec3_add(sum.linear, kt_vec3_add(own.linear, kt_vec3_cross(own.angular, arm)));
        arm = kt_vec3_add(arm, links[i].offset);
    }
    return sum;
}

/* d/dt R' omega = R' alpha, d/dt R' u = R' (a - omega x u), d/dt (u + p x omega) = a + p x alpha + u x omega. */
kt_twist kt_frame_bias(const kt_model *model, const kt_data *data, int body, kt_vec3 at, kt_twist_frame frame) {
    if (!kt_data_serve(model, data) || !KT_IS_INDEX(body, model->n.body) || !kt_is_twist_frame(frame))
        return (kt_twist){{(double)NAN, (double)NAN, (double)NAN}, {(double)NAN, (double)NAN, (double)NAN}};
    kt_twist bias = aligned_bias(model, data, body, at);
    if (frame == KT_TWIST_ALIGNED)
        return bias;
    const kt_vec3 w = data->kinematics[model->body[body].link].omega, u = kt_point_velocity(model, data, body, at);
    bias.linear = kt_vec3_sub(bias.linear, kt_vec3_cross(w, u));
    return express_twist(frame, kt_body_pose(model, data, body).rotation, kt_point_position(model, data, body, at),
                         bias);
}
