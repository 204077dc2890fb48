/* The chart of the records of runs: panels, titles and marks. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/plot_chart.h"
#include "command.h"
#include "plot/choice.h"
#include "plot/kind.h"
#include "plot/plot.h"
#include "records/keep.h"
#include "records/marks.h"
#include "records/output.h"
#include "text/input.h"
#include "text/list.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    OWN_KINDS = 12, /* columns of a scene's own that have units: "range [m]" */
    KINDS = KT_COLUMN_KINDS + OWN_KINDS,
    PART_PANELS = 12,
};

typedef struct kt_chart {
    const kt_plot_arguments *arguments;
    const kt_table *table;
    const double *x;
    const char *x_name;
    bool is_complete;   /* memory has sufficed */
    double *magnitudes; /* buffer for the columns of logarithmic panels, one after the other */
    size_t magnitude_count;
    kt_plot_series series[KINDS][KT_PLOT_SERIES_MAX];
    char labels[KINDS * KT_PLOT_SERIES_MAX][128]; /* of shown columns */
    char units[KT_COLUMN_KINDS][16];              /* by the summary */
    kt_candidate *candidates;                     /* the requested columns */
    int candidate_count;
    struct own_kind {
        const char *name;
        char title[96], unit[32];
    } own[OWN_KINDS];
    int own_count;
    kt_plot_panel panels[KINDS + PART_PANELS];
    int panel_count;
    kt_plot_series *parts[PART_PANELS]; /* of each panel of several results: a curve for each */
    char part_titles[PART_PANELS][160];
    int part_panels, parts_left_out; /* columns that have such a panel, and that have none */
    kt_plot_scale scale;
    char scene[256]; /* its name, if a summary contains it */
    kt_marks marks;
    kt_plot_event events[KT_MARKS_MAX]; /* as lines */
} kt_chart;

/* Returns the kind of a column in a picture. An own column with a unit gets a kind of its own, as long as there is
 * room. */
static int chart_panel_of(kt_chart *chart, const char *name) {
    for (int i = 0; i < chart->own_count; i++)
        if (strcmp(chart->own[i].name, name) == 0)
            return KT_COLUMN_KINDS + i;
    if (!kt_column_has_own_unit(name) || chart->own_count == OWN_KINDS)
        return kt_column_kind_of(name);
    struct own_kind *own = &chart->own[chart->own_count];
    const char *bracket = strstr(name, " [");
    own->name = name;
    (void)snprintf(own->title, sizeof own->title, "%.*s", (int)(bracket - name), name);
    (void)snprintf(own->unit, sizeof own->unit, "%.*s", (int)strlen(bracket) - 3, bracket + 2);
    return KT_COLUMN_KINDS + chart->own_count++;
}

/* Returns the kind at an index. Ownership: the chart owns titles and units. */
static kt_column_kind kind_at(const kt_chart *chart, int kind) {
    if (kind < KT_COLUMN_KINDS)
        return kt_column_kinds[kind];
    const struct own_kind *own = &chart->own[kind - KT_COLUMN_KINDS];
    return (kt_column_kind){.name = own->name, .title = own->title, .unit = own->unit};
}

/* Returns the magnitudes of a column for a logarithmic axis, with NaN in place of zeros. */
static const double *take_magnitudes(kt_chart *chart, const double *y) {
    double *to = chart->magnitudes + chart->magnitude_count;
    for (size_t i = 0; i < chart->table->rows; i++)
        to[i] = y[i] != 0.0 ? fabs(y[i]) : (double)NAN;
    chart->magnitude_count += chart->table->rows;
    return to;
}

static bool is_log(const kt_chart *chart, int kind) { return chart->arguments->log || kind_at(chart, kind).is_log; }

static void add_chart_column(kt_chart *chart, int column) {
    const char *name = chart->table->names[column];
    const int kind = chart_panel_of(chart, name);
    chart->candidates[chart->candidate_count++] =
        (kt_candidate){.name = name,
                       .y = chart->table->cells + (size_t)column * chart->table->rows,
                       .panel = kind,
                       .family = strncmp(name, "reaction", 8) == 0 || strncmp(name, "bearing.", 8) == 0 ? -1 : kind,
                       .is_error = is_log(chart, kind) && kind_at(chart, kind).is_residual};
}

