/* What an accuracy study says to people: how it was made, what each method does, what each goal costs. */
#include "accuracy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *kt_findings_unit(const kt_findings *findings) {
    return findings->results->unit == KT_ACCURACY_METRE ? "m" : "rad";
}

const kt_accuracy_curve *kt_findings_curve(const kt_findings *findings, int point) {
    const kt_accuracy_results *results = findings->results;
    int i = 0;
    while (i + 1 < results->curve_count && point >= results->curves[i].first + results->curves[i].count)
        i++;
    return &results->curves[i];
}

void kt_findings_setting(const kt_accuracy_curve *curve, const kt_accuracy_point *point, char *text, size_t size) {
    snprintf(text, size, curve->adaptive ? "tolerance %.3g" : "step %.4g s", point->setting);
}

/* ---- how it was made --------------------------------------------------------------------------------------------- */

static void print_horizon(const kt_accuracy_results *results) {
    if (results->cut == KT_ACCURACY_WHOLE) {
        if (results->growth > 0.0)
            printf("  a small error grows by a factor of %.3g in %g s\n", results->amplification, results->duration);
        return;
    }
    switch (results->cut) {
    case KT_ACCURACY_GROWTH:
        printf("  chaotic: a small error grows by a factor of e every %.3g s, by %.2g in %.4g s; after that an error "
               "means\n"
               "  nothing any more: of the %g s asked for, the study looks at the first %.4g s\n",
               1.0 / results->growth, results->amplification, results->duration, results->asked, results->duration);
        break;
    case KT_ACCURACY_DISAGREEMENT:
        printf("  after %.4g s the reference and its check part: the motion cannot be known there; of the %g s asked "
               "for,\n"
               "  the study looks at the first %.4g s\n",
               results->duration, results->asked, results->duration);
        break;
    default:
        printf("  the reference took too long: of the %g s asked for, the study looks at the first %.4g s (--budget)\n",
               results->asked, results->duration);
        break;
    }
}

static void print_head(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const char *unit = kt_findings_unit(findings);
    printf("%s\n  %g s in %d records; errors are the largest over all joints and records, in %s",
           kt_show(findings->name).text, results->duration, results->records, unit);
    if (results->unit != KT_ACCURACY_METRE)
        fputs(", angles on the circle", stdout);
    if (results->unit == KT_ACCURACY_MIXED)
        printf(", lengths over %.3g m", results->length);
    printf("\n  reference: ");
    if (results->reference != NULL)
        printf("%s at tolerance %g", results->reference->name, results->reference_tolerance);
    else
        printf("%s", findings->arguments->reference);
    printf(", checked by %s at %g: they differ by %.2g %s,\n  and no error below that is believed\n",
           results->check->name, results->check_tolerance, results->uncertainty.position, unit);
    print_horizon(results);
}

/* ---- methods ----------------------------------------------------------------------------------------------------- */

static void print_slope(const kt_accuracy_curve *curve) {
    char text[32] = "-";
    if (curve->fitted > 0)
        snprintf(text, sizeof text, "%s^%.2f", curve->adaptive ? "tol" : "h", curve->slope);
    printf("  %-9s", text);
}

static double least_error(const kt_findings *findings, const kt_accuracy_curve *curve) {
    double least = HUGE_VAL;
    for (int i = curve->first; i < curve->first + curve->count; i++)
        if (findings->results->points[i].usable)
            least =
                fmin(least, fmax(findings->results->points[i].error.position, findings->results->uncertainty.position));
    return least;
}

static const char *end_text(kt_accuracy_end end) {
    switch (end) {
#define KT_END_CASE(id, text)                                                                                          \
    case id:                                                                                                           \
        return text;
        KT_ACCURACY_END_LIST(KT_END_CASE)
#undef KT_END_CASE
    }
    return "";
}

static void print_method(const kt_findings *findings, const kt_accuracy_curve *curve) {
    const double least = least_error(findings, curve);
    const char *variant = findings->results->variants[curve->variant].label;
    printf("  %-9s %5d", curve->method->name, curve->method->order);
    print_slope(curve);
    if (curve->stable_step > 0.0)
        printf("  %-12.3g", curve->stable_step);
    else
        printf("  %-12s", "-");
    if (isfinite(least))
        printf("  %-8.2g", least);
    else
        printf("  %-8s", "-");
    printf("  %s%s%s\n", end_text(curve->end), variant != NULL ? "; " : "", variant != NULL ? variant : "");
}

