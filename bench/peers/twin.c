/* SPDX-License-Identifier: Apache-2.0 */
#include "twin.h"

#include <math.h>
#include <string.h>

bool kt_twin_flat(const kt_twin *twin) {
    for (int i = 0; i < twin->description->body_count; i++) {
        const kt_joint *j = &twin->description->bodies[i].joint;
        const bool turns = j->type == KT_JOINT_REVOLUTE && j->axis.x == 0.0 && j->axis.y == 0.0;
        if (!(turns || (j->type == KT_JOINT_PRISMATIC && j->axis.z == 0.0)) || j->rotation.type != KT_ROTATION_NONE)
            return false;
    }
    return true;
}

void kt_twin_read(const kt_model *model, const kt_data *data, const kt_twin *to) {
    for (int b = 1; b < kt_model_body_count(model); b++) {
        const int i = kt_body_source(model, b);
        to->pose[i] = kt_body_pose(model, data, b);
        to->twist[i] = kt_body_twist(model, data, b);
    }
}

void kt_twin_mass(const kt_twin *twin, int body, kt_vec3 *com, kt_sym3 *inertia) {
    const kt_body *b = &twin->description->bodies[body];
    *com = b->com;
    *inertia = b->inertia;
    if (b->com_of_shape || b->inertia_of_shape)
        (void)!kt_body_inertia(b, com, inertia, NULL);
    if (kt_twin_flat(twin)) {
        inertia->xx = fmax(inertia->xx, 1e-4 * b->mass + inertia->zz);
        inertia->yy = fmax(inertia->yy, 1e-4 * b->mass + inertia->zz);
    }
}

bool kt_twin_known(const kt_description *description) {
    bool good = true;
    for (int i = 0; i < description->body_count; i++) {
        const kt_joint_type type = description->bodies[i].joint.type;
        good = good && (type == KT_JOINT_FIXED || type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC ||
                        type == KT_JOINT_SPHERICAL || type == KT_JOINT_FREE);
    }
    for (int i = 0; i < description->loop_count; i++)
        good =
            good && (description->loops[i].type == KT_LOOP_REVOLUTE || description->loops[i].type == KT_LOOP_SPHERICAL);
    return good && description->effect_count == 0;
}

kt_pose kt_twin_end(const kt_twin *twin, const kt_end *end, int *body) {
    kt_pose frame = kt_pose_identity();
    frame.position = end->at;
    (void)!kt_rotation_evaluate(&end->rotation, &frame.rotation, NULL);
    *body = -1;
    for (int i = 0; end->body && i < twin->description->body_count; i++)
        if (strcmp(twin->description->bodies[i].name, end->body) == 0)
            *body = i;
    if (*body < 0)
        return frame;
    const kt_body *b = &twin->description->bodies[*body];
    for (int m = 0; end->marker && m < b->marker_count; m++)
        if (strcmp(b->markers[m].name, end->marker) == 0)
            frame.position = b->markers[m].at;
    return kt_pose_compose(twin->pose[*body], frame);
}
