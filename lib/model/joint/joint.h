/* A joint type, and the code that the files of the types share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_JOINT_JOINT_H
#define KT_JOINT_JOINT_H

#include "base/inner.h"
#include "model/check.h"
#include "model/describe.h"
#include "model/model.h"

/* An elementary joint: its motion, and the frame of its link relative to the joint frame. */
typedef struct kt_element {
    kt_motion motion;
    int axis;
    double pitch;
    kt_mat3 frame;
} kt_element;

enum { KT_ELEMENT_MAX = 3 };

/* Pose of a body relative to the joint frame on its parent, and the rates of the pose in that frame: the angular
 * velocity, and the velocity of the body's origin. */
typedef struct kt_joint_motion {
    kt_pose pose;
    kt_twist velocity, acceleration;
} kt_joint_motion;

/* A type is one file. KT_JOINT_LIST has the numbers of coordinates, which follow from the elements. Only checked joints
 * reach these functions. */
typedef struct kt_joint_kind {
    kt_descriptor descriptor;
    unsigned char coordinate[KT_JOINT_NV_MAX]; /* kt_coordinate_kind of each velocity coordinate */
    /* Reports the faults that the ranges of the keys do not cover; NULL: none. */
    void (*check)(kt_checker *checker, const kt_joint *joint);
    /* kt_joint_elements of the type. NULL: one for each coordinate, all about or along the axis. */
    int (*elements)(const kt_joint *joint, kt_element *elements);
    /* The loop type that leaves the same motion free, for the absolute formulation; KT_LOOP_TYPE_COUNT: no equation. */
    kt_loop_type loop;
    /* kt_joint_measure and kt_joint_wrench of the type. NULL: its coordinates are turns about the axis, lengths along
     * it and translations across it. */
    void (*measure)(const kt_joint_axes *axes, const kt_joint_motion *motion, const double *near, double *q, double *v,
                    double *a);
    kt_wrench (*wrench)(const kt_joint_axes *axes, const kt_pose *pose, const double *tau);
} kt_joint_kind;

KT_INNER extern const kt_joint_kind *const kt_joint_kinds[KT_JOINT_TYPE_COUNT];

/* The type of joint that permits the same motion as loops of a type; KT_JOINT_FIXED: there is none with coordinates. */
kt_joint_type kt_loop_joint_type(kt_loop_type loop);

/* Writes up to KT_ELEMENT_MAX elements and returns their number. */
KT_INNER int kt_joint_elements(const kt_joint *joint, kt_element *elements);

/* Computes the coordinates of a body that moves as the joint allows, and their first and second rates. If several
 * numbers describe the same rotation, the coordinates nearest to `near` (nq) are returned. */
KT_INNER void kt_joint_measure(kt_joint_type type, const kt_joint_axes *axes, const kt_joint_motion *motion,
                               const double *near, double *q, double *v, double *a);

/* Returns a wrench on the body (about its origin), and opposite on its parent, in the axes of the joint frame. The
 * power of the wrench is tau . v in every motion that the joint allows. */
KT_INNER kt_wrench kt_joint_wrench(kt_joint_type type, const kt_joint_axes *axes, const kt_pose *pose,
                                   const double *tau);

/* The axes of a joint; without meaning for a type that has none. */
KT_INNER kt_joint_axes kt_joint_axes_of(const kt_joint *joint);

#define KT_JOINT_AT(member) offsetof(kt_joint, member)

/* Keys that every joint has: where the joint frame is on the parent. */
#define KT_JOINT_FRAME_KEYS                                                                                            \
    {"joint.at",     KT_KEY_VECTOR, KT_JOINT_AT(at), "m", "origin of the joint frame, in the parent's body frame",     \
     .needed = false},                                                                                                 \
    {                                                                                                                  \
        "joint.rotation", KT_KEY_ROTATION, KT_JOINT_AT(rotation), "", "of the joint frame, likewise", .needed = false  \
    }

