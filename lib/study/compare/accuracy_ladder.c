/* The settings of one method, from the coarsest that is usable to where further refinement gains nothing.
 *
 * Fixed steps are the duration over whole numbers n, n_max, 2 n_max, 4 n_max, ... The first step follows from the
 * number of steps that dop853 took for the reference. It is doubled while it is usable, or halved until it is. The
 * error shows whether accuracy or stability prevents the next larger step: at order p, a step twice as large has 2^p
 * times the error. If that would still be a small error and the run fails nevertheless, the step has left the method's
 * stability region. The limit is then found by bisection. An adaptive method shows the same limit by a number of steps
 * that does not fall when the tolerance is loosened.
 */
#include "compare/accuracy.h"

#include <math.h>

static const double limit_ratio = 1.02; /* ratio to which a stability limit is found */

/* A curve under construction. */
typedef struct kt_ladder {
    kt_accuracy *study;
    kt_accuracy_curve *curve;
    kt_accuracy_point *points; /* of the curve, by decreasing setting */
    double deadline;
    int stalls; /* consecutive points at which the error has not fallen */
} kt_ladder;

static const kt_variant *variant_of(const kt_ladder *ladder) {
    return &ladder->study->results.variants[ladder->curve->variant];
}

static kt_status try_setting(const kt_ladder *ladder, double setting, kt_accuracy_point *point, kt_error *error) {
    const kt_accuracy_curve *curve = ladder->curve;
    kt_accuracy *study = ladder->study;
    point->setting = setting;
    return kt_accuracy_try(study, study->models[curve->variant], study->absolutes[curve->variant], variant_of(ladder),
                           curve->method, curve->adaptive, point, error);
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
    else if (study->options.clock != NULL && kt_accuracy_now(study) > ladder->deadline)
        curve->end = KT_ACCURACY_BUDGET;
    else
        return false;
    return true;
}

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

static double ladder_step_of(const kt_ladder *ladder, double steps) { return ladder->study->results.duration / steps; }

/* Finds the stability limit between a step that is usable and one that is not. */
static kt_status bisect(kt_ladder *ladder, double good, double bad, kt_error *error) {
    kt_status status = KT_OK;
    while (bad > limit_ratio * good && status == KT_OK) {
        kt_accuracy_point point;
        const double step = sqrt(good * bad);
        status = try_setting(ladder, step, &point, error);
        *(point.usable ? &good : &bad) = step;
    }
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
        if (*steps < 2.0 || ladder->curve->count == KT_ACCURACY_POINTS_MAX / 2)
            return KT_OK;
        *steps = floor(0.5 * *steps);
        status = try_setting(ladder, ladder_step_of(ladder, *steps), &point, error);
        if (!point.usable)
            *failed = point;
    }
    while (status == KT_OK && !is_usable && !point.usable) {
        *failed = point;
        *steps *= 2.0;
        if (is_too_long(ladder, *steps * stages)) {
            *steps = 0.0;
            return KT_OK;
        }
        status = try_setting(ladder, ladder_step_of(ladder, *steps), &point, error);
    }
    if (status == KT_OK && !is_usable)
        keep_point(ladder, &point);
    return status;
}

static kt_status refine(kt_ladder *ladder, kt_error *error) {
    kt_accuracy_curve *curve = ladder->curve;
    const kt_accuracy_point *points = ladder->points;
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK; i++) {
        if (i == curve->count) {
            const double step = 0.5 * points[i - 1].setting;
            kt_accuracy_point point;
            if (curve->count == KT_ACCURACY_POINTS_MAX ||
                is_too_long(ladder, ladder->study->results.duration / step * curve->method->stages)) {
                curve->end = KT_ACCURACY_LENGTH;
                return KT_OK;
            }
            status = try_setting(ladder, step, &point, error);
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

static kt_status climb_steps(kt_ladder *ladder, kt_error *error) {
    kt_accuracy *study = ladder->study;
    kt_accuracy_point failed;
    double steps = fmax(4.0, ceil(study->reference_steps * study->results.duration));
    kt_status status = find_coarsest(ladder, &steps, &failed, error);
    if (status != KT_OK)
        return status;
    if (ladder->curve->count == 0) {
        ladder->curve->end = KT_ACCURACY_UNUSABLE;
        return KT_OK;
    }
    const kt_accuracy_point *coarsest = &ladder->points[0];
    const double expected =
        coarsest->error.judged * pow(failed.setting / coarsest->setting, ladder->curve->method->order + 2);
    if (failed.setting > 0.0 && expected < KT_ACCURACY_USABLE * kt_accuracy_amplitude(study))
        status = bisect(ladder, ladder->points[0].setting, failed.setting, error);
    return status == KT_OK ? refine(ladder, error) : status;
}

/* ---- tolerances -------------------------------------------------------------------------------------------------- */

/* The mean step where a looser tolerance saves no steps although the error would allow it. */
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
    int stride = 1;
    for (int i = 4; i < 28 && status == KT_OK; i += stride) { /* 1e-2, 3e-3, ... 3e-14 */
        const int decade = i / 2;
        kt_accuracy_point point;
        const kt_accuracy_point before = curve->count > 0 ? ladder->points[curve->count - 1] : (kt_accuracy_point){0};
        const double tolerance = mantissas[i % 2] * pow(10.0, -decade);
        if (before.usable &&
            is_too_long(ladder, (double)before.counts.evaluations * pow(3.3, 1.0 / curve->method->order))) {
            curve->end = KT_ACCURACY_LENGTH;
            break;
        }
        status = try_setting(ladder, tolerance, &point, error);
        if (status != KT_OK || (!point.usable && curve->count == 0))
            continue;
        keep_point(ladder, &point);
        if (!point.usable && point.status != KT_OK) { /* the step became too small or the run too long */
            curve->end = KT_ACCURACY_LENGTH;
            break;
        }
        if (is_done(ladder, before.usable ? &before : NULL, &point))
            break;
        if (i % 2 == 0)
            stride = is_costly(ladder, &point, started) ? 2 : 1;
    }
    if (curve->count == 0)
        curve->end = KT_ACCURACY_UNUSABLE;
    find_held_step(ladder);
    return status;
}

kt_status kt_accuracy_climb(kt_accuracy *study, kt_accuracy_curve *curve, double deadline, kt_error *error) {
    const kt_accuracy_options *options = &study->options;
    kt_ladder ladder = {.study = study, .curve = curve, .points = study->points + curve->first, .deadline = deadline};
    kt_status status;
    if (curve->adaptive)
        status = options->tolerances != NULL ? try_all(&ladder, options->tolerances, options->tolerance_count, error)
                                             : climb_tolerances(&ladder, error);
    else
        status = options->steps != NULL ? try_all(&ladder, options->steps, options->step_count, error)
                                        : climb_steps(&ladder, error);
    if (status == KT_OK)
        kt_accuracy_fit(study, curve);
    return status;
}
