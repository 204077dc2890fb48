/* The response of the loops at a state to joint forces and to changes of their equations, and their multipliers. */
#ifndef KT_DERIVATIVE_LOOP_RESPONSE_H
#define KT_DERIVATIVE_LOOP_RESPONSE_H

#include "reduction/kernel.h"

/* How well derivatives next to singular positions are known at least, relative to the largest. */
#define KT_KNOWN 1e-3

/* Poses, and the equations of one kind at (t, q), factored. Errors: KT_ERROR_SINGULAR at a singular position, where
 * accelerations have no defined derivative; KT_ERROR_NOT_FINITE. */
KT_CHECKED kt_status kt_loops_factor(const kt_model *model, kt_data *data, double t, const double *q, kt_rows rows,
                                     kt_error *error);

/* The same of another kind where kt_loops_factor was the last to set poses. */
KT_CHECKED kt_status kt_loops_factor_again(const kt_model *model, kt_data *data, kt_rows rows, kt_error *error);

/* KT_ERROR_SINGULAR where the last factors are near a singular position. */
KT_CHECKED kt_status kt_loops_refuse_near(const kt_model *model, const kt_data *data, kt_error *error);

/* The error of the derivatives of accelerations at a state, over the coordinates' units: 0 where it is near no singular
 * position. Next to one the acceleration of the motion is evaluated, into a (n). Leaves the equations factored.
 * KT_ERROR_SINGULAR where no derivative can be computed. */
KT_CHECKED kt_status kt_loops_derivative_error(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                               double *a, double *size, kt_error *error);

/* Refuses derivatives that are known to less than KT_KNOWN of the largest of them. */
KT_CHECKED kt_status kt_derivatives_refuse_unknown(double t, double size, double most, kt_error *error);

/* After kt_loops_factor: the least x with J x = right (numbers by the order of the loops' equations; NULL: zeros), as
 * `least_step` in kernel.h, force being what acts besides. */
KT_CHECKED kt_status kt_loops_respond(const kt_model *model, kt_data *data, kt_metric metric, const double *right,
                                      const double *force, double *x, kt_error *error);

/* After kt_loops_factor: lambda, in the order of the loops' equations, with J' lambda = force; phi; and J x. */
KT_CHECKED kt_status kt_loops_multipliers_of(const kt_model *model, kt_data *data, const double *force, double *lambda,
                                             kt_error *error);
void kt_loops_residuals(const kt_model *model, const kt_data *data, double *phi);
void kt_loops_apply(const kt_model *model, kt_data *data, const double *x, double *out);

#endif
