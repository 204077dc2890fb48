/* Compares formulations of closed loops: the reduction to independent coordinates, and the alternatives. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* The formulations that are compared, in this order; each row gives one curve per method. Columns: label, unprojected,
 * absolute, has a formulation, which, its gain. No single gain suits Baumgarte stabilisation: a low gain loses the
 * loops at singular positions, a high gain costs steps and order. */
static const struct {
    const char *label;
    bool unprojected, absolute, has_set;
    kt_constraint_formulation_type formulation;
    double gain;
} kinds[KT_COMPARED_FORMULATIONS] = {
    {"minimal", false, false, false, KT_CONSTRAINT_FORMULATION_GAUSS, 0.0},
    {"unprojected", true, false, false, KT_CONSTRAINT_FORMULATION_GAUSS, 0.0},
    {"absolute", false, true, false, KT_CONSTRAINT_FORMULATION_GAUSS, 0.0},
    {"Baumgarte", false, false, true, KT_CONSTRAINT_FORMULATION_BAUMGARTE, 1.0},
    {"stiff Baumgarte", false, false, true, KT_CONSTRAINT_FORMULATION_BAUMGARTE, 4.0},
    {"augmented", false, false, true, KT_CONSTRAINT_FORMULATION_AUGMENTED, 1.0},
    {"projection", false, false, true, KT_CONSTRAINT_FORMULATION_PROJECTION, 0.0},
};

void kt_compared_formulations(const kt_scene *scene, kt_variant *variants) {
    for (int i = 0; i < KT_COMPARED_FORMULATIONS; i++) {
        variants[i] = kt_own_variant(scene);
        variants[i].label = kinds[i].label;
        variants[i].formulation = kinds[i].absolute ? KT_FORMULATION_ABSOLUTE : KT_FORMULATION_TREE;
        variants[i].simulation.unprojected = kinds[i].unprojected;
        variants[i].has_constraint_formulation = kinds[i].has_set;
        variants[i].constraint_formulation = kinds[i].formulation;
        variants[i].gain = kinds[i].gain;
    }
}

int kt_compared_methods(const kt_method **methods) {
    methods[0] = kt_method_find("rk4");
    methods[1] = kt_method_find("dopri5");
    return 2;
}

/* ---- one setting ------------------------------------------------------------------------------------------------- */

static const kt_accuracy_curve *method_curve_of(const kt_accuracy_results *results, const kt_method *method,
                                                int variant) {
    for (int i = 0; i < results->curve_count; i++)
        if (results->curves[i].method == method && results->curves[i].variant == variant)
            return &results->curves[i];
    return NULL;
}

/* Returns the point of the minimal formulation whose setting is used to compare all formulations. It is the cheapest
 * point that reaches the goal by the rule of recommendations. If no point reaches the goal, it is the most accurate
 * point. */
static const kt_accuracy_point *choose_compared_point(const kt_findings *findings, const kt_accuracy_curve *curve,
                                                      double goal) {
    const kt_accuracy_point *points = findings->results->points + curve->first, *best = NULL;
    const int found = kt_accuracy_best_of(findings->study, points, curve->count, goal);
    if (found >= 0)
        return &points[found];
    for (int i = 0; i < curve->count; i++)
        if (points[i].usable && (best == NULL || points[i].error.judged < best->error.judged))
            best = &points[i];
    return best;
}

static void print_formulation_row(const char *label, const kt_accuracy_point *point, double duration) {
    printf("  %-15s", label);
    if (point->status != KT_OK)
        printf(" %9s  %9s  %9s  %9s", "-", "-", "-", "-");
    else
        printf(" %9.2g  %9.2g  %9.2g  %9.2g", point->error.judged, point->error.constraint.position,
               point->error.constraint.velocity, point->error.energy);
    printf("  %8.0f\n", (double)point->counts.evaluations / duration);
}

