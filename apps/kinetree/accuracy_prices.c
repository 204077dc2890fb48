/* The price of each promise: the same motion computed in other ways, at the same setting of the same method. */
#include "accuracy.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { VARIANTS_MAX = 12, LARGE = 40 };

static kt_variant *add(kt_variant *variants, int *count, const kt_variant *base, const char *label) {
    kt_variant *variant = &variants[(*count)++];
    *variant = *base;
    variant->label = label;
    return variant;
}

/* A line here is a line of the table. */
static int list_variants(const kt_findings *findings, kt_variant *variants) {
    static const char *const reductions[] = {"QR reduction", "partitioning", "SVD reduction"};
    const kt_variant base = kt_variant_default(&findings->scene->run);
    const bool has_loops = kt_loop_count(kt_accuracy_model(findings->study)) > 0;
    int count = 0;
    add(variants, &count, &base, "as the scene has it");
    add(variants, &count, &base, "with its records")->records = true;
    if (has_loops) {
        add(variants, &count, &base, "without projection")->simulation.unprojected = true;
        for (int i = 0; i < 3; i++)
            if (i != (int)base.model.reduction)
                add(variants, &count, &base, reductions[i])->model.reduction = (kt_reduction)i;
        const bool is_mass = base.model.metric == KT_METRIC_MASS;
        add(variants, &count, &base, is_mass ? "identity metric" : "mass metric")->model.metric =
            is_mass ? KT_METRIC_IDENTITY : KT_METRIC_MASS;
    }
    if (strcmp(kt_model_plan(kt_accuracy_model(findings->study)), "spatial") != 0)
        add(variants, &count, &base, "spatial, not in the plane")->model.plan = KT_PLAN_SPATIAL;
    if (!findings->arguments->prices && kt_model_body_count(kt_accuracy_model(findings->study)) > LARGE)
        return count; /* six coordinates a body: making that model alone takes long */
    const bool is_absolute = base.model.formulation == KT_FORMULATION_ABSOLUTE;
    add(variants, &count, &base, is_absolute ? "tree formulation" : "absolute formulation")->model.formulation =
        is_absolute ? KT_FORMULATION_TREE : KT_FORMULATION_ABSOLUTE;
    return count;
}

/* The point whose variants are compared: the cheapest for the middle goal, or the best there is. */
static int choose(const kt_findings *findings) {
    const kt_accuracy_arguments *arguments = findings->arguments;
    int best = kt_accuracy_best(findings->study, arguments->goals[arguments->goal_count / 2]);
    for (int decade = -6; best < 0 && decade < 0; decade++)
        best = kt_accuracy_best(findings->study, pow(10.0, decade));
    return best;
}

int kt_findings_print_prices(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const int chosen = choose(findings);
    kt_variant variants[VARIANTS_MAX];
    if (chosen < 0)
        return KT_EXIT_DONE;
    const kt_accuracy_curve *curve = kt_findings_curve(findings, chosen);
    const kt_accuracy_point *point = &results->points[chosen];
    const int count = list_variants(findings, variants);
    if (!findings->arguments->prices && 12.0 * count * point->cpu > 0.2 * findings->arguments->budget)
        return KT_EXIT_DONE;
    char setting[64];
    kt_findings_setting(curve, point, setting, sizeof setting);
    printf("\nwhat else costs how much, with %s at %s\n", curve->method->name, setting);
    printf("  %-26s %10s  %6s  %8s  %9s  %9s  %9s\n", "", "ms", "times", "evals", "error", "energy, J", "loops open");
    double base = (double)NAN;
    for (int i = 0; i < count; i++) {
        kt_accuracy_point measured;
        kt_error error = {0};
        kt_status status = kt_accuracy_measure(findings->study, &variants[i], curve->method, curve->adaptive,
                                               point->setting, &measured, &error);
        if (status != KT_OK) {
            kt_say_error(&error);
            return kt_exit_code(status);
        }
        if (i == 0)
            base = measured.cpu;
        printf("  %-26s ", variants[i].label);
        if (measured.usable)
            printf("%10.3g  %6.2f  %8.0f  %9.2g  %9.2g", 1e3 * measured.cpu / results->duration, measured.cpu / base,
                   (double)measured.counts.evaluations / results->duration, measured.error.position,
                   measured.error.energy);
        else
            printf("%10s  %6s  %8s  %9.2g  %9s", "-", "-", "-", measured.error.position, "-");
        if (kt_loop_count(kt_accuracy_model(findings->study)) > 0)
            printf("  %9.2g\n", measured.error.constraint.position);
        else
            puts("          -");
    }
    return KT_EXIT_DONE;
}
