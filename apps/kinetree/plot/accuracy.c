/* The work-precision diagram: error against CPU time and against evaluations, both per simulated second. It has one
 * curve for each family of methods (accuracy_curves.c). Filled marks are adaptive methods, and hollow marks are fixed
 * steps. Dashed lines are implicit methods. Marks and dashes differ, hence the picture is readable in grey.
 *
 * Bars show times from the least to the median of repeated runs. Recommended points have rings. Errors within the
 * uncertainty of the reference are in the grey region. A dashed line shows rounding: a number of the size of the
 * motion has a rounding error of 2^-52 of it, which grows like any small error (kt_accuracy_results.amplification).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"
#include "plot/accuracy_curves.h"
#include "plot/plot.h"

#include "base/order.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PANELS = 2, REMARKS = 3 /* series besides curves: the front, recommended points, floors */ };

/* Two panels show the same curves. */
typedef struct kt_diagram {
    double *error, *cost[PANELS], *median; /* all points, curve by curve */
    char (*setting)[32];                   /* of all points */
    const char **names;                    /* these, or NULL if they are not asked for */
    double *front_error[PANELS], *front_cost[PANELS];
    double *floor_error, *floor_cost[PANELS]; /* a point for each curve */
    int floors;
    double ring_error[KT_ACCURACY_GOALS_MAX], ring_cost[PANELS][KT_ACCURACY_GOALS_MAX];
    char ring_text[KT_ACCURACY_GOALS_MAX][80];
    const char *ring_names[KT_ACCURACY_GOALS_MAX];
    int ring_point[KT_ACCURACY_GOALS_MAX], rings;
    kt_plot_series *series[PANELS];
    char (*labels)[80];
    bool is_chosen[KT_CURVES_MAX];
    int shown, left_out; /* curves of methods and of other engines */
    int orders[KT_CURVES_SHOWN], order_count;
    double lowest, noise; /* the least error; the noise of rounding, 0: unknown or far below */
} kt_diagram;

static int count_peers(const kt_findings *findings) { return findings->peers != NULL ? findings->peers->count : 0; }

/* ---- points ------------------------------------------------------------------------------------------------------ */

/* An error below the reference's uncertainty cannot be resolved; it is drawn at that uncertainty. */
static double known(const kt_accuracy_results *results, const kt_accuracy_point *point) {
    return point->usable ? fmax(point->error.judged, results->uncertainty.judged) : (double)NAN;
}

/* Writes "1e-6" or "0.002". */
static void write_setting(double setting, char *text, size_t size) {
    char digits[32];
    (void)snprintf(digits, sizeof digits, "%.2g", setting);
    char *zero = strstr(digits, "e-0");
    if (zero != NULL)
        memmove(zero + 2, zero + 3, strlen(zero + 3) + 1);
    (void)snprintf(text, size, "%s", digits);
}

static double cost_of(const kt_accuracy_results *results, const kt_accuracy_point *point, int panel) {
    return (panel == 0 ? 1e3 * point->cpu : (double)point->counts.evaluations) / results->duration;
}

static void place_point(const kt_accuracy_results *results, const kt_accuracy_point *point, int i, kt_diagram *d) {
    d->error[i] = known(results, point);
    for (int panel = 0; panel < PANELS; panel++)
        d->cost[panel][i] = cost_of(results, point, panel);
    d->median[i] = d->cost[0][i] * (1.0 + point->spread);
    write_setting(point->setting, d->setting[i], sizeof d->setting[i]);
    if (d->names != NULL)
        d->names[i] = d->setting[i];
}

/* ---- colours and marks ------------------------------------------------------------------------------------------- */

/* How a family of methods is drawn. */
typedef struct kt_family_style {
    const char *family;
    int colour, fixed_colour; /* with adaptive and with fixed steps */
    bool is_dashed;           /* it is implicit */
} kt_family_style;

