/* The settings of one method, from the coarsest usable setting to the setting at which further refinement gains
 * nothing.
 *
 * Fixed steps are the duration over whole numbers n, n_max, 2 n_max, 4 n_max, ... The first step follows from the
 * number of steps that dop853 took for the reference. The step is doubled while still usable, or halved until usable.
 * The error shows whether accuracy or stability prevents the next larger step: at order p, a step twice as large has
 * 2^p times the error. If that would still be a small error and the run fails nevertheless, the step has left the
 * method's stability region. The limit is then found by bisection. An adaptive method shows the same limit by a number
 * of steps that does not fall when the tolerance is loosened.
 *
 * Goals lie between the rungs. After the ladder, settings are refined next to each goal: between the loosest setting
 * from which on all tighter settings reach the goal, and the next looser setting. Thus fixed steps and tolerances are
 * compared at equal errors. Settings have few digits, so that a printed setting is exactly the setting of the run.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/accuracy.h"

#include <math.h>
#include <string.h>

static const double limit_ratio = 1.02; /* ratio to which a stability limit is found */
static const double ladder_part = 0.65; /* of a curve's time: the ladder; the rest is for the goals */
static const double goal_margin = 0.9;  /* of a goal: the error at which the next setting aims */
enum { GOAL_RUNS = 4, LATE_RUNS = 3 };  /* runs for one goal; runs in succession that took too long */

/* A curve under construction. */
typedef struct kt_ladder {
    kt_accuracy *study;
    kt_accuracy_curve *curve;
    kt_accuracy_point *points; /* of the curve, by decreasing setting */
    double deadline;
    bool late;  /* the last run took too long */
    int stalls; /* consecutive points at which the error has not fallen */
} kt_ladder;

static const kt_variant *variant_of(const kt_ladder *ladder) {
    return &ladder->study->results.variants[ladder->curve->variant];
}

static kt_status try_setting(kt_ladder *ladder, double setting, kt_accuracy_point *point, kt_error *error) {
    const kt_accuracy_curve *curve = ladder->curve;
    kt_accuracy *study = ladder->study;
    point->setting = setting;
    const kt_status status = kt_accuracy_try(study, study->models[curve->variant], study->absolutes[curve->variant],
                                             variant_of(ladder), curve->method, curve->adaptive, point, error);
    ladder->late = point->late;
    return status;
}

/* The number with so many digits that is nearest to x. */
static double round_to_digits(double x, int digits) {
    const double unit = pow(10.0, floor(log10(x)) - (digits - 1)), whole = floor(x / unit + 0.5);
    return unit < 1.0 ? whole / floor(1.0 / unit + 0.5) : whole * unit;
}

static bool is_over(const kt_ladder *ladder) {
    const kt_accuracy *study = ladder->study;
    return study->options.clock != NULL && kt_accuracy_now(study) > ladder->deadline;
}

/* Why there are no longer runs: the budget limits their number of evaluations, or run_evaluations does. */
static kt_accuracy_end end_of_long_runs(const kt_ladder *ladder) {
    return kt_accuracy_most(ladder->study) < (double)ladder->study->options.run_evaluations ? KT_ACCURACY_BUDGET
                                                                                            : KT_ACCURACY_LENGTH;
}

/* Inserts a point in the order of settings. */
static void keep_point(kt_ladder *ladder, const kt_accuracy_point *point) {
    kt_accuracy_curve *curve = ladder->curve;
    int i = curve->count;
    if (i == KT_ACCURACY_POINTS_MAX)
        return;
    for (; i > 0 && ladder->points[i - 1].setting < point->setting; i--)
        ladder->points[i] = ladder->points[i - 1];
    ladder->points[i] = *point;
    curve->count++;
}

/* Whether the method has no limit of stability on the real axis, like A-stable and L-stable methods. */
static bool damps_all(const kt_method *method) {
    kt_stability stability;
    if (strcmp(kt_method_family_name(method), "switching") == 0)
        return true; /* the curve continues with radau5 */
    return kt_method_is_implicit(method) && kt_stability_make(method, 2, &stability, NULL) == KT_OK &&
           kt_stability_real_limit(&stability) == HUGE_VAL;
}

/* ---- where to stop ----------------------------------------------------------------------------------------------- */

/* The least factor by which the error must fall for a further point to be worthwhile. */
static double least_fall(const kt_accuracy_curve *curve, double ratio) {
    const double order = curve->adaptive ? 1.0 : curve->method->order;
    return pow(ratio, 0.3 * order);
}

