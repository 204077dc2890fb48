/* An oracle in quadruple precision: small mechanisms with loops, in absolute coordinates, that share nothing with the
 * library but the description that both are given.
 *
 * (alpha_i, a_i) are the accelerations of every body, about its origin and in world axes. C (alpha, a) = c are the rows
 * of all joints and loops. The motion is that of the Newton-Euler equations with multipliers:
 *     [ M  C' ] [ (alpha, a) ]   [ f ]
 *     [ C  0  ] [   mu       ] = [ c ]
 * solved by Gauss' elimination with 113 bits. A state of joint coordinates is closed by Newton's method with least
 * steps, to 1e-32.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_REFERENCE_QUADRUPLE_H
#define KT_TEST_REFERENCE_QUADRUPLE_H

#include "kinetree/description.h"

#include <stdbool.h>

typedef __float128 quad;

enum {
    QUAD_BODIES = 8,
    QUAD_LOOPS = 3,
    QUAD_NQ = 24,
    QUAD_NV = 18,
    QUAD_ROWS = 12,
    QUAD_UNKNOWNS = 6 * QUAD_BODIES + 5 * QUAD_BODIES + QUAD_ROWS
};

typedef struct quad_joint {
    kt_joint_type type; /* revolute, prismatic, cylindrical, universal or spherical */
    int parent;         /* -1: the world */
    double at[3];       /* in the parent's frame */
    int axis, axis2;    /* 0, 1, 2: x, y, z */
} quad_joint;

typedef struct quad_loop {
    kt_loop_type type;     /* spherical, revolute (about z; in the plane the two equations of the points), inline
                                (along the world's z), distance */
    int first, second;     /* bodies; -1: the world, of the first end alone */
    quad at[2][3], length; /* length: of a distance */
} quad_loop;

typedef struct quad_mechanism {
    bool planar; /* all in the xy plane, all axes z */
    int bodies, loops;
    quad_joint joint[QUAD_BODIES];
    quad_loop loop[QUAD_LOOPS];
    double mass[QUAD_BODIES], com[QUAD_BODIES][3], inertia[QUAD_BODIES][6]; /* about the com: xx yy zz xy xz yz */
    double gravity[3];
    double tau[QUAD_NV];
    int nq, nv, rows, at_q[QUAD_BODIES], at_v[QUAD_BODIES];
} quad_mechanism;

/* Coordinates and rows are counted. */
void quad_count(quad_mechanism *m);
/* q (+) step */
void quad_add(const quad_mechanism *m, const quad *q, const quad *step, quad *out);
void quad_residual(const quad_mechanism *m, const quad *q, quad *phi);
/* rows x nv, by rows; bias: phi'' without joint accelerations, at the velocities u (NULL: not wanted) */
void quad_jacobian(const quad_mechanism *m, const quad *q, quad A[QUAD_ROWS][QUAD_NV]);
void quad_bias(const quad_mechanism *m, const quad *q, const quad *u, quad *bias);
/* Onto the loops by the least steps; false if they do not close. */
bool quad_close(const quad_mechanism *m, quad *q);
bool quad_close_velocity(const quad_mechanism *m, const quad *q, quad *u);
/* Joint accelerations. False where the equations are singular. */
bool quad_accelerate(const quad_mechanism *m, const quad *q, const quad *u, quad *a);
/* The world's position of a point of a body (-1: the world). */
void quad_point(const quad_mechanism *m, const quad *q, int body, const quad at[3], quad out[3]);
/* The point of the world in a body's frame. */
void quad_in_body(const quad_mechanism *m, const quad *q, int body, const quad point[3], quad out[3]);
/* K x = x by Gauss' elimination with row pivots, in place. False at a pivot that is zero but for rounding. */
bool quad_eliminate(int n, quad *K, int stride, quad *x);
/* x of least norm with A x = b, A of full row rank; n columns, stride QUAD_NV. False if it has not. */
bool quad_least(int rows, int columns, const quad *A, int stride, const quad *b, quad *x);
/* The smallest and the largest singular value of A (A A' by Jacobi's method), and the left vector of the smallest. */
void quad_singular(int rows, int columns, const quad *A, int stride, quad *least, quad *most, quad *left);
quad quad_sqrt(quad x);
quad quad_abs(quad x);
quad quad_norm(int n, const quad *x);

#endif
