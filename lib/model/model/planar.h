/* Trees that move in a plane, and the data of the planar kernels.
 *
 * A tree is a joint on the ground with all links that it carries. A tree is planar if all its joints are revolute about
 * one direction n, or prismatic along a normal to n. Masses and forces may have any direction and position: their
 * components out of the plane appear in reactions only. Trees with the same n share a *plane*: a right-handed basis
 * (e1, e2, n) in the world. Planar links come last, plane by plane: the links [n.spatial, n.link). Link i has the
 * *planar index* i - n.spatial + 1, which is i + to_planar. Planar index 0 is the ground, with the gravity of the plane
 * that is being swept.
 *
 * The angle phi of a planar link is relative to q = 0, so that no rotation at rest has to be stored. A link's offset,
 * prismatic direction and first moment at q = 0 are constant two-vectors in (e1, e2), which phi rotates. The angle is
 * stored as its cosine c and its sine s. Heights along n are constant.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_PLANAR_H
#define KT_MODEL_PLANAR_H

#include "algebra/real3.h"
#include "kinetree/model.h"
#include "model/planar_loop.h"

#include <stdbool.h>
#include <stdint.h>

/* The kinds of links that a model has. */
typedef enum kt_sweep { KT_SWEEP_SPATIAL = 0, KT_SWEEP_PLANAR, KT_SWEEP_MIXED, KT_SWEEP_COUNT } kt_sweep;

typedef struct kt_plane {
    kt_const_mat3 basis;  /* e1, e2, n, world */
    kt_const1 gravity[2]; /* along e1, e2 */
    int32_t first, last;  /* planar indices of its links: [first, last) */
} kt_plane;

/* A link as planar kernels read it. */
typedef struct kt_planar_link {
    kt_const1 at[2];     /* origin of the joint frame relative to the parent's origin, at q = 0 */
    kt_const1 along[2];  /* prismatic: direction, at q = 0 */
    kt_const1 moment[2]; /* first moment m c, at q = 0 */
    kt_const1 inertia;   /* inertia of all bodies on the link, about n through its origin */
    kt_const1 mass;
    kt_const1 size; /* as in kt_link */
    kt_const1 sign; /* revolute: 1 about n, -1 about -n */
    kt_const1 armature;
    int32_t parent; /* planar index */
    int32_t group;  /* the constraint group that it is part of, or -1 */
    int32_t local;  /* the link's coordinate among the group's */
    int32_t q, v;
    int32_t angle;                 /* among the sines and cosines of the planar links */
    int32_t end;                   /* the last planar index among the links that this link carries */
    bool revolute;                 /* about n; otherwise prismatic */
    bool follows, branches, leads; /* as in kt_link */
    bool first_of_group;           /* the link is the first of its group */
    bool carries_others;           /* the link carries links that are not of its group */
} kt_planar_link;

/* For transforming a planar link to the world. */
typedef struct kt_planar_rest {
    kt_v4 axes[3]; /* the link's axes at q = 0 in the plane's basis, columns */
    int32_t plane;
} kt_planar_rest;

/* The motion of a planar link, expressed along (e1, e2) about its own origin. */
typedef struct kt_planar_motion {
    union {
        struct {
            kt_real1 c, s; /* cosine, sine of the angle relative to q = 0 */
        };
        kt_real1 rotation[2];
    };
    kt_real1 offset[2];        /* r: own origin minus the parent's */
    kt_real1 omega;            /* angular velocity about n */
    kt_real1 alpha;            /* angular acceleration */
    kt_real1 linear[2];        /* acceleration of the origin (in dynamics: minus gravity); until it is computed, c_f */
    kt_real1 moment, force[2]; /* wrench */
    kt_real1 first[2];         /* m c, rotated; by forward dynamics only */
} kt_planar_motion;

/* An articulated inertia and bias wrench: n = J alpha + h . a + n_b, f = h alpha + M a + f_b. For a rigid link h is its
 * first moment rotated by a right angle, (-m c_y, m c_x), and M = m I. */
typedef struct kt_planar_inertia {
    kt_real1 j, h[2];
    kt_real1 xx, xy, yy; /* M */
    kt_real1 moment, force[2];
} kt_planar_inertia;

/* The acceleration of a joint is y - K (alpha, a) of its parent: y is the free acceleration, K the parent gain. The
 * member `free` is a product minus a number, and `gain_angular` a product plus a number. The two members must not be
 * neighbours, because gcc 12 would combine both operations in one fused instruction, even without contraction. */
typedef struct kt_planar_response {
    kt_real1 free;
    union {
        kt_real1 gain_linear[2];
        kt_real1 bias_linear[2]; /* in a constraint group: the acceleration that the velocities alone give */
    };
    kt_real1 gain_angular;
} kt_planar_response;

#endif
