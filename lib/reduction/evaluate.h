/* Accelerations of mechanisms with loops and effects. */
#ifndef KT_REDUCTION_EVALUATE_H
#define KT_REDUCTION_EVALUATE_H

#include "reduction/project.h"

/* Adds what the effects do to *tau and *external: afterwards these point to sums in data. */
void kt_effects_apply(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                      const double **tau, const kt_wrench **external);

/* The same, and adds up their powers. */
void kt_effects_account(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                        const double **tau, const kt_wrench **external, kt_power *power);

/* Whether a loop changes with time. */
bool kt_loops_are_driven(const kt_model *model);

/* kt_acceleration_evaluate for a model with loops, effects not included. *crossed (may be NULL): whether a comes from
 * beside a singular position; the groups' matrices are then not those of (t, q, v). */
kt_status kt_closed_forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            const double *tau, const kt_wrench *external, double *a, bool *crossed, kt_error *error);

#endif
