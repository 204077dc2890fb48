/* The arguments of 'kinetree plot', and the chart of the records of runs. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_PLOT_CHART_H
#define KT_COMMAND_SUBCOMMANDS_PLOT_CHART_H

#include "plot/plot.h"
#include "records/keep.h"

typedef struct kt_plot_arguments {
    const char *columns, *phase, *x, *by, *map, *marks, *title, *size, *out;
    bool histogram, log, dark;
    kt_plot_size page; /* --size */
} kt_plot_arguments;

/* Draws a table of records into the file `out`. `path` is the file of the records, and `base` the title if no scene has
 * a name. Returns the exit code, after printing an error. */
int kt_plot_draw_chart(const kt_plot_arguments *arguments, const kt_table *table, const char *path, const char *base,
                       const char *out);

/* Lists the columns whose names begin with a word of --columns, each column once. `columns` has room for all of them.
 * Returns -1, or an exit code after printing the error. */
int kt_plot_list_columns(const kt_table *table, const char *list, int *columns, int *count);

/* Prints that an option names a column that the table lacks, and which ones it may mean. Returns the exit code. */
int kt_plot_say_no_column(const kt_table *table, const char *option, const char *name);

#endif