/* Whether the ladder ends after a point, and why. `before` may be NULL. */
static bool is_done(kt_ladder *ladder, const kt_accuracy_point *before, const kt_accuracy_point *point) {
    kt_accuracy_curve *curve = ladder->curve;
    kt_accuracy *study = ladder->study;
    if (!point->usable)
        return false;
    const bool small = point->error.judged < 1e-6 * kt_accuracy_amplitude(study);
    const bool fell = before == NULL || !before->usable || kt_accuracy_is_held(curve, before, point) ||
                      point->error.judged * least_fall(curve, before->setting / point->setting) <= before->error.judged;
    ladder->stalls = small && !fell ? ladder->stalls + 1 : 0;
    if (ladder->stalls >= (curve->adaptive ? 4 : 2)) /* tolerances are closer together, and errors less smooth */
        curve->end = point->believed ? KT_ACCURACY_FLOOR : KT_ACCURACY_REFERENCE;
    else if (!point->believed && before != NULL && !before->believed)
        curve->end = KT_ACCURACY_REFERENCE;
    else if (is_over(ladder))
        curve->end = KT_ACCURACY_BUDGET;
    else
        return false;
    return true;
}

/* Whether so many evaluations exceed those of one run. */
static bool is_too_long(const kt_ladder *ladder, double evaluations) {
    return evaluations > kt_accuracy_most(ladder->study);
}

/* ---- given settings ---------------------------------------------------------------------------------------------- */

/* Runs each given setting once. */
static kt_status try_all(kt_ladder *ladder, const double *settings, int count, kt_error *error) {
    kt_status status = KT_OK;
    for (int i = 0; i < count && status == KT_OK; i++) {
        kt_accuracy_point point;
        status = try_setting(ladder, settings[i], &point, error);
        if (status == KT_OK)
            keep_point(ladder, &point);
    }
    ladder->curve->end = KT_ACCURACY_LISTED;
    return status;
}

/* ---- fixed steps ------------------------------------------------------------------------------------------------- */

static double ladder_step_of(const kt_ladder *ladder, double steps) {
    return round_to_digits(ladder->study->results.duration / steps, 4);
}

/* Finds the stability limit between a step that is usable and one that is not. */
static kt_status bisect(kt_ladder *ladder, double good, double bad, kt_error *error) {
    kt_status status = KT_OK;
    while (bad > limit_ratio * good && status == KT_OK) {
        kt_accuracy_point point;
        const double step = round_to_digits(sqrt(good * bad), 4);
        status = try_setting(ladder, step, &point, error);
        *(point.usable ? &good : &bad) = step;
    }
    /* A method that damps fast modes at every step has no such limit: its Newton iteration or the motion fails. */
    if (!damps_all(ladder->curve->method))
        ladder->curve->stable_step = good;
    return status;
}

/* Finds the least usable number of steps among *steps times powers of two; *steps = 0: none. */
static kt_status find_coarsest(kt_ladder *ladder, double *steps, kt_accuracy_point *failed, kt_error *error) {
    kt_accuracy_point point;
    const int stages = ladder->curve->method->stages;
    kt_status status = try_setting(ladder, ladder_step_of(ladder, *steps), &point, error);
    const bool is_usable = point.usable;
    failed->setting = 0.0;
    while (status == KT_OK && is_usable && point.usable) {
        keep_point(ladder, &point);
        if (*steps < 2.0 || ladder->curve->count >= KT_ACCURACY_LADDER_MAX / 2)
            return KT_OK;
        *steps = floor(0.5 * *steps);
        status = try_setting(ladder, ladder_step_of(ladder, *steps), &point, error);
        if (!point.usable)
            *failed = point;
    }
    while (status == KT_OK && !is_usable && !point.usable) {
        *failed = point;
        *steps *= 2.0;
        if (ladder->late || is_over(ladder) || is_too_long(ladder, *steps * stages)) {
            ladder->curve->end = ladder->late || is_over(ladder) ? KT_ACCURACY_BUDGET : end_of_long_runs(ladder);
            *steps = 0.0;
            return KT_OK;
        }
        status = try_setting(ladder, ladder_step_of(ladder, *steps), &point, error);
    }
    if (status == KT_OK && !is_usable)
        keep_point(ladder, &point);
    return status;
}

