/* What a joint type tells the compiler, and what the files of the types share. */
#ifndef KT_JOINT_JOINT_H
#define KT_JOINT_JOINT_H

#include "model/model.h"

/* An elementary joint as a joint type names it: its link's frame against the joint frame, and what moves. */
typedef struct kt_element {
    kt_motion motion;
    int axis;
    double pitch;
    kt_mat3 frame;
} kt_element;

enum { KT_ELEMENT_MAX = 3 };

/* A body against the joint frame on its parent, and its rates as seen from there: angular, and of the body's origin. */
typedef struct kt_joint_motion {
    kt_pose pose;
    kt_twist velocity, acceleration;
} kt_joint_motion;

/* A joint type: one file of lib/joint each; the joint has been checked before. */
typedef struct kt_joint_kind {
    int nq, nv;
    /* Writes up to KT_ELEMENT_MAX elements and returns their number. Coordinates follow the elements. */
    int (*elements)(const kt_joint *joint, kt_element *elements);
    /* The same pair as a closure, for the absolute formulation; KT_LOOP_TYPE_COUNT: nothing is held. */
    kt_loop_type loop;
    /* Coordinates of a body that moves as the joint lets it, and their first and second rates. Of the numbers that
     * stand for the same rotation those next to `near` (nq) are taken. NULL where there are none. */
    void (*measure)(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a);
    /* A wrench on the body (about its origin) and against its parent with the power tau . v in all motions that the
     * joint allows; joint frame's axes. */
    kt_wrench (*push)(const kt_joint_axes *axes, const kt_pose *pose, const double *tau);
} kt_joint_kind;

extern const kt_joint_kind *const kt_joint_kinds[KT_JOINT_TYPE_COUNT];

/* Of a joint; of a type without axes they mean nothing. */
kt_joint_axes kt_joint_axes_of(const kt_joint *joint);

#define KT_JOINT_EXTERN(id, name, nq, nv) extern const kt_joint_kind kt_joint_##name;
KT_JOINT_LIST(KT_JOINT_EXTERN)
#undef KT_JOINT_EXTERN

/* The unit vector along `axis`; exact along coordinate axes, whatever the length. */
kt_vec3 kt_joint_unit(kt_vec3 axis);

/* A one-axis motion about or along `axis`. The link's frame is turned so that the motion is about or along one of its
 * coordinate axes; where `axis` is x, y or z already, it is not turned at all. */
kt_element kt_element_about(kt_motion motion, kt_vec3 axis);

/* The second axis of a universal joint, given or not. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint);

/* The angle of a rotation about z of the triad, of all that differ by whole turns the one nearest to `near`. Where the
 * rotation is about another axis too, that of the turn left when z is brought back by the least rotation. */
double kt_measured_angle(const kt_mat3 *triad, const kt_mat3 *rotation, double near);

/* The quaternion of a rotation, of both the one nearer to `near` (4); into q (4). */
void kt_measured_quaternion(const kt_mat3 *rotation, const double *near, double *q);

/* The three numbers of a vector. */
static inline void kt_joint_store(double *x, kt_vec3 u) {
    x[0] = u.x;
    x[1] = u.y;
    x[2] = u.z;
}

static inline kt_vec3 kt_joint_load(const double *x) { return kt_vec3_make(x[0], x[1], x[2]); }

/* One turn about the axis, and one slide along it: both are parts of several joints. */
static inline void kt_measure_revolute(const kt_joint_axes *axes, const kt_joint_motion *motion, double near, double *q,
                                       double *v, double *a) {
    *q = kt_measured_angle(&axes->triad, &motion->pose.rotation, near);
    *v = kt_vec3_dot(axes->triad.z, motion->velocity.angular);
    *a = kt_vec3_dot(axes->triad.z, motion->acceleration.angular);
}

static inline void kt_measure_prismatic(kt_vec3 along, const kt_joint_motion *motion, double *q, double *v, double *a) {
    *q = kt_vec3_dot(along, motion->pose.position);
    *v = kt_vec3_dot(along, motion->velocity.linear);
    *a = kt_vec3_dot(along, motion->acceleration.linear);
}

#endif