static const kt_family_style *style_of(const kt_method *method) {
    static const kt_family_style styles[] = {
        {"explicit", 1, 7, false},  {"switching", 3, 3, false},  {"radau", 2, 2, true},
        {"rosenbrock", 4, 4, true}, {"stabilised", 6, 6, false}, {"adams", 5, 5, false},
        {"two-step", 7, 7, true},   {"dirk", 4, 4, true},        {"time stepping", 5, 5, false}};
    const char *family = kt_method_family_name(method);
    size_t i = 0;
    while (i + 1 < sizeof styles / sizeof styles[0] && strcmp(styles[i].family, family) != 0)
        i++;
    return &styles[i];
}

/* Methods of one order share a colour in pictures of all methods. */
static int order_colour_of(int order) {
    static const int colours[] = {7, 7, 5, 6, 3, 1, 4, 4, 2}; /* black, orange, sky, green, blue, purple, vermilion */
    return colours[order < 9 ? order : 8];
}

static int colour_at(const kt_findings *findings, const kt_accuracy_curve *curve) {
    if (findings->results->variant_count > 1)
        return 1 + curve->variant % KT_PLOT_SERIES_MAX;
    if (findings->arguments->all)
        return order_colour_of(curve->method->order);
    const kt_family_style *style = style_of(curve->method);
    return curve->adaptive ? style->colour : style->fixed_colour;
}

/* The first mark that no series of the same kind has. With more series than marks, none of this colour. */
static int free_mark(const kt_plot_series *series, int count, bool is_hollow, int colour) {
    for (int with_colour = 0; with_colour < 2; with_colour++)
        for (int mark = 1; mark <= KT_PLOT_MARK_COUNT; mark++) {
            bool is_taken = false;
            for (int i = 0; i < count; i++)
                is_taken = is_taken || (series[i].mark == mark && series[i].hollow == is_hollow &&
                                        (with_colour == 0 || series[i].colour == colour));
            if (!is_taken)
                return mark;
        }
    return 1 + count % KT_PLOT_MARK_COUNT;
}

static bool has_usable(const kt_accuracy_point *points, int count) {
    for (int i = 0; i < count; i++)
        if (points[i].usable)
            return true;
    return false;
}

/* The legend shows "fails" for a curve without usable points. */
static void name_curve(const kt_accuracy_results *results, const kt_accuracy_curve *curve, char *label, size_t size) {
    const char *variant = results->variants[curve->variant].label;
    char order[32] = "";
    if (variant == NULL)
        (void)snprintf(order, sizeof order, ", order %d", curve->method->order);
    (void)snprintf(label, size, "%s%s%s%s", kt_findings_method(curve), variant != NULL ? ", " : order,
                   variant != NULL ? variant : "",
                   has_usable(results->points + curve->first, curve->count) ? "" : ": fails");
}

/* ---- curves ------------------------------------------------------------------------------------------------------ */

/* Adds a series to both panels, whose points begin at `first`. */
static void add_curve(kt_diagram *d, const kt_plot_series *curve, int first) {
    const int mark = free_mark(d->series[0], d->shown, curve->hollow, curve->colour);
    for (int panel = 0; panel < PANELS; panel++) {
        kt_plot_series *series = &d->series[panel][d->shown];
        *series = *curve;
        series->mark = mark;
        series->label = d->labels[d->shown];
        series->x = d->cost[panel] + first;
        series->y = d->error + first;
        series->x_high = panel == 0 ? d->median + first : NULL;
        series->names = d->names != NULL ? d->names + first : NULL;
    }
    d->shown++;
}

static void add_order(kt_diagram *d, int order) {
    int i = d->order_count;
    for (int k = 0; k < d->order_count; k++)
        if (d->orders[k] == order)
            return;
    if (i == KT_CURVES_SHOWN)
        return;
    for (; i > 0 && d->orders[i - 1] > order; i--)
        d->orders[i] = d->orders[i - 1];
    d->orders[i] = order;
    d->order_count++;
}

