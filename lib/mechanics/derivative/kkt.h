/* The equations of motion with multipliers, for many right-hand sides at one position,
 *
 *     M x - A' lambda = f
 *     A x = b
 *
 * a saddle-point system. The factors serve derivatives of accelerations (acceleration.c) and their response to joint
 * forces.
 *
 * The equations are those of forward dynamics at rest and without gravity, with f for the joint forces and b for b''.
 * Therefore the recursion is that of spatial_links.c, and the parts that depend on the position alone are stored. From
 * the tips to the ground each link has an articulated inertia I and a wrench P.
 *
 * Outside groups, for each degree of freedom S, the last first,
 *
 *     U = I S,   d = 1 / (S.U + armature),   y = d (f - S.P)
 *     P += U y,   I -= d U U',   then the shift to the parent
 *
 * For a group by dense matrices (spatial_group.h), x0 = W b is a solution of its equations, and N their null space.
 * With N' M N = L L',
 *
 *     h = f - F P - M W b,   y = W b + N L^-T (N L^-T)' h,   I = Ic - F K,   P += F y
 *
 * For a group by fronts (front.h), a step with parameters p, of which p_t are kept, is one affine map. H is the energy
 * of A and p, and g its linear part. The joint force and the wrench I t + P on the link are added. The letter t is the
 * known part of the link's acceleration, and e are the right-hand sides of the step's equations. As for accelerations
 *
 *     p = Q (y, p2),   R1' y = e,   p2 = Qs (p_t, p_u),   p_u = H_uu^-1 (g_u - H_ut p_t - H_uA A)
 *
 * so that with W = Q1 R1^-T, C = Q2 Qs, N = C_u L^-T where H_uu = L L', and G = C_t - C_u H_uu^-1 H_ut
 *
 *     h = g - H W e,   p0 = W e + N N' h,   t += T W e           of the links in slots
 *     p = p0 + G p_t - G_A A                                    G_A = C_u H_uu^-1 H_uA
 *     g = G' h, and of A  h_A - G_A' h                          for the next step
 *
 * Back to the tips, x = y - d U.A or y - K A, A being the acceleration of the parent.
 *
 * With the metric of the coordinates M is the matrix 1 (projections onto the loops). Then groups do not interact. Only
 * the maps W, C_t and C_u remain, because all changes of parameters are orthogonal.
 *
 * A right-hand side takes time in proportion to the number of links, for any loops. Several are treated at a time, one
 * a lane.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_KKT_H
#define KT_DERIVATIVE_KKT_H

#include "base/arena.h"
#include "constraint/group.h"

/* Right-hand sides that the memory has room for. */
enum { KT_KKT_LANES = 8 };

typedef struct kt_kkt_sizes {
    size_t links, v, rows, groups;
    size_t steps, width;    /* number of steps of all fronts; the largest number of parameters */
    size_t vectors, stride; /* the most of a front */
    size_t maps, kept;      /* numbers of the maps of all groups; the most kept of a front's energies */
} kt_kkt_sizes;

/* Every array: type, name, count, meaning. Arrays with a lane for each right-hand side hold KT_KKT_LANES times as many
 * numbers. */
