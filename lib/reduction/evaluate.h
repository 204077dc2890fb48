/* Accelerations of mechanisms with loops and effects. */
#ifndef KT_REDUCTION_EVALUATE_H
#define KT_REDUCTION_EVALUATE_H

#include "reduction/project.h"

/* Adds what the effects do to *tau and *external: afterwards these point to sums in data, where there is something to
 * sum. Errors: KT_ERROR_NOT_FINITE, KT_ERROR_EFFECT, KT_ERROR_CALLBACK, each naming the effect and the time. */
KT_CHECKED kt_status kt_effects_apply(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                      const double **tau, const kt_wrench **external, kt_error *error);

/* The same of a caller's own effects alone. */
KT_CHECKED kt_status kt_effects_apply_own(const kt_model *model, kt_data *data, double t, const double *q,
                                          const double *v, const double **tau, const kt_wrench **external,
                                          kt_error *error);

/* The same of all, and adds up their powers. */
KT_CHECKED kt_status kt_effects_account(const kt_model *model, kt_data *data, double t, const double *q,
                                        const double *v, const double **tau, const kt_wrench **external,
                                        kt_power *power, kt_error *error);

/* kt_acceleration_evaluate for a model with loops, effects not included. *crossed (may be NULL): whether a comes from
 * beside a singular position; the groups' matrices are then not those of (t, q, v). */
kt_status kt_closed_forward(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            const double *tau, const kt_wrench *external, double *a, bool *crossed, kt_error *error);

/* Whether the wrenches that a caller gives are finite: recursions in a plane read of them what lies in it
 * alone, and would not notice. */
kt_status kt_wrenches_check(const kt_model *model, const double *q, const double *v, const kt_wrench *external,
                            kt_error *error);

#endif