/* Writes the part of a column's name that the title of its panel lacks: "strut.force" for "effect.strut.force [N]". */
static void write_label(const char *name, int kind, char *label, size_t size) {
    const char *unit = kind >= KT_COLUMN_KINDS || kt_column_kinds[kind].unit != NULL ? strstr(name, " [") : NULL;
    const char *from = kind < KT_COLUMN_KINDS - 1 ? kt_label_of_column(name) : name;
    (void)snprintf(label, size, "%.*s", unit != NULL ? (int)(unit - from) : (int)strlen(from), from);
}

/* Adds a panel for one column of several results. Each result is one curve. If there are more results than colours in
 * the palette, a colour scale shows their numbers. */
static void add_parts(kt_chart *chart, const kt_candidate *column) {
    const kt_table *table = chart->table;
    const int kind = column->panel, k = chart->part_panels;
    kt_plot_series *series = k < PART_PANELS && chart->is_complete ? calloc(table->part_count, sizeof *series) : NULL;
    chart->is_complete = chart->is_complete && (series != NULL || k == PART_PANELS);
    if (series == NULL) {
        chart->parts_left_out++;
        return;
    }
    const double *y = is_log(chart, kind) ? take_magnitudes(chart, column->y) : column->y;
    for (size_t i = 0; i < table->part_count; i++) {
        const kt_table_part *part = &table->parts[i];
        series[i] = (kt_plot_series){.label = part->name,
                                     .x = chart->x + part->first,
                                     .y = y + part->first,
                                     .count = part->rows,
                                     .value = (double)(i + 1),
                                     .is_dense = kt_plot_is_rising(chart->x + part->first, part->rows)};
    }
    chart->scale = (kt_plot_scale){1.0, (double)table->part_count, false, "result"};
    (void)snprintf(chart->part_titles[k], sizeof chart->part_titles[k], "%.*s", (int)strcspn(column->name, " "),
                   column->name);
    chart->parts[chart->part_panels++] = series;
    chart->panels[chart->panel_count++] =
        (kt_plot_panel){.title = chart->part_titles[k],
                        .unit = kind_at(chart, kind).unit,
                        .series = series,
                        .series_count = (int)table->part_count,
                        .has_legend = true,
                        .scale = table->part_count > KT_PLOT_SERIES_MAX ? &chart->scale : NULL,
                        .y_log = is_log(chart, kind)};
}

static void add_chart_panel(kt_chart *chart, int kind) {
    kt_plot_panel *made = &chart->panels[chart->panel_count];
    *made = kt_candidates_panel(chart->candidates, chart->candidate_count, kind, chart->x, chart->table->rows,
                                chart->series[kind]);
    made->title = kind_at(chart, kind).title;
    made->unit = kind_at(chart, kind).unit;
    made->y_log = is_log(chart, kind);
    chart->panel_count += made->series_count > 0;
}

static void add_panels(kt_chart *chart) {
    const bool has_parts = chart->table->part_count > 1;
    kt_candidates_choose(chart->candidates, chart->candidate_count, chart->table->rows);
    kt_candidates_say_noise("plot", chart->candidates, chart->candidate_count);
    for (int i = 0, shown = 0; i < chart->candidate_count; i++) {
        kt_candidate *column = &chart->candidates[i];
        if (column->is_shown && has_parts) {
            add_parts(chart, column);
        } else if (column->is_shown) {
            column->label = chart->labels[shown];
            write_label(column->name, column->panel, chart->labels[shown], sizeof chart->labels[shown]);
            column->y = is_log(chart, column->panel) ? take_magnitudes(chart, column->y) : column->y;
            shown++;
        }
    }
    for (int kind = 0; kind < KT_COLUMN_KINDS + chart->own_count && !has_parts; kind++)
        add_chart_panel(chart, kind);
}

/* Returns whether a name occurs in a column's name after a point, as "legs" in "marker.legs.toes.x". */
static bool has_part(const char *column, const char *name) {
    for (const char *dot = strchr(column, '.'); dot != NULL; dot = strchr(dot + 1, '.'))
        if (kt_column_begins(dot + 1, name))
            return true;
    return false;
}

/* Writes the columns that contain a name, or all for NULL, as a list: the first few, and the number of the others.
 * Returns how many there are. */
static int list_matching_columns(const kt_table *table, const char *name, char *text, size_t size) {
    enum { NAMED = 4 };
    size_t used = 0;
    int count = 0;
    text[0] = '\0';
    for (int i = 0; i < table->columns; i++)
        if ((name == NULL || has_part(table->names[i], name)) && count++ < NAMED)
            used += (size_t)snprintf(text + used, size - used, "%s'%.80s'", used > 0 ? ", " : "", table->names[i]);
    if (count > NAMED)
        snprintf(text + used, size - used, " and %d more", count - NAMED);
    return count;
}

