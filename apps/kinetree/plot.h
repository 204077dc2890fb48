/* Line charts, as SVG or PNG: panels under one another, each with its axes, units and series. */
#ifndef KT_COMMAND_PLOT_H
#define KT_COMMAND_PLOT_H

#include <stdbool.h>
#include <stddef.h>

/* ---- axes -------------------------------------------------------------------------------------------------------- */

/* Round numbers between low and high, at most `most` of them: first + i step, i = 0 .. count - 1, written with
 * `decimals` places after they are divided by 10^exponent. */
typedef struct kt_axis {
    double low, high;
    double first, step;
    int count;
    int exponent; /* 0 where the numbers are short as they are */
    int decimals;
} kt_axis;

/* low < high, both finite. */
kt_axis kt_axis_make(double low, double high, int most);
double kt_axis_tick(const kt_axis *axis, int i);
/* With a true minus sign (UTF-8). */
void kt_axis_text(const kt_axis *axis, int i, char *text, size_t size);

/* ---- charts ------------------------------------------------------------------------------------------------------ */

/* Points in rising x; those that are not finite leave a gap. */
typedef struct kt_plot_series {
    const char *label;
    const double *x, *y;
    size_t count;
} kt_plot_series;

enum { KT_PLOT_SERIES_MAX = 7 }; /* colours that can be told apart */

typedef struct kt_plot_panel {
    const char *title; /* what is shown: "Energy drift" */
    const char *unit;  /* "J"; NULL: none */
    const kt_plot_series *series;
    int series_count; /* at most KT_PLOT_SERIES_MAX */
    int left_out;     /* further series that are not shown, which the legend says */
    bool has_legend;
} kt_plot_panel;

typedef struct kt_plot {
    const char *title, *subtitle;
    const char *x_title, *x_unit;
    const kt_plot_panel *panels;
    int panel_count;
} kt_plot;

/* Whether a picture can be drawn to a file of this name, by its ending and by what this build has. Returns -1 to go on,
 * or an exit code after saying why not. */
int kt_plot_check(const char *path);

/* Returns KT_EXIT_DONE, or an exit code after saying why. */
int kt_plot_draw(const kt_plot *plot, const char *path);

#endif
