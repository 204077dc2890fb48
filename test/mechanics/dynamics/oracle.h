/* The dynamics of a mechanism computed apart from the library, slowly, in long double.
 *
 * Poses are composed along each body's path from the description alone, with axes as given. Every coordinate is a
 * Taylor series in time, `q + v t + a t^2 / 2`. Rotations are `exp(w t + w' t^2 / 2)` in the body frame. Twists and
 * accelerations are therefore coefficients of the product, and no velocity recursion is needed. Then Kane: J from unit
 * velocities, M = sum J' m J, tau = sum J' (inertial wrench - gravity - external), M a = tau by Gaussian elimination.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_DYNAMICS_ORACLE_H
#define KT_TEST_DYNAMICS_ORACLE_H

#include "tree.h"

/* The body frame in the world: rotation (r[row][column]), origin, and the rates of both, world axes. */
typedef struct kt_oracle_body {
    long double r[3][3], p[3];
    long double w[3], u[3];     /* angular velocity, velocity of the origin */
    long double alpha[3], a[3]; /* angular acceleration, acceleration of the origin */
} kt_oracle_body;

typedef struct kt_oracle_wrench {
    long double moment[3], force[3];
} kt_oracle_wrench;

/* Bodies have the model's indices. v and a may be NULL. */
void kt_oracle_motion(const kt_tree *tree, const double *q, const double *v, const double *a, kt_oracle_body *bodies);

/* M, row by row: nv * nv numbers. */
void kt_oracle_mass(const kt_tree *tree, const double *q, long double *mass);

/* tau, and the magnitude of the terms in its sum. Rounding errors are proportional to this magnitude. */
void kt_oracle_inverse(const kt_tree *tree, const kt_tree_state *s, const double *a, long double *tau,
                       long double *size);

/* Accelerations, and how far each moves when every term of the equations changes by a part of one:
 *   sensitivity = |M^-1| (|M| |a| + |tau| + size of h).  False where M is singular. */
bool kt_oracle_forward(const kt_tree *tree, const kt_tree_state *s, long double *a, double *sensitivity);

/* The wrench of each joint on its body about the origin of the joint frame, in world axes, as a sum over the carried
 * bodies. */
void kt_oracle_reactions(const kt_tree *tree, const kt_tree_state *s, kt_oracle_wrench *wrenches);

/* T; V = -sum m g . c over the bodies that move; linear and angular momentum about the world's origin. */
long double kt_oracle_kinetic(const kt_tree *tree, const kt_oracle_body *bodies);
long double kt_oracle_potential(const kt_tree *tree, const kt_oracle_body *bodies);
kt_oracle_wrench kt_oracle_momentum(const kt_tree *tree, const kt_oracle_body *bodies);

/* Whether a body can move at all: some joint between it and the world is not fixed. */
bool kt_oracle_moves(const kt_tree *tree, int body);

/* x = A^-1 b, A and b overwritten (b by x), by Gaussian elimination with row pivots. False where a pivot is zero. */
bool kt_oracle_solve(int n, long double *a, int columns, long double *b);

#endif
