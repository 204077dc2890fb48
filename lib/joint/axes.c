/* Shared by the joint types: axes, elementary joints about or along an axis, and angles and quaternions measured from a
 * rotation. */
#include "joint/joint.h"

#include "algebra/elementary.h"

kt_vec3 kt_joint_unit(kt_vec3 axis) {
    const int zeros = (axis.x == 0.0) + (axis.y == 0.0) + (axis.z == 0.0);
    return zeros == 2 ? kt_vec3_make(kt_sign_of(axis.x), kt_sign_of(axis.y), kt_sign_of(axis.z))
                      : kt_vec3_normalize(axis);
}

kt_element kt_element_about(kt_motion motion, kt_vec3 axis) {
    const kt_vec3 n = kt_joint_unit(axis);
    const double component[3] = {n.x, n.y, n.z};
    for (int k = 0; k < 3; k++)
        if (component[k] == 1.0 && component[(k + 1) % 3] == 0.0 && component[(k + 2) % 3] == 0.0)
            return (kt_element){.motion = motion, .axis = k, .frame = kt_mat3_identity()};
    return (kt_element){.motion = motion, .axis = 2, .frame = kt_triad_from_axis(n, 2)};
}

/* The default second axis follows the first one: x follows z, y follows x, and z follows y. For any other axis the
 * second is the x axis of its triad. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint) {
    if (joint->axis2.x != 0.0 || joint->axis2.y != 0.0 || joint->axis2.z != 0.0)
        return joint->axis2;
    return kt_triad_from_axis(kt_joint_unit(joint->axis), 2).x;
}

kt_joint_axes kt_joint_axes_of(const kt_joint *joint) {
    kt_joint_axes axes;
    axes.triad = kt_triad_from_axis(kt_joint_unit(joint->axis), 2);
    axes.second = kt_joint_unit(kt_joint_second_axis(joint));
    return axes;
}

int kt_joint_elements(const kt_joint *joint, kt_element *elements) {
    static const kt_motion motion[] = {[KT_COORDINATE_ANGLE] = KT_MOTION_REVOLUTE,
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

/* The axis of a coordinate of kind->coordinate, and whether it is a rotation about it. Translations are along the first
 * axes of the triad. */
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

/* The angle of the quaternion's part about z, as in loop/screw.c. */
double kt_measured_angle(const kt_mat3 *triad, const kt_mat3 *rotation, double near) {
    const double turn = 6.283185307179586;
    const kt_vec3 x = kt_mat3_apply(*rotation, triad->x), y = kt_mat3_apply(*rotation, triad->y);
    const double angle =
        atan2(kt_vec3_dot(triad->y, x) - kt_vec3_dot(triad->x, y), kt_vec3_dot(triad->x, x) + kt_vec3_dot(triad->y, y));
    return angle + turn * rint((near - angle) / turn);
}

void kt_measured_quaternion(const kt_mat3 *rotation, const double *near, double *q) {
    const kt_quat p = kt_quat_from_matrix(*rotation);
    const double sign = p.w * near[0] + p.x * near[1] + p.y * near[2] + p.z * near[3] < 0.0 ? -1.0 : 1.0;
    q[0] = sign * p.w;
    q[1] = sign * p.x;
    q[2] = sign * p.y;
    q[3] = sign * p.z;
}
