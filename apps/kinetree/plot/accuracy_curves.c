/* The curves of a work-precision diagram: the best one of each family, at most eight.
 *
 * A picture with all methods has more than twenty curves, which nobody can tell apart. Each family of methods has one
 * curve. Explicit methods are two families, those with fixed and those with adaptive steps. If variants are compared,
 * each variant is a family, and so is each other engine. Curves with a recommended point are always drawn, and so is
 * time stepping: a diagram of hard contacts compares it with events.
 *
 * The better one of two curves reaches more powers of ten of the error. If both reach as many, the better one needs
 * fewer evaluations for them, in the geometric mean. Evaluations do not depend on the machine, hence neither does the
 * choice, except for the recommended points.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/accuracy_curves.h"

#include <math.h>
#include <string.h>

enum { DECADES = 17 }; /* errors from 1 to 1e-16 */

/* The reach of a curve: the number of powers of ten, and the sum of the logarithms of their costs. */
typedef struct kt_reach {
    int decades;
    double cost;
} kt_reach;

static kt_reach find_reach(const kt_accuracy_results *results, const kt_accuracy_point *points, int count) {
    const double scale = results->range > 0.0 ? results->range : 1.0;
    kt_reach reach = {0, 0.0};
    for (int decade = 1; decade < DECADES; decade++) {
        double least = HUGE_VAL;
        for (int i = 0; i < count; i++)
            if (points[i].usable &&
                fmax(points[i].error.judged, results->uncertainty.judged) <= scale * pow(10.0, -decade))
                least = fmin(least, (double)points[i].counts.evaluations);
        if (!isfinite(least))
            break;
        reach.decades++;
        reach.cost += log(fmax(least, 1.0));
    }
    return reach;
}

static bool is_better(kt_reach a, kt_reach b) {
    return a.decades != b.decades ? a.decades > b.decades : a.cost < b.cost;
}

/* A curve of the study or of another engine. */
typedef struct kt_candidate {
    kt_reach reach;
    const char *family; /* of methods; or the engine */
    int variant;
    bool adaptive, is_needed, is_chosen;
} kt_candidate;

static bool is_same_family(const kt_candidate *a, const kt_candidate *b) {
    return strcmp(a->family, b->family) == 0 && a->variant == b->variant &&
           (a->adaptive == b->adaptive || strcmp(a->family, "explicit") != 0);
}

/* Whether a curve is time stepping, or has a recommended point. */
static bool is_needed_curve(const kt_findings *findings, const kt_accuracy_curve *curve) {
    if (strcmp(kt_findings_method(curve), KT_STEPS_NAME) == 0)
        return true;
    for (int g = 0; g < findings->arguments->goal_count; g++) {
        const int best = kt_accuracy_best(findings->study, findings->arguments->goals[g]);
        if (best >= curve->first && best < curve->first + curve->count)
            return true;
    }
    return false;
}

static int list_candidates(const kt_findings *findings, kt_candidate *candidates) {
    const kt_accuracy_results *results = findings->results;
    int count = 0;
    for (int i = 0; i < results->curve_count && count < KT_CURVES_MAX; i++) {
        const kt_accuracy_curve *curve = &results->curves[i];
        const bool is_one = results->variant_count == 1;
        candidates[count++] = (kt_candidate){find_reach(results, results->points + curve->first, curve->count),
                                             is_one ? kt_method_family_name(curve->method) : "",
                                             curve->variant,
                                             curve->adaptive,
                                             is_needed_curve(findings, curve),
                                             false};
    }
    for (int i = 0; findings->peers != NULL && i < findings->peers->count && count < KT_CURVES_MAX; i++) {
        const kt_peer_curve *curve = &findings->peers->curves[i];
        candidates[count++] =
            (kt_candidate){find_reach(results, curve->points, curve->count), curve->engine, -1, false, false, false};
    }
    return count;
}

/* Chooses the best candidate whose family has none yet; needed ones come first. Returns false if none is left. */
static bool choose_next(kt_candidate *candidates, int count) {
    kt_candidate *best = NULL;
    for (int i = 0; i < count; i++) {
        kt_candidate *candidate = &candidates[i];
        bool is_taken = candidate->is_chosen || candidate->reach.decades == 0;
        for (int k = 0; k < count && !candidate->is_needed; k++)
            is_taken = is_taken || (candidates[k].is_chosen && is_same_family(candidate, &candidates[k]));
        if (is_taken)
            continue;
        if (best == NULL || candidate->is_needed > best->is_needed ||
            (candidate->is_needed == best->is_needed && is_better(candidate->reach, best->reach)))
            best = candidate;
    }
    if (best != NULL)
        best->is_chosen = true;
    return best != NULL;
}

int kt_choose_curves(const kt_findings *findings, bool *is_chosen) {
    kt_candidate candidates[KT_CURVES_MAX];
    const int count = list_candidates(findings, candidates);
    int chosen = 0;
    while (chosen < KT_CURVES_SHOWN && choose_next(candidates, count))
        chosen++;
    for (int i = 0; i < count; i++)
        is_chosen[i] = findings->arguments->all || candidates[i].is_chosen;
    return count - chosen;
}