/* The end of a curve whose error stopped falling. */
static void add_floor(const kt_accuracy_results *results, const kt_accuracy_curve *curve, kt_diagram *d) {
    int least = -1;
    for (int i = curve->first; i < curve->first + curve->count; i++)
        if (results->points[i].usable && (least < 0 || d->error[i] < d->error[least]))
            least = i;
    if (isnan(curve->floor) || least < 0)
        return;
    d->floor_error[d->floors] = d->error[least];
    for (int panel = 0; panel < PANELS; panel++)
        d->floor_cost[panel][d->floors] = d->cost[panel][least];
    d->floors++;
}

static void fill_methods(const kt_findings *findings, kt_diagram *d) {
    const kt_accuracy_results *results = findings->results;
    for (int i = 0; i < results->curve_count; i++) {
        const kt_accuracy_curve *curve = &results->curves[i];
        if (!d->is_chosen[i])
            continue;
        name_curve(results, curve, d->labels[d->shown], sizeof d->labels[0]);
        const kt_plot_series series = {.count = (size_t)curve->count,
                                       .colour = colour_at(findings, curve),
                                       .hollow = !curve->adaptive,
                                       .is_dashed = style_of(curve->method)->is_dashed};
        add_curve(d, &series, curve->first);
        add_floor(results, curve, d);
        add_order(d, curve->method->order);
    }
}

/* Other engines, behind the points of the study. An engine without usable points has its name alone. */
static void fill_peers(const kt_findings *findings, kt_diagram *d) {
    const kt_accuracy_results *results = findings->results;
    int first = results->point_count, engine = 0;
    for (int i = 0; i < count_peers(findings); i++) {
        const kt_peer_curve *curve = &findings->peers->curves[i];
        for (int k = 0; k < curve->count; k++)
            place_point(results, &curve->points[k], first + k, d);
        engine += i > 0 && strcmp(curve->engine, curve[-1].engine) != 0;
        if (d->is_chosen[results->curve_count + i]) {
            (void)snprintf(d->labels[d->shown], sizeof d->labels[0], "%.*s %s%s", (int)strcspn(curve->engine, " "),
                           curve->engine, curve->method, has_usable(curve->points, curve->count) ? "" : ": fails");
            const kt_plot_series series = {.count = (size_t)curve->count,
                                           .colour = 1 + engine % KT_PLOT_SERIES_MAX,
                                           .hollow = !curve->adaptive,
                                           .is_scattered = true};
            add_curve(d, &series, first);
        }
        first += curve->count;
    }
}

/* ---- remarks ----------------------------------------------------------------------------------------------------- */

/* Collects the points of the Pareto front that are on drawn curves, sorted by cost. Returns their number. */
static size_t find_front(const kt_accuracy_results *results, int panel, kt_diagram *d) {
    enum { MOST = 512 };
    size_t count = 0;
    double pairs[2 * MOST];
    for (int k = 0; k < results->curve_count; k++) {
        const kt_accuracy_curve *curve = &results->curves[k];
        for (int i = curve->first; i < curve->first + curve->count && d->is_chosen[k] && count < MOST; i++) {
            const kt_accuracy_point *point = &results->points[i];
            if (!(panel == 0 ? point->cheapest : point->fewest))
                continue;
            pairs[2 * count] = d->cost[panel][i];
            pairs[2 * count++ + 1] = d->error[i];
        }
    }
    /* cppcheck-suppress uninitvar ; only the first `count` pairs are read, and these have been written */
    qsort(pairs, count, 2 * sizeof *pairs, kt_compare_numbers);
    for (size_t i = 0; i < count; i++) {
        d->front_cost[panel][i] = pairs[2 * i];
        d->front_error[panel][i] = pairs[2 * i + 1];
    }
    return count;
}

