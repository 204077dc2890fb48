/* The cone solver's memory, and the declarations that its parts share (cone.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_CONE_PARTS_H
#define KT_LINEAR_CONE_PARTS_H

#include "base/arena.h"
#include "cone/cone.h"

/* m = 3n. The problem is scaled contact by contact, so that cones stay cones. */
#define KT_CONE_FIELDS(X)                                                                                              \
    X(double, b, m, "scaled")                                                                                          \
    X(double, mu, m, "of n")                                                                                           \
    X(double, least, m, "of n, scaled")                                                                                \
    X(double, limit, m, "of n, scaled")                                                                                \
    X(double, scale, m, "of n")                                                                                        \
    X(double, near_b, m, "of proximal points")                                                                         \
    X(double, diagonal, m, "of W, while that of proximal points is larger")                                            \
    X(double, u, m, "rates")                                                                                           \
    X(double, f, m, "Alart and Curnier's function")                                                                    \
    X(double, dx, m, "step of Newton's method")                                                                        \
    X(double, trial, m, "x + dx")                                                                                      \
    X(double, best, m, "of Newton's method")                                                                           \
    X(double, target, m, "of n: the value of a normal impulse that is known")                                          \
    X(double, x, m, "of the cascade")                                                                                  \
    X(double, y, m, "of a round")                                                                                      \
    X(double, z, m, "of a proximal point")                                                                             \
    X(double, found, m, "the best of all")                                                                             \
    X(int, first, m + 1, "of n + 1: the first of an item's blocks in `block`")                                         \
    X(int, later_first, m + 1, "likewise in `later`")                                                                  \
    X(int, mode, m, "of n")

/* Arrays for problems of n contacts, of which m / 3 have room in matrices. */
#define KT_CONE_MEMBER_FIELDS(X)                                                                                       \
    X(int, member, m, "the working set")                                                                               \
    X(bool, is_member, n, "whether a contact is in it")                                                                \
    X(double, unit, n, "scales of all contacts")                                                                       \
    X(double, rate, 3 * n, "rates of all contacts")

#define KT_CONE_MATRICES(X)                                                                                            \
    X(double, W, m *m, "scaled")                                                                                       \
    X(double, A, m *m, "of linear equations: blocks of 3 x 3")                                                         \
    X(int, place, m *m / 9, "of two items: the place of their block in A, or -1")                                      \
    X(int, later, m *m / 9, "of each item: later items, to which elimination couples it")                              \
    X(int, block, m *m / 9, "of each item: the items whose block of W is not zero, itself among them")

struct kt_cone {
    int most; /* contacts */
    int n;
    int newton, blocks; /* steps of Newton's method; blocks of A */
    double enough;      /* the residual at which the cascade ends */
    double rounding;    /* the part of the terms of a row that counts for the size of its residual */
    KT_ARENA_DECLARE(KT_CONE_FIELDS)
    KT_ARENA_DECLARE(KT_CONE_MATRICES)
    KT_ARENA_DECLARE(KT_CONE_MEMBER_FIELDS)
};

/* Solves a problem with a stored matrix, or with blocks for `n` of its items, in this order (NULL: all items). */
kt_cone_result kt_cone_cascade(kt_cone *cone, const kt_cone_problem *problem, const int *member, int n, double *p);

/* The residual at x, with these b: those of the scaled problem, or of a proximal point. */
double kt_cone_residual(kt_cone *cone, const double *b, const double *x);

/* Newton's method from x, at most so many steps. Returns whether the residual is cone->enough or less; x is the best.
 * Steps have Levenberg and Marquardt's damping, in proportion to the residual: redundant contacts leave W singular. */
bool kt_cone_newton(kt_cone *cone, const double *b, double *x, int most);

/* Equations A x = y in blocks of 3 x 3 (cone_equations.c). kt_cone_list_blocks finds the blocks of W and of A.
 * kt_cone_clear_equations begins with A = 0. kt_cone_eliminate solves from y to x, and overwrites A. */
void kt_cone_list_blocks(kt_cone *cone);
void kt_cone_clear_equations(kt_cone *cone);
void kt_cone_eliminate(kt_cone *cone, double *x);
/* Block (i, j) of A, by rows. */
static inline double *kt_cone_block(const kt_cone *cone, int i, int j) {
    return cone->A + 9 * cone->place[i * cone->n + j];
}

/* Solves a problem with blocks on a working set (cone_members.c). */
kt_cone_result kt_cone_solve_members(kt_cone *cone, const kt_cone_problem *problem, double *p);

#endif
