/* Pictures of a sweep's lines. Each column is a panel of its own: their units differ. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/plot.h"

#include "command.h"
#include "plot/kind.h"

#include "base/order.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    PANELS_MAX = 6,
    BINS_MAX = 100,
    CURVES_MAX = 200,
    MARKED = 60 /* points of a curve that have marks */
};

/* Numbers that a panel takes: of curves at most 5 for each row, of a map 10. */
static size_t room_of(size_t rows) { return 10 * rows + 8 * BINS_MAX; }

bool kt_sweep_table_find(const kt_table *table, int *first, int *count) {
    *first = 1;
    *count = 0;
    if (table->columns < 3 || strcmp(table->names[0], "run") != 0)
        return false;
    while (*first + *count < table->columns && strcmp(table->names[*first + *count], "status") != 0)
        ++*count;
    return *first + *count<table->columns && * count> 0;
}

/* ---- a picture in the making ------------------------------------------------------------------------------------- */

typedef struct picture {
    const kt_sweep_chart *chart;
    size_t rows;
    kt_plot_panel panels[PANELS_MAX];
    kt_plot_series series[PANELS_MAX][CURVES_MAX];
    kt_plot_scale scale; /* of the values that curves are drawn by */
    kt_plot_cells cells[PANELS_MAX];
    char labels[CURVES_MAX][96];
    char units[PANELS_MAX][KT_SWEEP_UNIT_SIZE], x_unit[KT_SWEEP_UNIT_SIZE], by_unit[KT_SWEEP_UNIT_SIZE];
    size_t shared;   /* the largest number of runs at one place of a map */
    double *numbers; /* room for all that is drawn */
    size_t used;
} picture;

static const double *sweep_column_of(const picture *p, int column) {
    return p->chart->table->cells + (size_t)column * p->rows;
}

static double *take_plot_numbers(picture *p, size_t count) {
    double *numbers = p->numbers + p->used;
    p->used += count;
    return numbers;
}

/* Writes the finite values of a column in rising order, each once or all. */
static size_t sort_values(const double *values, size_t rows, bool once, double *to) {
    size_t count = 0, kept = 0;
    for (size_t i = 0; i < rows; i++)
        if (isfinite(values[i]))
            to[count++] = values[i];
    qsort(to, count, sizeof *to, kt_compare_numbers);
    for (size_t i = 0; i < count && once; i++)
        if (kept == 0 || to[i] != to[kept - 1])
            to[kept++] = to[i];
    return once ? kept : count;
}

/* ---- curves and points ------------------------------------------------------------------------------------------- */

/* The points whose value in column `by` is `value` (by < 0: all). pairs: room for them. They form a curve if x rises or
 * falls from run to run. The values of a range do so, those of a sample do not. */
static kt_plot_series trace(picture *p, int column, double value, double *pairs) {
    const kt_sweep_chart *chart = p->chart;
    const double *x = sweep_column_of(p, chart->x), *y = sweep_column_of(p, column);
    const double *by = chart->by >= 0 ? sweep_column_of(p, chart->by) : NULL;
    size_t count = 0, rising = 0, falling = 0;
    for (size_t i = 0; i < p->rows; i++)
        if (by == NULL || by[i] == value) {
            rising += count > 0 && x[i] > pairs[2 * count - 2];
            falling += count > 0 && x[i] < pairs[2 * count - 2];
            pairs[2 * count] = x[i];
            pairs[2 * count++ + 1] = y[i];
        }
    const bool is_curve = count > 0 && (rising == count - 1 || falling == count - 1);
    qsort(pairs, count, 2 * sizeof *pairs, kt_compare_numbers);
    double *to_x = take_plot_numbers(p, count), *to_y = take_plot_numbers(p, count);
    for (size_t i = 0; i < count; i++) {
        to_x[i] = pairs[2 * i];
        to_y[i] = !chart->is_log ? pairs[2 * i + 1] : pairs[2 * i + 1] != 0.0 ? fabs(pairs[2 * i + 1]) : (double)NAN;
    }
    return (kt_plot_series){.x = to_x,
                            .y = to_y,
                            .count = count,
                            .mark = count <= MARKED || !is_curve,
                            .is_scattered = !is_curve,
                            .is_dense = is_curve && count > MARKED};
}

