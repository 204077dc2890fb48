/* The work-precision diagram: error against CPU time and against evaluations, both per simulated second, with one curve
 * per method. The colour shows the order; filled marks are adaptive methods, hollow marks are fixed steps. */
#include "subcommands/accuracy.h"
#include "plot/plot.h"

#include "base/order.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Two panels show the same curves; the last series of each panel is the Pareto front. */
typedef struct kt_diagram {
    double *error, *cost[2]; /* all points, curve by curve */
    double *front_error[2], *front_cost[2];
    kt_plot_series *series[2];
    char (*labels)[64];
    int shown; /* curves of the study that are drawn, before those of other engines */
} kt_diagram;

static int count_peers(const kt_findings *findings) { return findings->peers != NULL ? findings->peers->count : 0; }

/* Methods of one order share a colour and differ by their marks. */
static int order_colour_of(int order) {
    static const int colours[] = {7, 7, 5, 6, 3, 1, 4, 4, 2}; /* black, orange, sky, green, blue, purple, vermilion */
    return colours[order < 9 ? order : 8];
}

/* With several variants the colour shows the variant, otherwise the order of the method. */
static int colour_at(const kt_accuracy_results *results, const kt_accuracy_curve *curve) {
    return results->variant_count > 1 ? 1 + curve->variant % KT_PLOT_SERIES_MAX : order_colour_of(curve->method->order);
}

static int method_mark_of(const kt_accuracy_results *results, int index) {
    int mark = 1;
    if (results->variant_count > 1) /* the mark shows the method */
        return 1 + index % (results->curve_count / results->variant_count) % KT_PLOT_MARK_COUNT;
    for (int i = 0; i < index; i++)
        mark += results->curves[i].method->order == results->curves[index].method->order;
    return 1 + (mark - 1) % KT_PLOT_MARK_COUNT;
}

/* An error below the reference's uncertainty cannot be resolved; it is drawn at that uncertainty. */
static double known(const kt_accuracy_results *results, const kt_accuracy_point *point) {
    return point->usable ? fmax(point->error.judged, results->uncertainty.judged) : (double)NAN;
}

static bool has_usable(const kt_accuracy_results *results, const kt_accuracy_curve *curve) {
    for (int i = curve->first; i < curve->first + curve->count; i++)
        if (results->points[i].usable)
            return true;
    return false;
}

/* The legend shows "fails" for a curve without usable points. */
static void name_curve(const kt_accuracy_results *results, const kt_accuracy_curve *curve, char *label, size_t size) {
    const char *variant = results->variants[curve->variant].label;
    snprintf(label, size, "%s%s%s%s", curve->method->name, variant != NULL ? ", " : "", variant != NULL ? variant : "",
             has_usable(results, curve) ? "" : ": fails");
}

/* Collects the points of the Pareto front, sorted by cost. Returns their number. */
static size_t find_front(const kt_accuracy_results *results, bool of_time, double *error, double *cost) {
    size_t count = 0;
    double pairs[2 * 512];
    for (int i = 0; i < results->point_count && count < 512; i++) {
        const kt_accuracy_point *point = &results->points[i];
        if (!(of_time ? point->cheapest : point->fewest))
            continue;
        pairs[2 * count] = (of_time ? 1e3 * point->cpu : (double)point->counts.evaluations) / results->duration;
        pairs[2 * count++ + 1] = known(results, point);
    }
    /* cppcheck-suppress uninitvar ; only the first `count` pairs are read, and these have been written */
    qsort(pairs, count, 2 * sizeof *pairs, kt_compare_numbers);
    for (size_t i = 0; i < count; i++) {
        cost[i] = pairs[2 * i];
        error[i] = pairs[2 * i + 1];
    }
    return count;
}

static void place_point(const kt_accuracy_results *results, const kt_accuracy_point *point, int i, kt_diagram *d) {
    d->error[i] = known(results, point);
    d->cost[0][i] = 1e3 * point->cpu / results->duration;
    d->cost[1][i] = (double)point->counts.evaluations / results->duration;
}

/* With other engines, the legend has room for the best methods only: those of a front. */
static bool is_shown(const kt_findings *findings, const kt_accuracy_curve *curve) {
    bool is_best = findings->peers == NULL;
    for (int i = curve->first; i < curve->first + curve->count; i++)
        is_best = is_best || findings->results->points[i].cheapest || findings->results->points[i].fewest;
    return is_best;
}

/* Other engines, behind the curves and points of the study. An engine without usable points has its name alone. */
static void fill_peers(const kt_findings *findings, kt_diagram *d) {
    const kt_accuracy_results *results = findings->results;
    int first = results->point_count, engine = 0;
    for (int i = 0; i < count_peers(findings); i++) {
        const kt_peer_curve *curve = &findings->peers->curves[i];
        const int at = d->shown + i;
        bool is_usable = false;
        for (int k = 0; k < curve->count; k++) {
            place_point(results, &curve->points[k], first + k, d);
            is_usable = is_usable || curve->points[k].usable;
        }
        engine += i > 0 && strcmp(curve->engine, curve[-1].engine) != 0;
        (void)snprintf(d->labels[at], sizeof d->labels[at], "%.*s %s%s", (int)strcspn(curve->engine, " "),
                       curve->engine, curve->method, is_usable ? "" : ": fails");
        for (int panel = 0; panel < 2; panel++)
            d->series[panel][at] = (kt_plot_series){.label = d->labels[at],
                                                    .x = d->cost[panel] + first,
                                                    .y = d->error + first,
                                                    .count = (size_t)curve->count,
                                                    .colour = 1 + engine % KT_PLOT_SERIES_MAX,
                                                    .mark = 1 + i % KT_PLOT_MARK_COUNT,
                                                    .hollow = !curve->adaptive,
                                                    .is_scattered = true};
        first += curve->count;
    }
}