/* The recommended points, each with the goals that it is for. */
static void find_rings(const kt_findings *findings, kt_diagram *d) {
    for (int g = 0; g < findings->arguments->goal_count; g++) {
        char goal[32];
        int k = 0;
        const int best = kt_accuracy_best(findings->study, findings->arguments->goals[g]);
        write_setting(findings->arguments->goals[g], goal, sizeof goal);
        while (k < d->rings && d->ring_point[k] != best)
            k++;
        if (best < 0)
            continue;
        if (k < d->rings) {
            const size_t used = strlen(d->ring_text[k]);
            (void)snprintf(d->ring_text[k] + used, sizeof d->ring_text[k] - used, ", %s", goal);
            continue;
        }
        (void)snprintf(d->ring_text[k], sizeof d->ring_text[k], "for %s", goal);
        d->ring_names[k] = d->ring_text[k];
        d->ring_point[k] = best;
        d->ring_error[k] = d->error[best];
        for (int panel = 0; panel < PANELS; panel++)
            d->ring_cost[panel][k] = d->cost[panel][best];
        d->rings++;
    }
}

/* The noise of rounding, if it is near the least error. */
static void find_noise(const kt_accuracy_results *results, kt_diagram *d) {
    static const double near = 1e3;
    const double noise = DBL_EPSILON * results->range * results->amplification;
    const double least = fmin(d->lowest, results->uncertainty.judged > 0.0 ? results->uncertainty.judged : HUGE_VAL);
    d->noise = results->growth > 0.0 && noise * near > least ? noise : 0.0;
}

static void fill_remarks(const kt_findings *findings, kt_diagram *d) {
    for (int panel = 0; panel < PANELS; panel++) {
        kt_plot_series *series = d->series[panel] + d->shown;
        series[0] = (kt_plot_series){.label = "least for its error",
                                     .x = d->front_cost[panel],
                                     .y = d->front_error[panel],
                                     .count = find_front(findings->results, panel, d),
                                     .is_halo = true};
        series[1] = (kt_plot_series){.label = "recommended",
                                     .x = d->ring_cost[panel],
                                     .y = d->ring_error,
                                     .names = d->ring_names,
                                     .count = (size_t)d->rings,
                                     .colour = KT_PLOT_SERIES_MAX,
                                     .is_ringed = true};
        series[2] = (kt_plot_series){.label = "no longer falls",
                                     .x = d->floor_cost[panel],
                                     .y = d->floor_error,
                                     .count = (size_t)d->floors,
                                     .colour = KT_PLOT_SERIES_MAX,
                                     .is_floor = true};
    }
}

