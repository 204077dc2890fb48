/* The gradient of sums of the loops' equations at a state. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_GRADIENT_H
#define KT_CONSTRAINT_GRADIENT_H

#include "constraint/dual_rows.h"
#include "constraint/group.h"

/* The sum  lambda_0 . A p_0 + lambda_1 . A p_1 + pi . (A a - b''(v))  of the equations in the order of the loops. Terms
 * with a NULL member are left out. */
typedef struct kt_loop_sum {
    const double *lambda[2], *p[2];
    const double *pi, *v, *a;
} kt_loop_sum;

/* Whether the gradients below read the links' poses in space (data->motion), which planar kernels leave out. O(loops).
 */
bool kt_loop_gradient_reads_space(const kt_model *model);

/* Adds the gradient of the sum with respect to positions and velocities, at the poses in data. Velocities and
 * accelerations are those of the sum. */
void kt_loop_gradient(const kt_dual_motion *at, const kt_loop_sum *sum, double *by_q, double *by_v);

/* Computes matrices of the motion `at`, with the multipliers lambda of all equations. Subtracts d(A' lambda)/dq from
 * d_q (nv x nv). If `moving`, writes the derivatives of b'' - A a by q and v to by_q and by_v (equations x nv).
 * Otherwise writes d(A v)/dq to by_q; by_v may be NULL. */
void kt_loop_matrices(const kt_dual_motion *at, const double *lambda, bool moving, double *d_q, double *by_q,
                      double *by_v);

/* The part of one loop in a plane in kt_loop_gradient, and in kt_loop_matrices: the rows of its equations, in the
 * columns of the degrees of freedom on its paths. */
#define KT_LOOP_GRADIENT_DECLARE(isa)                                                                                  \
    void kt_planar_loop_gradient_##isa(const kt_model *model, const kt_data *data, int32_t index,                      \
                                       const kt_loop_sum *sum, double *by_q, double *by_v);                            \
    void kt_planar_loop_matrices_##isa(const kt_dual_motion *at, int32_t index, const double *lambda, bool moving,     \
                                       double *d_q, double *by_q, double *by_v);
KT_EACH_ISA(KT_LOOP_GRADIENT_DECLARE)
#undef KT_LOOP_GRADIENT_DECLARE

/* Likewise for a loop in space, by dual numbers; links' poses are in data->motion. */
void kt_dual_loop_gradient(const kt_dual_motion *at, int32_t index, const kt_loop_sum *sum, double *by_q, double *by_v);
void kt_dual_loop_matrices(const kt_dual_motion *at, int32_t index, const double *lambda, bool moving, double *d_q,
                           double *by_q, double *by_v);

#endif
