/* One accepted step.
 *
 * All decisions are made in local variables and in scratch. The time, the grid and the pointers to the states change
 * only in commit_try(), after which nothing can fail. Therefore a failed step needs no undoing. Only counts and the
 * measure of progress (`advanced`, `window`, `slow`) also change in tries that fail.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/finite.h"
#include "base/where.h"
#include "integrator/integrator.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- where to ---------------------------------------------------------------------------------------------------- */

static kt_status report_lost(const kt_integrator *it, const char *what, double h, kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                        "%s %g is lost in the rounding of the time; take a larger one, or start nearer to 0", what, h);
}

/* Fixed step: to the next point t0 + k h of the grid, or to t_limit if that comes first. A whole step is h itself and
 * not the difference of two rounded times. Autonomous problems therefore give the same bits for every start time. */
static kt_status plan_fixed(const kt_integrator *it, double t_limit, kt_plan_of_try *p, kt_error *error) {
    const kt_integrator_memory *m = &it->memory;
    const double h = it->options.step, direction = t_limit > m->t ? 1.0 : -1.0;
    const int64_t next = direction > 0.0 ? m->grid + 1 : m->grid - (m->on_grid ? 1 : 0);
    double end = m->origin + (double)next * h;
    const double rounding = 8.0 * DBL_EPSILON * fmax(fabs(m->origin), fabs(end));
    const double beyond = direction * (end - t_limit);

    p->on_grid = beyond <= rounding;
    if (beyond >= -rounding)
        end = t_limit;
    p->grid = p->on_grid ? next : next - (direction > 0.0 ? 1 : 0);
    p->interval.h = p->on_grid && m->on_grid ? direction * h : end - m->t;
    p->interval.end = end;
    if (h > 2.0 * rounding && direction * (end - m->t) > 0.0)
        return KT_OK;
    return report_lost(it, "the step", h, error);
}

/* Adaptive: |h| from t is the proposed size if t_limit leaves room for two such steps. With less room, |h| is half the
 * rest, or the rest. */
static void plan_adaptive(const kt_integrator *it, double t_limit, double proposed, kt_plan_of_try *p) {
    const double t = it->memory.t, left = fabs(t_limit - t), direction = t_limit > t ? 1.0 : -1.0;
    p->proposed = proposed;
    p->clipped = proposed > left || 2.0 * proposed > left;
    if (proposed >= left)
        p->interval.end = t_limit;
    else
        p->interval.end = t + direction * (p->clipped ? 0.5 * left : proposed);
    p->interval.h = p->interval.end - t;
    p->clipped = p->clipped && fabs(p->interval.h) < proposed;
}

/* ---- one step ---------------------------------------------------------------------------------------------------- */

/* Puts f(t, y) into slot 0 unless the slot has it already (after a step it may be in `fresh`), and prepares the
 * family. */
static kt_try_result prepare_attempt(kt_integrator *it, kt_try *result) {
    result->result = KT_TRY_PASSED;
    it->stages_known = false;
    it->dense_known = false;
    if (it->derivative_slot == (int)it->fresh) {
        double *k = it->k[0];
        it->k[0] = it->k[it->fresh];
        it->k[it->fresh] = k;
        it->derivative_slot = 0;
    }
    if (it->derivative_slot < 0 && kt_evaluate(it, it->memory.t, it->y, 0, result) == KT_TRY_PASSED)
        it->derivative_slot = 0;
    if (result->result == KT_TRY_PASSED && it->family->prepare != NULL)
        return it->family->prepare(it, false, result);
    return result->result;
}

kt_try_result kt_try_check(kt_integrator *it, const kt_interval *in, kt_try *result) {
    if (!kt_all_finite(it->trial, it->sizes.n)) {
        result->component = kt_first_not_finite(it->trial, it->sizes.n);
        return kt_try_fail(result, KT_TRY_NOT_FINITE, "the new state", in->end);
    }
    if (it->options.step > 0.0)
        return KT_TRY_PASSED;
    return kt_try_check_error(in, it->family->error(it, in->h), result);
}