/* Whether the values of a column grow by equal ratios rather than by equal differences: a range that was given as
 * log. */
static bool is_logarithmic(const picture *p, int column) {
    double *values = malloc(p->rows * sizeof *values);
    const size_t count = values != NULL ? sort_values(sweep_column_of(p, column), p->rows, true, values) : 0;
    bool is_log = count > 2 && values[0] > 0.0;
    for (size_t i = 2; i < count && is_log; i++)
        is_log = fabs(log(values[i] / values[i - 1]) / log(values[1] / values[0]) - 1.0) < 0.01;
    is_log = is_log && values[count - 1] > 5.0 * values[0];
    free(values);
    return is_log;
}

static void add_curves(picture *p, int k, int column) {
    const kt_sweep_chart *chart = p->chart;
    kt_plot_panel *panel = &p->panels[k];
    double *values = take_plot_numbers(p, p->rows);
    const size_t count = chart->by >= 0 ? sort_values(sweep_column_of(p, chart->by), p->rows, true, values) : 1;
    *panel = (kt_plot_panel){.title = chart->table->names[column],
                             .unit = kt_sweep_unit(chart->table->names[column], p->units[k]),
                             .series = p->series[k],
                             .has_legend = chart->by >= 0,
                             .x_log = is_logarithmic(p, chart->x),
                             .y_log = chart->is_log};
    double *pairs = take_plot_numbers(p, 2 * p->rows); /* of one curve after the other */
    if (count > KT_PLOT_SERIES_MAX) {
        p->scale =
            (kt_plot_scale){values[0], values[count - 1], is_logarithmic(p, chart->by), chart->table->names[chart->by]};
        panel->scale = &p->scale;
    }
    for (size_t i = 0; i < count; i++) {
        kt_plot_series *series = &p->series[k][panel->series_count];
        *series = trace(p, column, chart->by >= 0 ? values[i] : 0.0, pairs);
        series->value = chart->by >= 0 ? values[i] : 0.0;
        series->label = p->labels[panel->series_count++];
        if (chart->by >= 0)
            (void)snprintf(p->labels[i], sizeof p->labels[i], "%.60s = %.6g", chart->table->names[chart->by],
                           values[i]);
    }
}

/* Rejects more curves than colours can distinguish. Returns -1, or an exit code after printing the error. */
static int check_curves(const picture *p) {
    const kt_sweep_chart *chart = p->chart;
    if (chart->by < 0 || chart->is_map || chart->is_histogram)
        return -1;
    const size_t count = sort_values(sweep_column_of(p, chart->by), p->rows, true, p->numbers);
    if (count <= CURVES_MAX)
        return -1;
    return kt_misuse(
        "plot: --by: '%s' has %zu values, and a picture has %d curves at most; --map %s,%s shows all as colours",
        chart->table->names[chart->by], count, CURVES_MAX, chart->table->names[chart->x],
        chart->table->names[chart->by]);
}

/* ---- histograms -------------------------------------------------------------------------------------------------- */

/* Returns the number of bins of n sorted values. Their width is 2 n^(-1/3) times the distance of the quartiles. If half
 * of the values or more are equal, the quartiles may coincide. The number of bins is then 1 + log2(n).
 * Sources: Freedman, Diaconis 1981 (Z. Wahrscheinlichkeitstheorie 57); Sturges 1926 (J. Am. Stat. Assoc. 21). */
static int count_bins(const double *sorted, size_t n) {
    const double range = n > 0 ? sorted[n - 1] - sorted[0] : 0.0;
    if (!(range > 0.0))
        return 1;
    const double width = 2.0 * (sorted[3 * n / 4] - sorted[n / 4]) / cbrt((double)n);
    const double most = width > 0.0 ? ceil(range / width) : 1.0 + ceil(log2((double)n));
    return most < 1.0 ? 1 : most > BINS_MAX ? BINS_MAX : (int)most;
}