/* Appends text to a sentence, after a comma if the sentence is not empty. */
static void add_phrase(char *text, size_t size, const char *format, ...) KT_PRINTF(3, 4);

static void add_phrase(char *text, size_t size, const char *format, ...) {
    size_t used = strlen(text);
    va_list values;
    if (used > 0 && used + 2 < size) {
        memcpy(text + used, ", ", 3);
        used += 2;
    }
    va_start(values, format);
    (void)vsnprintf(text + used, size - used, format, values);
    va_end(values);
}

/* Describes the errors of a formulation relative to the minimal one at the same setting. */
static void report_wrong(const kt_findings *findings, const kt_accuracy_point *base, const kt_accuracy_point *point,
                         char *text, size_t size) {
    const double least = findings->results->uncertainty.judged;
    const double times = fmax(point->error.judged, least) / fmax(base->error.judged, least);
    const double work = (double)point->counts.evaluations / (double)base->counts.evaluations;
    const kt_residual *open = &point->error.constraint;
    text[0] = '\0';
    if (point->status != KT_OK) {
        add_phrase(text, size, "breaks down before the end");
    } else if (!point->usable) {
        add_phrase(text, size, "takes another branch");
        add_phrase(text, size, "while its loops open by no more than %.1g", open->position);
    } else {
        if (times > 2.0)
            add_phrase(text, size, "%.2g times the error", times);
        if (work > 1.2)
            add_phrase(text, size, "%.2g times the evaluations", work);
        if (open->position > 1e-12)
            add_phrase(text, size, "loops open by %.1g", open->position);
        if (open->velocity > 1e-10)
            add_phrase(text, size, "velocities off their equations by %.1g", open->velocity);
    }
    if (point->verdict == KT_ERROR_SINGULAR)
        add_phrase(text, size, "passes singular positions without means to cross them");
    else if (point->verdict != KT_OK)
        add_phrase(text, size, "its loops came apart");
    if (text[0] == '\0')
        add_phrase(text, size, "nothing");
}

/* ---- one method -------------------------------------------------------------------------------------------------- */

static int print_formulations(const kt_findings *findings, const kt_accuracy_curve *curve,
                              const kt_accuracy_point *chosen) {
    const kt_accuracy_results *results = findings->results;
    kt_accuracy_point points[KT_COMPARED_FORMULATIONS];
    char setting[64], text[256];
    kt_findings_setting(curve, chosen, setting, sizeof setting);
    printf("\n%s, %s\n  %-15s %9s  %9s  %9s  %9s  %8s\n", curve->method->name, setting, "", "error", "loops open",
           "rates off", "energy, J", "evals/s");
    for (int i = 0; i < KT_COMPARED_FORMULATIONS; i++) {
        kt_error error = {0};
        const kt_status status = kt_accuracy_measure(findings->study, &results->variants[i], curve->method,
                                                     curve->adaptive, chosen->setting, &points[i], &error);
        if (status != KT_OK)
            return kt_say_status(status, &error);
        print_formulation_row(kinds[i].label, &points[i], results->duration);
    }
    for (int i = 1; i < KT_COMPARED_FORMULATIONS; i++) {
        report_wrong(findings, &points[0], &points[i], text, sizeof text);
        printf("  %s gets wrong: %s\n", kinds[i].label, text);
    }
    return KT_EXIT_DONE;
}

int kt_findings_print_formulations(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const kt_accuracy_arguments *arguments = findings->arguments;
    const double goal = arguments->goals[arguments->goal_count / 2];
    const int methods = results->curve_count / results->variant_count;
    int code = KT_EXIT_DONE;
    for (int m = 0; m < methods && code == KT_EXIT_DONE; m++) {
        const kt_accuracy_curve *curve = method_curve_of(results, results->curves[m].method, 0);
        const kt_accuracy_point *chosen = curve != NULL ? choose_compared_point(findings, curve, goal) : NULL;
        if (chosen != NULL)
            code = print_formulations(findings, curve, chosen);
    }
    return code;
}
