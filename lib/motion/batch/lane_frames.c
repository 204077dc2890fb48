/* Motion and Jacobians of frames on bodies, for several states at once. For one state, dynamics/body_frames.c and
 * control/marker.c compute the same. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "batch/lanes.h"

#include "dynamics/point.h"

static void store3(kt_real1 *x, kt_real3 a) {
    x[0] = a.x;
    x[1] = a.y;
    x[2] = a.z;
}

/* A marker in its body. */
typedef struct placement {
    kt_real3 rotation[3], position;
} placement;

static placement placement_of(const kt_lane_frame *frame) {
    const kt_real1 *x = (const void *)frame->marker;
    return (placement){.rotation = {kt_load3(x), kt_load3(x + 3), kt_load3(x + 6)}, .position = kt_load3(x + 9)};
}

/* The frame's origin in its body. */
static kt_real3 lane_frame_origin(const kt_lane_frame *frame) {
    return frame->marker ? placement_of(frame).position : kt_zero3();
}

/* p = p_b + R_b d and R = R_b S, of the body's frame p_b and R_b. */
static void store_pose(const kt_body_record *b, const kt_link_motion *m, kt_real3 origin, const kt_lane_frame *frame,
                       kt_real1 *out) {
    const kt_const_mat3 *r = &b->in_link.rotation;
    const kt_real3 in_link[3] = {r->x, r->y, r->z};
    kt_real3 axes[3], position = kt_add3(origin, kt_point_arm(b, m->axes, kt_zero3()));
    kt_multiply3(m->axes, in_link, axes);
    if (frame->marker) {
        const placement s = placement_of(frame);
        position = kt_add3(position, kt_apply3(axes, s.position));
        kt_multiply3(axes, s.rotation, axes);
    }
    for (int k = 0; k < 3; k++)
        store3(out + 3 * k, axes[k]);
    store3(out + 9, position);
}

/* The 24 numbers of kt_frame_motion: axes (9), position, angular velocity, velocity, angular acceleration, and
 * acceleration. */
void KT_KERNEL(kt_frame_motion)(const kt_model *model, const kt_data *data, const kt_lane_frame *frame, kt_real1 *out) {
    const kt_body_record *b = &model->body[frame->body];
    const kt_link_motion *m = &data->motion[b->link];
    const kt_link_origin *at = &data->origin[b->link];
    const kt_real3 arm = kt_point_arm(b, m->axes, lane_frame_origin(frame));
    store_pose(b, m, at->position, frame, out);
    store3(out + 12, m->omega);
    store3(out + 15, kt_point_transport(at->velocity, m->omega, arm));
    store3(out + 18, m->alpha);
    store3(out + 21, kt_point_accelerate(m->linear, m->alpha, m->omega, arm));
}

/* Walks from the body's link to the ground. `arm` leads from the origin of the present link to the frame's origin. */
void KT_KERNEL(kt_frame_columns)(const kt_model *model, const kt_data *data, const kt_lane_frame *frame,
                                 double *const *out) {
    const kt_body_record *b = &model->body[frame->body];
    kt_real1 column[6 * KT_DOF_MAX] = {{0.0}};
    kt_point_columns c = {.first = column,
                          .arm = kt_point_arm(b, data->motion[b->link].axes, lane_frame_origin(frame))};
    for (int32_t i = b->link; i > 0; i = model->link[i].parent) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *m = &data->motion[i];
        const int count = 6 * kt_link_dofs(link);
        kt_dofs_visit(link, data->motion[link->parent].axes, m->axes, kt_point_column, &c);
        for (int lane = 0; lane < KT_LANES; lane++)
            for (int k = 0; k < count && out[lane]; k++)
                out[lane][6 * link->v + k] = column[k][lane];
        c.arm = kt_add3(c.arm, m->offset);
    }
}
