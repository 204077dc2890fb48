/* Points of bodies, from the motion of their links, of one state (body_frames.c) and in lanes (batch/lane_frames.c). A
 * body is fixed in its link:
 *   p = p_l + R_l d
 *   v = v_l + w x R_l d
 *   a = a_l + alpha x R_l d + w x (w x R_l d)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_POINT_H
#define KT_DYNAMICS_POINT_H

#include "dynamics/joint_motion.h"

/* R_l d, world axes: from the link's origin to a point given in the body frame; axes: the axes of the link. */
KT_INLINE kt_real3 kt_point_arm(const kt_body_record *b, const kt_real3 axes[3], kt_real3 at) {
    const kt_const_mat3 *r = &b->in_link.rotation;
    const kt_real3 body[3] = {kt_const_from3(r->x), kt_const_from3(r->y), kt_const_from3(r->z)};
    return kt_apply3(axes, kt_add3(kt_const_from3(b->in_link.position), kt_apply3(body, at)));
}

/* v */
KT_INLINE kt_real3 kt_point_transport(kt_real3 velocity, kt_real3 w, kt_real3 arm) {
    return kt_add3(velocity, kt_cross3(w, arm));
}

/* a */
KT_INLINE kt_real3 kt_point_accelerate(kt_real3 linear, kt_real3 alpha, kt_real3 w, kt_real3 arm) {
    return kt_add3(kt_add3(linear, kt_cross3(alpha, arm)), kt_cross3(w, kt_cross3(w, arm)));
}

/* The begin of the columns of a link in a Jacobian, and the arm from its origin to the point. */
typedef struct kt_point_columns {
    kt_real1 *first;
    kt_real3 arm;
} kt_point_columns;

/* (w, u + w x arm) for the degree of freedom (w, u). */
KT_INLINE void kt_point_column(const kt_dof *dof, void *context) {
    const kt_point_columns *c = context;
    const kt_real3 w = kt_dof_angular(dof), linear = kt_point_transport(kt_dof_linear(dof), w, c->arm);
    kt_real1 *column = c->first + 6 * dof->index;
    for (int k = 0; k < 3; k++) {
        column[k] = KT_PART3(w, k);
        column[3 + k] = KT_PART3(linear, k);
    }
}

#endif
