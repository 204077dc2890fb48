/* Compiles the absolute formulation (model/absolute.h) of a tree. */
#ifndef KT_COMPILE_ABSOLUTE_H
#define KT_COMPILE_ABSOLUTE_H

#include "model/absolute.h"

/* Compiles the absolute formulation of `tree`, which was compiled from this description. Errors: KT_ERROR_MEMORY, and
 * those of kt_model_compile. */
kt_status kt_absolute_compile(const kt_description *description, const kt_model_options *options, const kt_model *tree,
                              struct kt_absolute **absolute, kt_error *error);

/* Computes the coordinates of a free body on the world from its pose and twist (world axes, of its origin): q (7) are
 * position and quaternion; v (6) are linear velocity (world axes) and angular velocity (body axes). */
void kt_free_coordinates(kt_pose pose, kt_twist twist, double *q, double *v);

/* Computes the pose and the twist of a universal joint's cross, from position q[0] and rate v[0] of the first axis and
 * the parent's pose and twist in the world (twists: world axes, of the frame's origin). */
void kt_cross_motion(const kt_absolute_joint *joint, kt_pose parent, kt_twist parent_twist, const double *q,
                     const double *v, kt_pose *pose, kt_twist *twist);

#endif