/* The key of the rotor inertias of a joint; the unit is that of each degree of freedom. */
#define KT_JOINT_ARMATURE_KEY(unit)                                                                                    \
    {                                                                                                                  \
        "joint.armature", KT_KEY_ARMATURE, KT_JOINT_AT(armature), unit,                                                \
            "a, rotor inertia reflected to each degree of freedom", .range = KT_RANGE_NOT_NEGATIVE, .needed = false    \
    }

/* The keys that end the list of a joint with coordinates. The texts describe positions and velocities. */
#define KT_JOINT_COORDINATE_KEYS(position_words, velocity_words, armature_unit)                                        \
    KT_JOINT_FRAME_KEYS,                                                                                               \
        {"joint.position", KT_KEY_POSITION, KT_JOINT_AT(position), "", position_words, .needed = false},               \
        {"joint.velocity", KT_KEY_VELOCITY, KT_JOINT_AT(velocity), "", velocity_words, .needed = false},               \
        KT_JOINT_ARMATURE_KEY(armature_unit)

/* The example of a joint for the pages: a box that the joint moves. */
#define KT_EXAMPLE_JOINT(joint)                                                                                        \
    "bodies:\n"                                                                                                        \
    "  - name: box\n"                                                                                                  \
    "    joint: " joint "\n"                                                                                           \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: box, size: [0.2, 0.3, 0.4]}\n"

/* The index of the quaternion among the positions of a joint; -1 if the joint has none. */
static inline int kt_joint_quaternion(kt_joint_type type) {
    const kt_joint_size *size = &kt_joint_sizes[type];
    return size->nq > size->nv ? size->nq - 4 : -1;
}

/* Checks the members of a joint that its type reads. The type exists. */
void kt_joint_check(kt_checker *checker, const kt_joint *joint);

#define KT_JOINT_EXTERN(id, name, nq, nv) extern const kt_joint_kind kt_joint_##name;
KT_JOINT_LIST(KT_JOINT_EXTERN)
#undef KT_JOINT_EXTERN

/* Returns the unit vector along `axis`; exact along coordinate axes, for any length. */
kt_vec3 kt_joint_unit(kt_vec3 axis);

/* Returns a one-axis motion about or along `axis`. The link's frame is turned so that the motion is about or along one
 * of its coordinate axes. If `axis` is x, y or z already, the frame is not turned at all. */
kt_element kt_element_about(kt_motion motion, kt_vec3 axis);

/* The second axis of a universal joint, given or not. */
kt_vec3 kt_joint_second_axis(const kt_joint *joint);

/* The angle of a rotation about z of the triad. Among angles that differ by whole turns, the angle nearest to `near`.
 * If the rotation also tilts z, the least rotation first brings z back, and the angle of the remaining rotation is
 * returned. */
double kt_measured_angle(const kt_mat3 *triad, const kt_mat3 *rotation, double near);

/* Writes the quaternion of a rotation to q (4). Of the two quaternions +p and -p, writes the nearer to `near` (4). */
void kt_measured_quaternion(const kt_mat3 *rotation, const double *near, double *q);

/* The three numbers of a vector. */
static inline void kt_joint_store(double *x, kt_vec3 u) {
    x[0] = u.x;
    x[1] = u.y;
    x[2] = u.z;
}

static inline kt_vec3 kt_joint_load(const double *x) { return kt_vec3_make(x[0], x[1], x[2]); }
static inline kt_quat kt_joint_load_quaternion(const double *p) { return kt_quat_make(p[0], p[1], p[2], p[3]); }

/* As a simulation does after a step: if a quaternion in q is no unit to four roundings, all are made so. Returns false,
 * with q unchanged, if one is zero or not finite. */
bool kt_position_make_units(const kt_model *model, double *q);

/* Computes out = q (+) dv. A link that does not move, or a part that is held (NULL: none), keeps its bits; the
 * exponential map would round its quaternion. out may be q. */
void kt_position_move(const kt_model *model, const bool *held, const double *q, const double *dv, double *out);

#endif
