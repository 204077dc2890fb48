/* The picture of a run: the recorded columns, with one panel for each quantity, and the drift of the energy. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/run.h"

#include "plot/choice.h"
#include "text/bytes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PANELS_MAX = 40 };

struct kt_plot_run {
    const kt_columns *columns;
    bool has_energy; /* there is a panel for the energy */
    int *panel;      /* of each column; -1: it is not drawn */
    size_t *panels;  /* a column of each panel */
    int panel_count;
    kt_bytes rows; /* row-major, so that rows can be appended: change of the energy, then the columns, the time first */
    size_t width, count;
    double energy_start; /* J, total energy, or the balance if the work done is recorded */
};

/* ---- the panels -------------------------------------------------------------------------------------------------- */

/* Whether a column is drawn. The time has no panel. Energies and works are drawn as one change in a separate panel. If
 * no record was selected (is_default), only positions, markers and the scene's `output.columns` are drawn. */
static bool is_drawn(const kt_column *column, bool is_default) {
    if (column->source == KT_COLUMN_TIME || column->source == KT_COLUMN_ENERGY || column->source == KT_COLUMN_WORK)
        return false;
    return !is_default || column->source == KT_COLUMN_POSITION || column->source == KT_COLUMN_MARKER ||
           column->source == KT_COLUMN_OWN;
}

static int run_panel_of(kt_plot_run *plot, size_t column) {
    const kt_measure quantity = kt_column_quantity(plot->columns, column);
    for (int i = 0; i < plot->panel_count; i++)
        if (strcmp(kt_column_quantity(plot->columns, plot->panels[i]).title, quantity.title) == 0)
            return i;
    if (plot->panel_count == PANELS_MAX)
        return -1;
    plot->panels[plot->panel_count] = column;
    return plot->panel_count++;
}

kt_plot_run *kt_plot_run_start(const kt_columns *columns, const kt_run *run) {
    const bool is_default = run->record == KT_RECORD_DEFAULT;
    kt_plot_run *plot = calloc(1, sizeof *plot);
    if (plot == NULL)
        return NULL;
    plot->columns = columns;
    plot->width = columns->count + 1;
    plot->has_energy = is_default || (run->record & (KT_RECORD_ENERGY | KT_RECORD_BALANCE)) != 0;
    plot->panel = malloc(columns->count * sizeof *plot->panel);
    plot->panels = malloc(PANELS_MAX * sizeof *plot->panels);
    if (plot->panel == NULL || plot->panels == NULL) {
        kt_plot_run_free(plot);
        return NULL;
    }
    for (size_t i = 0; i < columns->count; i++)
        plot->panel[i] = is_drawn(&columns->columns[i], is_default) ? run_panel_of(plot, i) : -1;
    return plot;
}

/* ---- records ----------------------------------------------------------------------------------------------------- */

