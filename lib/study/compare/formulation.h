/* The declarations that the files of the constraint formulations share. Matrices are column-major; n = nv, k = the
 * number of equations of all loops, including vanishing equations (whose rows are zero).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STUDY_FORMULATION_H
#define KT_STUDY_FORMULATION_H

#include "base/arena.h"
#include "base/require.h"
#include "base/where.h"
#include "kinetree/study.h"

/* Every array of a formulation: type, name, count, meaning. */
#define KT_FORMULATION_FIELDS(X)                                                                                       \
    X(double, mass, n *n, "M, then its Cholesky factor")                                                               \
    X(double, force, n, "f = tau - h")                                                                                 \
    X(double, jacobian, k *n, "A, k x n")                                                                              \
    X(double, phi, k, "closure, positions")                                                                            \
    X(double, slip, k, "A v - b'; then changes of multipliers")                                                        \
    X(double, rate, k, "b'")                                                                                           \
    X(double, drift, k, "b''")                                                                                         \
    X(double, target, k, "c: the wanted A a")                                                                          \
    X(double, factor, n *(n > k ? n : k), "L^-1 A' or A' factored; M + A' s A factored")                               \
    X(double, reflector_scale, n < k ? n : k, "scales of the reflectors")                                              \
    X(int32_t, pivot, k, "order of the equations")                                                                     \
    X(double, multiplier, k, "lambda*")                                                                                \
    X(double, velocity, n, "u'")                                                                                       \
    X(double, state_q, q, "a state at placement")                                                                      \
    X(double, state_v, n, "a state at placement, and scratch of the projection")                                       \
    X(double, x, n, "the solution")                                                                                    \
    X(double, work, 34 * (n + k) + 65 * 64 + 64, "of LAPACK: dgeqp3, and dormqr on one column")

struct kt_constraint_formulation {
    void *owned; /* memory of kt_constraint_formulation_create, or NULL */
    const kt_model *model;
    kt_constraint_formulation_options options;
    int n, k, cap;  /* nv, equations, their rank at generic positions */
    double penalty; /* s */
    double largest; /* the last independent direction: the largest so far, */
    double least;   /* and the smallest so far */
    kt_constraint_formulation_statistics found;
    KT_ARENA_DECLARE(KT_FORMULATION_FIELDS)
};

/* Fills M, f, A, phi, b', b'' and A v - b' at (t, q, v); f and b'' depend on v. */
KT_CHECKED kt_status kt_formulation_fill(kt_constraint_formulation *formulation, kt_data *data, double t,
                                         const double *q, const double *v, const double *tau, const kt_wrench *external,
                                         kt_error *error);

/* target = b'' - 2 alpha (A v - b') - beta^2 phi */
void kt_formulation_baumgarte(kt_constraint_formulation *formulation, double alpha, double beta);

/* Factors the n x k matrix in `factor` and returns the rank to be used. With `watch`, the matrix is L^-1 A' (M = L L'),
 * and the statistics of its independent directions are updated. */
int kt_formulation_factor(kt_constraint_formulation *formulation, double t, bool watch);

/* Changes x (n) by the least step for which (factored matrix)' x = b (k), by its first `rank` pivots. */
void kt_formulation_constrain(kt_constraint_formulation *formulation, int rank, const double *b, double *x);

/* Computes a by Gauss' principle with A a = target; M is overwritten by its Cholesky factor. */
KT_CHECKED kt_status kt_formulation_gauss(kt_constraint_formulation *formulation, double t, double *a, kt_error *error);

/* Computes a by penalties and multipliers with A a = target. */
KT_CHECKED kt_status kt_formulation_augmented(kt_constraint_formulation *formulation, double t, double *a,
                                              kt_error *error);

/* velocity = v with the least change to A u' = b', at a state whose equations have been filled. */
void kt_formulation_project_velocity(kt_constraint_formulation *formulation, double t, const double *v);

/* Eliminates the drift of positions in a simulation; `user` is the formulation. */
int kt_formulation_project_positions(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error,
                                     void *user);

/* Reports an error with the time at which it occurred. */
KT_CHECKED static inline kt_status kt_formulation_reject(double t, kt_status status, const char *message,
                                                         kt_error *error) {
    return kt_error_set(error, status, kt_where_format("t = %.9g s", t).text, "%s", message);
}

#endif
