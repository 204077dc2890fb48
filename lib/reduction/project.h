/* Closing loops: tolerances, messages, one projection in place. */
#ifndef KT_REDUCTION_PROJECT_H
#define KT_REDUCTION_PROJECT_H

#include "kinetree/reduction.h"
#include "reduction/kernel.h"

/* Residuals that rounding leaves: relative to the mechanism's size (at least a radian counts as one) and speed. */
#define KT_CLOSED_TOLERANCE 1e-15

/* right <- -phi in all groups. */
void kt_aim_at_closure(const kt_model *model, const kt_data *data);

/* Projects q, then v, in place, by up to `most` steps; what is left in *violation. Returns 0; 1 where q does not get
 * closed to model->length * tolerance; -1 where a number is not finite. v may be NULL. */
int kt_project_in_place(const kt_model *model, kt_data *data, double t, double *q, double *v, int most,
                        double tolerance, bool *changed, kt_violation *violation);

/* KT_ERROR_CONSTRAINT with the loops that are open as last factored, worst first, and their gaps. */
kt_status kt_open_loops_error(const kt_model *model, kt_data *data, double t, const char *what, kt_error *error);

#endif
