/* Prints the results of an accuracy study: tables, the cost of variants, and every run as CSV. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/output.h"
#include "subcommands/accuracy.h"

#include "base/order.h"
#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* The same with the absolute tolerance, as `run --tolerance` takes it, if it is not the relative one. */
static void describe_setting(const kt_findings *findings, const kt_accuracy_curve *curve,
                             const kt_accuracy_point *point, char *text, size_t size) {
    const double scale = findings->results->absolute_scale;
    if (curve->adaptive && scale != 1.0)
        snprintf(text, size, "tolerance %.3g,%.3g", point->setting, scale * point->setting);
    else
        kt_findings_setting(curve, point, text, size);
}

/* ---- conditions of the study ------------------------------------------------------------------------------------- */

static void print_horizon(const kt_accuracy_results *results) {
    if (results->cut == KT_ACCURACY_WHOLE) {
        if (results->growth > 0.0)
            printf("  a small error grows by a factor of %.3g in %g s\n", results->amplification, results->duration);
        return;
    }
    switch (results->cut) {
    case KT_ACCURACY_GROWTH:
        printf("  chaotic: a small error grows by a factor of e every %.3g s, by %.2g in %.4g s; after that, an error "
               "has\n  no meaning: of %g s, the study compares the first %.4g s\n",
               1.0 / results->growth, results->amplification, results->duration, results->asked, results->duration);
        break;
    case KT_ACCURACY_DISAGREEMENT:
        printf("  after %.4g s the reference and its check disagree, so the motion is unknown: of %g s,\n  the study "
               "compares the first %.4g s\n",
               results->duration, results->asked, results->duration);
        break;
    case KT_ACCURACY_STOPPED:
        printf("  '%s' ends the run at %.6g s, of %g s\n", results->instants[results->instant_count - 1].name,
               results->duration, results->asked);
        if (results->growth > 0.0)
            printf("  a small error grows by a factor of %.3g until then\n", results->amplification);
        break;
    case KT_ACCURACY_CROWDED:
        printf("  more than %d instants of events: of %g s, the study compares the first %.4g s\n",
               (int)KT_ACCURACY_INSTANTS_MAX, results->asked, results->duration);
        break;
    default:
        printf("  the reference took too long: of %g s, the study compares the first %.4g s (--budget)\n",
               results->asked, results->duration);
        break;
    }
}

/* The unit behind a number: " rad", or nothing. */
typedef struct kt_unit_behind {
    char text[40];
} kt_unit_behind;

static kt_unit_behind unit_behind(const kt_findings *findings) {
    const char *unit = kt_findings_unit(findings);
    kt_unit_behind behind;
    (void)snprintf(behind.text, sizeof behind.text, "%s%s", unit[0] != '\0' ? " " : "", unit);
    return behind;
}

static void print_head(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const kt_unit_behind unit = unit_behind(findings);
    printf("%s\n  %g s in %d records; ", kt_show(findings->name).text, results->duration, results->records);
    if (results->subject == KT_ACCURACY_QUANTITY)
        printf("errors are the largest of '%s' over all records", kt_show(findings->subject->name).text);
    else
        printf("errors%s are the largest over all joints and records",
               results->subject == KT_ACCURACY_VELOCITIES ? " of velocities" : "");
    printf("%s%s", unit.text[0] != '\0' ? ", in" : "", unit.text);
    if (results->subject == KT_ACCURACY_POSITIONS && results->unit != KT_ACCURACY_METRE)
        fputs(", angles on the circle", stdout);
    if (results->subject != KT_ACCURACY_QUANTITY && results->unit == KT_ACCURACY_MIXED)
        printf(", lengths over %.3g m", results->length);
    printf("\n  reference: ");
    if (results->reference != NULL)
        printf("%s at tolerance %g", results->reference->name, results->reference_tolerance);
    else
        printf("%s", findings->arguments->reference);
    printf(", checked by %s at %g", results->check->name, results->check_tolerance);
    if (results->check_step > 0.0)
        printf(" with steps of %.2g s at most", results->check_step);
    printf(": they differ by %.2g%s,\n  and errors below that are not reliable\n", results->uncertainty.judged,
           unit.text);
    print_horizon(results);
    kt_findings_print_instants(findings);
}

/* ---- methods ----------------------------------------------------------------------------------------------------- */

