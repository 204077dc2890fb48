/* The response of the loops at a state to joint forces and to changes of their equations, and their multipliers. */
#ifndef KT_DERIVATIVE_LOOP_RESPONSE_H
#define KT_DERIVATIVE_LOOP_RESPONSE_H

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
 * `least_step` in kernel.h, force being what acts besides. */
KT_CHECKED kt_status kt_loops_respond(const kt_model *model, kt_data *data, kt_metric metric, const double *right,
                                      const double *force, double *x, kt_error *error);

/* After kt_loops_factor: lambda, in the order of the loops' equations, with J' lambda = force; phi; and J x. */
KT_CHECKED kt_status kt_loops_multipliers_of(const kt_model *model, kt_data *data, const double *force, double *lambda,
                                             kt_error *error);
void kt_loops_residuals(const kt_model *model, const kt_data *data, double *phi);
void kt_loops_apply(const kt_model *model, kt_data *data, const double *x, double *out);

#endif