int kt_plot_say_no_column(const kt_table *table, const char *option, const char *name) {
    char columns[400];
    const int about = list_matching_columns(table, name, columns, sizeof columns);
    kt_nearest nearest = kt_nearest_make(name, NULL);
    const bool takes_beginnings = strcmp(option, "columns") == 0;
    for (int i = 0; i < table->columns; i++) {
        (void)kt_nearest_try(&nearest, table->names[i]);
        if (takes_beginnings)
            (void)kt_nearest_try(&nearest, kt_column_kinds[kt_column_kind_of(table->names[i])].name);
    }
    const kt_question did = kt_ask(&nearest, "", "");
    if (about > 0)
        kt_say("plot: --%s: there is no column '%s'; about it there %s %s", option, name, about == 1 ? "is" : "are",
               columns);
    else if (did.text[0] != '\0')
        kt_say("plot: --%s: there is no column '%s'%s", option, name, did.text);
    else if (list_matching_columns(table, NULL, columns, sizeof columns) > 0)
        kt_say("plot: --%s: there is no column '%s'; the columns are %s", option, name, columns);
    return KT_EXIT_USAGE;
}

/* Adds the columns whose names begin with a word, except those that are listed already. 'position,position.arm' would
 * list one column twice. Returns false if no name begins so. */
static bool list_begun_columns(const kt_table *table, const char *word, int *columns, int *count) {
    bool found = false;
    for (int i = 0; i < table->columns; i++) {
        bool is_new = kt_column_begins(table->names[i], word);
        found = found || is_new;
        for (int k = 0; k < *count; k++)
            is_new = is_new && columns[k] != i;
        if (is_new)
            columns[(*count)++] = i;
    }
    return found;
}

int kt_plot_list_columns(const kt_table *table, const char *list, int *columns, int *count) {
    const size_t size = strlen(list) + 1;
    char *word = malloc(size);
    int code = word != NULL ? -1 : kt_say_no_memory("the picture");
    *count = 0;
    while (code < 0 && kt_list_next(&list, word, size))
        if (!list_begun_columns(table, word, columns, count))
            code = kt_plot_say_no_column(table, "columns", word);
    free(word);
    return code;
}

static int add_listed(kt_chart *chart, const char *list) {
    int *columns = malloc((size_t)chart->table->columns * sizeof *columns), count = 0;
    const int code =
        columns != NULL ? kt_plot_list_columns(chart->table, list, columns, &count) : kt_say_no_memory("the picture");
    for (int i = 0; code < 0 && i < count; i++)
        add_chart_column(chart, columns[i]);
    if (code < 0)
        add_panels(chart);
    free(columns);
    return code;
}

static bool is_default(const char *name) {
    return kt_column_kinds[kt_column_kind_of(name)].is_default || kt_column_has_own_unit(name);
}

/* Adds the quantities that are drawn by default, and the own columns of the scene. A table without these quantities,
 * such as one of another program, is drawn as a whole. */
static void add_default(kt_chart *chart) {
    bool has_kinds = false;
    for (int i = 0; i < chart->table->columns; i++)
        has_kinds = has_kinds || is_default(chart->table->names[i]);
    for (int i = 0; i < chart->table->columns; i++)
        if ((!has_kinds || is_default(chart->table->names[i]) || kt_column_is_own(chart->table->names[i])) &&
            chart->table->cells + (size_t)i * chart->table->rows != chart->x)
            add_chart_column(chart, i);
    add_panels(chart);
}

/* Returns whether markers are drawn over a marker coordinate: a path in space, drawn with one scale for both axes. */
static bool is_path(const kt_chart *chart) {
    bool all = kt_column_kind_of(chart->x_name) == KT_COLUMN_MARKER && chart->panel_count == 1 &&
               (chart->panels[0].series == chart->series[KT_COLUMN_MARKER] || chart->part_panels == 1);
    return all && !is_log(chart, KT_COLUMN_MARKER);
}

static void make_path(kt_chart *chart) {
    chart->panels[0].is_equal = true;
    chart->panels[0].x_title = chart->x_name;
    chart->panels[0].x_unit = "m";
}

