/* kinetree plot: draws the columns of a result, with one panel for each kind of quantity, because kinds differ in their
 * units. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/plot.h"
#include "command.h"
#include "plot/kind.h"
#include "records/output.h"
#include "subcommands/plot_chart.h"
#include "text/arguments.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KT_AT(member) offsetof(kt_plot_arguments, member)

static const kt_option options[] = {
    KT_OPTION(NAMES, "columns", columns, "A,B", "draw these columns: names, or beginnings such as 'velocity'"),
    KT_OPTION(TEXT, "phase", phase, "JOINT", "draw the velocity of a joint against its position"),
    KT_OPTION(TEXT, "x", x, "COLUMN", "draw against this column; default: the first"),
    KT_OPTION(TEXT, "by", by, "COLUMN", "draw a curve for each value of this column of a sweep"),
    KT_OPTION(TEXT, "map", map, "A,B", "draw a sweep as colours over these two columns"),
    KT_FLAG("histogram", histogram, "count the runs of a sweep by their values"),
    KT_FLAG("log", log, "draw magnitudes on logarithmic axes"),
    KT_OPTION(TEXT, "marks", marks, "SUMMARY", "draw lines at the events and impacts in this summary of the run"),
    KT_OPTION(TEXT, "title", title, "TEXT",
              "set the title; default: the name of the scene in --marks or in the summary NAME.json next to NAME.csv, "
              "or of the file"),
    KT_OPTION(TEXT, "size", size, "WxH", "set width and height, such as 1200x800; default: it fits a screen"),
    KT_OPTION(TEXT, "out", out, "FILE", "write the picture here: FILE.svg, FILE.png or FILE.pdf; default: NAME.svg"),
    KT_FLAG("dark", dark, "draw on a dark page"),
};

/* The picture of one has no place for the other. */
static const kt_option_rule rules[] = {
    {"phase", false, "columns,x,log", NULL},
    {"map", false, "x,by,histogram", NULL},
    {"histogram", false, "x,by", NULL},
};

