/* Forward pass from the ground to the tips: how a link's motion follows from its parent's.
 *
 * Vectors are in world axes, each link about its own origin; r = origin minus the parent's origin. Accelerations are
 * classical (not spatial) ones of the origins, so that the shift from parent to child is
 *   alpha = alpha_p + c_n + [alpha of the joint]
 *   a     = a_p + alpha_p x r + c_f + [a of the joint]
 *   c_n   = w_p x (joint's angular velocity)
 *   c_f   = w_p x (w_p x r) + 2 w_p x (joint's linear velocity)
 */
#ifndef KT_DYNAMICS_SWEEP_H
#define KT_DYNAMICS_SWEEP_H

#include "algebra/sincos.h"
#include "model/model.h"

/* Rotates two columns of `base` in their plane and leaves the third: base times R1, R2 or R3 of the angle. */
KT_INLINE void kt_rotate_axes(int axis, const kt_v4 base[3], double c, double s, kt_v4 out[3]) {
    const kt_v4 cc = kt_v4_splat(c), ss = kt_v4_splat(s);
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    out[axis] = base[axis];
    out[j] = cc * base[j] + ss * base[k];
    out[k] = cc * base[k] - ss * base[j];
}

/* The link's axes at joint position zero, in the world. */
KT_INLINE void kt_rest_axes(const kt_link *link, const kt_v4 parent[3], kt_v4 out[3]) {
    if (link->turned) {
        kt_v4_multiply(parent, link->turn, out);
    } else {
        out[0] = parent[0];
        out[1] = parent[1];
        out[2] = parent[2];
    }
}

KT_INLINE kt_v4 kt_load3(const double *x) { return (kt_v4){x[0], x[1], x[2], 0.0}; }

/* The columns of base times R(p), for a quaternion p of any non-zero norm. */
KT_INLINE void kt_quaternion_axes(const double *p, const kt_v4 base[3], kt_v4 out[3]) {
    kt_v4 r[3];
    kt_v4_from_mat3(kt_matrix_from_quat(kt_quat_make(p[0], p[1], p[2], p[3])), r);
    kt_v4_multiply(base, r, out);
}

/* Pose of one link from its parent's: axes, axis, offset. */
KT_INLINE void kt_link_pose(const kt_link *link, const kt_link_motion *parent, const double *q, const double *cosine,
                            const double *sine, kt_link_motion *out) {
    kt_v4 base[3];
    kt_rest_axes(link, parent->axes, base);
    out->offset = kt_v4_apply(parent->axes, link->at);
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
    case KT_MOTION_SCREW: {
        const double c = cosine[link->angle], s = sine[link->angle];
        switch (link->axis) {
        case 0:
            kt_rotate_axes(0, base, c, s, out->axes), out->axis = base[0];
            break;
        case 1:
            kt_rotate_axes(1, base, c, s, out->axes), out->axis = base[1];
            break;
        default:
            kt_rotate_axes(2, base, c, s, out->axes), out->axis = base[2];
            break;
        }
        if (link->motion == KT_MOTION_SCREW)
            out->offset += kt_v4_splat(link->pitch * q[link->q]) * out->axis;
        break;
    }
    case KT_MOTION_PRISMATIC:
        for (int k = 0; k < 3; k++)
            out->axes[k] = base[k];
        out->axis = base[link->axis];
        out->offset += kt_v4_splat(q[link->q]) * out->axis;
        break;
    case KT_MOTION_SPHERICAL:
        kt_quaternion_axes(q + link->q, base, out->axes);
        break;
    case KT_MOTION_FREE:
        kt_quaternion_axes(q + link->q + 3, base, out->axes);
        out->offset += kt_v4_apply(base, kt_load3(q + link->q));
        break;
    case KT_MOTION_NONE:
        break;
    }
}

/* The joint's relative velocity for the rates v: its angular and linear parts. */
KT_INLINE void kt_joint_twist(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *self,
                              const double *v, kt_v4 *angular, kt_v4 *linear) {
    const kt_v4 none = kt_v4_splat(0.0);
    *angular = none;
    *linear = none;
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        *angular = kt_v4_splat(v[link->v]) * self->axis;
        break;
    case KT_MOTION_PRISMATIC:
        *linear = kt_v4_splat(v[link->v]) * self->axis;
        break;
    case KT_MOTION_SCREW:
        *angular = kt_v4_splat(v[link->v]) * self->axis;
        *linear = kt_v4_splat(link->pitch * v[link->v]) * self->axis;
        break;
    case KT_MOTION_SPHERICAL:
        *angular = kt_v4_apply(self->axes, kt_load3(v + link->v));
        break;
    case KT_MOTION_FREE: {
        kt_v4 base[3];
        kt_rest_axes(link, parent->axes, base);
        *angular = kt_v4_apply(self->axes, kt_load3(v + link->v + 3));
        *linear = kt_v4_apply(base, kt_load3(v + link->v));
        break;
    }
    case KT_MOTION_NONE:
        break;
    }
}

/* Velocity of one link and its velocity-product accelerations c_n (in alpha) and c_f (in linear). */
KT_INLINE void kt_link_velocity(const kt_link *link, const kt_link_motion *parent, const double *v,
                                kt_link_motion *out) {
    const kt_v4 w = parent->omega, around = kt_v4_cross(w, kt_v4_cross(w, out->offset));
    if (link->motion == KT_MOTION_REVOLUTE) { /* the most frequent motion, without terms that it does not need */
        const kt_v4 rate = kt_v4_splat(v[link->v]) * out->axis;
        out->omega = w + rate;
        out->alpha = kt_v4_cross(w, rate);
        out->linear = around;
        return;
    }
    kt_v4 angular, linear;
    kt_joint_twist(link, parent, out, v, &angular, &linear);
    out->omega = w + angular;
    out->alpha = kt_v4_cross(w, angular);
    out->linear = around + kt_v4_splat(2.0) * kt_v4_cross(w, linear);
}

/* From c_n, c_f to the full accelerations, for joint accelerations a. */
KT_INLINE void kt_link_acceleration(const kt_link *link, const kt_link_motion *parent, const double *a,
                                    kt_link_motion *out) {
    kt_v4 angular, linear;
    kt_joint_twist(link, parent, out, a, &angular, &linear);
    out->alpha += parent->alpha + angular;
    out->linear += parent->linear + kt_v4_cross(parent->alpha, out->offset) + linear;
}

/* The ground: world axes, at rest, with the acceleration -gravity. */
KT_INLINE void kt_ground_set(kt_v4 gravity, kt_link_motion *ground) {
    const kt_v4 none = kt_v4_splat(0.0);
    *ground = (kt_link_motion){.axes = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}},
                               .axis = none,
                               .offset = none,
                               .omega = none,
                               .alpha = none,
                               .linear = -gravity,
                               .moment = none,
                               .force = none};
}

/* Subtracts wrenches on bodies (world axes, about the body frames' origins) from the wrenches of their links. */
KT_INLINE void kt_external_subtract(const kt_model *model, kt_link_motion *motion, const kt_wrench *external) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        kt_link_motion *m = &motion[body->link];
        const kt_v4 arm = kt_v4_apply(m->axes, kt_v4_from(body->in_link.position));
        const kt_v4 force = kt_v4_from(external[b].force);
        m->moment -= kt_v4_from(external[b].moment) + kt_v4_cross(arm, force);
        m->force -= force;
    }
}

#endif
