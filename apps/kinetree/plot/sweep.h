/* Pictures of a sweep's lines: columns over the swept values, as curves or points, as colours over two, as
 * histograms. */
#ifndef KT_COMMAND_PLOT_SWEEP_H
#define KT_COMMAND_PLOT_SWEEP_H

#include "plot/plot.h"
#include "records/table.h"

#include <stdbool.h>

typedef struct kt_sweep_chart {
    const kt_table *table;
    const char *title;
    const int *columns; /* that are drawn, a panel each */
    int column_count;
    int x;  /* the column that they are drawn over */
    int by; /* a curve for each of its values; the other axis of a map; -1: none */
    kt_plot_size size;
    bool is_map, is_histogram, is_log, is_dark;
} kt_sweep_chart;

/* Whether a table has the lines of a sweep. *first and *count: the columns of the swept values. */
bool kt_sweep_table_find(const kt_table *table, int *first, int *count);

/* Returns an exit code. */
int kt_sweep_plot(const kt_sweep_chart *chart, const char *out);

#endif