/* Halves the step, point by point, until further points add nothing, or a run fails or takes too long. */
static kt_status refine(kt_ladder *ladder, kt_error *error) {
    kt_accuracy_curve *curve = ladder->curve;
    const kt_accuracy_point *points = ladder->points;
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK; i++) {
        if (i == curve->count) {
            const double step = round_to_digits(0.5 * points[i - 1].setting, 4);
            kt_accuracy_point point;
            if (curve->count >= KT_ACCURACY_LADDER_MAX ||
                is_too_long(ladder, ladder->study->results.duration / step * curve->method->stages)) {
                curve->end = end_of_long_runs(ladder);
                return KT_OK;
            }
            status = try_setting(ladder, step, &point, error);
            if (status == KT_OK && point.status != KT_OK) {
                curve->end = point.late ? KT_ACCURACY_BUDGET : KT_ACCURACY_FAILED;
                return KT_OK;
            }
            if (status == KT_OK)
                keep_point(ladder, &point);
        }
        if (status == KT_OK && is_done(ladder, i > 0 ? &points[i - 1] : NULL, &points[i])) {
            curve->count = i + 1; /* finer points were computed by find_coarsest and add nothing */
            return KT_OK;
        }
    }
    return status;
}

/* The curve of a method with fixed steps: finds the coarsest step that works, searches between this step and the
 * longer one that failed if the error may still be usable there, and refines. */
static kt_status climb_steps(kt_ladder *ladder, kt_error *error) {
    kt_accuracy *study = ladder->study;
    kt_accuracy_point failed;
    double steps = fmax(4.0, ceil(study->reference_steps * study->results.duration));
    kt_status status = find_coarsest(ladder, &steps, &failed, error);
    if (status != KT_OK)
        return status;
    if (ladder->curve->count == 0) {
        if (ladder->curve->end == KT_ACCURACY_LISTED)
            ladder->curve->end = KT_ACCURACY_UNUSABLE;
        return KT_OK;
    }
    const kt_accuracy_point *coarsest = &ladder->points[0];
    /* e_failed = e_coarsest (h_failed / h_coarsest)^(p + 2): higher terms than h^p count at the longest steps. */
    const double error_of_failed =
        coarsest->error.judged * pow(failed.setting / coarsest->setting, ladder->curve->method->order + 2);
    if (failed.setting > 0.0 && error_of_failed < KT_ACCURACY_USABLE * kt_accuracy_amplitude(study))
        status = bisect(ladder, ladder->points[0].setting, failed.setting, error);
    return status == KT_OK ? refine(ladder, error) : status;
}

/* ---- tolerances -------------------------------------------------------------------------------------------------- */

/* The mean step at which a looser tolerance saves no steps although the error would allow longer steps. */
static void find_held_step(kt_ladder *ladder) {
    kt_accuracy_curve *curve = ladder->curve;
    for (int i = 0; i + 1 < curve->count; i++) {
        const kt_accuracy_point *loose = &ladder->points[i], *tight = &ladder->points[i + 1];
        if (loose->usable && tight->usable && loose->counts.steps >= 50 && kt_accuracy_is_held(curve, loose, tight)) {
            curve->stable_step = ladder->study->results.duration / (double)loose->counts.steps;
            return;
        }
    }
}

/* Whether 20 more points would take longer than the time left for this curve. */
static bool is_costly(const kt_ladder *ladder, const kt_accuracy_point *point, double started) {
    kt_accuracy *study = ladder->study;
    if (study->options.clock == NULL || isnan(point->cpu))
        return false;
    const double now = kt_accuracy_now(study), spent = now - started;
    return 20.0 * fmax(point->cpu, spent / ladder->curve->count) > ladder->deadline - now;
}

/* Tolerances by half decades, or by whole decades where runs are long. */
static kt_status climb_tolerances(kt_ladder *ladder, kt_error *error) {
    static const double mantissas[] = {1.0, 0.3};
    kt_accuracy_curve *curve = ladder->curve;
    kt_status status = KT_OK;
    curve->end = KT_ACCURACY_LISTED;
    const double started = kt_accuracy_now(ladder->study);
    int stride = 1, late = 0;
    for (int i = 4; i < 28 && status == KT_OK; i += stride) { /* 1e-2, 3e-3, ... 3e-14 */
        const int decade = i / 2;
        kt_accuracy_point point;
        const kt_accuracy_point before = curve->count > 0 ? ladder->points[curve->count - 1] : (kt_accuracy_point){0};
        const double tolerance = round_to_digits(mantissas[i % 2] * pow(10.0, -decade), 1);
        if (before.usable &&
            is_too_long(ladder, (double)before.counts.evaluations * pow(3.3, 1.0 / curve->method->order))) {
            curve->end = end_of_long_runs(ladder);
            break;
        }
        status = try_setting(ladder, tolerance, &point, error);
        late = point.late ? late + 1 : 0;
        if (late == LATE_RUNS || (!point.usable && is_over(ladder))) {
            curve->end = KT_ACCURACY_BUDGET;
            break;
        }
        if (status != KT_OK || (!point.usable && curve->count == 0))
            continue;
        keep_point(ladder, &point);
        if (!point.usable && point.status != KT_OK) { /* the step became too small or the run too long */
            curve->end = point.late ? KT_ACCURACY_BUDGET : KT_ACCURACY_FAILED;
            break;
        }
        if (is_done(ladder, before.usable ? &before : NULL, &point))
            break;
        if (i % 2 == 0)
            stride = is_costly(ladder, &point, started) ? 2 : 1;
    }
    if (curve->count == 0 && curve->end == KT_ACCURACY_LISTED)
        curve->end = KT_ACCURACY_UNUSABLE;
    if (!damps_all(curve->method))
        find_held_step(ladder);
    return status;
}