/* Adds the phase plane of a joint, and writes its title. Returns -1 on success, else an exit code. */
static int add_phase(kt_chart *chart, const char *joint, char *title, size_t size) {
    char position[256], velocity[256];
    snprintf(position, sizeof position, "position.%s", joint);
    snprintf(velocity, sizeof velocity, "velocity.%s", joint);
    chart->x = kt_table_column(chart->table, position);
    const double *y = kt_table_column(chart->table, velocity);
    if (chart->x == NULL || y == NULL)
        return kt_plot_say_no_column(chart->table, "phase", chart->x == NULL ? position : velocity);
    snprintf(title, size, "Velocity of %s", joint);
    chart->series[0][0] = (kt_plot_series){.label = joint, .x = chart->x, .y = y, .count = chart->table->rows};
    chart->panels[chart->panel_count++] = (kt_plot_panel){.title = title,
                                                          .unit = "rad/s or m/s",
                                                          .series = chart->series[0],
                                                          .series_count = 1,
                                                          .x_title = "its position",
                                                          .x_unit = "rad or m"};
    return -1;
}

/* ---- marks ------------------------------------------------------------------------------------------------------- */

static const char *unit_in(const json_t *summary, const char *column) {
    return json_string_value(json_object_get(json_object_get(json_object_get(summary, "columns"), column), "unit"));
}

/* The unit of all columns that a panel of this kind shows, by the summary; NULL: they differ, or it has none. */
static const char *common_unit(const kt_chart *chart, const json_t *summary, int kind) {
    const char *unit = NULL;
    for (int i = 0; i < chart->candidate_count; i++) {
        const kt_candidate *column = &chart->candidates[i];
        if (column->panel != kind || !column->is_shown)
            continue;
        const char *own = unit_in(summary, column->name);
        if (own == NULL || (unit != NULL && strcmp(own, unit) != 0))
            return NULL;
        unit = own;
    }
    return unit;
}

/* The units of the axes of a phase plane. */
static void decide_phase_units(kt_chart *chart, const json_t *summary, const char *joint) {
    static const char *const quantities[2] = {"position", "velocity"};
    const char **units[2] = {&chart->panels[0].x_unit, &chart->panels[0].unit};
    char column[256];
    for (int i = 0; i < 2; i++) {
        (void)snprintf(column, sizeof column, "%s.%s", quantities[i], joint);
        const char *unit = unit_in(summary, column);
        if (unit != NULL) {
            (void)snprintf(chart->units[i], sizeof chart->units[i], "%s", unit);
            *units[i] = chart->units[i];
        }
    }
}

/* A column of a joint has no unit in its name. The summary decides between 'rad' and 'm'. */
static void decide_units(kt_chart *chart, const json_t *summary) {
    for (int kind = 0; kind < KT_COLUMN_KINDS; kind++) {
        const char *unit = common_unit(chart, summary, kind);
        if (unit == NULL || kt_column_kinds[kind].unit == NULL || strchr(unit, '^') != NULL ||
            strstr(kt_column_kinds[kind].unit, " or ") == NULL)
            continue;
        (void)snprintf(chart->units[kind], sizeof chart->units[kind], "%s", unit);
        for (int i = 0; i < chart->panel_count; i++)
            if (chart->panels[i].series == chart->series[kind])
                chart->panels[i].unit = chart->units[kind];
    }
}

/* Finds the name of the scene, and units, in the summary next to the records: NAME.json for NAME.csv. The summary must
 * end at the same time as the records. */
static void read_chart_summary(kt_chart *chart, const char *path) {
    const ptrdiff_t length = kt_stem_length(path, ".csv");
    char summary[4096];
    if (chart->table->part_count > 1 || length < 0 ||
        snprintf(summary, sizeof summary, "%.*s.json", (int)length, path) >= (int)sizeof summary)
        return;
    kt_error error = {0};
    char *text = NULL;
    size_t size = 0;
    if (kt_input_read(summary, &kt_input_summary, &text, &size, &error) != KT_OK)
        return;
    json_t *root = json_loadb(text, size, 0, NULL);
    free(text);
    const double *times = kt_table_column(chart->table, "time");
    const char *scene = json_string_value(json_object_get(root, "scene"));
    const double end = json_number_value(json_object_get(root, "time"));
    if (scene != NULL && times != NULL && chart->table->rows > 0 &&
        fabs(times[chart->table->rows - 1] - end) <= 1e-9 * fabs(end)) {
        if (chart->scene[0] == '\0')
            (void)snprintf(chart->scene, sizeof chart->scene, "%s", scene);
        if (chart->arguments->phase != NULL)
            decide_phase_units(chart, root, chart->arguments->phase);
        else
            decide_units(chart, root);
    }
    json_decref(root);
}

