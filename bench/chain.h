/* The chain that all figures refer to has n links on revolute joints about x, y, z in turn.
 *
 *     each joint        at (0.1, 0.2, -0.3) of its parent
 *     mass              1
 *     centre of mass    (0.02, -0.05, -0.15)
 *     inertia about it  (0.020, 0.030, 0.025, 0.001, -0.002, 0.0015)
 *     gravity           9.81 along -z
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_CHAIN_H
#define KT_BENCH_CHAIN_H

#include "kinetree/dynamics.h"

extern const kt_body kt_chain_link; /* all but name, parent and axis */
extern const kt_vec3 kt_chain_gravity;

/* The axis of link i, 0 <= i. */
kt_vec3 kt_chain_axis(int i);

/* A chain ready to be evaluated, at a state and under torques without any symmetry. */
typedef struct kt_chain {
    int n, nq; /* velocities, positions; n = nq but for kt_chain_of */
    kt_model *model;
    kt_data *data;
    double set_up;       /* seconds of processor time to describe and to compile it */
    double *q, *v, *tau; /* n each: positions, velocities, torques */
    double *a, *torque;  /* n each: results */
    double *mass;        /* n x n, or NULL; with its factors, and x, n: a solution by them */
    kt_mass_factor *factor;
    double *x;
    void *work; /* of derivatives, or NULL; with da_dq and da_dv, n x n */
    size_t work_size;
    double *da_dq, *da_dv;
    kt_error error; /* the first failure of a call below; KT_OK: none */
} kt_chain;

/* Allocates all of it; with_mass: the mass matrix too. On failure *chain is empty and *error holds the reason. */
KT_CHECKED kt_status kt_chain_make(int n, kt_isa isa, bool with_mass, kt_chain *chain, kt_error *error);
void kt_chain_free(kt_chain *chain);

/* The same for other trees. The function kt_chain_branch makes n such links, depth first, each with `arity` children,
 * or fewer at the tips. The function kt_chain_of takes only the joints and bodies of a description, at its initial
 * state. */
KT_CHECKED kt_status kt_chain_branch(int n, int arity, kt_isa isa, bool with_mass, kt_chain *chain, kt_error *error);
KT_CHECKED kt_status kt_chain_of(const kt_description *description, kt_isa isa, bool with_mass, kt_chain *chain,
                                 kt_error *error);

/* Their description, which must be released with kt_chain_describe_free. */
typedef struct kt_chain_description {
    kt_description description;
    kt_body *bodies;
    char (*names)[16];
} kt_chain_description;
KT_CHECKED kt_status kt_chain_describe(int n, int arity, kt_chain_description *out, kt_error *error);
void kt_chain_describe_free(kt_chain_description *d);

/* Allocates the arrays for derivatives. */
KT_CHECKED kt_status kt_chain_make_derivatives(kt_chain *chain, kt_error *error);

/* Tasks for kt_bench_measure, on a kt_chain. In this order: a from tau, torque from a, the mass matrix, its factors, x
 * = M^-1 tau by the factors, da/dq and da/dv. */
void kt_chain_forward(void *chain, long repetitions);
void kt_chain_inverse(void *chain, long repetitions);
void kt_chain_mass(void *chain, long repetitions);
void kt_chain_factor(void *chain, long repetitions);
void kt_chain_solve(void *chain, long repetitions);
void kt_chain_derivatives(void *chain, long repetitions);

/* max |x_i - y_i| / max |scale_i|; NaN where any of them is not finite. */
double kt_chain_difference(const double *x, const double *y, const double *scale, int n);

#endif
