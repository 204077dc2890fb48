/* M^-1 of a tree in the factors of the articulated-body recursion, for any number of right-hand sides. The cost is O(n)
 * for the terms and O(n) a column, without M.
 *
 * With I the articulated inertia of a link (aba.h) and S_k its degrees of freedom, all about the link's origin, from
 * the tips to the ground and from the last k to the first
 *     U_k = I S_k,   d_k = 1 / S_k.U_k,   I -= U_k U_k' d_k
 * These terms depend on q alone. A column x of joint forces then takes two passes. F is the wrench that a link, with
 * all bodies that it carries, passes on:
 *     backward    y_k = (x_k - S_k.F) d_k,   F += U_k y_k
 *     forward     x_k = y_k - d_k U_k.A,     A += S_k x_k
 * F is shifted to the parent's origin, and the acceleration A to the child's (Featherstone 2008, 7.3). The passes are
 * factors of M^-1 (Rodriguez, Jain, Kreutz-Delgado, Spatial operator algebra, J. Astronautical Sciences 40, 1992).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_ABA_INVERSE_H
#define KT_DYNAMICS_ABA_INVERSE_H

#include "base/arena.h"
#include "base/isa.h"
#include "dynamics/dynamics.h"

typedef struct kt_inverse_dof {
    kt_real3 s[2];    /* S: angular, linear */
    kt_real3 gain[2]; /* U d */
} kt_inverse_dof;

typedef struct kt_inverse_flow {
    kt_real3 angular, linear; /* moment and force, or accelerations */
} kt_inverse_flow;

/* Every array: type, name, count, meaning. Degrees of freedom have the order of the links. */
#define KT_INVERSE_FIELDS(X)                                                                                           \
    X(kt_inverse_dof, dof, n->v, "terms of each degree of freedom")                                                    \
    X(kt_real1, reciprocal, n->v, "d")                                                                                 \
    X(kt_real3, offset, n->link, "origin minus the parent's")                                                          \
    X(kt_inverse_flow, flow, n->link, "backward: what children pass, where links branch; forward: accelerations")

typedef struct kt_inverse_terms {
    KT_ARENA_DECLARE(KT_INVERSE_FIELDS)
} kt_inverse_terms;

/* compute: the terms at q, which is finite. zero: as many zeros as velocities. Returns a link without inertia along a
 *   degree of freedom, or 0.
 * apply: x (nv) becomes M^-1 x.
 * In lanes, data->sound excludes states that are rejected. */
#define KT_INVERSE_DECLARE(isa)                                                                                        \
    size_t kt_inverse_compute_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *zero,     \
                                    kt_inverse_terms *terms);                                                          \
    void kt_inverse_apply_##isa(const kt_model *model, const kt_inverse_terms *terms, kt_real1 *x);
KT_EACH_KERNEL(KT_INVERSE_DECLARE)
#undef KT_INVERSE_DECLARE

/* Places the arrays of the terms of a model with these counts in memory (NULL: none); returns the bytes. */
size_t kt_inverse_layout(kt_inverse_terms *terms, void *memory, const kt_counts *n);

/* Returns the error that a link's joint moves no inertia, in forward dynamics, too (dynamics.c). */
kt_status kt_link_reject_inertia(const kt_model *model, size_t link, kt_error *error);

/* The first of three hinges through one point of which a link is one, and whose first two links have no mass: a body
 * turns on them as on a ball, but for gimbal lock. 0: there are none. */
size_t kt_link_first_of_hinges(const kt_model *model, size_t link);

/* The remedy for gimbal lock of three hinges, in words. */
typedef struct kt_gimbal_text {
    char text[320];
} kt_gimbal_text;
kt_gimbal_text kt_link_gimbal_advice(const kt_model *model, size_t first);

/* The kernels of the model's instruction set. Errors: KT_ERROR_SINGULAR names the joint; those of kt_input_check. */
KT_CHECKED kt_status kt_inverse_compute(const kt_model *model, kt_data *data, const double *q, kt_inverse_terms *terms,
                                        kt_error *error);
void kt_inverse_apply(const kt_model *model, const kt_inverse_terms *terms, double *x);

#endif
