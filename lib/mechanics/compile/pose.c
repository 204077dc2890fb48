/* Poses and twists of all links by the functions of the C library, for set-up, when there are no data yet. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"

#include "dynamics/joint_motion.h"

void kt_link_poses(const kt_model *model, const double *q, kt_pose *poses) {
    poses[0] = kt_pose_identity();
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        struct {
            kt_link link;
            kt_link_rest rest;
        } at = {.link = *link};
        const kt_pose *up = &poses[link->parent];
        const double x = q[link->q], c = cos(x), s = sin(x);
        kt_link_motion parent = {.omega = {0.0}}, own = {.omega = {0.0}};
        kt_v4_from_mat3(up->rotation, parent.axes);
        at.link.angle = 0; /* c and s are those of this link alone */
        if (link->rest) {
            at.rest = *kt_link_rest_of(link);
            at.link.rest = (int32_t)(sizeof at.link / sizeof(double));
        }
        kt_link_pose(&at.link, &parent, q, &c, &s, &own);
        poses[i].rotation = kt_v4_mat3(own.axes);
        poses[i].position = kt_vec3_add(up->position, kt_v4_vec3(own.offset));
    }
}

void kt_link_twists(const kt_model *model, const double *v, const kt_pose *poses, kt_twist *twists) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    twists[0] = (kt_twist){none, none};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_pose *up = &poses[link->parent];
        const kt_twist *carried = &twists[link->parent];
        const kt_vec3 arm = kt_vec3_sub(poses[i].position, up->position);
        kt_link_motion parent = {.omega = {0.0}}, own = {.omega = {0.0}};
        kt_v4 angular, linear;
        kt_v4_from_mat3(up->rotation, parent.axes);
        kt_v4_from_mat3(poses[i].rotation, own.axes);
        kt_joint_twist(link, &parent, &own, v, &angular, &linear);
        twists[i].angular = kt_vec3_add(carried->angular, kt_v4_vec3(angular));
        twists[i].linear =
            kt_vec3_add(kt_vec3_add(carried->linear, kt_vec3_cross(carried->angular, arm)), kt_v4_vec3(linear));
    }
}