kt_try_result kt_try_check_error(const kt_interval *in, double error, kt_try *result) {
    assert(!(error < 0.0));
    result->error = error;
    if (error <= 1.0) /* false for an estimate that overflowed */
        return KT_TRY_PASSED;
    return kt_try_fail(result, KT_TRY_INACCURATE, "the error estimate", in->end);
}

/* Whether the estimated error of each component is that of a time within the instant in which slopes jump. */
static bool estimate_is_rounding_of_time(const kt_integrator *it, double h) {
    const double instant = it->noise->instant(it->memory.t, it->callbacks.user);
    bool all = fabs(h) <= instant;
    for (size_t i = 0; all && i < it->counted; i++)
        all = fabs(it->family->error_at(it, h, i)) <=
              fmax(kt_error_scale(it, i, it->y[i], it->trial[i]), instant * fabs(it->k[0][i]));
    return all;
}

/* Whether the error estimate of a try is made of errors of the slopes, or of the time, which no shorter step lowers. */
static bool estimate_is_noise(const kt_integrator *it, double h, const kt_try *r) {
    const kt_integrator_options *o = &it->options;
    return it->noise != NULL && r->result == KT_TRY_INACCURATE &&
           (r->error * fmax(o->relative_tolerance, o->absolute_tolerance) <=
                it->noise->within(fabs(h), it->callbacks.user) ||
            estimate_is_rounding_of_time(it, h));
}

/* Applies the caller's projection, if any, to the trial state. */
static kt_try_result project_trial(kt_integrator *it, double t, bool *changed, kt_try *result) {
    *changed = true;
    const int code = it->callbacks.project(t, it->trial, changed, it->callbacks.user);
    if (code != 0)
        return kt_try_called(result, code, "the projection", t);
    if (*changed && !kt_all_finite(it->trial, it->sizes.n)) {
        result->component = kt_first_not_finite(it->trial, it->sizes.n);
        return kt_try_fail(result, KT_TRY_NOT_FINITE, "the projected state", t);
    }
    return KT_TRY_PASSED;
}

static const char advice_on_fixed[] = "the step is fixed: take a smaller one, or a method with error control";

/* Makes the try the last step. The slope at its end belongs to the new state only if the projection has not changed
 * that state; otherwise derivative_slot is -1, and the next step evaluates the slope again. */
static void commit_try(kt_integrator *it, const kt_plan_of_try *p, bool changed, double next_step, double error) {
    kt_integrator_memory *m = &it->memory;
    double *spare = it->previous_y;
    it->previous_y = it->y;
    it->y = it->trial;
    it->trial = spare;
    it->stages_known = true;
    it->derivative_slot = it->gives_end_derivative && !changed ? (int)it->fresh : -1;

    m->previous_t = m->t;
    m->t = p->interval.end;
    m->last_step = p->interval.h;
    m->has_previous = true;
    m->grid = p->grid;
    m->on_grid = p->on_grid;
    m->next_step = next_step;
    m->last_error = error;
    m->advanced += fabs(p->interval.h);
    m->counts.steps++;
    if (it->family->accept != NULL)
        it->family->accept(it);
}

/* Whether the present call may make another try (kt_integrator_limit_call). The first step of a call may make as many
 * tries as necessary, because an event that needs more tries than the limit would fail in every call. */
static kt_status count_try(kt_integrator *it, kt_error *error) {
    const uint64_t tries = it->memory.counts.steps + it->memory.counts.rejected;
    if (it->tries_end == 0 || tries < it->tries_end || it->memory.t == it->call_began)
        return KT_OK;
    it->used_up = true;
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                        "the %.0f steps of a call are used up", (double)it->tries_in_call);
}

/* ---- adaptive ---------------------------------------------------------------------------------------------------- */

static kt_status report_steps_used_up(const kt_integrator *it, kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                        "max_steps = %.0f are used up; allow more, or loosen the tolerances",
                        (double)it->options.max_steps);
}

static const char advice_on_model[] =
    "Check the model there: a position it cannot reach, a singular one, or a pole of a force";
/* The advice for a method that solves Newton's equations names no other such method, and no advice names a method that
 * is not built. */
