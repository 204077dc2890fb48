/* Charts as SVG, PNG or PDF: panels in a column or in a row, each with its axes (linear or logarithmic), units and
 * series. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_PLOT_H
#define KT_COMMAND_PLOT_PLOT_H

#include "plot/size.h"
#include "records/table.h"

#include <stdbool.h>
#include <stddef.h>

/* ---- axes -------------------------------------------------------------------------------------------------------- */

/* An axis between low and high with at most `most` ticks at round numbers. Tick i is at first + i step, i < count.
 * Labels have `decimals` decimal places after division by 10^exponent. On a logarithmic axis tick i is at 10^(first + i
 * step). */
typedef struct kt_axis {
    double low, high;
    double first, step;
    int count;
    int exponent; /* 0 if the numbers are short without it */
    int decimals;
    double offset; /* the labels are differences from it; a multiple of ten steps */
    bool is_log;
} kt_axis;

/* Requires low < high, both finite. */
kt_axis kt_axis_make(double low, double high, int most);
/* Gives the axis an offset if its labels would have more than seven digits. */
void kt_axis_shift(kt_axis *axis);
/* Requires 0 < low < high. The axis is extended to contain at least two powers of ten. */
kt_axis kt_axis_make_log(double low, double high, int most);
double kt_axis_tick(const kt_axis *axis, int i);
/* Position of a value on the axis: 0 at low, 1 at high. NaN if a logarithmic axis cannot show it. */
double kt_axis_place(const kt_axis *axis, double value);
/* Label of tick i, with a true minus sign (UTF-8); on a logarithmic axis only the exponent. */
void kt_axis_text(const kt_axis *axis, int i, char *text, size_t size);

/* ---- charts ------------------------------------------------------------------------------------------------------ */

enum {
    KT_PLOT_SERIES_MAX = 7, /* colours that can be distinguished */
    KT_PLOT_MARK_COUNT = 7,
};

/* Points connected in their order; points that are not finite leave a gap. */
typedef struct kt_plot_series {
    const char *label;
    const double *x, *y;
    size_t count;
    int colour;               /* 1 to KT_PLOT_SERIES_MAX; 0: by its index in the panel */
    double value;             /* in a panel with a scale of colours: the value that the colour represents */
    int mark;                 /* 1 to KT_PLOT_MARK_COUNT at each point; 0: none */
    bool hollow;              /* marks */
    bool is_dashed;           /* lines */
    bool is_ringed;           /* rings around points, without lines and marks */
    bool is_floor;            /* bars under points, likewise */
    const double *x_high;     /* upper ends of bars along x; NULL: none */
    const char *const *names; /* texts next to the points; NULL: none */
    bool is_halo;             /* a broad faint line behind all others */
    bool is_scattered;        /* marks alone, without lines */
    bool is_dense; /* x is rising and there may be more points than pixels: draw only visible ones. Points between
                          gaps are dots */
} kt_plot_series;

/* Rectangles of a map, coloured by a value. */
typedef struct kt_plot_cells {
    const double *x, *y; /* two ends of each */
    const double *z;     /* NaN: none */
    size_t count;
    bool is_grid;             /* the shape is a grid; else small squares around the points */
    bool is_log;              /* colours by the logarithm of magnitudes */
    const char *label, *unit; /* of the colours; unit NULL: none */
} kt_plot_cells;

/* A scale of colours for more curves than a palette has colours: each has that of its value. */
typedef struct kt_plot_scale {
    double low, high;
    bool is_log;
    const char *label;
} kt_plot_scale;

/* A line across a panel, at an x. */
typedef struct kt_plot_event {
    double x;
    const char *label;
} kt_plot_event;

typedef struct kt_plot_panel {
    const char *title; /* quantity: "Energy drift" */
    const char *unit;  /* "J"; NULL: none */
    const kt_plot_series *series;
    int series_count;
    int left_out; /* number of further series that are not shown; the legend states it */
    bool has_legend;
    bool x_log, y_log;
    bool is_equal;                /* equal scales of x and y, for paths in space; linear axes only */
    const char *x_title, *x_unit; /* NULL: those of the whole plot */
    double blind;                 /* > 0: the region below this y is grey */
    const char *blind_label;
    double noise; /* > 0: a dashed line at this y */
    const char *noise_label;
    const int *orders; /* slopes -p that a fan of lines shows, on logarithmic axes; NULL: none */
    int order_count;
    const kt_plot_cells *cells;  /* NULL: none; the legend has their colours */
    const kt_plot_scale *scale;  /* scale of the series' colours; NULL: the palette has the colours */
    const kt_plot_event *events; /* x is rising; NULL: none */
    int event_count;
    bool names_events; /* names of events are shown where there is room */
} kt_plot_panel;

typedef struct kt_plot {
    const char *title, *subtitle;
    const char *x_title, *x_unit;
    const kt_plot_panel *panels;
    int panel_count;
    bool is_row; /* panels in a row, with one legend, that of the last. On a narrow page they are under each other */
    bool is_dark;
    kt_plot_size size;
} kt_plot;

/* Returns whether this build can draw pictures. */
bool kt_plot_is_possible(void);

/* Checks whether a picture can be drawn to a file of this name, by its extension and the libraries of this build.
 * Returns -1 if it can, else an exit code after printing the error. */
int kt_plot_check(const char *path);

/* Returns KT_EXIT_DONE, or an exit code after printing the error. */
int kt_plot_draw(const kt_plot *plot, const char *path);

/* Mode shapes: one panel per mode, two bars per coordinate. */
typedef struct kt_shape_panel {
    const char *title;  /* "1: 0.38 Hz, damping ratio 0.01" */
    const double *bars; /* two per coordinate: real part, in phase with the largest element, and imaginary part */
} kt_shape_panel;

typedef struct kt_shape_plot {
    const char *title;
    const char *subtitle;
    const char *const *names; /* names of the joints' coordinates */
    int count;                /* number of coordinates */
    const kt_shape_panel *panels;
    int panel_count;
    bool is_dark;
} kt_shape_plot;

/* Returns KT_EXIT_DONE, or an exit code after printing the error. The caller has checked the path with
 * kt_plot_check. */
int kt_plot_shapes(const kt_shape_plot *plot, const char *path);

/* Pictures of a sweep's lines: columns over the swept values, as curves or points, as colours over two, as
 * histograms. */
typedef struct kt_sweep_chart {
    const kt_table *table;
    const char *title;
    const int *columns; /* columns that are drawn, a panel each */
    int column_count;
    int x;  /* the column that they are drawn over */
    int by; /* a curve for each of its values; the other axis of a map; -1: none */
    kt_plot_size size;
    bool is_map, is_histogram, is_log, is_dark;
} kt_sweep_chart;

enum { KT_SWEEP_UNIT_SIZE = 48 };

/* The unit of a column of a sweep, which may be written to `unit` (sweep_unit.c); NULL: it has none, or it is
 * unknown. */
const char *kt_sweep_unit(const char *name, char unit[KT_SWEEP_UNIT_SIZE]);

/* Whether a table has the lines of a sweep. *first and *count: the columns of the swept values. */
bool kt_sweep_table_find(const kt_table *table, int *first, int *count);

/* Returns an exit code. */
int kt_sweep_plot(const kt_sweep_chart *chart, const char *out);

#endif
