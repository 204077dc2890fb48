/* Where the links are, with plain arithmetic: what set-up needs before there are data. */
#include "model/internal.h"

static kt_pose joint_pose(const kt_link *link, const double *q) {
    kt_pose p = kt_pose_identity();
    const double x = q[link->q];
    kt_vec3 along = {0.0, 0.0, 0.0};
    (link->axis == 0 ? &along.x : link->axis == 1 ? &along.y : &along.z)[0] = 1.0;
    switch ((kt_motion)link->motion) {
    case KT_MOTION_TURN:
        p.rotation = kt_matrix_about(link->axis, x);
        break;
    case KT_MOTION_SLIDE:
        p.position = kt_vec3_scale(x, along);
        break;
    case KT_MOTION_HELIX:
        p.rotation = kt_matrix_about(link->axis, x);
        p.position = kt_vec3_scale(link->pitch * x, along);
        break;
    case KT_MOTION_BALL:
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
