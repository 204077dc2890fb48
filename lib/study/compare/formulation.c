/* Constraint formulations as the right-hand side of a simulation: the tree's equations as matrices, the choice of the
 * formulation, and its statistics. The formulations themselves are in formulation_gauss.c, _baumgarte.c, _augmented.c
 * and _projection.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/formulation.h"
#include "base/copy.h"
#include "constraint/group.h"
#include "evaluate/evaluate.h"
#include "model/model.h"

#include <math.h>

/* ---- the equations ----------------------------------------------------------------------------------------------- */

/* f = tau + forces of effects - (h - J' external) */
static kt_status fill_formulation_force(kt_constraint_formulation *formulation, kt_data *data, double t,
                                        const double *q, const double *v, const double *tau, const kt_wrench *external,
                                        kt_error *error) {
    double *f = formulation->force;
    kt_status status = kt_effect_forces(formulation->model, data, t, q, v, f, error);
    if (status == KT_OK)
        status = kt_dynamics_inverse(formulation->model, data, q, v, NULL, external, formulation->x, error);
    for (int i = 0; i < formulation->n && status == KT_OK; i++)
        f[i] += (tau ? tau[i] : 0.0) - formulation->x[i];
    return status;
}

/* Remembers the largest |phi| of all evaluations. */
static void note_open_constraints(kt_constraint_formulation *formulation, double t) {
    for (int r = 0; r < formulation->k; r++)
        if (fabs(formulation->phi[r]) > formulation->found.open) {
            formulation->found.open = fabs(formulation->phi[r]);
            formulation->found.open_time = t;
        }
}

kt_status kt_formulation_fill(kt_constraint_formulation *formulation, kt_data *data, double t, const double *q,
                              const double *v, const double *tau, const kt_wrench *external, kt_error *error) {
    const size_t n = (size_t)formulation->n, k = (size_t)formulation->k;
    kt_status status = kt_loop_equations(formulation->model, data, t, q, v, formulation->jacobian, formulation->phi,
                                         formulation->rate, formulation->drift, error);
    if (status == KT_OK)
        status = kt_dynamics_mass(formulation->model, data, q, formulation->mass, error);
    if (status == KT_OK)
        status = fill_formulation_force(formulation, data, t, q, v, tau, external, error);
    for (size_t r = 0; r < k && status == KT_OK; r++) {
        formulation->slip[r] = -formulation->rate[r];
        for (size_t i = 0; i < n; i++)
            formulation->slip[r] += formulation->jacobian[i * k + r] * v[i];
    }
    return status;
}

/* ---- evaluation -------------------------------------------------------------------------------------------------- */

/* Fills the equations with forces and b'' at u' instead of w. */
static kt_status fill_projected(kt_constraint_formulation *formulation, kt_data *data, double t, const double *q,
                                const double *w, const double *tau, const kt_wrench *external, kt_error *error) {
    kt_status status = kt_loop_equations(formulation->model, data, t, q, w, formulation->jacobian, NULL,
                                         formulation->rate, NULL, error);
    if (status != KT_OK)
        return status;
    kt_formulation_project_velocity(formulation, t, w);
    return kt_formulation_fill(formulation, data, t, q, formulation->velocity, tau, external, error);
}

kt_status kt_constraint_formulation_evaluate(kt_constraint_formulation *formulation, kt_data *data, double t,
                                             const double *q, const double *v, const double *tau,
                                             const kt_wrench *external, double *rate, double *a, kt_error *error) {
    if (KT_IS_MISSING(error, formulation, data, q || formulation->n == 0, v || formulation->n == 0,
                      a || formulation->n == 0))
        return KT_ERROR_ARGUMENT;
    const kt_constraint_formulation_options *o = &formulation->options;
    const bool projects = o->type == KT_CONSTRAINT_FORMULATION_PROJECTION;
    const bool stable =
        o->type == KT_CONSTRAINT_FORMULATION_BAUMGARTE || o->type == KT_CONSTRAINT_FORMULATION_AUGMENTED;
    const kt_dynamic_state at = {t, q, v, tau, external};
    kt_status status = kt_open_contacts_reject(formulation->model, data, &at, error);
    if (status != KT_OK)
        return status;
    status = projects ? fill_projected(formulation, data, t, q, v, tau, external, error)
                      : kt_formulation_fill(formulation, data, t, q, v, tau, external, error);
    if (status != KT_OK)
        return status;
    formulation->found.evaluations++;
    note_open_constraints(formulation, t);
    kt_formulation_baumgarte(formulation, stable ? o->alpha : 0.0, stable ? o->beta : 0.0);
    status = o->type == KT_CONSTRAINT_FORMULATION_AUGMENTED
                 ? kt_formulation_augmented(formulation, t, formulation->x, error)
                 : kt_formulation_gauss(formulation, t, formulation->x, error);
    double sum = 0.0;
    for (int i = 0; i < formulation->n; i++)
        sum += formulation->x[i] - formulation->x[i];
    if (status == KT_OK && !(sum == 0.0))
        status = kt_formulation_reject(t, KT_ERROR_NOT_FINITE, "the formulation's accelerations are not finite", error);
    if (status != KT_OK)
        return status;
    kt_copy(a, formulation->x, (size_t)formulation->n * sizeof *a);
    if (rate)
        kt_copy(rate, projects ? formulation->velocity : v, (size_t)formulation->n * sizeof *rate);
    return KT_OK;
}

