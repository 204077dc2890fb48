/* The response of the loops at a state to joint forces and to changes of their equations, and their multipliers. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_LOOP_RESPONSE_H
#define KT_DERIVATIVE_LOOP_RESPONSE_H

#include "reduction/kernel.h"

/* The largest accepted error of derivatives next to singular positions, relative to the largest derivative. */
#define KT_KNOWN 1e-3

/* Computes poses, and factors the equations of one kind at (t, q). Errors: KT_ERROR_NOT_FINITE; KT_ERROR_SINGULAR at a
 * singular position, where accelerations have no defined derivative. */
KT_CHECKED kt_status kt_loops_factor(const kt_model *model, kt_data *data, double t, const double *q, kt_rows rows,
                                     kt_error *error);

/* Factors the equations of another kind, if kt_loops_factor was the last to set poses. */
KT_CHECKED kt_status kt_loops_factor_again(const kt_model *model, kt_data *data, kt_rows rows, kt_error *error);

/* Returns KT_ERROR_SINGULAR if the last factors are near a singular position. */
KT_CHECKED kt_status kt_loops_reject_near(const kt_model *model, const kt_data *data, kt_error *error);

/* Finds the error of the derivatives of accelerations at a state, over the coordinates' units. The error is 0 if no
 * singular position is near. Near a singular position, the acceleration of the motion is evaluated, and stored in a
 * (n). Leaves the equations factored.
 * Errors: KT_ERROR_SINGULAR if no derivative can be computed. */
KT_CHECKED kt_status kt_loops_derivative_error(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                               double *a, double *size, kt_error *error);

/* Rejects derivatives if the error exceeds KT_KNOWN times the largest derivative. */
KT_CHECKED kt_status kt_derivatives_reject_unknown(double t, double size, double most, kt_error *error);

/* After kt_loops_factor: finds the least x with J x = right, as `least_step` in kernel.h.
 *
 * right: numbers in the order of the loops' equations; NULL: zeros.
 *
 * force: forces that act in addition. */
KT_CHECKED kt_status kt_loops_respond(const kt_model *model, kt_data *data, kt_metric metric, const double *right,
                                      const double *force, double *x, kt_error *error);

/* After kt_loops_factor, these find lambda with J' lambda = force, phi, and J x, in the order of the equations. */
KT_CHECKED kt_status kt_loops_multipliers_of(const kt_model *model, kt_data *data, const double *force, double *lambda,
                                             kt_error *error);
void kt_loops_residuals(const kt_model *model, const kt_data *data, double *phi);
void kt_loops_apply(const kt_model *model, kt_data *data, const double *x, double *out);

#endif