#define ADVICE_ON_MOTION "Look for a jump or a pole of a force here; if the motion is smooth, loosen the tolerances"
static const char *advice_on_motion(const kt_integrator *it) {
    if (!kt_method_needs_newton(it->method))
        return ADVICE_ON_MOTION "; if it is stiff, by a strong damper or a light body on a hard spring, take radau5";
    (void)it;
    return ADVICE_ON_MOTION;
}

/* |error estimate| of a component over its tolerance, for the last try of the step h. */
static double component_error_of(const kt_integrator *it, double h, size_t i) {
    return fabs(it->family->error_at(it, h, i)) / kt_error_scale(it, i, it->y[i], it->trial[i]);
}

static double worst_quadrature(const kt_integrator *it, double h) {
    double worst = 0.0;
    for (size_t i = it->counted; i < it->sizes.n; i++)
        worst = fmax(worst, component_error_of(it, h, i));
    return worst;
}

/* The component with the largest part in the error estimate of the last try of the step h. */
static size_t worst_component(const kt_integrator *it, double h) {
    size_t worst = it->sizes.n;
    double most = 0.0;
    for (size_t i = 0; i < it->counted; i++) {
        const double u = component_error_of(it, h, i);
        if (u > most) {
            most = u;
            worst = i;
        }
    }
    return worst;
}

static bool is_of_error(const kt_try *r) {
    return r->result == KT_TRY_PASSED || r->result == KT_TRY_INACCURATE || r->result == KT_TRY_DIVERGED;
}

/* Stores the component that caused a step to fail: the component that is not finite or has the largest error. */
static void blame_component(kt_integrator *it, const kt_try *r, double h) {
    if (r->result == KT_TRY_NOT_FINITE)
        it->blamed = r->component;
    else if (is_of_error(r) && r->result != KT_TRY_DIVERGED)
        it->blamed = worst_component(it, h);
}

/* Reports that the step became shorter than h, the least length, and why the last try failed. */
static kt_status report_too_small(const kt_integrator *it, double h, const kt_try *r, kt_error *error) {
    char reason[160];
    if (r->result == KT_TRY_NOT_FINITE)
        snprintf(reason, sizeof reason, "component %lu of %s was not finite at t = %.17g", (unsigned long)r->component,
                 r->what, r->t);
    else if (r->result == KT_TRY_RECOVERABLE)
        snprintf(reason, sizeof reason, "%s could not be computed at t = %.17g (code %d)", r->what, r->t, r->code);
    else if (r->result == KT_TRY_DIVERGED)
        snprintf(reason, sizeof reason, "Newton's iteration did not converge");
    else
        snprintf(reason, sizeof reason, "the error estimate was still %.3g times the tolerance", r->error);
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                        "a step below %.3g would be needed: %s. %s", h, reason,
                        is_of_error(r) ? advice_on_motion(it) : advice_on_model);
}

/* Progress. Even accepted steps may make no progress. Near a point at which velocities grow without bound, steps shrink
 * with the distance to the point. If forces jump back and forth, or are not accurate enough, steps remain as short as
 * one jump allows.
 *
 * Progress is therefore checked every KT_PROGRESS_TRIES tries, accepted or not. The average advance of a try must be
 * KT_PROGRESS of the time. In at least one of KT_PROGRESS_WINDOWS windows, the average advance must be
 * KT_PROGRESS_LASTING. A run that would need more than 1 / KT_PROGRESS tries counts as stuck at once. A run that would
 * need a tenth of this number counts as stuck unless the run becomes faster. */
static double time_scale(const kt_integrator *it, double t_limit) {
    return fmax(fmax(fabs(it->memory.t), fabs(it->until)), isfinite(t_limit) ? fabs(t_limit) : 0.0);
}

/* The time with which progress is compared. An event may end the motion long before t_limit. */
static double progress_scale(const kt_integrator *it, double t_limit) {
    const double scale = time_scale(it, t_limit);
    return it->may_end_early ? fmax(fabs(it->memory.t), fmin(scale, KT_PROGRESS_OPEN)) : scale;
}

/* Whether the window of tries that the present try completes made too little progress. If so, `advanced` remains for
 * the report; otherwise a new window begins. */
