/* How the degrees of freedom of a link move it and all that it carries, for derivatives (derivative.h).
 *
 * Spatial vectors (w, v) are expressed about the link's own origin, or any point fixed in the world. With C and A_C the
 * motion of the frame that carries a degree of freedom S_k, and V the motion of the node that S_k moves (the
 * translations of a free link are one node, its rotations the next),
 *     psi'  = C x S_k
 *     psi'' = A_C x S_k + C x psi'
 *     phi   = psi' + V x S_k
 */
#ifndef KT_DYNAMICS_DOF_H
#define KT_DYNAMICS_DOF_H

#include "dynamics/sweep.h"

enum { KT_LINK_DOF_MAX = 6 }; /* of a link */

/* A degree of freedom, world axes: angular and linear parts. */
typedef struct kt_dof_motion {
    kt_v4 s[2];    /* S */
    kt_v4 psi[2];  /* psi' */
    kt_v4 rate[2]; /* psi'' */
    kt_v4 phi[2];
} kt_dof_motion;

/* Spatial velocity and acceleration of the carrying frame, expressed about the link's own origin. */
typedef struct kt_carried {
    kt_v4 omega, velocity, alpha, linear;
} kt_carried;

/* (w, v) x (s, u) */
KT_INLINE void kt_motion_cross(kt_v4 w, kt_v4 v, const kt_v4 s[2], kt_v4 out[2]) {
    out[0] = kt_v4_cross(w, s[0]);
    out[1] = kt_v4_cross(w, s[1]) + kt_v4_cross(v, s[0]);
}

/* (omega, velocity): V. */
KT_INLINE void kt_dof_motion_set(const kt_carried *c, kt_v4 omega, kt_v4 velocity, kt_v4 angular, kt_v4 linear,
                                 kt_dof_motion *out) {
    kt_v4 twice[2], along[2];
    out->s[0] = angular;
    out->s[1] = linear;
    kt_motion_cross(c->omega, c->velocity, out->s, out->psi);
    kt_motion_cross(c->omega, c->velocity, out->psi, twice);
    kt_motion_cross(c->alpha, c->linear, out->s, along);
    kt_motion_cross(omega, velocity, out->s, out->phi);
    for (int k = 0; k < 2; k++) {
        out->rate[k] = along[k] + twice[k];
        out->phi[k] += out->psi[k];
    }
}

/* Sets all degrees of freedom of a link, in their order; `up` and `m` are its parent's pose and its own. c is the
 * motion of the frame that carries the link; it receives the link's own. */
KT_INLINE void kt_dof_motions_set(const kt_link *link, const kt_link_motion *up, const kt_link_motion *m,
                                  const double *v, const double *a, kt_carried *c, kt_dof_motion *out) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_v4 base[3], angular, linear, turned, moved;
    kt_joint_twist(link, up, m, v, &angular, &linear);
    kt_joint_twist(link, up, m, a, &turned, &moved);
    const kt_v4 omega = c->omega + angular, velocity = c->velocity + linear;
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        kt_dof_motion_set(c, omega, velocity, m->axis, none, out);
        break;
    case KT_MOTION_PRISMATIC:
        kt_dof_motion_set(c, omega, velocity, none, m->axis, out);
        break;
    case KT_MOTION_SCREW:
        kt_dof_motion_set(c, omega, velocity, m->axis, kt_v4_splat(link->pitch) * m->axis, out);
        break;
    case KT_MOTION_FREE:
        kt_rest_axes(link, up->axes, base);
        for (int k = 0; k < 3; k++)
            kt_dof_motion_set(c, c->omega, velocity, none, base[k], out++);
        c->linear += moved + kt_v4_cross(c->omega, linear);
        c->velocity = velocity;
        linear = moved = none;
        /* and the rotations */
        __attribute__((fallthrough));
    case KT_MOTION_SPHERICAL:
        for (int k = 0; k < 3; k++)
            kt_dof_motion_set(c, omega, velocity, m->axes[k], none, out++);
        break;
    case KT_MOTION_NONE:
        break;
    }
    c->linear += moved + kt_v4_cross(c->omega, linear) + kt_v4_cross(c->velocity, angular);
    c->alpha += turned + kt_v4_cross(c->omega, angular);
    c->omega = omega;
    c->velocity = velocity;
}

#endif
