/* The axes of inertias in MJCF. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ROBOT_MJCF_AXES_H
#define KT_ROBOT_MJCF_AXES_H

#include "robot/mjcf.h"

/* The axes of an inertia, the one of the largest moment first, with the signs that MuJoCo gives them. */
kt_mat3 kt_mjcf_axes(kt_sym3 inertia);

/* The axes of a body's inertia: those of its <inertial> or only geom, else those computed from the inertia. */
kt_mat3 kt_mjcf_axes_of_body(const kt_mjcf_body *b);

/* Whether MuJoCo's axes may be others: the inertia is that of a mesh, whose rounding there decides between equal
 * moments. */
bool kt_mjcf_has_doubtful_axes(const kt_mjcf_body *b);

#endif