static bool is_stuck(kt_integrator *it, double t_limit) {
    kt_integrator_memory *m = &it->memory;
    const uint64_t tries = m->counts.steps + m->counts.rejected + 1;
    if (tries - m->window < KT_PROGRESS_TRIES)
        return false;
    const double time = KT_PROGRESS_TRIES * progress_scale(it, t_limit);
    m->slow = m->advanced < KT_PROGRESS_LASTING * time ? m->slow + 1 : 0;
    const bool stuck = m->advanced < KT_PROGRESS * time || m->slow >= KT_PROGRESS_WINDOWS;
    if (!stuck)
        m->advanced = 0.0;
    m->window = tries;
    return stuck;
}

/* Whether a motion counts as stuck only because the end of the run is too far. With an event that may end the run, such
 * a motion does not count as stuck. */
static bool ends_too_late(const kt_integrator *it) {
    const double time = KT_PROGRESS_TRIES * fmax(fabs(it->memory.t), KT_PROGRESS_OPEN);
    return it->memory.advanced >= KT_PROGRESS_LASTING * time;
}

/* Reports a motion that makes no progress. A new window of progress begins, so that the caller may go on. The last try
 * is not committed even if its error is small, and therefore counts as rejected. */
static kt_status report_stuck(kt_integrator *it, double t_limit, double h, const kt_try *r, kt_error *error) {
    char rest[80] = "";
    const bool late = ends_too_late(it);
    const double advanced = it->memory.advanced, left = fmax(fabs(t_limit - it->memory.t), it->until - it->memory.t);
    if (advanced > 0.0 && isfinite(left))
        snprintf(rest, sizeof rest, ", and %.2g more would be needed", left / advanced * KT_PROGRESS_TRIES);
    it->memory.advanced = 0.0;
    it->memory.slow = 0;
    it->memory.counts.rejected++;
    if (late)
        return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                            "the last %d tries of a step have advanced the time by %.3g in all%s: the run is too long "
                            "for steps of this length. Loosen the tolerances, or end the run earlier",
                            KT_PROGRESS_TRIES, advanced, rest);
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                        "the last %d tries of a step have advanced the time by %.3g in all, the last one was of "
                        "%.3g%s: the motion makes no progress. %s%s",
                        KT_PROGRESS_TRIES, advanced, fabs(h), rest,
                        is_of_error(r) ? advice_on_motion(it) : advice_on_model,
                        is_of_error(r) && isfinite(left) ? ", or end the run earlier" : "");
}

/* Whether the tolerances are below the state's own rounding, for every step size. The error estimate of a step is then
 * rounding, and steps shrink until a run would never end. (CVODE's test for too much accuracy.) */
static bool is_beyond_rounding(const kt_integrator *it) { return DBL_EPSILON * kt_scaled_norm(it, it->y, NULL) > 1.0; }

static kt_status report_beyond_rounding(const kt_integrator *it, kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
                        "the tolerances (relative %g, absolute %g) are %.3g times below the rounding of the "
                        "state; loosen them",
                        it->options.relative_tolerance, it->options.absolute_tolerance,
                        DBL_EPSILON * kt_scaled_norm(it, it->y, NULL));
}

/* The longest step that the family can take now. */
static double longest_family_step(const kt_integrator *it) {
    return it->family->longest_step != NULL ? it->family->longest_step(it) : HUGE_VAL;
}

/* The first proposal of a step, and the least |h| that may be tried. */
static kt_status choose_first(kt_integrator *it, double t_limit, double *proposed, double *least, kt_error *error) {
    const kt_integrator_options *o = &it->options;
    const double t = it->memory.t, left = fabs(t_limit - t);
    const double most = fmin(o->max_step > 0.0 ? o->max_step : HUGE_VAL, longest_family_step(it));
    double h = it->memory.next_step;
    if (o->max_step > 0.0 && o->max_step <= 16.0 * DBL_EPSILON * time_scale(it, t_limit))
        return report_lost(it, "max_step", o->max_step, error);
    if (h == 0.0) {
        kt_try r;
        if (is_beyond_rounding(it))
            return report_beyond_rounding(it, error);
        h = kt_control_initial(it, t_limit > t ? 1.0 : -1.0, left < most ? left : most, &r);
        if (h == 0.0)
            return kt_try_report(it, &r, "", error);
    }
    h = h < most ? h : most;
    *least = fmax(o->min_step, 16.0 * DBL_EPSILON * fmax(fabs(t), h < left ? h : left));
    *least = fmax(*least, DBL_TRUE_MIN); /* the product is 0 for h near it, and a step of 0 never ends */
    *proposed = h > *least ? h : *least;
    return KT_OK;
}

