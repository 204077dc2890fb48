/* Stages of implicit methods that are solved together (implicit.c), and their changes (implicit_changes.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SENSITIVITY_IMPLICIT_H
#define KT_SENSITIVITY_IMPLICIT_H

#include "kinetree/joint.h"
#include "linear/cholesky.h"
#include "sensitivity/sensitivity.h"

/* Stages first .. end - 1, which are solved together. */
typedef struct kt_coupled {
    size_t first, end;
} kt_coupled;

/* The stages from stage `first` on that are solved together. */
kt_coupled kt_coupled_at(const kt_method *method, size_t first);
/* a_ij of an implicit method. */
static inline double kt_implicit_entry(const kt_method *method, size_t i, size_t j) {
    return method->a[i * (size_t)method->stages + j];
}

/* Whether the step depends on these stages. */
bool kt_coupled_counts(const kt_method *method, kt_coupled c);

/* Computes F of each stage (w->by_q, w->by_v), and with `held` columns f_p (w->by_held), at the solved stages; then
 * factors. */
KT_CHECKED kt_status kt_coupled_differentiate(kt_step_work *w, kt_coupled c, size_t held, kt_error *error);

/* x becomes the solution of the equations, or of the transposed equations, with w->unknowns numbers for each stage. */
void kt_coupled_solve(const kt_step_work *w, kt_coupled c, double *x);
void kt_coupled_solve_transposed(const kt_step_work *w, kt_coupled c, double *x);

#endif
