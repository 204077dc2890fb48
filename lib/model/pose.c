/* Where the links are and how fast they move, with plain arithmetic: what set-up needs before there are data. */
#include "model/model.h"

static kt_pose joint_pose(const kt_link *link, const double *q) {
    kt_pose p = kt_pose_identity();
    const double x = q[link->q];
    kt_vec3 along = {0.0, 0.0, 0.0};
    (link->axis == 0 ? &along.x : link->axis == 1 ? &along.y : &along.z)[0] = 1.0;
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        p.rotation = kt_matrix_about(link->axis, x);
        break;
    case KT_MOTION_PRISMATIC:
        p.position = kt_vec3_scale(x, along);
        break;
    case KT_MOTION_SCREW:
        p.rotation = kt_matrix_about(link->axis, x);
        p.position = kt_vec3_scale(link->pitch * x, along);
        break;
    case KT_MOTION_SPHERICAL:
        p.rotation = kt_matrix_from_quat(kt_quat_make(x, q[link->q + 1], q[link->q + 2], q[link->q + 3]));
        break;
    case KT_MOTION_FREE: {
        const double *c = q + link->q;
        p.position = kt_vec3_make(c[0], c[1], c[2]);
        p.rotation = kt_matrix_from_quat(kt_quat_make(c[3], c[4], c[5], c[6]));
        break;
    }
    case KT_MOTION_NONE:
        break;
    }
    return p;
}

void kt_link_poses(const kt_model *model, const double *q, kt_pose *poses) {
    poses[0] = kt_pose_identity();
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        kt_pose rest;
        rest.rotation = kt_v4_mat3(link->turn);
        rest.position = kt_v4_vec3(link->at);
        poses[i] = kt_pose_compose(kt_pose_compose(poses[link->parent], rest), joint_pose(link, q));
    }
}

/* Angular and linear velocity of a link against its parent, in the world; `rest` are its axes at rest, `axes` its own.
 */
static kt_twist joint_twist(const kt_link *link, kt_mat3 rest, kt_mat3 axes, const double *v) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    const kt_vec3 along = link->axis == 0 ? rest.x : link->axis == 1 ? rest.y : rest.z;
    const double *x = v + link->v;
    kt_twist t = {none, none};
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        t.angular = kt_vec3_scale(x[0], along);
        break;
    case KT_MOTION_PRISMATIC:
        t.linear = kt_vec3_scale(x[0], along);
        break;
    case KT_MOTION_SCREW:
        t.angular = kt_vec3_scale(x[0], along);
        t.linear = kt_vec3_scale(link->pitch * x[0], along);
        break;
    case KT_MOTION_SPHERICAL:
        t.angular = kt_mat3_apply(axes, kt_vec3_make(x[0], x[1], x[2]));
        break;
    case KT_MOTION_FREE:
        t.linear = kt_mat3_apply(rest, kt_vec3_make(x[0], x[1], x[2]));
        t.angular = kt_mat3_apply(axes, kt_vec3_make(x[3], x[4], x[5]));
        break;
    case KT_MOTION_NONE:
        break;
    }
    return t;
}

void kt_link_twists(const kt_model *model, const double *v, const kt_pose *poses, kt_twist *twists) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    twists[0] = (kt_twist){none, none};
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_pose *up = &poses[link->parent];
        const kt_twist *carried = &twists[link->parent];
        const kt_vec3 arm = kt_vec3_sub(poses[i].position, up->position);
        const kt_mat3 rest = kt_mat3_multiply(up->rotation, kt_v4_mat3(link->turn));
        const kt_twist own = joint_twist(link, rest, poses[i].rotation, v);
        twists[i].angular = kt_vec3_add(carried->angular, own.angular);
        twists[i].linear = kt_vec3_add(kt_vec3_add(carried->linear, kt_vec3_cross(carried->angular, arm)), own.linear);
    }
}
