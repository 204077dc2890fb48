/* The gradient of sums of the loops' equations at a state. */
#ifndef KT_CONSTRAINT_GRADIENT_H
#define KT_CONSTRAINT_GRADIENT_H

#include "constraint/dual_rows.h"
#include "constraint/group.h"

/* The sum  lambda_0 . J p_0 + lambda_1 . J p_1 + pi . (J a - b''(v))  of the equations in the order of the loops; what
 * is NULL is left out. */
typedef struct kt_loop_sum {
    const double *lambda[2], *p[2];
    const double *pi, *v, *a;
} kt_loop_sum;

/* Whether the gradients below read the links' poses in space (data->motion), which planar kernels leave out. O(loops). */
bool kt_loop_gradient_reads_space(const kt_model *model);

/* Adds the gradient of the sum with respect to positions and velocities, at the poses in data. Velocities and
 * accelerations are those of the sum. */
void kt_loop_gradient(const kt_dual_motion *at, const kt_loop_sum *sum, double *by_q, double *by_v);

/* The matrices of the two sums with J: subtracts d(J' lambda)/dq from d_q (nv x nv), and writes d(J z)/dq (equations x
 * nv) to c_q. unit: nv zeros and as many as there are equations, which are zeros again afterwards; work: 2 nv. */
void kt_loop_matrices(const kt_dual_motion *at, const double *lambda, const double *z, double *unit, double *work,
                      double *d_q, double *c_q);

/* The sum of one loop in a plane. */
#define KT_LOOP_GRADIENT_DECLARE(isa)                                                                                  \
    void kt_planar_loop_gradient_##isa(const kt_model *model, const kt_data *data, int32_t index,                      \
                                       const kt_loop_sum *sum, double *by_q, double *by_v);
KT_LOOP_GRADIENT_DECLARE(baseline)
KT_LOOP_GRADIENT_DECLARE(v3)
KT_LOOP_GRADIENT_DECLARE(v4)
#undef KT_LOOP_GRADIENT_DECLARE

/* The sum and the matrices of one loop by dual numbers; links' poses are in data->motion. */
void kt_dual_loop_gradient(const kt_dual_motion *at, int32_t index, const kt_loop_sum *sum, double *by_q, double *by_v);
void kt_dual_loop_matrices(const kt_dual_motion *at, int32_t index, const double *lambda, const double *z, double *d_q,
                           double *c_q);

#endif
