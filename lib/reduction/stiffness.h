/* The linearised equations of motion of a whole mechanism, before anything is solved (stiffness.c): what
 * kt_stiffness_evaluate reduces, and what kt_acceleration_derivatives solves. */
#ifndef KT_REDUCTION_STIFFNESS_H
#define KT_REDUCTION_STIFFNESS_H

#include "base/arena.h"
#include "dynamics/derivative.h"
#include "kinetree/dynamics.h"
#include "reduction/dual.h"
#include "reduction/effect_slopes.h"
#include "reduction/evaluate.h"

/* Every array: type, name, count, meaning; p equations in the order of the loops, of n coordinates. Of a tree m is 0,
 * otherwise n. */
#define KT_STIFFNESS_FIELDS(X)                                                                                         \
    X(double, tree, kt_derivative_work_size(model) / sizeof(double), "of the derivatives of the tree")                 \
    X(double, q, model->n.q, "positions")                                                                              \
    X(double, v, n, "velocities")                                                                                      \
    X(double, a, n, "accelerations")                                                                                   \
    X(double, lambda, p, "multipliers")                                                                                \
    X(double, force, n, "joint forces of the effects")                                                                 \
    X(double, weight, n, "joint forces of external wrenches")                                                          \
    X(double, change, n, "differences, and a right-hand side")                                                         \
    X(double, jacobian, n *p, "A, p x n")                                                                              \
    X(double, factor, n *p, "A' factored")                                                                             \
    X(double, reflector, n + p, "scales of the reflectors")                                                            \
    X(double, norm, p, "squared lengths of the equations")                                                             \
    X(double, choice, p, "by which equations are chosen")                                                              \
    X(int32_t, pivot, p, "order of the equations")                                                                     \
    X(double, basis, m *m, "orthogonal factor Q")                                                                      \
    X(double, product, m, "a column of M Z")                                                                           \
    X(double, half, m *m, "Q' M Z, n x f")                                                                             \
    X(kt_effect_dof, path, n, "of an effect")                                                                          \
    X(kt_support_dof, dof, m, "of a loop")                                                                             \
    X(int32_t, chain, m ? model->n.link : 0, "of a loop")                                                              \
    X(double, e_q, n *p, "E by positions, p x n")                                                                      \
    X(double, e_v, n *p, "E by velocities")

typedef struct kt_linearized {
    const kt_model *model;
    kt_data *data;
    double t;
    size_t n, p;
    int rank;                 /* of A */
    kt_derivative_work terms; /* of the tree, in `tree` */
    double *mass, *d_q, *d_v; /* M, D by positions and by velocities: n x n, where `terms` has them */
    KT_ARENA_DECLARE(KT_STIFFNESS_FIELDS)
} kt_linearized;

/* Returns the bytes of the arrays, and unless memory is NULL initialises w in it. */
size_t kt_linearized_init(kt_linearized *w, void *memory, const kt_model *model, kt_data *data, double t);

/* Fills M, D and with loops E, Q, R and Q' M Z, at the accelerations a; NULL: those of the motion are evaluated. */
KT_CHECKED kt_status kt_linearized_fill(kt_linearized *w, const double *q, const double *v, const double *tau,
                                        const kt_wrench *external, const double *a, kt_error *error);

/* y = R1^-T E for one column e of E, the entries of the independent equations in the order of the pivots. */
void kt_linearized_across(const kt_linearized *w, const double *e, double *y);

/* The error that derivatives overflow. */
kt_status kt_linearized_overflow(kt_error *error);

#endif