static void fill_diagram(const kt_findings *findings, kt_diagram *d) {
    const kt_accuracy_results *results = findings->results;
    d->left_out = kt_choose_curves(findings, d->is_chosen);
    for (int i = 0; i < results->point_count; i++)
        place_point(results, &results->points[i], i, d);
    fill_methods(findings, d);
    fill_peers(findings, d);
    d->lowest = HUGE_VAL;
    for (int s = 0; s < d->shown; s++)
        for (size_t i = 0; i < d->series[0][s].count; i++)
            if (d->series[0][s].y[i] > 0.0)
                d->lowest = fmin(d->lowest, d->series[0][s].y[i]);
    find_rings(findings, d);
    find_noise(results, d);
    fill_remarks(findings, d);
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

static void describe_findings(const kt_findings *findings, char *text, size_t size) {
    const kt_accuracy_results *results = findings->results;
    const bool is_column = results->subject == KT_ACCURACY_QUANTITY;
    char length[64] = "";
    if (results->unit == KT_ACCURACY_MIXED && !is_column)
        (void)snprintf(length, sizeof length, ", lengths over %.3g m", results->length);
    (void)snprintf(
        text, size,
        "%g s; the largest error of all%s %d records%s%s; filled marks: adaptive steps, dashed lines: implicit",
        results->duration, is_column ? "" : " joints at", results->records,
        results->instant_count > 0 ? " away from events" : "", length);
}

static int draw_diagram(const kt_findings *findings, const kt_diagram *d, const char *path, bool is_dark) {
    static const char *const titles[] = {"CPU time a simulated second", "evaluations a simulated second"};
    static const char *const units[] = {"ms", NULL};
    const kt_accuracy_arguments *arguments = findings->arguments;
    const kt_accuracy_results *results = findings->results;
    kt_plot_panel panels[PANELS];
    const char *unit = kt_findings_unit(findings);
    char subtitle[256], title[200];
    kt_findings_title(findings, title, sizeof title);
    for (int panel = 0; panel < PANELS; panel++)
        panels[panel] = (kt_plot_panel){.title = title,
                                        .unit = unit[0] != '\0' ? unit : NULL,
                                        .series = d->series[panel],
                                        .series_count = d->shown + REMARKS,
                                        .left_out = arguments->all ? 0 : d->left_out,
                                        .has_legend = panel == PANELS - 1,
                                        .x_log = true,
                                        .y_log = true,
                                        .x_title = titles[panel],
                                        .x_unit = units[panel],
                                        .blind = results->uncertainty.judged,
                                        .blind_label = "within the reference\u2019s uncertainty",
                                        .noise = d->noise,
                                        .noise_label = "rounding",
                                        .orders = d->orders,
                                        .order_count = d->order_count};
    describe_findings(findings, subtitle, sizeof subtitle);
    kt_plot plot = {.title = findings->name,
                    .subtitle = subtitle,
                    .panels = panels,
                    .panel_count = PANELS,
                    .is_row = true,
                    .is_dark = is_dark,
                    .size = arguments->picture_size};
    return kt_plot_draw(&plot, path);
}

/* Divides the numbers among the arrays of a diagram. */
static void place_numbers(kt_diagram *d, double *numbers, size_t points) {
    double **const arrays[] = {&d->error,         &d->median,         &d->floor_error,    &d->cost[0],
                               &d->cost[1],       &d->front_error[0], &d->front_error[1], &d->front_cost[0],
                               &d->front_cost[1], &d->floor_cost[0],  &d->floor_cost[1]};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++)
        *arrays[i] = numbers + i * points;
}

int kt_findings_draw(const kt_findings *findings, const char *path, bool is_dark) {
    enum { ARRAYS = 11 };
    const kt_accuracy_results *results = findings->results;
    const size_t peers = (size_t)count_peers(findings), curves = (size_t)results->curve_count + peers + REMARKS;
    const size_t points = (size_t)results->point_count + peers * KT_PEER_POINTS_MAX + curves;
    double *numbers = malloc(ARRAYS * points * sizeof *numbers);
    kt_plot_series *series = malloc(PANELS * curves * sizeof *series);
    kt_diagram *d = calloc(1, sizeof *d);
    int code = KT_EXIT_INTEGRATION;
    if (d != NULL) {
        d->labels = malloc(curves * sizeof *d->labels);
        d->setting = malloc(points * sizeof *d->setting);
        d->names = findings->arguments->name_settings ? malloc(points * sizeof *d->names) : NULL;
    }
    const bool has_names = d != NULL && (d->names != NULL || !findings->arguments->name_settings);
    if (numbers == NULL || series == NULL || !has_names || d->labels == NULL || d->setting == NULL) {
        kt_say("there is not enough memory for the picture");
    } else {
        place_numbers(d, numbers, points);
        for (int panel = 0; panel < PANELS; panel++)
            d->series[panel] = series + (size_t)panel * curves;
        fill_diagram(findings, d);
        code = draw_diagram(findings, d, path, is_dark);
    }
    if (d != NULL) {
        free(d->labels);
        free(d->setting);
        free((void *)d->names);
    }
    free(d);
    free(numbers);
    free(series);
    return code;
}
