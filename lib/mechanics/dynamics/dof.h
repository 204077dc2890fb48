/* The motion of a link, and of all bodies that it carries, with the degrees of freedom of the link, for derivatives
 * (dynamics_derivative.h).
 *
 * Spatial vectors (w, v) are expressed about the link's own origin, or any point fixed in the world. The frame that
 * carries a degree of freedom S_k has the motion C and A_C. The node that S_k moves has the motion V. Then
 *     psi'  = C x S_k
 *     psi'' = A_C x S_k + C x psi'
 *     phi   = psi' + V x S_k
 * The translations of a free link are one node, its rotations the next. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_DOF_H
#define KT_DYNAMICS_DOF_H

#include "dynamics/sweep.h"

/* A degree of freedom, world axes: angular and linear parts. */
typedef struct kt_dof_motion {
    kt_real3 s[2];    /* S */
    kt_real3 psi[2];  /* psi' */
    kt_real3 rate[2]; /* psi'' */
    kt_real3 phi[2];
} kt_dof_motion;

/* Spatial velocity and acceleration of the carrying frame, expressed about the link's own origin. */
typedef struct kt_carried {
    kt_real3 omega, velocity, alpha, linear;
} kt_carried;

/* (w, v) x (s, u) */
KT_INLINE void kt_motion_cross(kt_real3 w, kt_real3 v, const kt_real3 s[2], kt_real3 out[2]) {
    out[0] = kt_cross3(w, s[0]);
    out[1] = kt_add3(kt_cross3(w, s[1]), kt_cross3(v, s[0]));
}

/* (omega, velocity): V. */
KT_INLINE void kt_dof_motion_set(const kt_carried *c, kt_real3 omega, kt_real3 velocity, kt_real3 angular,
                                 kt_real3 linear, kt_dof_motion *out) {
    kt_real3 twice[2], along[2];
    out->s[0] = angular;
    out->s[1] = linear;
    kt_motion_cross(c->omega, c->velocity, out->s, out->psi);
    kt_motion_cross(c->omega, c->velocity, out->psi, twice);
    kt_motion_cross(c->alpha, c->linear, out->s, along);
    kt_motion_cross(omega, velocity, out->s, out->phi);
    for (int k = 0; k < 2; k++) {
        out->rate[k] = kt_add3(along[k], twice[k]);
        out->phi[k] = kt_add3(out->phi[k], out->psi[k]);
    }
}

/* How many translations of a link are a node before its rotations. */
KT_INLINE int kt_link_first_node(const kt_link *link) {
    const kt_motion_facts motion = kt_motion_facts_of(link->motion);
    return motion.lengths < motion.velocities ? motion.lengths : 0;
}

/* A node that moves at (w, u) and accelerates by (dw, du) against the frame c that carries it. */
typedef struct kt_dof_node {
    kt_carried *c;
    kt_real3 w, u, dw, du;
    kt_real3 omega, velocity; /* V */
    kt_dof_motion *out;
} kt_dof_node;

KT_INLINE void kt_dof_node_begin(kt_dof_node *n, kt_real3 w) {
    n->omega = kt_add3(n->c->omega, w);
    n->velocity = kt_add3(n->c->velocity, n->u);
}

/* c receives the motion of the node. */
KT_INLINE void kt_dof_node_end(kt_dof_node *n, kt_real3 w, kt_real3 dw) {
    kt_carried *c = n->c;
    c->linear = kt_add3(c->linear, kt_add3(kt_add3(n->du, kt_cross3(c->omega, n->u)), kt_cross3(c->velocity, w)));
    c->alpha = kt_add3(c->alpha, kt_add3(dw, kt_cross3(c->omega, w)));
    c->omega = n->omega;
    c->velocity = n->velocity;
}

/* Sets psi', psi'' and phi of one degree of freedom. The rotations of a free link begin a node, which its translations
 * carry. */
KT_INLINE void kt_dof_motion_add(const kt_dof *dof, void *context) {
    kt_dof_node *n = context;
    const kt_real3 none = kt_zero3();
    if (dof->kind == KT_DOF_ROTATION && dof->first && dof->index > 0) { /* the translations before are a node */
        kt_dof_node_end(n, none, none);
        n->u = n->du = none;
        kt_dof_node_begin(n, n->w);
    }
    kt_dof_motion_set(n->c, n->omega, n->velocity, kt_dof_angular(dof), kt_dof_linear(dof), &n->out[dof->index]);
}

/* Sets all degrees of freedom of a link, in their order. `up` and `m` are the poses of the parent and of the link. On
 * entry c is the motion of the frame that carries the link, on return the motion of the link. */
KT_INLINE void kt_dof_motions_set(const kt_link *link, const kt_link_motion *up, const kt_link_motion *m,
                                  const kt_real1 *v, const kt_real1 *a, kt_carried *c, kt_dof_motion *out) {
    kt_dof_node n = {.c = c, .out = out};
    kt_joint_twist(link, up, m, v, &n.w, &n.u);
    kt_joint_twist(link, up, m, a, &n.dw, &n.du);
    kt_dof_node_begin(&n, kt_link_first_node(link) ? kt_zero3() : n.w);
    kt_dofs_visit(link, up->axes, m->axes, kt_dof_motion_add, &n);
    kt_dof_node_end(&n, n.w, n.dw);
}

#endif
