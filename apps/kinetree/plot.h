/* Charts, as SVG or PNG: panels under or beside one another, each with its axes, linear or logarithmic, its units and
 * its series. */
#ifndef KT_COMMAND_PLOT_H
#define KT_COMMAND_PLOT_H

#include <stdbool.h>
#include <stddef.h>

/* ---- axes -------------------------------------------------------------------------------------------------------- */

/* Round numbers between low and high, at most `most` of them: first + i step, i = 0 .. count - 1, written with
 * `decimals` places after they are divided by 10^exponent. On a logarithmic axis 10^(first + i step). */
typedef struct kt_axis {
    double low, high;
    double first, step;
    int count;
    int exponent; /* 0 where the numbers are short as they are */
    int decimals;
    bool is_log;
} kt_axis;

/* low < high, both finite. */
kt_axis kt_axis_make(double low, double high, int most);
/* 0 < low < high; the axis is widened to hold two whole powers of ten at least. */
kt_axis kt_axis_make_log(double low, double high, int most);
double kt_axis_tick(const kt_axis *axis, int i);
/* Where a value lies: 0 at low, 1 at high. NaN where a logarithmic axis has no place for it. */
double kt_axis_place(const kt_axis *axis, double value);
/* With a true minus sign (UTF-8); of a logarithmic axis, the exponent alone. */
void kt_axis_text(const kt_axis *axis, int i, char *text, size_t size);

/* ---- charts ------------------------------------------------------------------------------------------------------ */

enum {
    KT_PLOT_SERIES_MAX = 7, /* colours that can be told apart */
    KT_PLOT_MARK_COUNT = 7,
};

/* Points that are joined in their order; those that are not finite leave a gap. */
typedef struct kt_plot_series {
    const char *label;
    const double *x, *y;
    size_t count;
    int colour;    /* 1 to KT_PLOT_SERIES_MAX; 0: by its place in the panel */
    int mark;      /* 1 to KT_PLOT_MARK_COUNT at each point; 0: none */
    bool hollow;   /* marks */
    bool is_halo;  /* a broad faint line behind all others */
    bool is_dense; /* in rising x, more points than the paper can show: draw what can be seen */
} kt_plot_series;

typedef struct kt_plot_panel {
    const char *title; /* what is shown: "Energy drift" */
    const char *unit;  /* "J"; NULL: none */
    const kt_plot_series *series;
    int series_count;
    int left_out; /* further series that are not shown, which the legend says */
    bool has_legend;
    bool x_log, y_log;
    bool is_equal;                /* a unit is as long along x as along y: paths in space; linear axes alone */
    const char *x_title, *x_unit; /* NULL: those of the picture */
    double blind;                 /* > 0: what lies below this y is grey */
    const char *blind_label;
} kt_plot_panel;

typedef struct kt_plot {
    const char *title, *subtitle;
    const char *x_title, *x_unit;
    const kt_plot_panel *panels;
    int panel_count;
    bool is_row; /* panels beside one another, with one legend, that of the last */
    bool is_dark;
} kt_plot;

/* Whether this build draws pictures at all. */
bool kt_plot_is_possible(void);

/* Whether a picture can be drawn to a file of this name, by its ending and by what this build has. Returns -1 to go on,
 * or an exit code after saying why not. */
int kt_plot_check(const char *path);

/* Returns KT_EXIT_DONE, or an exit code after saying why. */
int kt_plot_draw(const kt_plot *plot, const char *path);

#endif