const kt_usage kt_usage_plot = {
    .command = "plot",
    .examples = "  kinetree plot pendulum.csv\n"
                "  kinetree plot pendulum.csv --columns velocity.upper,velocity.lower,energy --out speeds.png\n"
                "  kinetree plot pendulum.csv --phase lower --dark\n"
                "  kinetree plot pendulum.csv --x marker.lower.tip.x --columns marker.lower.tip.y\n"
                "  kinetree plot short.csv long.csv --columns position.arm\n"
                "  kinetree plot records.h5 --columns position.arm\n"
                "  kinetree plot ball.csv --marks ball.json             after run --summary ball.json\n"
                "  kinetree plot lengths-sweep.csv --columns position.arm.max --by m\n"
                "  kinetree plot lengths-sweep.csv --columns energy.error --map L,m --log\n"
                "  kinetree run pendulum.yaml --out - | kinetree plot - --out pendulum.svg\n",
    .operands = "RESULT...",
    .about = "Draws the records of 'kinetree run' ('-': standard input).\n"
             "The default is positions, auxiliary states, forces of effects, energies, the openings of loops and\n"
             "columns by formulas, against time.\n"
             "Each quantity shows the columns that vary most, without columns of rounding noise.\n"
             "If a marker is drawn against a marker, both axes have one scale.\n"
             "Several results, and the runs of an HDF5 file, are drawn over each other.\n"
             "The columns of a sweep are drawn over its first column that varies.\n"
             "The columns are drawn as curves if each value has one run, and as points otherwise.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

/* ---- sweeps ------------------------------------------------------------------------------------------------------ */

/* Finds the column that an option names, if it is given. */
static int find_plotted_column(const kt_table *table, const char *option, const char *name, int *column) {
    if (name == NULL)
        return -1;
    for (*column = 0; *column < table->columns; ++*column)
        if (strcmp(table->names[*column], name) == 0)
            return -1;
    return kt_plot_say_no_column(table, option, name);
}

/* Adds the functionals of results with one of these endings. */
static void add_functionals(const kt_table *table, int first, const char *endings, int *columns, int *count) {
    for (int i = first; i + 1 < table->columns; i++)
        if (kt_column_ends(table->names[i], endings))
            columns[(*count)++] = i;
}

/* Chooses the columns whose names begin with a word of --columns. The default is the columns of events, maxima and
 * ends, or the other functionals if there are none of these. Returns -1, or an exit code after printing the error. */
static int choose_columns(const kt_plot_arguments *arguments, const kt_table *table, int first, int *columns,
                          int *count) {
    int code = -1;
    *count = 0;
    for (int i = first; arguments->columns == NULL && i + 1 < table->columns; i++)
        if (strncmp(table->names[i], "event.", 6) == 0 || kt_column_ends(table->names[i], ".end|.max"))
            columns[(*count)++] = i;
    if (arguments->columns == NULL && *count == 0)
        add_functionals(table, first, ".min|.mean|.rms|.integral", columns, count);
    if (arguments->columns != NULL)
        code = kt_plot_list_columns(table, arguments->columns, columns, count);
    if (code < 0 && *count == 0)
        code = kt_misuse("plot: there is nothing to draw: --columns chooses");
    return code;
}

/* Chooses the columns over which the others are drawn (--map, --x, --by). */
static int choose_axes(const kt_plot_arguments *arguments, const kt_table *table, kt_sweep_chart *chart) {
    if (arguments->map == NULL) {
        const int code = find_plotted_column(table, "x", arguments->x, &chart->x);
        return code < 0 ? find_plotted_column(table, "by", arguments->by, &chart->by) : code;
    }
    const char *comma = strchr(arguments->map, ',');
    if (comma == NULL)
        return kt_misuse("plot: --map takes two columns, A,B, not '%s'", arguments->map);
    char *first = strndup(arguments->map, (size_t)(comma - arguments->map));
    int code = first != NULL ? find_plotted_column(table, "map", first, &chart->x) : kt_say_no_memory("the picture");
    free(first);
    return code < 0 ? find_plotted_column(table, "map", comma + 1, &chart->by) : code;
}

static int draw_sweep(const kt_plot_arguments *arguments, const kt_table *table, int first, int count, const char *base,
                      const char *out) {
    int *columns = malloc((size_t)table->columns * sizeof *columns), chosen = 0;
    kt_sweep_chart chart = {.table = table,
                            .title = arguments->title != NULL ? arguments->title : base,
                            .x = first,
                            .by = -1,
                            .columns = columns,
                            .is_map = arguments->map != NULL,
                            .is_histogram = arguments->histogram,
                            .is_log = arguments->log,
                            .is_dark = arguments->dark,
                            .size = arguments->page};
    int code = columns != NULL ? choose_axes(arguments, table, &chart) : kt_say_no_memory("the picture");
    if (code < 0)
        code = choose_columns(arguments, table, first + count, columns, &chosen);
    chart.column_count = chosen;
    if (code < 0)
        code = kt_sweep_plot(&chart, out);
    free(columns);
    return code;
}

static int draw_table(const kt_plot_arguments *arguments, const kt_table *table, const char *path, const char *base,
                      const char *out) {
    int first, count;
    if (kt_sweep_table_find(table, &first, &count)) {
        if (arguments->marks == NULL && arguments->phase == NULL)
            return draw_sweep(arguments, table, first, count, base, out);
        return kt_misuse("plot: --%s goes with the records of a run, and these are the lines of a sweep; leave it out",
                         arguments->marks != NULL ? "marks" : "phase");
    }
    if (arguments->by != NULL || arguments->map != NULL || arguments->histogram)
        return kt_misuse("plot: --by, --map and --histogram draw the lines of a sweep ('run', its values, 'status', "
                         "...), and this file is no sweep");
    return kt_plot_draw_chart(arguments, table, path, base, out);
}

int kt_command_plot(int argc, char **argv) {
    kt_plot_arguments arguments = {0};
    kt_table table;
    char name[512];
    int operands;
    int code = kt_arguments_read(&kt_usage_plot, argc, argv, &arguments, &operands);
    if (code >= 0)
        return code;
    char *base = kt_base_name(argv[1]);
    snprintf(name, sizeof name, "%s.svg", base != NULL ? base : "result");
    const char *out = arguments.out != NULL ? arguments.out : name;
    code = kt_plot_check(out);
    code = code < 0 ? kt_plot_size_read("plot", arguments.size, &arguments.page) : code;
    for (int i = 1; i <= operands && code < 0; i++)
        code = kt_check_result("plot", "the result", argv[i], "--out", out);
    const char *ending = strrchr(argv[1], '.');
    if (code < 0 && ending != NULL && strcmp(ending, ".yaml") == 0)
        code = kt_misuse("plot: %s is a scene, not a result: 'kinetree run %s --plot %s' runs and draws it", argv[1],
                         argv[1], out);
    if (code < 0)
        code = kt_table_read_files(argv + 1, operands, &table);
    if (code < 0) {
        char replaced[600] = "";
        kt_note_replaced(out, replaced, sizeof replaced);
        code = draw_table(&arguments, &table, argv[1], base != NULL ? base : "result", out);
        kt_table_free(&table);
        if (code == KT_EXIT_DONE)
            kt_say_written("picture", out, "", replaced);
    }
    free(base);
    return code;
}