static void add_histogram(picture *p, int k, int column) {
    double *sorted = take_plot_numbers(p, p->rows);
    const size_t n = sort_values(sweep_column_of(p, column), p->rows, false, sorted);
    const double low = n > 0 ? sorted[0] : 0.0, range = n > 0 ? sorted[n - 1] - low : 0.0;
    const int bins = count_bins(sorted, n);
    double *x = take_plot_numbers(p, 4 * BINS_MAX), *y = take_plot_numbers(p, 4 * BINS_MAX);
    size_t points = 0, next = 0;
    for (int bin = 0; bin < bins; bin++) {
        const double left = low + range * bin / bins, right = low + range * (bin + 1) / bins;
        const size_t before = next;
        while (next < n && (sorted[next] < right || bin + 1 == bins))
            next++;
        const double corners[4][2] = {
            {left, 0.0}, {left, (double)(next - before)}, {right, (double)(next - before)}, {right, 0.0}};
        for (int i = 0; i < 4; i++) {
            x[points] = corners[i][0];
            y[points++] = corners[i][1];
        }
    }
    p->series[k][0] = (kt_plot_series){.x = x, .y = y, .count = points};
    p->panels[k] = (kt_plot_panel){.title = "Runs",
                                   .series = p->series[k],
                                   .series_count = 1,
                                   .x_title = p->chart->table->names[column],
                                   .x_unit = kt_sweep_unit(p->chart->table->names[column], p->units[k])};
}

/* ---- maps -------------------------------------------------------------------------------------------------------- */

/* The ends of the cell around a value among `count` sorted ones: half-way to its neighbours. */
static void find_cell_ends(const double *values, size_t count, double value, bool is_log, double *from, double *to) {
    size_t k = 0;
    while (k + 1 < count && values[k] < value)
        k++;
    const double before = k > 0 ? values[k - 1] : 2.0 * values[0] - values[count > 1];
    const double after = k + 1 < count ? values[k + 1] : 2.0 * values[k] - values[k > 0 ? k - 1 : 0];
    *from = 0.5 * (before + value);
    *to = 0.5 * (value + after);
    if (is_log) {
        *from = k > 0 ? sqrt(before * value) : value * sqrt(values[0] / values[count > 1]);
        *to = k + 1 < count ? sqrt(value * after) : value * sqrt(value / values[k > 0 ? k - 1 : 0]);
    }
}

/* A run of a map. */
typedef struct map_place {
    double x, y, row;
} map_place;

static int compare_map_places(const void *a, const void *b) {
    const map_place *one = a, *other = b;
    const double by_x = one->x - other->x, by_y = one->y - other->y, difference = by_x != 0.0 ? by_x : by_y;
    return difference < 0.0 ? -1 : difference > 0.0 ? 1 : one->row < other->row ? -1 : 1;
}

/* Gives each run at a place of the map the mean of the finite values there. Runs share a place if they are repeated, or
 * if a name besides the axes varies. The last one would hide the others. */
static const double *average_map_places(picture *p, const double *x, const double *y, const double *z) {
    double *mean = take_plot_numbers(p, p->rows);
    map_place *places = (map_place *)take_plot_numbers(p, 3 * p->rows);
    for (size_t i = 0; i < p->rows; i++)
        places[i] = (map_place){x[i], y[i], (double)i};
    qsort(places, p->rows, sizeof *places, compare_map_places);
    for (size_t first = 0, end; first < p->rows; first = end) {
        double sum = 0.0;
        size_t finite = 0;
        for (end = first; end < p->rows && places[end].x == places[first].x && places[end].y == places[first].y;
             end++) {
            const double value = z[(size_t)places[end].row];
            sum += !isfinite(value) ? 0.0 : p->chart->is_log ? fabs(value) : value;
            finite += isfinite(value) ? 1 : 0;
        }
        end += end == first; /* a place that is not a number */
        const double value = end - first == 1 ? z[(size_t)places[first].row] : sum / (double)finite;
        for (size_t i = first; i < end; i++)
            mean[(size_t)places[i].row] = value;
        p->shared = end - first > p->shared ? end - first : p->shared;
    }
    return mean;
}

