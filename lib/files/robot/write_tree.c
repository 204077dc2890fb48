/* Bodies within one another, and the pose of each. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/write.h"

kt_pose kt_export_pose(const kt_export *x, int body) {
    const kt_joint *joint = &kt_export_body(x, body)->joint;
    const double *p = joint->position;
    const kt_pose frame = kt_frame_of_joint(joint);
    if (joint->type != KT_JOINT_FREE || x->parent[body] >= 0)
        return frame;
    kt_quat q = kt_quat_make(p[3], p[4], p[5], p[6]);
    q = kt_quat_norm_squared(q) > 0.0 ? kt_quat_normalize(q) : kt_quat_make(1.0, 0.0, 0.0, 0.0);
    const kt_pose start = {.rotation = kt_mat3_from_quat(q), .position = kt_vec3_make(p[0], p[1], p[2])};
    return kt_pose_compose(frame, start);
}

/* Without recursion: the number of bodies within one another has no bound. */
void kt_export_tree(kt_export *x, kt_export_visit *begin, kt_export_visit *end) {
    int depth = 0;
    for (int at = x->first_root; at >= 0;) {
        begin(x, at, depth);
        if (x->first_child[at] >= 0) {
            at = x->first_child[at];
            depth++;
            continue;
        }
        for (;;) {
            if (end != NULL)
                end(x, at, depth);
            if (x->next_child[at] >= 0) {
                at = x->next_child[at];
                break;
            }
            at = x->parent[at];
            if (at < 0)
                return;
            depth--;
        }
    }
}
