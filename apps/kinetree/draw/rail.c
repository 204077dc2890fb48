/* Rails of joints that slide, in space. A rail is fixed to the parent, and is the same in all states of a drawing:
 * it extends from the joint to the body in its outermost states, and beyond.
 *
 * The joint moves its body along the axis, and turns it about the axis at most. The part of the body that the axis
 * pierces is thus the same at all positions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"
#include "picture/solid.h"

#include <math.h>

void kt_reach_along(const kt_picture *p, const kt_pose *poses, int body, const kt_pose *frame, double r, double *low,
                    double *high) {
    for (int i = 0; i < p->solid_count; i++) {
        if (p->part[p->solids[i].body] != p->part[body])
            continue;
        const kt_pose pose = kt_pose_compose(poses[p->solids[i].body], p->solids[i].pose);
        const kt_pose inverse = kt_pose_invert(pose);
        const kt_vec3 from = kt_pose_apply(inverse, frame->position),
                      d = kt_mat3_apply(inverse.rotation, frame->rotation.z);
        kt_solid thick = p->solids[i];
        double enter, leave;
        thick.half = kt_vec3_add(thick.half, kt_vec3_make(0.2 * r, 0.2 * r, 0.2 * r));
        if (!kt_solid_cut(&thick, from, d, &enter, &leave))
            continue;
        *low = fmin(*low, enter);
        *high = fmax(*high, leave);
    }
}

/* The position of a joint that slides, in a state. */
static double place_on_rail(const kt_picture_joint *joint, const kt_pose *poses) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, poses);
    return kt_vec3_dot(kt_vec3_sub(poses[joint->body].position, frame.position), frame.rotation.z);
}

bool kt_rail_span(const kt_drawing *d, const kt_picture_joint *joint, double r, double *low, double *high) {
    const kt_picture *p = d->picture;
    const kt_pose *first = d->rest != NULL ? d->rest : d->poses, frame = kt_body_frame_pose(&joint->frame, first);
    const double at = place_on_rail(joint, first);
    double parent_low = 0.0, parent_high = 0.0, body_low = at, body_high = at;
    if (joint->type != KT_JOINT_PRISMATIC && joint->type != KT_JOINT_CYLINDRICAL && joint->type != KT_JOINT_SCREW)
        return false;
    kt_reach_along(p, first, joint->frame.body, &frame, r, &parent_low, &parent_high);
    if (parent_high - parent_low > 2.0 * r && p->part[joint->frame.body] > 0) /* a solid of the parent is the rail */
        return false;
    kt_reach_along(p, first, joint->body, &frame, r, &body_low, &body_high);
    double least = fmin(at, 0.0), most = fmax(at, 0.0);
    for (int i = 0; i < d->state_count; i++) {
        const double place = place_on_rail(joint, d->poses + (ptrdiff_t)i * p->body_count);
        least = fmin(least, place);
        most = fmax(most, place);
    }
    const double more = 0.5 * (body_high - body_low);
    *low = least + (body_low - at) - more;
    *high = most + (body_high - at) + more;
    return true;
}
