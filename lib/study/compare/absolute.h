/* The absolute formulation of a model: the same mechanism with every body free and every joint a loop [MSD 7.1].
 *
 * The result is a model like any other, compiled from a transformed description. Bodies and loops keep their order in
 * the description. The loops that were joints follow, and two kinds of massless bodies: counters and crosses.
 *
 * Counters. A relation, an effect or a function may refer to the position of a joint, which is no longer a coordinate.
 * For such a position, a massless counter on the parent has this one coordinate. An equation ties the counter to the
 * body, so that full revolutions are counted.
 *
 * Crosses. A universal joint whose axes are not normal to each other becomes two revolute loops with a cross between.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STUDY_ABSOLUTE_H
#define KT_STUDY_ABSOLUTE_H

#include "kinetree/study.h"
#include "model/model.h"

/* A body of the tree and its joint in the absolute model; all indices are those of the absolute model. */
typedef struct kt_absolute_joint {
    int32_t type;         /* kt_joint_type */
    int32_t body, parent; /* the body, and its parent in the tree */
    int32_t loop;         /* the loop that replaces the joint; -1: the joint was free */
    int32_t counter, tie; /* the body that counts its position, the loop that ties it; 0 and -1: none */
    int32_t cross;        /* the body between the axes of a universal joint; 0: none */
    kt_pose frame;        /* the joint frame in the parent's body frame */
    kt_joint_axes axes;
} kt_absolute_joint;

struct kt_absolute {
    const kt_model *tree;
    kt_model *model;
    kt_absolute_joint joint[]; /* one for each body of the tree; that of the world is not used */
};

/* Computes the coordinates of a free body on the world from its pose and twist (world axes, of its origin). The vector
 * q (7) holds position and quaternion; v (6) holds linear velocity (world axes) and angular velocity (body axes). */
void kt_free_coordinates(kt_pose pose, kt_twist twist, double *q, double *v);

/* Computes the pose and the twist of a universal joint's cross. Inputs are the position q[0] and the rate v[0] of the
 * first axis, and the parent's pose and twist in the world. Frame of twists: world axes, of the frame's origin. */
void kt_cross_motion(const kt_absolute_joint *joint, kt_pose parent, kt_twist parent_twist, const double *q,
                     const double *v, kt_pose *pose, kt_twist *twist);

#endif