/* ---- in a simulation --------------------------------------------------------------------------------------------- */

/* A kt_right_hand_side: after an error of the evaluation, a shorter step may help. */
static int accelerate_formulation(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    kt_constraint_formulation *formulation = user;
    if (at->model != formulation->model) {
        (void)kt_error_set(
            error, KT_ERROR_ARGUMENT, "constraint formulation",
            "the formulation belongs to another model than the simulation (in absolute coordinates, make the "
            "formulation for kt_absolute_model)");
        return -1;
    }
    return kt_constraint_formulation_evaluate(formulation, at->data, at->t, at->q, at->v, at->tau, at->external, rate,
                                              a, error) == KT_OK
               ? 0
               : 1;
}

void kt_constraint_formulation_use(kt_constraint_formulation *formulation, kt_simulation_options *options) {
    if (!formulation || !options)
        return;
    const bool projects = formulation->options.type == KT_CONSTRAINT_FORMULATION_PROJECTION;
    options->acceleration = accelerate_formulation;
    options->projection = projects ? kt_formulation_project_positions : NULL;
    options->unprojected = !projects;
    options->user = formulation;
}

/* ---- statistics -------------------------------------------------------------------------------------------------- */

kt_constraint_formulation_statistics
kt_constraint_formulation_statistics_of(const kt_constraint_formulation *formulation) {
    return formulation ? formulation->found : (kt_constraint_formulation_statistics){.evaluations = 0};
}

void kt_constraint_formulation_reset(kt_constraint_formulation *formulation) {
    if (!formulation)
        return;
    const kt_constraint_formulation_statistics none = {.least = 1.0};
    formulation->found = none;
    formulation->largest = 0.0;
    formulation->least = HUGE_VAL;
}

kt_status kt_constraint_formulation_verdict(const kt_constraint_formulation *formulation, kt_error *error) {
    if (KT_IS_MISSING(error, formulation))
        return KT_ERROR_ARGUMENT;
    const kt_constraint_formulation_statistics *f = &formulation->found;
    if (f->trusted)
        return kt_error_set(error, KT_ERROR_CONSTRAINT, NULL,
                            "redundant equations looked independent and were trusted in %llu evaluations: closure "
                            "errors then stop the mechanism; leave `uncapped` off",
                            (unsigned long long)f->trusted);
    if (f->least < KT_NEAR_SINGULAR || f->dropped)
        return kt_error_set(
            error, KT_ERROR_SINGULAR, kt_where_format("t = %.9g s", f->least_time).text,
            "the loops came within %.1e of a singular position, in which this formulation divides its closure errors "
            "by almost zero (loops open by up to %.1e): compare the rest with the reduction",
            f->least, f->open);
    if (f->open > 1e-3 * fmax(formulation->model->length, 1.0))
        return kt_error_set(error, KT_ERROR_CONSTRAINT, kt_where_format("t = %.9g s", f->open_time).text,
                            "the loops came apart by %.1e m or rad: take shorter steps or other gains", f->open);
    if (f->residual > 1e-2)
        return kt_error_set(error, KT_ERROR_SINGULAR, NULL,
                            "after up to %d iterations the equations of the loops were still off by %.1e of their "
                            "terms, as they are near singular positions: compare with the reduction",
                            f->iterations, f->residual);
    return KT_OK;
}