#define KT_KKT_FIELDS(X)                                                                                               \
    X(double, inertia, KT_FRONT_SPACE *KT_FRONT_SPACE * s->links, "I by columns, symmetric")                           \
    X(double, axis, KT_FRONT_SPACE * s->v, "S of each degree of freedom")                                              \
    X(double, gain, KT_FRONT_SPACE * s->v, "d U of those outside groups")                                              \
    X(double, inverse, s->v, "d of these")                                                                             \
    X(size_t, at, s->steps, "where the map of a front's step begins")                                                  \
    X(size_t, begin, s->groups, "where that of a group by dense matrices does")                                        \
    X(double, map, s->maps, "of a step, by columns: -G_A, G; N; W; H W; T W by rows. Of a group: N L^-T; W; M W")      \
    X(double, kept, s->kept, "of each step of one front: Q' H Q1, and L")                                              \
    X(double, motion, KT_KKT_LANES *KT_FRONT_SPACE * s->links, "P, then A")                                            \
    X(double, x, KT_KKT_LANES * s->v, "f, then y, then x")                                                             \
    X(double, b, KT_KKT_LANES * s->rows, "b by groups and slots")                                                      \
    X(double, constant, KT_KKT_LANES * s->vectors, "the known parts of the accelerations in slots")                    \
    X(double, pull, KT_KKT_LANES * s->stride, "g")                                                                     \
    X(double, z, KT_KKT_LANES * s->stride, "A and p_t, or e")                                                          \
    X(double, found, KT_KKT_LANES * s->steps * s->width, "p0 of each step, then p")                                    \
    X(double, force, KT_KKT_LANES * s->v, "h of a group by dense matrices")                                            \
    X(double, response, KT_KKT_LANES * s->v, "its y")

typedef struct kt_kkt {
    const kt_model *model;
    kt_data *data;
    kt_kkt_sizes size;
    kt_rows rows;     /* equations as last factored */
    kt_metric metric; /* M: the mass matrix or 1 */
    size_t mapped;    /* numbers of the maps so far */
    KT_ARENA_DECLARE(KT_KKT_FIELDS)
} kt_kkt;

/* Returns the bytes of the arrays and, unless memory is NULL, initialises w in this memory. */
size_t kt_kkt_init(kt_kkt *w, void *memory, const kt_model *model, kt_data *data);

/* Factors the equations at (t, q), with all rows of A or only the rows of position equations.
 *
 * Errors: KT_ERROR_NOT_FINITE; KT_ERROR_SINGULAR if there is no inertia along a degree of freedom. Cost: O(links). */
KT_CHECKED kt_status kt_kkt_factor(kt_kkt *w, kt_rows rows, kt_metric metric, double t, const double *q,
                                   kt_error *error);

/* Overwrites each of so many columns of f (nv) with x. The result is valid until data are used for something else.
 * Dependent equations have no effect.
 *
 * b: as many columns, with the equations in the order of the loops; NULL: zeros.
 *
 * Cost: O(links) a column. */
void kt_kkt_solve(const kt_kkt *w, size_t columns, double *f, const double *b);

/* Both calls follow a factorisation with the metric of the coordinates (kkt_reduced.c).
 *
 * kt_kkt_apply_mass replaces columns of x (nv) by M x, M being the mass matrix.
 *
 * kt_kkt_restrict computes z = Z' x, with kt_kkt_dofs numbers a column. The columns of Z are orthonormal and span the
 * null space of the equations. The result z may overwrite x.
 *
 * Cost: O(links) a column. */
void kt_kkt_apply_mass(const kt_kkt *w, size_t columns, double *x);
size_t kt_kkt_dofs(const kt_kkt *w);
void kt_kkt_restrict(const kt_kkt *w, size_t columns, const double *x, double *z);

/* The kernels.
 *
 * kt_kkt_reduce returns false if there is no inertia along one of the degrees of freedom.
 *
 * kt_kkt_reduce_front does this for one group, and adds the group's inertia to the inertia of the parent. */
#define KT_KKT_DECLARE(isa)                                                                                            \
    bool kt_kkt_reduce_##isa(kt_kkt *w);                                                                               \
    bool kt_kkt_reduce_front_##isa(kt_kkt *w, size_t g, double *parent);                                               \
    void kt_kkt_solve_##isa(const kt_kkt *w, size_t count, double *f, const double *b);                                \
    void kt_kkt_apply_mass_##isa(const kt_kkt *w, size_t count, double *x);                                            \
    void kt_kkt_restrict_##isa(const kt_kkt *w, size_t dofs, size_t count, const double *x, double *z);
KT_EACH_ISA(KT_KKT_DECLARE)

#endif
