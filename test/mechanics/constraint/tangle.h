/* Random closed mechanisms: a random tree (dynamics/tree.h) with loops of every type, which are closed at its start
 * position. Their equations of motion are solved apart from the library. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CONSTRAINT_TANGLE_H
#define KT_TEST_CONSTRAINT_TANGLE_H

#include "check.h"
#include "mechanics/dynamics/tree.h"

#include "kinetree/mechanism.h"

enum {
    TANGLE_LOOPS = 8,
    TANGLE_ROWS = 6 * TANGLE_LOOPS,
    TANGLE_ALL_TYPES = (1 << KT_LOOP_GEAR) - 1 /* wheels need axes that keep their distance */
};
enum { TANGLE_PLANAR_TYPES = TANGLE_ALL_TYPES & ~(1 << KT_LOOP_SCREW | 1 << KT_LOOP_ROLLING | 1 << KT_LOOP_CURVE) };

typedef struct tangle_plan {
    kt_tree_plan tree;
    int loops;
    unsigned types; /* loop types: bits 1 << KT_LOOP_... */
    double nearby;  /* chance that a loop joins bodies that are few joints apart, so that groups stay small */
    bool still;     /* no loop is driven in time */
    bool linear;    /* no coupling has a formula */
    kt_model_options options;
} tangle_plan;

/* 14 bodies, 4 loops of all types. */
tangle_plan tangle_plan_default(void);

/* The same for trees in one oblique plane, with loops that can be closed there. Their axes are along its normal or in
 * it, or any if the type allows this. */
tangle_plan tangle_plan_planar(void);

/* Points into itself: not to be copied. */
typedef struct tangle {
    kt_tree tree; /* with the model and data of the closed mechanism */
    kt_loop loop[TANGLE_LOOPS];
    kt_term term[TANGLE_LOOPS][3];
    char name[TANGLE_LOOPS][16], formula[TANGLE_LOOPS][200];
    int loops, rows;
    double t;
    double q[KT_TREE_NQ], v[KT_TREE_NV], tau[KT_TREE_NV]; /* a state on the manifold at t, and the forces */
    kt_wrench external[KT_TREE_SLOTS];
} tangle;

/* Grows, compiles and assembles one, away from the initial state. Draws until one can be had that has a freedom left; a
 * failure ends the test. */
void tangle_grow(tangle *g, const tangle_plan *plan, kt_random *random);

/* Adds a body next to one on a revolute joint in a loop, and a rod between equal arms of both. No loop may drive the
 * mechanism. In its present state, the rod is `off` (radians) from its dead centre. With `braced`, a second rod is at
 * right angles. This rod is redundant everywhere, as both bodies turn as one. Compiles the mechanism again, with its
 * state as the initial one; false if it has no such body. */
bool tangle_add_dead_centre(tangle *g, double off, bool braced, const kt_model_options *options, kt_random *random);

/* The matrices of M a + h = tau + A' lambda, A a = b'' at the state: mass (nv x nv), force = tau + J' external - h
 * (nv), jacobian (rows x nv), drift = b'' (rows). */
typedef struct tangle_system {
    double mass[KT_TREE_NV * KT_TREE_NV], force[KT_TREE_NV];
    double jacobian[TANGLE_ROWS * KT_TREE_NV], drift[TANGLE_ROWS];
} tangle_system;
void tangle_system_of(const tangle *g, tangle_system *s);

/* How the accelerations are computed that are to be compared. */
typedef struct tangle_way {
    bool mixes; /* orthogonal factors mix all coordinates: of equations, |A_r| |a| is rounded, and not its terms */
    const double *by; /* other accelerations that they go by, with products as large as these make them; or NULL */
} tangle_way;

/* a by elimination in long double, and how much rounding of the matrices may move each (1 unit of eps). Returns the
 * number of independent equations. */
int tangle_solve(const tangle *g, const tangle_system *s, tangle_way way, double *a, double *moved);

/* The largest move of a coordinate that closes loops which are open by one. All moves are least in the metric W of
 * masses or of ones. This is the largest row sum of
 *     |W^-1 A' (A W^-1 A')^-1|.
 * That of ones measures how near the state is to a singular position: 1 to 100 mostly. */
double tangle_reach(const tangle *g, bool mass);

/* Moves its closed state off by up to `size` in all coordinates, and its velocities too. */
void tangle_disturb(const tangle *g, kt_random *random, double size, double *q, double *v);

/* Whether the last requested accelerations came from neighbouring states, because the state is so near to a singular
 * position. They are then accurate to h^6 and not to rounding, which another test covers. */
bool tangle_was_near_singular(const kt_model *model, const kt_data *data);

#endif