static void print_slope(const kt_accuracy_curve *curve) {
    char text[48] = "-";
    if (curve->fitted > 0)
        snprintf(text, sizeof text, "%s^%.2f+-%.2f", curve->adaptive ? "tol" : "h", curve->slope, curve->slope_spread);
    printf("  %-14s", text);
}

/* Returns the least error of the points, the uncertainty of the reference included; infinite: none is usable. */
static double least_error(const kt_findings *findings, const kt_accuracy_point *points, int count) {
    double least = HUGE_VAL;
    for (int i = 0; i < count; i++)
        if (points[i].usable)
            least = fmin(least, fmax(points[i].error.judged, findings->results->uncertainty.judged));
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

/* Prints a number in a column of this width, or a dash without one. */
static void print_or_dash(bool is_known, int width, int digits, double x) {
    if (is_known)
        printf("  %-*.*g", width, digits, x);
    else
        printf("  %-*s", width, "-");
}

/* An error as text: a bound if it is below the uncertainty of the reference. */
typedef struct kt_error_text {
    char text[24];
} kt_error_text;

static kt_error_text error_text(const kt_findings *findings, double error) {
    const double least = findings->results->uncertainty.judged;
    kt_error_text made = {"-"};
    if (isfinite(error))
        (void)snprintf(made.text, sizeof made.text, error > least ? "%.2g" : "<%.2g", error > least ? error : least);
    return made;
}

static void print_bound(const kt_findings *findings, double error, int width) {
    printf("  %-*s", width, error_text(findings, error).text);
}

static void print_curve(const kt_findings *findings, const kt_accuracy_curve *curve) {
    const double least = least_error(findings, findings->results->points + curve->first, curve->count);
    const char *variant = findings->results->variants[curve->variant].label;
    printf("  %-14s %5d", kt_findings_method(curve), curve->method->order);
    print_slope(curve);
    print_or_dash(curve->stable_step > 0.0, 12, 3, curve->stable_step);
    print_bound(findings, least, 9);
    printf("  %s%s%s\n", end_text(curve->end), variant != NULL ? "; " : "", variant != NULL ? variant : "");
}

static void print_methods(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    printf("\n  %-14s %5s  %-14s  %-12s  %-9s  %s\n", "method", "order", "error ~", "stable to, s", "least",
           "reason to stop");
    for (int i = 0; i < results->curve_count; i++)
        print_curve(findings, &results->curves[i]);
    for (int i = 0; i < results->curve_count; i++)
        if (results->curves[i].stable_step > 0.0) {
            puts("  steps longer than 'stable to' are unstable (adaptive methods: on average). 'kinetree stability' "
                 "shows\n"
                 "  the modes that cause this, and rkc2 is stable with them");
            return;
        }
}

/* ---- goals ------------------------------------------------------------------------------------------------------- */

/* The number of goals for which a table has room. */
static int count_goals(const kt_findings *findings) {
    return findings->arguments->goal_count < 4 ? findings->arguments->goal_count : 4;
}

/* Prints the cheapest of the points for each goal; an asterisk marks the cheapest of all methods. */
static void print_cheapest(const kt_findings *findings, const kt_accuracy_point *points, int count) {
    const kt_accuracy_results *results = findings->results;
    for (int g = 0; g < count_goals(findings); g++) {
        const double goal = findings->arguments->goals[g];
        const int found = kt_accuracy_best_of(findings->study, points, count, goal);
        const kt_accuracy_point *point = &points[found < 0 ? 0 : found];
        const int best = kt_accuracy_best(findings->study, goal);
        if (found < 0)
            printf("  %-8s %7s %9s", "-", "-", "- ");
        else
            printf("  %-8.4g %7.0f %8.3g%c", point->setting, (double)point->counts.evaluations / results->duration,
                   1e3 * point->cpu / results->duration, best >= 0 && point == &results->points[best] ? '*' : ' ');
    }
}

/* Prints the head of a table of costs, whose first column has this width. */
static void print_costs_head(const kt_findings *findings, int width, const char *what) {
    printf("\n  a simulated second costs, for an error of\n  %-*s", width, "");
    for (int g = 0; g < count_goals(findings); g++)
        printf("  %-8.3g %-17s", findings->arguments->goals[g], kt_findings_unit(findings));
    printf("\n  %-*s", width, what);
    for (int g = 0; g < count_goals(findings); g++)
        printf("  %-8s %7s %9s", "with", "evals", "ms");
    putchar('\n');
}

static void print_costs(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    print_costs_head(findings, 14, "method");
    for (int i = 0; i < results->curve_count; i++) {
        const kt_accuracy_curve *curve = &results->curves[i];
        printf("  %-14s", kt_findings_method(curve));
        print_cheapest(findings, results->points + curve->first, curve->count);
        printf("%s%s\n", results->variant_count > 1 ? "  " : "",
               results->variant_count > 1 ? results->variants[curve->variant].label : "");
    }
    if (results->absolute_scale != 1.0)
        printf("  the amplitude is %.2g%s, hence absolute tolerances are %.3g times these: 'run --tolerance R,A'\n",
               results->amplitude, unit_behind(findings).text, results->absolute_scale);
    puts("  evaluations and times are those of the steps, without records");
}

static void print_peers(const kt_findings *findings) {
    if (findings->peers == NULL)
        return;
    print_costs_head(findings, 31, "other engines");
    for (int i = 0; i < findings->peers->count; i++) {
        const kt_peer_curve *curve = &findings->peers->curves[i];
        const double least = least_error(findings, curve->points, curve->count);
        char name[96];
        (void)snprintf(name, sizeof name, "%s %s", curve->engine, curve->method);
        printf("  %-31s", kt_show(name).text);
        if (isfinite(least)) {
            print_cheapest(findings, curve->points, curve->count);
            printf("  least %s\n", error_text(findings, least).text);
        } else {
            printf("  fails: %s\n",
                   curve->reason[0] != '\0' ? kt_show(curve->reason).text : "no setting comes near the motion");
        }
    }
}

/* Prints a note if other processes disturbed the measured times. */
static void print_spread(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    double spreads[512];
    size_t count = 0;
    for (int i = 0; i < results->point_count && count < 512; i++)
        if (results->points[i].usable && results->points[i].repeats >= 3)
            spreads[count++] = results->points[i].spread;
    if (count == 0)
        return;
    qsort(spreads, count, sizeof *spreads, kt_compare_numbers);
    printf("\n  times are the least of repeated runs; half of the times lie within %.2g %% of the least, nine tenths "
           "within %.2g %%\n",
           100.0 * spreads[count / 2], 100.0 * spreads[9 * count / 10]);
}

/* Prints why no setting is recommended for a goal above the uncertainty of the reference. */
static void print_miss(const kt_findings *findings, double goal, double least) {
    const kt_unit_behind unit = unit_behind(findings);
    const char *budget =
        findings->arguments->tolerance_count + findings->arguments->step_count > 0 ? "" : " (--budget)";
    if (!isfinite(least))
        printf("for %.3g%s: no run came near the motion%s\n", goal, unit.text, budget);
    else if (least <= goal)
        printf("for %.3g%s: only single settings came that close, and tighter ones of their methods did not\n", goal,
               unit.text);
    else
        printf("for %.3g%s: no run came that close; the best was %.2g%s%s\n", goal, unit.text, least, unit.text,
               budget);
}

static void print_goal(const kt_findings *findings, double goal) {
    const kt_accuracy_results *results = findings->results;
    const kt_unit_behind unit = unit_behind(findings);
    const int best = kt_accuracy_best(findings->study, goal);
    if (best < 0) {
        const double least = least_error(findings, results->points, results->point_count);
        if (results->uncertainty.judged > goal)
            printf("for %.3g%s: the error of the reference itself is %.2g%s\n", goal, unit.text,
                   results->uncertainty.judged, unit.text);
        else
            print_miss(findings, goal, least);
        return;
    }
    const kt_accuracy_point *point = &results->points[best];
    const double seconds = point->cpu / results->duration;
    char setting[64];
    describe_setting(findings, kt_findings_curve(findings, best), point, setting, sizeof setting);
    printf("for %.3g%s use %s with %s: %.3g %s per simulated second\n", goal, unit.text,
           kt_findings_method(kt_findings_curve(findings, best)), setting,
           seconds < 1e-3 ? 1e6 * seconds : 1e3 * seconds, seconds < 1e-3 ? "microseconds" : "ms");
}

void kt_findings_print(const kt_findings *findings) {
    print_head(findings);
    print_methods(findings);
    print_costs(findings);
    kt_findings_print_instant_errors(findings);
    print_peers(findings);
    print_spread(findings);
    putchar('\n');
    for (int g = 0; g < findings->arguments->goal_count; g++)
        print_goal(findings, findings->arguments->goals[g]);
}

/* ---- cost of variants -------------------------------------------------------------------------------------------- */

enum { VARIANTS_MAX = 12, LARGE = 40 };

static kt_variant *add_variant(kt_variant *variants, int *count, const kt_variant *base, const char *label) {
    kt_variant *variant = &variants[(*count)++];
    *variant = *base;
    variant->label = label;
    return variant;
}

/* Fills the list of variants, one per line of the table. Returns their number. */
static int list_variants(const kt_findings *findings, kt_variant *variants) {
    static const char *const reductions[] = {"QR reduction", "partitioning", "SVD reduction"};
    const kt_variant base = kt_own_variant(findings->scene);
    const kt_model *model = kt_accuracy_model(findings->study);
    const bool has_loops = kt_loop_count(model) > 0, has_contacts = kt_contact_count(model) > 0;
    int count = 0;
    add_variant(variants, &count, &base, "as the scene has it");
    add_variant(variants, &count, &base, "with its records")->records = true;
    if (has_loops && !has_contacts) /* hard contacts need the projection, and tree coordinates */
        add_variant(variants, &count, &base, "without projection")->simulation.unprojected = true;
    if (has_loops) {
        for (int i = 0; i < 3; i++)
            if (i != (int)findings->scene->reduction)
                add_variant(variants, &count, &base, reductions[i])->model.reduction =
                    kt_reduction_method_of((kt_reduction)i);
        const bool is_mass = base.model.metric == KT_METRIC_MASS;
        add_variant(variants, &count, &base, is_mass ? "identity metric" : "mass metric")->model.metric =
            is_mass ? KT_METRIC_IDENTITY : KT_METRIC_MASS;
    }
    if (strcmp(kt_model_plan(model), "spatial") != 0)
        add_variant(variants, &count, &base, "spatial, not in the plane")->model.plan = KT_PLAN_SPATIAL;
    if (has_contacts || (!findings->arguments->prices && kt_model_body_count(model) > LARGE))
        return count; /* six coordinates per body: compiling that model alone takes long */
    const bool is_absolute = base.formulation == KT_FORMULATION_ABSOLUTE;
    add_variant(variants, &count, &base, is_absolute ? "tree formulation" : "absolute formulation")->formulation =
        is_absolute ? KT_FORMULATION_TREE : KT_FORMULATION_ABSOLUTE;
    return count;
}

/* Returns the index of the point whose variants are compared: the cheapest point for the middle goal. If no point
 * reaches this goal, the goal is the smallest decade from 1e-6 to 0.1 that a point reaches. Returns -1 if no point
 * reaches any of these goals. */
static int choose_variant_point(const kt_findings *findings) {
    const kt_accuracy_arguments *arguments = findings->arguments;
    int best = kt_accuracy_best(findings->study, arguments->goals[arguments->goal_count / 2]);
    for (int decade = -6; best < 0 && decade < 0; decade++)
        best = kt_accuracy_best(findings->study, pow(10.0, decade));
    return best;
}

int kt_findings_print_prices(const kt_findings *findings) {
    const kt_accuracy_results *results = findings->results;
    const int chosen = choose_variant_point(findings);
    kt_variant variants[VARIANTS_MAX];
    if (chosen < 0)
        return KT_EXIT_DONE;
    const kt_accuracy_curve *curve = kt_findings_curve(findings, chosen);
    const kt_accuracy_point *point = &results->points[chosen];
    const int count = list_variants(findings, variants);
    if (!findings->arguments->prices && 12.0 * count * point->cpu > 0.2 * findings->arguments->budget)
        return KT_EXIT_DONE;
    char setting[64];
    describe_setting(findings, curve, point, setting, sizeof setting);
    printf("\ncosts of other settings, with %s at %s\n", kt_findings_method(curve), setting);
    printf("  %-26s %10s  %6s  %8s  %9s  %9s  %9s\n", "", "ms", "times", "evals", "error", "energy, J", "loops open");
    double base = (double)NAN;
    for (int i = 0; i < count; i++) {
        kt_accuracy_point measured;
        kt_error error = {0};
        kt_status status = kt_accuracy_measure(findings->study, &variants[i], curve->method, curve->adaptive,
                                               point->setting, &measured, &error);
        if (status != KT_OK && status != KT_ERROR_UNSUPPORTED)
            return kt_say_status(status, &error);
        printf("  %-26s ", variants[i].label);
        if (status == KT_ERROR_UNSUPPORTED) {
            printf("fails: %s\n", kt_show(error.message).text);
            continue;
        }
        if (i == 0)
            base = measured.cpu;
        if (measured.usable)
            printf("%10.3g  %6.2f  %8.0f  %9s  %9.2g", 1e3 * measured.cpu / results->duration, measured.cpu / base,
                   (double)measured.counts.evaluations / results->duration,
                   error_text(findings, measured.error.judged).text, measured.error.energy);
        else
            printf("%10s  %6s  %8s  %9s  %9s", "-", "-", "-", error_text(findings, measured.error.judged).text, "-");
        if (kt_loop_count(kt_accuracy_model(findings->study)) > 0)
            printf("  %9.2g\n", measured.error.constraint.position);
        else
            puts("          -");
    }
    return KT_EXIT_DONE;
}

/* ---- CSV -------------------------------------------------------------------------------------------------------- */

/* Writes 17 digits, which read back to the same bits; an unknown value leaves the cell empty. */
static void put_cell(FILE *file, double value) {
    if (isnan(value))
        fputc(',', file);
    else
        fprintf(file, ",%.17g", value);
}

/* head: the cells of the variant, the method and its order. results: of the study; NULL for points of another
 * engine. */
static void write_study_point(FILE *file, const char *head, bool is_adaptive, const kt_accuracy_results *results,
                              const kt_accuracy_point *point) {
    const kt_accuracy_error *error = &point->error;
    const bool has_quantity = results != NULL && results->subject == KT_ACCURACY_QUANTITY;
    const bool has_instants = results != NULL && results->instant_count > 0;
    fprintf(file, "%s,%s,%.17g,%s", head, is_adaptive ? "tolerance" : "step", point->setting,
            point->status != KT_OK ? "failed"
            : !point->usable       ? "unusable"
            : point->believed      ? "ok"
                                   : "below the reference");
    put_cell(file, error->position);
    put_cell(file, error->velocity);
    put_cell(file, error->end_position);
    put_cell(file, error->end_velocity);
    put_cell(file, error->energy);
    put_cell(file, has_quantity ? error->quantity : (double)NAN);
    put_cell(file, has_instants ? error->instant : (double)NAN);
    put_cell(file, has_instants ? error->missed : (double)NAN);
    put_cell(file, error->constraint.position);
    put_cell(file, error->constraint.velocity);
    fprintf(file, ",%llu,%llu,%llu,%llu", (unsigned long long)point->counts.steps,
            (unsigned long long)point->counts.rejected, (unsigned long long)point->counts.evaluations,
            (unsigned long long)point->counts.factorizations);
    put_cell(file, point->cpu);
    put_cell(file, isnan(point->cpu) ? (double)NAN : point->spread);
    fprintf(file, ",%d,%d,%d\n", point->repeats, point->cheapest, point->fewest);
}

static void write_study_points(FILE *file, const void *what) {
    const kt_findings *findings = what;
    const kt_accuracy_results *results = findings->results;
    char head[160];
    fputs("variant,method,order,kind,setting,status,error.position,error.velocity,error.end.position,"
          "error.end.velocity,error.energy,error.quantity,error.instant,instants.missed,constraint.position,constraint."
          "velocity,steps,rejected,"
          "evaluations,"
          "factorizations,cpu,cpu.spread,repeats,cheapest,fewest\n",
          file);
    for (int c = 0; c < results->curve_count; c++) {
        const kt_accuracy_curve *curve = &results->curves[c];
        const char *label = results->variants[curve->variant].label;
        (void)snprintf(head, sizeof head, "%s,%s,%d", label != NULL ? label : "", kt_findings_method(curve),
                       curve->method->order);
        for (int i = 0; i < curve->count; i++)
            write_study_point(file, head, curve->adaptive, results, &results->points[curve->first + i]);
    }
    for (int c = 0; findings->peers != NULL && c < findings->peers->count; c++) {
        const kt_peer_curve *curve = &findings->peers->curves[c];
        (void)snprintf(head, sizeof head, "%s,%s,", curve->engine, curve->method); /* the order is not known */
        for (int i = 0; i < curve->count; i++)
            write_study_point(file, head, curve->adaptive, NULL, &curve->points[i]);
    }
}

int kt_findings_write(const kt_findings *findings, const char *path) {
    return kt_output_write(path, write_study_points, findings);
}
