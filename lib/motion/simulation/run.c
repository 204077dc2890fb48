/* The settings of a run: defaults, limits and names. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "model/describe.h"
#include "simulation/simulation.h"

#include <assert.h>
#include <float.h>

kt_run kt_run_default(void) {
    kt_run run = {0};
    run.duration = 10.0;
    run.integrator = "dopri5";
    run.relative = 1e-9;
    run.rho = 0.6;
    run.absolute = 1e-9;
    return run;
}

/* The times of a run reach the duration; a smaller step would be lost in their rounding (integrator/step.c). */
static kt_status check_length(const kt_run *run, const char *where, double step, kt_error *error) {
    const double least = 16.0 * DBL_EPSILON * run->duration;
    if (step > 0.0 && step <= least)
        return kt_error_set(error, KT_ERROR_ARGUMENT, where,
                            "%g s is lost in the rounding of times up to %g s; take one above %.3g s, or a shorter "
                            "duration",
                            step, run->duration, least);
    return KT_OK;
}

static kt_status check_run_step(const kt_run *run, kt_error *error) {
    if (!kt_is_not_negative(run->step))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step", "%g s: must be above zero, or zero for an adaptive step",
                            run->step);
    return check_length(run, "step", run->step, error);
}

/* The bound applies to steps that a method chooses, not to fixed steps. */
static kt_status check_max_step(const kt_run *run, kt_error *error) {
    if (!kt_is_not_negative(run->max_step))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "max_step", "%g s: must be above zero, or zero for no limit",
                            run->max_step);
    return run->step == 0.0 ? check_length(run, "max_step", run->max_step, error) : KT_OK;
}

static kt_status check_run_tolerances(const kt_run *run, kt_error *error) {
    if (run->step > 0.0)
        return KT_OK;
    if (!kt_is_not_negative(run->relative) || !kt_is_not_negative(run->absolute) ||
        run->relative + run->absolute == 0.0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "tolerance",
                            "%g (relative), %g (absolute): must be finite and not negative, and one of them above zero",
                            run->relative, run->absolute);
    if (run->relative > 0.0 && run->relative < KT_TOLERANCE_LEAST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "tolerance",
                            "%g (relative) is below the rounding of numbers, which the error of a step cannot fall "
                            "below; take %.2g or more, or 0 to use only the absolute tolerance",
                            run->relative, 1.04 * KT_TOLERANCE_LEAST); /* two digits, rounded up */
    return KT_OK;
}

/* ---- the method -------------------------------------------------------------------------------------------------- */

/* The reason why a run has its method. */
typedef enum kt_choice_of_method {
    KT_CHOSEN_BY_NAME = 0,
    KT_CHOSEN_ADAPTIVE, /* the only method that is chosen automatically */
    KT_CHOSEN_FIXED,
    KT_CHOSEN_FOREIGN,
    KT_CHOSEN_LARGE
} kt_choice_of_method;

static kt_choice_of_method choose_run_method(const kt_run *run, const kt_model *model) {
    if (run->integrator != NULL)
        return KT_CHOSEN_BY_NAME;
    if (run->step > 0.0)
        return KT_CHOSEN_FIXED;
    if (model == NULL)
        return KT_CHOSEN_FOREIGN;
    return kt_model_nv(model) > KT_RUN_IMPLICIT_MOST ? KT_CHOSEN_LARGE : KT_CHOSEN_ADAPTIVE;
}

const char *kt_run_method_reason(const kt_run *run, const kt_model *model) {
    if (!run)
        return NULL;
    switch (choose_run_method(run, model)) {
    case KT_CHOSEN_BY_NAME:
        return NULL;
    case KT_CHOSEN_ADAPTIVE:
        return "the default";
    case KT_CHOSEN_FIXED:
        return "the default with a fixed step";
    case KT_CHOSEN_FOREIGN:
        return "the default where the equations of motion are the caller's";
    case KT_CHOSEN_LARGE:
        break;
    }
    static_assert(KT_RUN_IMPLICIT_MOST == 100, "the words tell it");
    return "the default above 100 velocity coordinates, for the size of matrices; if the motion is stiff, name auto or "
           "radau5";
}