/* Adds them to all panels, which are over the time. Returns -1, or an exit code after printing the error. */
static int add_marks(kt_chart *chart) {
    const kt_plot_arguments *arguments = chart->arguments;
    if (arguments->marks == NULL)
        return -1;
    if (arguments->phase != NULL || strcmp(chart->x_name, "time") != 0)
        return kt_misuse("plot: --marks are instants, and go with the time as x; leave them out");
    const int code = kt_marks_load(arguments->marks, "plot", &chart->marks, chart->scene, sizeof chart->scene);
    kt_panels_mark(chart->panels, chart->panel_count, &chart->marks, chart->events);
    return code;
}

/* Writes the line below the title: the numbers of records and results, and the omitted columns. */
static void write_subtitle(const kt_chart *chart, char *subtitle, size_t size) {
    const kt_table *table = chart->table;
    const kt_noise_words noise = kt_candidates_note_noise(chart->candidates, chart->candidate_count);
    const bool has_parts = table->part_count > 1;
    char parts[96] = "";
    if (has_parts && chart->parts_left_out > 0)
        snprintf(parts, sizeof parts, " of %zu results; %d more columns: --columns chooses", table->part_count,
                 chart->parts_left_out);
    else if (has_parts)
        snprintf(parts, sizeof parts, " of %zu results", table->part_count);
    const size_t records = table->rows - (has_parts ? table->part_count - 1 : 0);
    snprintf(subtitle, size, "%zu record%s%s%s%s%s", records, kt_plural((long long)records), parts, noise.text,
             kt_marks_note(&chart->marks), chart->arguments->log ? "; magnitudes" : "");
}

/* Chooses the panels that the arguments request. Returns -1, or an exit code after printing the error. */
static int choose_panels(kt_chart *chart, char *title, size_t size) {
    const kt_plot_arguments *arguments = chart->arguments;
    chart->x_name = arguments->x != NULL ? arguments->x : chart->table->names[0];
    chart->x = kt_table_column(chart->table, chart->x_name);
    if (chart->x == NULL)
        return kt_plot_say_no_column(chart->table, "x", chart->x_name);
    if (arguments->phase != NULL)
        return add_phase(chart, arguments->phase, title, size);
    if (arguments->columns != NULL)
        return add_listed(chart, arguments->columns);
    add_default(chart);
    return -1;
}

/* Paints the panels; the title is that of the arguments, the scene's name, or the name of the file. */
static int paint_chart(const kt_chart *chart, const char *base, const char *out) {
    const kt_plot_arguments *arguments = chart->arguments;
    char subtitle[400];
    write_subtitle(chart, subtitle, sizeof subtitle);
    const kt_plot plot = {.title = arguments->title != NULL  ? arguments->title
                                   : chart->scene[0] != '\0' ? chart->scene
                                                             : base,
                          .subtitle = subtitle,
                          .x_title = chart->x_name,
                          .x_unit = strcmp(chart->x_name, "time") == 0 ? "s" : NULL,
                          .panels = chart->panels,
                          .panel_count = chart->panel_count,
                          .is_row = arguments->phase != NULL || chart->panels[0].is_equal,
                          .is_dark = arguments->dark,
                          .size = arguments->page};
    return kt_plot_draw(&plot, out);
}

int kt_plot_draw_chart(const kt_plot_arguments *arguments, const kt_table *table, const char *path, const char *base,
                       const char *out) {
    kt_chart *chart = calloc(1, sizeof *chart);
    double *magnitudes = malloc((size_t)table->columns * table->rows * sizeof *magnitudes);
    kt_candidate *candidates = malloc((size_t)table->columns * sizeof *candidates);
    char title[300];
    int code = -1;
    if (chart == NULL || magnitudes == NULL || candidates == NULL) {
        code = kt_say_no_memory("the picture");
    } else {
        chart->arguments = arguments;
        chart->is_complete = true;
        chart->table = table;
        chart->magnitudes = magnitudes;
        chart->candidates = candidates;
        code = choose_panels(chart, title, sizeof title);
    }
    if (code < 0 && !chart->is_complete)
        code = kt_say_no_memory("the picture");
    if (code < 0 && chart->panel_count == 0)
        code = kt_misuse("plot: there is nothing to draw: --columns chooses");
    if (code < 0 && is_path(chart))
        make_path(chart);
    if (code < 0)
        code = add_marks(chart);
    if (code < 0) {
        read_chart_summary(chart, path);
        code = paint_chart(chart, base, out);
    }
    free(candidates);
    free(magnitudes);
    for (int i = 0; chart != NULL && i < chart->part_panels; i++)
        free(chart->parts[i]);
    if (chart != NULL)
        kt_marks_free(&chart->marks);
    free(chart);
    return code;
}