static void print_methods(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    printf("\n  %-9s %5s  %-9s  %-12s  %-8s  %s\n", "method", "order", "error ~", "stable to, s", "least",
           "why no further");
    for (int i = 0; i < results->curve_count; i++)
        print_method(findings, &results->curves[i]);
    for (int i = 0; i < results->curve_count; i++)
        if (results->curves[i].stable_step > 0.0) {
            puts("  beyond 'stable to' it is not accuracy but stability that forbids a step (of adaptive methods, on\n"
                 "  average): 'kinetree stability' tells which modes do, and rkc2 bears them");
            return;
        }
}

/* ---- goals ------------------------------------------------------------------------------------------------------- */

/* The cheapest point of a curve for a goal; NULL: none. */
static const kt_accuracy_point *find_best(const kt_findings *findings, const kt_accuracy_curve *curve, double goal) {
    const kt_accuracy_results *results = findings->results;
    const kt_accuracy_point *best = NULL;
    for (int i = curve->first; i < curve->first + curve->count; i++) {
        const kt_accuracy_point *point = &results->points[i];
        if (point->usable && fmax(point->error.position, results->uncertainty.position) <= goal &&
            (best == NULL || point->cpu < best->cpu))
            best = point;
    }
    return best;
}

static void print_costs(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const kt_accuracy_arguments *arguments = findings->arguments;
    const int columns = arguments->goal_count < 4 ? arguments->goal_count : 4;
    printf("\n  a simulated second costs, for an error of\n  %-9s", "");
    for (int g = 0; g < columns; g++)
        printf("  %-8.3g %-17s", arguments->goals[g], kt_findings_unit(findings));
    printf("\n  %-9s", "method");
    for (int g = 0; g < columns; g++)
        printf("  %-8s %7s %9s", "with", "evals", "ms");
    putchar('\n');
    for (int i = 0; i < results->curve_count; i++) {
        const kt_accuracy_curve *curve = &results->curves[i];
        printf("  %-9s", curve->method->name);
        for (int g = 0; g < columns; g++) {
            const kt_accuracy_point *point = find_best(findings, curve, arguments->goals[g]);
            const int best = kt_accuracy_best(findings->study, arguments->goals[g]);
            if (point == NULL)
                printf("  %-8s %7s %9s", "-", "-", "- ");
            else
                printf("  %-8.2g %7.0f %8.3g%c", point->setting, (double)point->counts.evaluations / results->duration,
                       1e3 * point->cpu / results->duration, best >= 0 && point == &results->points[best] ? '*' : ' ');
        }
        printf("%s%s\n", results->variant_count > 1 ? "  " : "",
               results->variant_count > 1 ? results->variants[curve->variant].label : "");
    }
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Says so where other work disturbed the times. */
static void print_spread(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    double spreads[512];
    size_t count = 0;
    for (int i = 0; i < results->point_count && count < 512; i++)
        if (results->points[i].usable && results->points[i].repeats >= 3)
            spreads[count++] = results->points[i].spread;
    if (count == 0)
        return;
    qsort(spreads, count, sizeof *spreads, by_size);
    printf(
        "\n  times are the least of repeated runs; half of them lie within %.2g %% of it, nine tenths within %.2g %%\n",
        100.0 * spreads[count / 2], 100.0 * spreads[9 * count / 10]);
}

static void print_goal(const kt_findings *findings, double goal) {
    const kt_accuracy_results *results = findings->results;
    const char *unit = kt_findings_unit(findings);
    const int best = kt_accuracy_best(findings->study, goal);
    if (best < 0) {
        double least = HUGE_VAL;
        for (int i = 0; i < results->curve_count; i++)
            least = fmin(least, least_error(findings, &results->curves[i]));
        if (results->uncertainty.position > goal)
            printf("for %.3g %s: the reference itself is only known to %.2g %s\n", goal, unit,
                   results->uncertainty.position, unit);
        else
            printf("for %.3g %s: no run came that close; the best was %.2g %s%s\n", goal, unit, least, unit,
                   findings->arguments->tolerance_count + findings->arguments->step_count > 0 ? "" : " (--budget)");
        return;
    }
    const kt_accuracy_point *point = &results->points[best];
    const double seconds = point->cpu / results->duration;
    char setting[64];
    kt_findings_setting(kt_findings_curve(findings, best), point, setting, sizeof setting);
    printf("for %.3g %s use %s with %s: %.3g %s per simulated second\n", goal, unit,
           kt_findings_curve(findings, best)->method->name, setting, seconds < 1e-3 ? 1e6 * seconds : 1e3 * seconds,
           seconds < 1e-3 ? "microseconds" : "ms");
}

void kt_findings_print(const kt_findings *findings) {
    print_head(findings);
    print_methods(findings);
    print_costs(findings);
    print_spread(findings);
    putchar('\n');
    for (int g = 0; g < findings->arguments->goal_count; g++)
        print_goal(findings, findings->arguments->goals[g]);
}
