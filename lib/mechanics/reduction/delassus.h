/* A constraint group of few equations and many links (a rope that is held at both ends). The links stay links of the
 * tree, for which the articulated-body recursion provides the inverse of M. Only the multipliers are found as a whole.
 *
 * The equations are A x = b'', k of them. With B = A' C such that B'B = 1 and the applied forces f = tau - h,
 *   x = M^-1 (f + B mu),   S mu = C' b'' - B' M^-1 f,   S = B' M^-1 B,   lambda = C mu
 * S is the Delassus matrix of the orthonormal rows B'. The condition of S is at most that of M, whereas the condition
 * of A M^-1 A' would include the square of A's condition, too (Popov & Vereshchagin 1978; Featherstone 2008, 8.5).
 *
 * The recursion over the group's links, tips first, needs no matrix of x. W holds the wrenches of unit multipliers on
 * the loops' links, as columns. The columns of B are the joint forces of the wrenches W C. The backward pass provides
 *
 *   P_i      the bias wrenches of W C
 *   K_i      the parent gain
 *   d_i      the inverse of the inertia of a joint's degree of freedom S_i
 *   y_i      its free acceleration
 *   A0_p     the parent's acceleration due to velocities and gravity alone
 *
 * Then
 *   u_i = -S_i . P_i,   P_parent += shift(P_i) + K_i u_i
 *   S = sum u_i d_i u_i',   B' M^-1 f = sum u_i (y_i - K_i . A0_p)
 * and d_i u_i' mu is added to y_i before the forward pass. A spherical joint counts as three such degrees of freedom,
 * by the factors L D L' of its inertia or, with armature, one after the other. A relation between joints, such as a
 * motion, is no wrench but a joint force: u_i has its coefficient times C as well. With K = 0 the same sweep yields
 * u_i, the rows of A'. C is the inverse of the triangular factor of A', loop by loop with pivoting.
 *
 * Rank. The fronts (front.h) treat positions next to singular ones, rows of very different size, and motions along
 * which the tree has no inertia.
 *
 * A damped step of a search minimises |B y + r|^2 + mu |y|^2, with equations and coordinates in their units. Such a
 * step needs no inertia and no rank: y = -B' (B B' + mu 1)^-1 r.
 *
 * Groups on the ground alone: wrenches that reach the ground need no further treatment.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_DELASSUS_H
#define KT_REDUCTION_DELASSUS_H

#include "algebra/real4.h"
#include "dynamics/aba.h"
#include "reduction/front.h"

/* The most equations: one a lane. */
enum { KT_DELASSUS_MAX = 4 };

/* The equations of a group, in the order of the steps of the elimination that complete their loops. */
typedef struct kt_delassus_equations {
    int32_t count;
    struct {
        int32_t loop, slot, step;
    } row[KT_DELASSUS_MAX];
} kt_delassus_equations;

/* Returns the size of the group's arrays, which replace those for the elimination by fronts. The arrays hold the rows
 * of B and 1 / D by coordinates, wrenches on links by their first coordinates, C, the equations, and flags of the parts
 * in use. */
static inline size_t kt_delassus_count(size_t m) {
    return (size_t)KT_DELASSUS_MAX * (m + KT_FRONT_SPACE * m + KT_DELASSUS_MAX) + m +
           (sizeof(kt_delassus_equations) + m + 7) / 8;
}

/* The arrays of a group (kt_delassus_count). Each vector of four has one number for each equation. */
typedef struct kt_delassus {
    kt_real4 *column;    /* m: the rows of B */
    kt_real4 *load;      /* KT_FRONT_SPACE m: wrenches on links, by the links' first coordinates */
    kt_real4 *transform; /* C, rows; from kt_delassus_measure to kt_delassus_damp: B B' */
    kt_real1 *inverse;   /* d, m */
    kt_delassus_equations *equations;
    uint8_t *present; /* m, by links' first coordinates: KT_DELASSUS_... */
} kt_delassus;

/* Whether `load` has wrenches on a link, and `column` joint forces. */
enum { KT_DELASSUS_WRENCH = 1, KT_DELASSUS_FORCE = 2 };

/* Finds the arrays of group g, in the order of kt_delassus_count, where other groups have those of fronts. */
KT_INLINE void kt_delassus_find(const kt_model *model, const kt_data *data, size_t g, kt_delassus *d) {
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    kt_real4 *at = (kt_real4 *)(void *)w.front; /* groups' matrices begin at multiples of eight numbers */
    d->column = at, at += w.m;
    d->load = at, at += KT_FRONT_SPACE * w.m;
    d->transform = at, at += KT_DELASSUS_MAX;
    d->inverse = (kt_real1 *)at;
    d->equations = (kt_delassus_equations *)(void *)(d->inverse + w.m);
    d->present = (uint8_t *)(d->equations + 1);
}

/* kt_delassus_prepare lists the equations of a group whose equations have been filled, and finds C. Returns false if
 * the group is left to the fronts. Sets the data that kt_front_factor sets.
 *
 * kt_delassus_least finds the least step A' (A A')^-1 right in the group's coordinates, of step (nv), after `prepare`.
 *
 * kt_delassus_measure computes B B' of a damped step, and its trace in *size. Returns false if there are more than four
 * equations.
 *
 * kt_delassus_damp finds the damped step for violations `gap` (k) in the group's coordinates, of step (nv), after
 * `measure`. Returns false if the matrix is not positive definite.
 *
 * kt_delassus_solve adds the multipliers' accelerations to the joint accelerations without multipliers, between
 * backward and forward pass. Stores lambda in `multiplier`. Returns false if S is not positive definite. gravity: of a
 * planar group's plane.
 *
 * In lanes (algebra/real3.h), without damped steps, `prepare` returns the states that are not left to the fronts.
 * `solve` returns the states with a positive definite S. Each state has its own order of the equations. */
#define KT_DELASSUS_DECLARE(isa)                                                                                       \
    kt_condition kt_delassus_prepare_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows);              \
    void kt_delassus_least_##isa(const kt_model *model, kt_data *data, size_t g, kt_real1 *step);                      \
    kt_condition kt_delassus_solve_##isa(const kt_model *model, kt_data *data, size_t g, const kt_const1 *gravity);
#define KT_DELASSUS_DAMP_DECLARE(isa)                                                                                  \
    bool kt_delassus_measure_##isa(const kt_model *model, kt_data *data, size_t g, kt_rows rows, double *size);        \
    bool kt_delassus_damp_##isa(const kt_model *model, kt_data *data, size_t g, const double *gap, double damping,     \
                                double *step);
KT_EACH_KERNEL(KT_DELASSUS_DECLARE)
KT_EACH_ISA(KT_DELASSUS_DAMP_DECLARE)

#endif