/* The next proposal after an accepted step. A step cut short by t_limit whose error is too small to be informative
 * leaves the proposal and the control's memory unchanged. retried: a longer try of this step was rejected, so that the
 * next step is not longer either. */
static double propose_after_step(const kt_integrator *it, const kt_plan_of_try *p, bool retried, const kt_try *r,
                                 double *control_error) {
    const double h = fabs(p->interval.h), error = r->error;
    const double factor = r->growth > 0.0               ? r->growth
                          : it->family->control != NULL ? it->family->control(it, h, error)
                                                        : kt_control_accepted(it, error);
    *control_error = it->memory.control_error;
    if (p->clipped && factor >= it->options.factor_max)
        return h * factor > p->proposed ? h * factor : p->proposed;
    *control_error = error > KT_CONTROL_ERROR_FLOOR ? error : KT_CONTROL_ERROR_FLOOR;
    return h * (retried && factor > 1.0 ? 1.0 : factor);
}

/* Plans the next try from a->proposed, within the steps that the caller permits. */
static kt_status plan_next(kt_integrator *it, kt_attempt *a, kt_error *error) {
    const kt_integrator_options *o = &it->options;
    if (o->max_steps > 0 && it->memory.counts.steps + it->memory.counts.rejected >= o->max_steps)
        return report_steps_used_up(it, error);
    a->plan = (kt_plan_of_try){.interval = {.t = it->memory.t, .y = it->y}};
    plan_adaptive(it, a->t_limit, a->proposed, &a->plan);
    if (isfinite(a->plan.interval.h))
        return KT_OK;
    return kt_error_set(
        error, KT_ERROR_STEP, kt_where_format("t = %.17g", it->memory.t).text,
        "nothing limits the next step, which leads beyond the largest number: give t_limit or max_step");
}

static kt_status begin_adaptive(kt_integrator *it, kt_attempt *a, kt_error *error) {
    kt_try r;
    if (prepare_attempt(it, &r) != KT_TRY_PASSED)
        return kt_try_report(it, &r, "the motion cannot continue from this state: check the model here", error);
    const kt_status status = choose_first(it, a->t_limit, &a->proposed, &a->least, error);
    if (status != KT_OK)
        return status;
    if (it->noise != NULL)
        it->noise->begin(it->callbacks.user);
    return plan_next(it, a, error);
}

/* Plans the next try after a failed one, with another length. */
static kt_status shorten_try(kt_integrator *it, kt_attempt *a, const kt_try *failed, kt_error *error) {
    kt_try r;
    if (failed->result == KT_TRY_STOPPED || failed->result == KT_TRY_TOO_LONG)
        return kt_try_report(it, failed, "", error);
    it->memory.counts.rejected++;
    if (failed->result == KT_TRY_INACCURATE && is_beyond_rounding(it))
        return report_beyond_rounding(it, error);
    a->proposed =
        fabs(a->plan.interval.h) * (failed->result == KT_TRY_INACCURATE ? kt_control_rejected(it, failed->error)
                                    : failed->result == KT_TRY_DIVERGED ? failed->factor
                                                                        : it->options.factor_min);
    if (it->family->prepare != NULL && it->family->prepare(it, true, &r) != KT_TRY_PASSED)
        return kt_try_report(it, &r, "", error);
    a->proposed = fmin(a->proposed, longest_family_step(it));
    a->retried = true;
    if (a->proposed < a->least)
        return report_too_small(it, a->least, failed, error);
    const kt_status status = count_try(it, error);
    return status == KT_OK ? plan_next(it, a, error) : status;
}