/* ---- goals ------------------------------------------------------------------------------------------------------- */

/* The loosest point from which on all tighter points that ran to the end reach the goal; -1: none. */
static int loosest_for_goal(const kt_ladder *ladder, double goal) {
    int found = -1;
    for (int i = ladder->curve->count - 1; i >= 0; i--) {
        const kt_accuracy_point *point = &ladder->points[i];
        if (point->status != KT_OK)
            continue;
        if (!point->usable || !(kt_accuracy_known(ladder->study, point) <= goal))
            break;
        found = i;
    }
    return found;
}

/* A setting between two points at which the error should just be below the goal; 0: no setting lies between both. */
static double setting_for_goal(const kt_ladder *ladder, const kt_accuracy_point *loose, const kt_accuracy_point *tight,
                               double goal) {
    const double ratio = loose->setting / tight->setting;
    const int digits = ladder->curve->adaptive ? 2 : 4;
    double part = 0.5; /* of the logarithm of the ratio */
    if (ratio < (ladder->curve->adaptive ? 1.2 : 1.03))
        return 0.0;
    if (loose->usable && loose->error.judged > tight->error.judged)
        part = log(goal_margin * goal / tight->error.judged) / log(loose->error.judged / tight->error.judged);
    part = fmin(fmax(part, 0.08), 0.92);
    const double setting = round_to_digits(tight->setting * pow(ratio, part), digits);
    return setting > tight->setting * (1.0 + 1e-9) && setting < loose->setting * (1.0 - 1e-9) ? setting : 0.0;
}

/* Each new point lies between the loosest point that reaches the goal and the next looser point, and narrows this
 * interval. */
static kt_status refine_goal(kt_ladder *ladder, double goal, kt_error *error) {
    for (int run = 0; run < GOAL_RUNS && !is_over(ladder) && ladder->curve->count < KT_ACCURACY_POINTS_MAX; run++) {
        kt_accuracy_point point;
        const int found = loosest_for_goal(ladder, goal);
        const double setting =
            found > 0 ? setting_for_goal(ladder, &ladder->points[found - 1], &ladder->points[found], goal) : 0.0;
        if (setting == 0.0)
            return KT_OK;
        const kt_status status = try_setting(ladder, setting, &point, error);
        if (status != KT_OK)
            return status;
        keep_point(ladder, &point);
    }
    return KT_OK;
}

kt_status kt_accuracy_climb(kt_accuracy *study, kt_accuracy_curve *curve, double deadline, kt_error *error) {
    const kt_accuracy_options *options = &study->options;
    const double now = kt_accuracy_now(study);
    const bool listed = (curve->adaptive ? options->tolerances : options->steps) != NULL;
    kt_ladder ladder = {.study = study, .curve = curve, .points = study->points + curve->first};
    kt_status status;
    ladder.deadline = options->goal_count > 0 ? now + ladder_part * (deadline - now) : deadline;
    curve->end = KT_ACCURACY_LISTED;
    if (curve->adaptive)
        status = options->tolerances != NULL ? try_all(&ladder, options->tolerances, options->tolerance_count, error)
                                             : climb_tolerances(&ladder, error);
    else
        status = options->steps != NULL ? try_all(&ladder, options->steps, options->step_count, error)
                                        : climb_steps(&ladder, error);
    if (status == KT_OK)
        kt_accuracy_fit(study, curve);
    ladder.deadline = deadline;
    for (int g = 0; g < options->goal_count && status == KT_OK && !listed; g++)
        status = refine_goal(&ladder, options->goals[g], error);
    return status;
}