static void add_map(picture *p, int k, int column) {
    const kt_sweep_chart *chart = p->chart;
    const double *x = sweep_column_of(p, chart->x), *y = sweep_column_of(p, chart->by);
    const double *z = average_map_places(p, x, y, sweep_column_of(p, column));
    double *xs = take_plot_numbers(p, p->rows), *ys = take_plot_numbers(p, p->rows);
    const size_t nx = sort_values(x, p->rows, true, xs), ny = sort_values(y, p->rows, true, ys);
    const bool is_grid = nx * ny <= 2 * p->rows, x_log = is_logarithmic(p, chart->x),
               y_log = is_logarithmic(p, chart->by);
    double *edges = take_plot_numbers(p, 4 * p->rows);
    kt_plot_cells *cells = &p->cells[k];
    *cells = (kt_plot_cells){.x = edges,
                             .y = edges + 2 * p->rows,
                             .z = z,
                             .count = p->rows,
                             .is_grid = is_grid,
                             .is_log = chart->is_log,
                             .label = chart->table->names[column],
                             .unit = kt_sweep_unit(chart->table->names[column], p->units[k])};
    for (size_t i = 0; i < p->rows; i++) {
        double *of_x = edges + 2 * i, *of_y = edges + 2 * (p->rows + i);
        of_x[0] = of_x[1] = x[i];
        of_y[0] = of_y[1] = y[i];
        if (is_grid && nx > 1)
            find_cell_ends(xs, nx, x[i], x_log, &of_x[0], &of_x[1]);
        if (is_grid && ny > 1)
            find_cell_ends(ys, ny, y[i], y_log, &of_y[0], &of_y[1]);
    }
    p->series[k][0] = (kt_plot_series){.x = cells->x, .y = cells->y, .count = 2 * p->rows, .is_scattered = true};
    p->panels[k] = (kt_plot_panel){.title = chart->table->names[chart->by],
                                   .unit = kt_sweep_unit(chart->table->names[chart->by], p->by_unit),
                                   .series = p->series[k],
                                   .series_count = 1,
                                   .has_legend = true,
                                   .x_log = x_log,
                                   .y_log = y_log,
                                   .x_title = chart->table->names[chart->x],
                                   .x_unit = kt_sweep_unit(chart->table->names[chart->x], p->x_unit),
                                   .cells = cells};
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static size_t count_failed(const picture *p) {
    const double *y = sweep_column_of(p, p->chart->columns[0]);
    size_t failed = 0;
    for (size_t i = 0; i < p->rows; i++)
        failed += isfinite(y[i]) ? 0 : 1;
    return failed;
}

static int draw_sweep_plot(picture *p, const char *out) {
    const kt_sweep_chart *chart = p->chart;
    const int count = chart->column_count < PANELS_MAX ? chart->column_count : PANELS_MAX;
    char subtitle[200], more[64] = "", means[64] = "";
    for (int k = 0; k < count; k++) {
        p->used = (size_t)k * room_of(p->rows);
        if (chart->is_histogram)
            add_histogram(p, k, chart->columns[k]);
        else if (chart->is_map)
            add_map(p, k, chart->columns[k]);
        else
            add_curves(p, k, chart->columns[k]);
    }
    if (chart->column_count > count)
        (void)snprintf(more, sizeof more, "; %d more columns: --columns chooses", chart->column_count - count);
    if (p->shared > 1)
        (void)snprintf(means, sizeof means, "; means of up to %zu runs at one place", p->shared);
    (void)snprintf(subtitle, sizeof subtitle, "%zu run%s, %zu without a value%s%s%s", p->rows,
                   kt_plural((long long)p->rows), count_failed(p), means, more, chart->is_log ? "; magnitudes" : "");
    const kt_plot plot = {.title = chart->title,
                          .subtitle = subtitle,
                          .x_title = chart->table->names[chart->x],
                          .x_unit = kt_sweep_unit(chart->table->names[chart->x], p->x_unit),
                          .panels = p->panels,
                          .panel_count = count,
                          .is_dark = chart->is_dark,
                          .size = chart->size};
    return kt_plot_draw(&plot, out);
}

int kt_sweep_plot(const kt_sweep_chart *chart, const char *out) {
    picture *p = calloc(1, sizeof *p);
    int code = KT_EXIT_INTEGRATION;
    if (p != NULL) {
        p->chart = chart;
        p->rows = chart->table->rows;
        p->numbers = malloc(PANELS_MAX * room_of(p->rows) * sizeof *p->numbers);
    }
    if (p != NULL && p->numbers != NULL) {
        code = check_curves(p);
        code = code < 0 ? draw_sweep_plot(p, out) : code;
    } else
        kt_say("there is not enough memory for the picture");
    if (p != NULL)
        free(p->numbers);
    free(p);
    return code;
}
