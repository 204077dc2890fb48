/* Warns if stability bounds the adaptive steps of an explicit method, and not the requested accuracy. This includes the
 * explicit steps of auto.
 *
 * At SAMPLES + 1 records, evenly over the run, the rate of the fastest mode is estimated (kt_mode_watch). It is
 * compared with the mean step of the method up to the next of these records. If the motion is stiff, their product is
 * near the limit of the method's stability on the real axis, for any tolerance. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include <math.h>
#include <string.h>

enum {
    SAMPLES = 10,
    STEPS_LEAST = 500 /* of a run: shorter ones are not worth the estimates */
};

/* A mean step counts as bounded from this share of the limit on. Estimated rates are slightly too low, and steps
 * vary. */
#define BOUNDED 0.6

static bool is_switching(const kt_method *method) { return strcmp(kt_method_family_name(method), "switching") == 0; }

static const kt_method *explicit_method(const kt_outcome *outcome) {
    const kt_method *method = outcome->run->integrator != NULL ? kt_method_find(outcome->run->integrator) : NULL;
    const bool adaptive = method != NULL && !(outcome->run->step > 0.0) && kt_method_is_adaptive(method);
    const bool bounded = adaptive && !kt_method_is_implicit(method) && !kt_method_stages_vary(method) &&
                         (is_switching(method) || strcmp(kt_method_family_name(method), "explicit") == 0);
    return bounded && kt_model_nv(outcome->model) > 0 ? method : NULL;
}

static double stability_limit_of(const kt_method *method) {
    kt_stability stability;
    return kt_stability_make(method, method->stages, &stability, NULL) == KT_OK ? kt_stability_real_limit(&stability)
                                                                                : HUGE_VAL;
}

/* Returns |lambda| of the fastest mode at a record, 1/s; 0: not found. Nothing decays in a joint that sticks. */
static double rate_at(const kt_outcome *outcome, const kt_record *record) {
    kt_mode_watch *watch = NULL;
    const kt_model *model = kt_outcome_model(outcome);
    if (kt_mode_watch_create(model, &watch, NULL) != KT_OK)
        return 0.0;
    kt_mode_watch_add(watch, record->t, record->q, record->v);
    const double rate = kt_mode_watch_fastest(watch).rate;
    kt_mode_watch_free(watch);
    return rate;
}

void kt_watch_stability(kt_outcome *outcome, const kt_record *record) {
    kt_stability_watch *w = &outcome->so_far.stability;
    const kt_method *method = explicit_method(outcome);
    const kt_simulation_counts counts = kt_simulation_counts_of(outcome->simulation);
    const uint64_t steps = counts.steps;
    if (method == NULL || record->t < (double)w->estimates * outcome->run->duration / SAMPLES)
        return;
    if (w->estimates > 0 && steps > w->steps) {
        const double step = (record->t - w->time) / (double)(steps - w->steps);
        const bool all_explicit = counts.switches == w->switches && counts.switches % 2 == 0; /* auto begins explicit */
        const bool bounded = all_explicit && step * w->rate >= BOUNDED * stability_limit_of(method);
        w->compared++;
        w->bounded += bounded;
        if (bounded && w->rate > w->fastest)
            w->fastest = w->rate;
    }
    const double share = record->t > 0.0 ? record->t / outcome->run->duration : 0.0; /* a duration may be 0 */
    w->estimates = 1 + (int)(share * SAMPLES + 1e-9);                                /* times are rounded */
    w->time = record->t;
    w->steps = steps;
    w->switches = counts.switches;
    w->rate = steps > 0 || record->t == 0.0 ? rate_at(outcome, record) : 0.0;
}

void kt_warn_of_stability(kt_outcome *outcome) {
    const kt_stability_watch *w = &outcome->so_far.stability;
    const kt_method *method = explicit_method(outcome);
    if (method == NULL || kt_simulation_counts_of(outcome->simulation).steps < STEPS_LEAST ||
        2 * w->bounded <= w->compared)
        return;
    const bool missed = is_switching(method);
    const kt_warning warning = kt_warning_of(
        "bounded_by_stability", w->fastest, "1/s",
        missed ? "Take radau5, whose steps no decaying mode bounds; 'kinetree accuracy' measures its cost here"
               : "Take auto, or radau5, whose steps no decaying mode bounds; 'kinetree accuracy' measures the cost of "
                 "each here");
    kt_warn(&outcome->warnings, &warning,
            "the steps of %s are bounded by its stability, not by the tolerance, in %d of %d parts of the run: a mode "
            "decays at up to %.3g /s, which allows none above %.3g s",
            missed ? "auto, which has not detected the stiffness and uses dopri5," : method->name, w->bounded,
            w->compared, w->fastest, stability_limit_of(method) / w->fastest);
}