static void fill_diagram(const kt_findings *findings, kt_diagram *d) {
    const kt_accuracy_results *results = findings->results;
    for (int i = 0; i < results->point_count; i++)
        place_point(results, &results->points[i], i, d);
    for (int panel = 0; panel < 2; panel++) {
        d->shown = 0;
        for (int i = 0; i < results->curve_count; i++) {
            const kt_accuracy_curve *curve = &results->curves[i];
            if (!is_shown(findings, curve))
                continue;
            char *label = d->labels[d->shown];
            name_curve(results, curve, label, sizeof d->labels[0]);
            d->series[panel][d->shown++] = (kt_plot_series){.label = label,
                                                            .x = d->cost[panel] + curve->first,
                                                            .y = d->error + curve->first,
                                                            .count = (size_t)curve->count,
                                                            .colour = colour_at(results, curve),
                                                            .mark = method_mark_of(results, i),
                                                            .hollow = !curve->adaptive};
        }
        const int last = d->shown + count_peers(findings);
        const size_t count = find_front(results, panel == 0, d->front_error[panel], d->front_cost[panel]);
        d->series[panel][last] = (kt_plot_series){.label = "least for its error",
                                                  .x = d->front_cost[panel],
                                                  .y = d->front_error[panel],
                                                  .count = count,
                                                  .is_halo = true};
    }
    fill_peers(findings, d);
}

static void describe_findings(const kt_findings *findings, char *text, size_t size) {
    const kt_accuracy_results *results = findings->results;
    char length[64] = "";
    if (results->unit == KT_ACCURACY_MIXED)
        snprintf(length, sizeof length, ", lengths over %.3g m", results->length);
    const bool is_column = results->subject == KT_ACCURACY_QUANTITY;
    snprintf(text, size, "%g s; the largest error of all%s %d records%s; filled marks: adaptive steps%s",
             results->duration, is_column ? "" : " joints at", results->records, is_column ? "" : length,
             findings->peers != NULL ? "; own methods that are best somewhere" : "");
}

static int draw_diagram(const kt_findings *findings, const kt_diagram *d, const char *path, bool is_dark) {
    static const char *const titles[] = {"CPU time a simulated second", "evaluations a simulated second"};
    static const char *const units[] = {"ms", NULL};
    const kt_accuracy_results *results = findings->results;
    kt_plot_panel panels[2];
    const char *unit = kt_findings_unit(findings);
    char subtitle[256], title[200];
    kt_findings_title(findings, title, sizeof title);
    for (int panel = 0; panel < 2; panel++)
        panels[panel] = (kt_plot_panel){.title = title,
                                        .unit = unit[0] != '\0' ? unit : NULL,
                                        .series = d->series[panel],
                                        .series_count = d->shown + count_peers(findings) + 1,
                                        .has_legend = panel == 1,
                                        .x_log = true,
                                        .y_log = true,
                                        .x_title = titles[panel],
                                        .x_unit = units[panel],
                                        .blind = results->uncertainty.judged,
                                        .blind_label = "within the reference\u2019s uncertainty"};
    describe_findings(findings, subtitle, sizeof subtitle);
    kt_plot plot = {.title = findings->name,
                    .subtitle = subtitle,
                    .panels = panels,
                    .panel_count = 2,
                    .is_row = true,
                    .is_dark = is_dark};
    return kt_plot_draw(&plot, path);
}

int kt_findings_draw(const kt_findings *findings, const char *path, bool is_dark) {
    const kt_accuracy_results *results = findings->results;
    const size_t peers = (size_t)count_peers(findings);
    const size_t points = (size_t)results->point_count + peers * KT_PEER_POINTS_MAX + 1;
    const size_t curves = (size_t)results->curve_count + peers + 1;
    double *numbers = malloc(7 * points * sizeof *numbers);
    kt_plot_series *series = malloc(2 * curves * sizeof *series);
    kt_diagram d = {.labels = malloc(curves * sizeof *d.labels)};
    int code = KT_EXIT_INTEGRATION;
    if (numbers == NULL || series == NULL || d.labels == NULL) {
        kt_say("there is not enough memory for the picture");
    } else {
        d.error = numbers;
        for (int panel = 0; panel < 2; panel++) {
            d.cost[panel] = numbers + (size_t)(1 + panel) * points;
            d.front_error[panel] = numbers + (size_t)(3 + panel) * points;
            d.front_cost[panel] = numbers + (size_t)(5 + panel) * points;
            d.series[panel] = series + (size_t)panel * curves;
        }
        fill_diagram(findings, &d);
        code = draw_diagram(findings, &d, path, is_dark);
    }
    free(numbers);
    free(series);
    free(d.labels);
    return code;
}
