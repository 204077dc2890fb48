/* What the files of the other coordinate sets share. Matrices are column-major; n = nv, k = equations of all loops,
 * void ones (which are zero) included. */
#ifndef KT_STUDY_FORMULATION_H
#define KT_STUDY_FORMULATION_H

#include "base/arena.h"
#include "kinetree/study.h"

/* Every array of a set: type, name, count, meaning. */
#define KT_FORMULATION_FIELDS(X)                                                                                       \
    X(double, mass, n *n, "M, then its Cholesky factor")                                                               \
    X(double, force, n, "f = tau - h")                                                                                 \
    X(double, jacobian, k *n, "A, k x n")                                                                              \
    X(double, phi, k, "closure, positions")                                                                            \
    X(double, slip, k, "A v - b'; then what multipliers change by")                                                    \
    X(double, rate, k, "b'")                                                                                           \
    X(double, drift, k, "b''")                                                                                         \
    X(double, target, k, "c: what A a is to be")                                                                       \
    X(double, factor, n *(n > k ? n : k), "L^-1 A' or A' factored; M + A' s A factored")                               \
    X(double, reflector, n < k ? n : k, "scales of the reflectors")                                                    \
    X(int32_t, pivot, k, "order of the equations")                                                                     \
    X(double, multiplier, k, "lambda*")                                                                                \
    X(double, velocity, n, "u'")                                                                                       \
    X(double, state_q, q, "a state at placement")                                                                      \
    X(double, state_v, n, "a state at placement, and scratch of the projection")                                       \
    X(double, x, n, "what is being solved for")                                                                        \
    X(double, work, 34 * (n + k) + 65 * 64 + 64, "of LAPACK: dgeqp3, and dormqr on one column")

struct kt_constraint_formulation {
    void *owned; /* memory of kt_constraint_formulation_create, or NULL */
    const kt_model *model;
    kt_constraint_formulation_options options;
    int n, k, cap;  /* nv, equations, their rank at generic positions */
    double penalty; /* s */
    double largest; /* the last independent direction: the largest seen, */
    double least;   /* and the smallest */
    kt_constraint_formulation_statistics found;
    KT_ARENA_DECLARE(KT_FORMULATION_FIELDS)
};

/* M, f, A, phi, b', b'' and A v - b' at (t, q, v); velocities enter f and b''. */
KT_CHECKED kt_status kt_formulation_fill(kt_constraint_formulation *set, kt_data *data, double t, const double *q,
                                         const double *v, const double *tau, const kt_wrench *external,
                                         kt_error *error);

/* target = b'' - 2 alpha (A v - b') - beta^2 phi */
void kt_formulation_baumgarte(kt_constraint_formulation *set, double alpha, double beta);

/* Factors the n x k matrix in `factor`; returns the rank that is to be believed, and notes what it saw. `watch`: it is
 * A M^-1/2, whose directions are the ones that are followed. */
int kt_formulation_factor(kt_constraint_formulation *set, double t, bool watch);

/* x (n) moves least so that (factored matrix)' x = b (k), by its first `rank` pivots. */
void kt_formulation_constrain(kt_constraint_formulation *set, int rank, const double *b, double *x);

/* a by Gauss' principle with A a = target; M is overwritten. */
KT_CHECKED kt_status kt_formulation_gauss(kt_constraint_formulation *set, double t, double *a, kt_error *error);

/* a by penalties and multipliers with A a = target; M is overwritten. */
KT_CHECKED kt_status kt_formulation_augmented(kt_constraint_formulation *set, double t, double *a, kt_error *error);

/* velocity = v moved least to A u' = b', at a state that has been filled. */
void kt_formulation_project_velocity(kt_constraint_formulation *set, double t, const double *v);

/* The drift eliminated, for simulations; `user` is the set. */
int kt_formulation_project_positions(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error,
                                     void *user);

/* Refusals with the time. */
KT_CHECKED kt_status kt_formulation_refuse(double t, kt_status status, const char *message, kt_error *error);

#endif
