/* Boxes that do not move and carry a robot, as ground.
 *
 * Contacts are between shapes and planes. A box is a plane if its edges do not matter: the plane of its upper face. Its
 * edges do not matter if every shape that moves starts with its middle above the face, and within the edges. A table
 * below a robot is such a box. A step next to the robot is none, and neither is a base on which the robot turns. The
 * upper face has the normal that is the nearest to the direction against gravity. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot_contact.h"

#include <math.h>

bool kt_floors_begin(kt_floors *f, kt_draft *d, kt_vec3 gravity, int most) {
    kt_error error;
    const double g = kt_vec3_norm(gravity);
    *f = (kt_floors){.d = d, .up = g > 0.0 ? kt_vec3_scale(-1.0 / g, gravity) : kt_vec3_make(0.0, 0.0, 1.0)};
    f->middles = kt_reader_take(d->r, &d->r->scratch, (size_t)most + 1, sizeof *f->middles);
    const kt_status status = f->middles != NULL
                                 ? kt_contact_tree_make(d->r, d->bodies.items, d->bodies.count, &f->tree, &error)
                                 : KT_ERROR_MEMORY;
    if (status == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(d->r);
    return status == KT_OK;
}

void kt_floors_end(kt_floors *f) { kt_contact_tree_free(&f->tree); }

static kt_pose place_of(const kt_floors *f, const char *body, kt_pose pose) {
    return kt_contact_pose(
        &f->tree, &(kt_end){.body = body, .at = pose.position, .rotation = kt_rotation_of_matrix(pose.rotation)});
}

void kt_floors_add(kt_floors *f, const char *body, kt_pose pose) {
    f->middles[f->count++] = place_of(f, body, pose).position;
}

/* The axis of the upper face, 0 to 2, and its sign. */
static int upper_axis(const kt_floors *f, kt_mat3 axes, double *sign) {
    const double part[3] = {kt_vec3_dot(axes.x, f->up), kt_vec3_dot(axes.y, f->up), kt_vec3_dot(axes.z, f->up)};
    int axis = 0;
    for (int k = 1; k < 3; k++)
        axis = fabs(part[k]) > fabs(part[axis]) ? k : axis;
    *sign = part[axis] < 0.0 ? -1.0 : 1.0;
    return axis;
}

/* Whether a body carries another one on a joint: neighbours do not touch. */
static bool carries_by_joint(const kt_floors *f, const char *body) {
    for (int i = 0; i < f->d->bodies.count && body != NULL; i++) {
        const kt_body *other = kt_draft_body_at(f->d, i);
        if (other->joint.type != KT_JOINT_FIXED && other->joint.type != KT_JOINT_FREE &&
            kt_text_is(other->parent, body))
            return true;
    }
    return false;
}

bool kt_floors_find(const kt_floors *f, const char *body, kt_pose pose, const double half[3], kt_pose *plane) {
    const kt_pose at = place_of(f, body, pose);
    double sign;
    const int axis = upper_axis(f, at.rotation, &sign);
    if (carries_by_joint(f, body))
        return false;
    for (int i = 0; i < f->count; i++) {
        const kt_vec3 from = kt_mat3_apply_transposed(at.rotation, kt_vec3_sub(f->middles[i], at.position));
        const double along[3] = {from.x, from.y, from.z};
        for (int k = 0; k < 3; k++)
            if (k == axis ? !(sign * along[k] > half[k]) : !(fabs(along[k]) < half[k]))
                return false;
    }
    const kt_vec3 normal = kt_vec3_scale(sign, axis == 0   ? pose.rotation.x
                                               : axis == 1 ? pose.rotation.y
                                                           : pose.rotation.z);
    *plane = (kt_pose){.rotation = kt_triad_from_axis(normal, 2),
                       .position = kt_vec3_add(pose.position, kt_vec3_scale(half[axis], normal))};
    return f->count > 0;
}