/* Accepts the step, or plans a shorter step. */
static kt_status end_adaptive(kt_integrator *it, kt_attempt *a, kt_try *r, bool *again, kt_error *error) {
    const kt_plan_of_try *p = &a->plan;
    bool changed = false;
    const bool passed =
        (r->result == KT_TRY_PASSED || estimate_is_noise(it, p->interval.h, r)) &&
        (it->callbacks.project == NULL || project_trial(it, p->interval.end, &changed, r) == KT_TRY_PASSED);
    const bool stuck = r->result != KT_TRY_STOPPED && is_stuck(it, a->t_limit);
    if ((stuck && !ends_too_late(it)) || !passed)
        blame_component(it, r, p->interval.h);
    if (stuck)
        return report_stuck(it, a->t_limit, p->interval.h, r, error);
    *again = !passed;
    if (!passed)
        return shorten_try(it, a, r, error);
    double control_error = it->memory.control_error, next = fabs(p->interval.h);
    it->quadrature_error = worst_quadrature(it, p->interval.h);
    if (r->error <= 1.0) /* the noise of a try is no information about the next step */
        next = propose_after_step(it, p, a->retried, r, &control_error);
    commit_try(it, p, changed, next, r->error);
    it->memory.control_error = control_error;
    return KT_OK;
}

double kt_integrator_quadrature_error(const kt_integrator *it) { return it->quadrature_error; }

void kt_integrator_put_quadratures(kt_integrator *it, const double *values) {
    memcpy(it->y + it->counted, values, (it->sizes.n - it->counted) * sizeof *values);
}

size_t kt_integrator_blamed(const kt_integrator *it) { return it->blamed; }

/* ---- a step in parts --------------------------------------------------------------------------------------------- */

kt_status kt_attempt_begin(kt_integrator *it, double t_limit, kt_attempt *a, kt_error *error) {
    assert(t_limit != it->memory.t);
    it->blamed = it->sizes.n;
    *a = (kt_attempt){.t_limit = t_limit, .plan = {.interval = {.t = it->memory.t, .y = it->y}}};
    kt_status status = it->tries_end > 0 ? count_try(it, error) : KT_OK;
    if (status != KT_OK)
        return status;
    if (!(it->options.step > 0.0))
        return begin_adaptive(it, a, error);
    kt_try r;
    status = plan_fixed(it, t_limit, &a->plan, error);
    if (status != KT_OK)
        return status;
    return prepare_attempt(it, &r) == KT_TRY_PASSED ? KT_OK : kt_try_report(it, &r, advice_on_fixed, error);
}

kt_status kt_attempt_end(kt_integrator *it, kt_attempt *a, kt_try *r, bool *again, kt_error *error) {
    *again = false;
    if (!(it->options.step > 0.0))
        return end_adaptive(it, a, r, again, error);
    bool changed = false;
    if (r->result != KT_TRY_PASSED ||
        (it->callbacks.project != NULL && project_trial(it, a->plan.interval.end, &changed, r) != KT_TRY_PASSED))
        return kt_try_report(it, r, advice_on_fixed, error);
    commit_try(it, &a->plan, changed, it->memory.next_step, (double)NAN);
    return KT_OK;
}

kt_status kt_integrator_take_step(kt_integrator *it, double t_limit, kt_error *error) {
    if (isnan(t_limit) || t_limit == it->memory.t)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_step",
                            "t_limit is %s; it must lie before or behind the current time, or be infinite",
                            isnan(t_limit) ? "NaN" : "the current time");
    kt_attempt a;
    kt_status status = kt_attempt_begin(it, t_limit, &a, error);
    for (bool again = true; status == KT_OK && again;) {
        kt_try r = {.result = KT_TRY_PASSED};
        if (it->family->try_step(it, &a.plan.interval, &r) == KT_TRY_PASSED)
            (void)kt_try_check(it, &a.plan.interval, &r);
        status = kt_attempt_end(it, &a, &r, &again, error);
    }
    return status;
}

kt_status kt_integrator_step(kt_integrator *it, double t_limit, kt_error *error) {
    if (KT_IS_MISSING(error, it))
        return KT_ERROR_ARGUMENT;
    if (!it->started)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_integrator_step", "call kt_integrator_start first");
    return kt_integrator_take_step(it, t_limit, error);
}
