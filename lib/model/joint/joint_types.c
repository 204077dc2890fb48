/* The list of joint types, and the functions that follow from their descriptors. Shared code of the types is in axes.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"

#define KT_JOINT_ENTRY(id, name, nq, nv) [id] = &kt_joint_##name,
const kt_joint_kind *const kt_joint_kinds[KT_JOINT_TYPE_COUNT] = {KT_JOINT_LIST(KT_JOINT_ENTRY)};
#undef KT_JOINT_ENTRY

const kt_descriptor *kt_joint_descriptor(kt_joint_type type) {
    return (unsigned)type < KT_JOINT_TYPE_COUNT ? &kt_joint_kinds[type]->descriptor : NULL;
}

/* The coordinates of a quaternion come last. A quaternion has one more coordinate than its rate. */
kt_coordinate_kind kt_joint_coordinate_kind(kt_joint_type type, int k) {
    if ((unsigned)type >= KT_JOINT_TYPE_COUNT || k < 0 || k >= kt_joint_sizes[type].nq)
        return KT_COORDINATE_NONE;
    const int last = kt_joint_sizes[type].nv - 1;
    return (kt_coordinate_kind)kt_joint_kinds[type]->coordinate[k < last ? k : last];
}

void kt_joint_check(kt_checker *checker, const kt_joint *joint) {
    const kt_joint_kind *kind = kt_joint_kinds[joint->type];
    const kt_joint standard = kt_joint_default();
    kt_checker_keys(checker, &kind->descriptor, joint, &standard);
    if (kind->check != NULL)
        kind->check(checker, joint);
}

kt_joint_type kt_loop_joint_type(kt_loop_type loop) {
    for (int type = 0; type < KT_JOINT_TYPE_COUNT; type++)
        if (kt_joint_kinds[type]->loop == loop)
            return (kt_joint_type)type;
    return KT_JOINT_FIXED;
}

int kt_joint_elements(const kt_joint *joint, kt_element *elements) {
    static const kt_motion motion[KT_COORDINATE_ROTATION + 1] = {[KT_COORDINATE_ANGLE] = KT_MOTION_REVOLUTE,
                                                                 [KT_COORDINATE_TURNS] = KT_MOTION_SCREW,
                                                                 [KT_COORDINATE_LENGTH] = KT_MOTION_PRISMATIC};
    const kt_joint_kind *kind = kt_joint_kinds[joint->type];
    const int count = kt_joint_sizes[joint->type].nv;
    if (kind->elements != NULL)
        return kind->elements(joint, elements);
    for (int k = 0; k < count; k++) {
        elements[k] = kt_element_about(motion[kind->coordinate[k]], joint->axis);
        elements[k].pitch = elements[k].motion == KT_MOTION_SCREW ? joint->pitch : 0.0;
    }
    return count;
}

/* The axis of a coordinate of kind->coordinate, and whether the coordinate is a rotation about this axis. Translations
 * are along the first axes of the triad. */
static kt_vec3 coordinate_axis(const kt_joint_kind *kind, const kt_joint_axes *axes, int k, bool *turns) {
    *turns = kind->coordinate[k] == KT_COORDINATE_ANGLE || kind->coordinate[k] == KT_COORDINATE_TURNS;
    return kind->coordinate[k] != KT_COORDINATE_TRANSLATION ? axes->triad.z : k == 0 ? axes->triad.x : axes->triad.y;
}

void kt_joint_measure(kt_joint_type type, const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near,
                      double *q, double *v, double *a) {
    const kt_joint_kind *kind = kt_joint_kinds[type];
    if (kind->measure != NULL) {
        kind->measure(axes, motion, near, q, v, a);
        return;
    }
    for (int k = 0; k < kt_joint_sizes[type].nv; k++) {
        bool turns;
        const kt_vec3 e = coordinate_axis(kind, axes, k, &turns);
        q[k] = turns ? kt_measured_angle(&axes->triad, &motion->pose.rotation, near[k])
                     : kt_vec3_dot(e, motion->pose.position);
        v[k] = kt_vec3_dot(e, turns ? motion->velocity.angular : motion->velocity.linear);
        a[k] = kt_vec3_dot(e, turns ? motion->acceleration.angular : motion->acceleration.linear);
    }
}

kt_wrench kt_joint_wrench(kt_joint_type type, const kt_joint_axes *axes, const kt_pose *pose, const double *tau) {
    const kt_joint_kind *kind = kt_joint_kinds[type];
    kt_wrench w = {.force = kt_vec3_make(0.0, 0.0, 0.0)};
    if (kind->wrench != NULL)
        return kind->wrench(axes, pose, tau);
    for (int k = 0; k < kt_joint_sizes[type].nv; k++) {
        bool turns;
        const kt_vec3 part = kt_vec3_scale(tau[k], coordinate_axis(kind, axes, k, &turns));
        const bool is_second = kind->coordinate[k] == KT_COORDINATE_TRANSLATION && k > 0;
        *(turns ? &w.moment : &w.force) = is_second ? kt_vec3_add(w.force, part) : part;
    }
    return w;
}
