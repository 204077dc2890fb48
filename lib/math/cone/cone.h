/* Complementarity with Coulomb's cone, for any number of contacts. Contact i has rows 3i (normal), 3i + 1 and 3i + 2
 * (tangential):
 *
 *     u = W p + b,    0 <= p_n - l  complementary to  u_n >= 0,    |p_t| <= mu p_n,    |u_t| p_t = -mu p_n u_t
 *
 * of impulses and rates, or of forces and accelerations; l >= 0 is a least normal impulse. An item with a limit S >= 0
 * is dry friction of a joint instead of a contact. Such an item has only its first row: |p| <= S, and |u| p = -S u
 * unless u is zero.
 *
 * The problem is solved when Alart and Curnier's function vanishes:
 *
 *     f_n = p_n - l - max(0, p_n - l - u_n)
 *     f_t = p_t - P(p_t - u_t),    P the projection to the disc of radius mu max(l, p_n - u_n)
 *
 * Solvers are tried in order until a solver succeeds. The order begins with two sweeps of block Gauss-Seidel, in which
 * each contact takes some steps of projection to its own solution, and semismooth Newton on f. Then come 100 sweeps and
 * Newton. Proximal points come last, from the best solution so far, and from zero. Newton's method polishes each
 * returned solution. Sums skip blocks of W that are zero.
 *
 * Matrices have room for `most` contacts. A problem with more contacts than the matrices hold gives W by blocks, and is
 * solved on a working set of contacts (cone_members.c).
 *
 * A problem with friction may have several solutions, or none (Painleve 1895). The solution depends on the start p: a
 * warm start stays near the previous solution.
 *
 * P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like solution methods,
 * 1991; V. Acary, M. Bremond, O. Huber, On solving contact problems with Coulomb friction, 2018.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LINEAR_CONE_H
#define KT_LINEAR_CONE_H

#include <stdbool.h>
#include <stddef.h>

/* W of a problem whose matrix is not stored. */
typedef struct kt_cone_blocks {
    void (*block)(const void *user, int i, int j, double *w);       /* 3 x 3, by rows: rows of i, columns of j */
    void (*rates)(const void *user, const double *p, double *rate); /* W p, of all rows */
    const void *user;
} kt_cone_blocks;

typedef struct kt_cone_problem {
    int n;                        /* items */
    const double *W, *b;          /* 3n x 3n, by rows; 3n */
    const kt_cone_blocks *blocks; /* in place of W; NULL: W is given */
    const double *mu;             /* n */
    const double *least;          /* n: l; NULL: zeros */
    const double *limit;          /* n: S of dry friction; negative: a contact; NULL: all are contacts */
    double enough;                /* the residual at which the cascade ends; 0: rounding */
} kt_cone_problem;

/* The part of the cascade that has succeeded. */
typedef enum kt_cone_round {
    KT_CONE_NEWTON,
    KT_CONE_SWEEPS,
    KT_CONE_PROXIMAL,
    KT_CONE_ROUNDS /* how many */
} kt_cone_round;

typedef struct kt_cone_result {
    bool converged;  /* residual <= 1e-9 */
    double residual; /* the largest |f|, relative to |b|, |p| up to 100 |b|, and the rounding of its row */
    kt_cone_round round;
    int newton; /* steps of Newton's method */
} kt_cone_result;

typedef struct kt_cone kt_cone;

/* Bytes of the memory for problems of up to n contacts, whose matrices have room for `most`, and bytes of these
 * matrices; both are aligned to KT_ARENA_ALIGNMENT. Then the solver in this memory. Matrices are scratch: between
 * solutions, their memory may serve others. */
size_t kt_cone_size(int n, int most);
size_t kt_cone_matrices_size(int most);
kt_cone *kt_cone_init(int n, int most, void *memory, void *matrices);

/* How many contacts have room in matrices. */
int kt_cone_room(const kt_cone *cone);

/* Memory for W of a problem, one of the matrices, where a caller may build W. The solver then scales W in place. */
double *kt_cone_matrix(kt_cone *cone);

/* Solves the problem from the start p, which becomes the best p that was found. */
kt_cone_result kt_cone_solve(kt_cone *cone, const kt_cone_problem *problem, double *p);

#endif