/* The two-step family is given by rho; bdf2 is its member with rho = 0. */
const kt_method *kt_run_method(const kt_run *run, const kt_model *model, kt_method *storage) {
    if (!run)
        return NULL;
    const char *chosen = choose_run_method(run, model) == KT_CHOSEN_ADAPTIVE ? "auto" : "dopri5";
    const kt_method *method = kt_method_find(run->integrator != NULL ? run->integrator : chosen);
    if (method == NULL || !(method->rho > 0.0))
        return method;
    if (storage == NULL)
        return NULL;
    *storage = *method;
    storage->rho = run->rho;
    return storage;
}

/* ---- limits ------------------------------------------------------------------------------------------------------ */

kt_status kt_record_check(unsigned record, kt_error *error) {
#define KT_RECORD_OR(id, bit, name) | (bit)
    static const unsigned all = 0U KT_RECORD_LIST(KT_RECORD_OR);
#undef KT_RECORD_OR
    if ((record & ~all) != 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "record", "0x%x: is no sum of KT_RECORD_ bits", record);
    return KT_OK;
}

kt_status kt_run_check(const kt_run *run, kt_error *error) {
    if (KT_IS_MISSING(error, run))
        return KT_ERROR_ARGUMENT;
    if (!(run->rho >= 0.0 && run->rho <= 1.0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "rho", "%g: the spectral radius at infinity must be 0 to 1",
                            run->rho);
    if (!kt_is_not_negative(run->duration))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "duration", "%g s: must be zero or more", run->duration);
    if (run->duration > 0.0 && run->duration < KT_DURATION_LEAST)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "duration",
                            "%g s is too short to be divided into steps and records; take zero, or %g s or more",
                            run->duration, KT_DURATION_LEAST);
    if (!kt_is_not_negative(run->interval))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "interval",
                            "%g s: must be above zero, or zero for about 1000 records", run->interval);
    /* Beyond 2^53 the numbers k of records are no longer exact in k * interval. */
    if (run->interval > 0.0 && run->duration / run->interval > 9007199254740992.0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "interval", "%g s: more records than can be counted",
                            run->interval);
    kt_status status = kt_record_check(run->record, error);
    if (status == KT_OK && (run->marker_count < 0 || (run->marker_count > 0 && !run->markers)))
        status = kt_error_set(error, KT_ERROR_ARGUMENT, "marker_count", "%d: is not the length of the array `markers`",
                              run->marker_count);
    if (status == KT_OK)
        status = check_run_step(run, error);
    if (status == KT_OK)
        status = check_max_step(run, error);
    return status == KT_OK ? check_run_tolerances(run, error) : status;
}

unsigned kt_run_record(const kt_run *run, const kt_model *model) {
    if (!run || !model)
        return 0;
    if (run->record != KT_RECORD_DEFAULT)
        return run->record;
    unsigned constraint = kt_loop_count(model) > 0 ? KT_RECORD_CONSTRAINT : 0U;
    const unsigned states = model->n.x > 0 ? KT_RECORD_STATE : 0U;
    return KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ENERGY | constraint | states;
}

const char *kt_metric_name(kt_metric metric) {
    static const char *const names[] = {KT_METRIC_LIST(KT_LISTED_NAME)};
    return (size_t)metric < sizeof names / sizeof *names ? names[metric] : NULL;
}

const char *kt_plan_name(kt_plan plan) {
    static const char *const names[] = {KT_PLAN_LIST(KT_LISTED_NAME)};
    return (unsigned)plan < KT_PLAN_COUNT ? names[plan] : NULL;
}

const char *kt_record_name(unsigned bit) {
#define KT_RECORD_IF(id, value, name)                                                                                  \
    if (bit == (value))                                                                                                \
        return #name;
    KT_RECORD_LIST(KT_RECORD_IF)
#undef KT_RECORD_IF
    return NULL;
}
