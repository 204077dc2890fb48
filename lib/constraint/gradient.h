/* The gradient of sums of the loops' equations at a state. */
#ifndef KT_CONSTRAINT_GRADIENT_H
#define KT_CONSTRAINT_GRADIENT_H

#include "constraint/dual_rows.h"
#include "constraint/group.h"

/* The sum  lambda_0 . J p_0 + lambda_1 . J p_1 + pi . (J a - b''(v))  of the equations in the order of the loops. Terms
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

/* Computes matrices along the velocities z of the motion `at`. Subtracts d(J' lambda)/dq from d_q (nv x nv), and writes
 * d(J z)/dq (equations x nv) to c_q. */
void kt_loop_matrices(const kt_dual_motion *at, const double *lambda, double *d_q, double *c_q);

/* The same of a motion with accelerations: kt_dual_loops, or by the planar loops' own forms. */
void kt_loop_linearize(const kt_dual_motion *at, const double *lambda, double *d_q, double *e_q, double *e_v);

/* The sum of one loop in a plane; and its matrices, those of kt_loop_linearize if `moving`, otherwise c_q as by_q. */
#define KT_LOOP_GRADIENT_DECLARE(isa)                                                                                  \
    void kt_planar_loop_gradient_##isa(const kt_model *model, const kt_data *data, int32_t index,                      \
                                       const kt_loop_sum *sum, double *by_q, double *by_v);                            \
    void kt_planar_loop_matrices_##isa(const kt_dual_motion *at, int32_t index, const double *lambda, bool moving,     \
                                       double *d_q, double *by_q, double *by_v);
KT_EACH_ISA(KT_LOOP_GRADIENT_DECLARE)
#undef KT_LOOP_GRADIENT_DECLARE

/* The sum and the matrices of one loop by dual numbers; links' poses are in data->motion. */
void kt_dual_loop_gradient(const kt_dual_motion *at, int32_t index, const kt_loop_sum *sum, double *by_q, double *by_v);
void kt_dual_loop_matrices(const kt_dual_motion *at, int32_t index, const double *lambda, double *d_q, double *c_q);

#endif
