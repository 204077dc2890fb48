/* What adjoints need of loops at a state: the response to joint forces, multipliers, and the gradient of sums of the
 * equations. */
#ifndef KT_CONSTRAINT_GRADIENT_H
#define KT_CONSTRAINT_GRADIENT_H

#include "constraint/dual_rows.h"
#include "reduction/kernel.h"

/* Poses, and the equations of one kind at (t, q), factored. Errors: KT_ERROR_SINGULAR at a singular position or next to
 * one, where accelerations have no defined derivative; KT_ERROR_NOT_FINITE. */
KT_CHECKED kt_status kt_loops_factor(const kt_model *model, kt_data *data, double t, const double *q, kt_rows rows,
                                     kt_error *error);

/* The same of another kind where kt_loops_factor was the last to set poses. */
KT_CHECKED kt_status kt_loops_factor_again(const kt_model *model, kt_data *data, kt_rows rows, kt_error *error);

/* KT_ERROR_SINGULAR where the last factors are near a singular position: accelerations have no defined derivative
 * there. */
KT_CHECKED kt_status kt_loops_refuse_singular(const kt_model *model, const kt_data *data, kt_error *error);

/* After kt_loops_factor: the least x with J x = right (numbers by the order of the loops' equations; NULL: zeros), as
 * `close` in kernel.h, force being what acts besides. */
KT_CHECKED kt_status kt_loops_respond(const kt_model *model, kt_data *data, kt_metric metric, const double *right,
                                      const double *force, double *x, kt_error *error);

/* After kt_loops_factor: lambda, in the order of the loops' equations, with J' lambda = force; phi; and J x. */
KT_CHECKED kt_status kt_loops_share(const kt_model *model, kt_data *data, const double *force, double *lambda,
                                    kt_error *error);
void kt_loops_residuals(const kt_model *model, const kt_data *data, double *phi);
void kt_loops_apply(const kt_model *model, kt_data *data, const double *x, double *out);

/* The sum  lambda_0 . J p_0 + lambda_1 . J p_1 + pi . (J a - b''(v))  of the equations in the order of the loops; what
 * is NULL is left out. */
typedef struct kt_loop_sum {
    const double *lambda[2], *p[2];
    const double *pi, *v, *a;
} kt_loop_sum;

/* Adds the gradient of the sum with respect to positions and velocities, at the poses in data. dof, chain: work memory,
 * nv and links. */
void kt_loop_gradient(const kt_model *model, kt_data *data, double t, const double *q, const kt_loop_sum *sum,
                      kt_support_dof *dof, int32_t *chain, double *by_q, double *by_v);

/* The matrices of the two sums with J: subtracts d(J' lambda)/dq from d_q (nv x nv), and writes d(J z)/dq (equations x
 * nv) to c_q. unit: nv zeros and as many as there are equations, which are zeros again afterwards; work: 2 nv. */
void kt_loop_matrices(const kt_model *model, kt_data *data, double t, const double *q, const double *lambda,
                      const double *z, kt_support_dof *dof, int32_t *chain, double *unit, double *work, double *d_q,
                      double *c_q);

/* The sum of one loop in a plane. */
#define KT_LOOP_GRADIENT_DECLARE(level)                                                                                \
    void kt_planar_loop_gradient_##level(const kt_model *model, const kt_data *data, int32_t index,                    \
                                         const kt_loop_sum *sum, double *by_q, double *by_v);
KT_LOOP_GRADIENT_DECLARE(baseline)
KT_LOOP_GRADIENT_DECLARE(v3)
KT_LOOP_GRADIENT_DECLARE(v4)
#undef KT_LOOP_GRADIENT_DECLARE

/* The sum and the matrices of one loop by dual numbers; links' poses are in data->motion. */
void kt_dual_loop_gradient(const kt_model *model, const kt_data *data, double t, const double *q, int32_t index,
                           const kt_loop_sum *sum, kt_support_dof *dof, int32_t *chain, double *by_q, double *by_v);
void kt_dual_loop_matrices(const kt_model *model, const kt_data *data, double t, const double *q, int32_t index,
                           const double *lambda, const double *z, kt_support_dof *dof, int32_t *chain, double *d_q,
                           double *c_q);

#endif