int kt_plot_run_take(kt_plot_run *plot, const kt_record *record, const double *values) {
    const double total = kt_shown_energy_of(record);
    if (plot->count == 0)
        plot->energy_start = total;
    const double change = total - plot->energy_start;
    plot->count++;
    kt_bytes_add(&plot->rows, &change, sizeof change);
    kt_bytes_add(&plot->rows, values, plot->columns->count * sizeof *values);
    if (plot->rows.is_short)
        (void)kt_say_no_memory("the picture");
    return plot->rows.is_short ? -1 : 0;
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

/* The contents of the picture. candidates: the columns that have a panel; names: their names. */
typedef struct picture {
    const kt_plot_run *plot;
    const double *x; /* the time */
    kt_plot_size size;
    kt_candidate *candidates;
    int candidate_count;
    char (*names)[160];
    kt_plot_series series[PANELS_MAX + 1][KT_PLOT_SERIES_MAX];
    kt_plot_panel panels[PANELS_MAX + 1];
    int panel_count;
} picture;

static bool is_residual(const kt_plot_run *plot, int panel) {
    return plot->columns->columns[plot->panels[panel]].source == KT_COLUMN_RESIDUAL;
}

/* Reactions are one family, also if they are in different panels. */
static int family_of(const kt_plot_run *plot, size_t column) {
    const kt_column_source source = plot->columns->columns[column].source;
    return source == KT_COLUMN_REACTION || source == KT_COLUMN_LOOP_REACTION || source == KT_COLUMN_MULTIPLIER ||
                   source == KT_COLUMN_BEARING
               ? -1
               : plot->panel[column];
}

/* columns: the rows transposed, plot->count numbers each. */
static void list_column_candidates(picture *p, const double *columns, bool is_quiet) {
    const kt_plot_run *plot = p->plot;
    for (size_t i = 0; i < plot->columns->count; i++) {
        if (plot->panel[i] < 0)
            continue;
        char *name = p->names[p->candidate_count];
        (void)kt_column_name(plot->columns, i, name, sizeof *p->names);
        p->candidates[p->candidate_count++] = (kt_candidate){.name = name,
                                                             .label = kt_label_of_column(name),
                                                             .y = columns + (i + 1) * plot->count,
                                                             .panel = plot->panel[i],
                                                             .family = family_of(plot, i),
                                                             .is_error = is_residual(plot, plot->panel[i])};
    }
    kt_candidates_choose(p->candidates, p->candidate_count, plot->count);
    if (!is_quiet)
        kt_candidates_say_noise("run", p->candidates, p->candidate_count);
}

static void add_run_panel(picture *p, int panel) {
    const kt_measure quantity = kt_column_quantity(p->plot->columns, p->plot->panels[panel]);
    kt_plot_panel *made = &p->panels[p->panel_count];
    *made =
        kt_candidates_panel(p->candidates, p->candidate_count, panel, p->x, p->plot->count, p->series[p->panel_count]);
    made->title = quantity.title;
    made->unit = quantity.unit[0] != '\0' ? quantity.unit : NULL;
    made->y_log = is_residual(p->plot, panel);
    p->panel_count += made->series_count > 0; /* else there is noise alone */
}

static void add_energy_panel(picture *p, const kt_outcome *outcome, const double *change) {
    const bool is_error =
        outcome->so_far.energy.has_balance || outcome->so_far.energy.energetics == KT_ENERGY_CONSERVED;
    kt_plot_series *series = p->series[p->panel_count];
    series[0] = (kt_plot_series){
        .label = is_error ? "drift" : "change", .x = p->x, .y = change, .count = p->plot->count, .is_dense = true};
    p->panels[p->panel_count++] =
        (kt_plot_panel){.title = outcome->so_far.energy.has_balance ? "Drift of the energy balance"
                                 : is_error                         ? "Drift of the total energy"
                                                                    : "Change of the total energy",
                        .unit = "J",
                        .series = series,
                        .series_count = 1};
}

static int draw_run_plot(picture *p, const double *columns, const kt_outcome *outcome, const char *path, bool is_dark,
                         bool is_quiet) {
    kt_plot_event events[KT_MARKS_MAX];
    p->x = columns + p->plot->count; /* the time is the first column */
    list_column_candidates(p, columns, is_quiet);
    for (int panel = 0; panel < p->plot->panel_count; panel++)
        add_run_panel(p, panel);
    if (p->plot->has_energy || p->panel_count == 0)
        add_energy_panel(p, outcome, columns);
    kt_panels_mark(p->panels, p->panel_count, &outcome->marks, events);
    const kt_method_words method = kt_describe_method(outcome->run);
    const kt_noise_words noise = kt_candidates_note_noise(p->candidates, p->candidate_count);
    char subtitle[400];
    snprintf(subtitle, sizeof subtitle, "%s%s%s", method.text, noise.text, kt_marks_note(&outcome->marks));
    const kt_plot chart = {.title = outcome->name,
                           .subtitle = subtitle,
                           .x_title = "time",
                           .x_unit = "s",
                           .panels = p->panels,
                           .panel_count = p->panel_count,
                           .is_dark = is_dark,
                           .size = p->size};
    return kt_plot_draw(&chart, path);
}

int kt_plot_run_write(const kt_plot_run *plot, const kt_outcome *outcome, const char *path, kt_plot_size size,
                      bool is_dark, bool is_quiet) {
    const size_t width = plot->width;
    const double *rows = (const double *)(const void *)plot->rows.text;
    double *columns = malloc((plot->count * width + 1) * sizeof *columns);
    picture *p = calloc(1, sizeof *p);
    kt_candidate *candidates = malloc(width * sizeof *candidates);
    char(*names)[160] = malloc(width * sizeof *names);
    int code;
    if (columns == NULL || p == NULL || candidates == NULL || names == NULL) {
        code = kt_say_no_memory("the picture");
    } else {
        *p = (picture){.plot = plot, .size = size, .candidates = candidates, .names = names};
        for (size_t i = 0; i < plot->count; i++)
            for (size_t k = 0; k < width; k++)
                columns[k * plot->count + i] = rows[i * width + k];
        code = draw_run_plot(p, columns, outcome, path, is_dark, is_quiet);
    }
    free(names);
    free(candidates);
    free(p);
    free(columns);
    return code;
}

void kt_plot_run_free(kt_plot_run *plot) {
    if (plot == NULL)
        return;
    free(plot->panel);
    free(plot->panels);
    free(plot->rows.text);
    free(plot);
}
