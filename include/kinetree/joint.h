/* Positions of joints: rates, steps along the exponential map, differences, norms.
 *
 * q has kt_model_nq numbers, v and dv have kt_model_nv. O(nq). No call allocates, and only kt_position_normalize can
 * fail. An output may be any of the inputs, if the array has room for the output: kt_model_nq numbers for positions.
 * Other overlaps are not allowed.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_JOINT_H
#define KINETREE_JOINT_H

#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* qdot = dq/dt for velocities v: equal to v except for quaternions [MSD A.36]. */
KT_API void kt_position_rate(const kt_model *model, const double *q, const double *v, double *qdot);

/* out = q (+) dv: moves q by dv along the joints' exponential maps; quaternions come back with unit norm. */
KT_API void kt_position_add(const kt_model *model, const double *q, const double *dv, double *out);

/* dv with q (+) dv = end, for rotations the shorter of the two. */
KT_API void kt_position_subtract(const kt_model *model, const double *end, const double *q, double *dv);

/* Scales every quaternion in q to unit norm. Returns false, with q unchanged, if one is zero or not finite. */
KT_API bool kt_position_normalize(const kt_model *model, double *q);

#ifdef __cplusplus
}
#endif
#endif
