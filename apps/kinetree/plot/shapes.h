/* Draws mode shapes as SVG or PNG: one panel per mode, two bars per coordinate. */
#ifndef KT_COMMAND_PLOT_SHAPES_H
#define KT_COMMAND_PLOT_SHAPES_H

#include <stdbool.h>

typedef struct kt_shape_panel {
    const char *title;  /* "1: 0.38 Hz, damping ratio 0.01" */
    const double *bars; /* two per coordinate: real part, in phase with the largest element, and imaginary part */
} kt_shape_panel;

typedef struct kt_shape_plot {
    const char *title;
    const char *subtitle;
    const char *const *names; /* of the joints' coordinates */
    int count;                /* number of coordinates */
    const kt_shape_panel *panels;
    int panel_count;
    bool is_dark;
} kt_shape_plot;

/* Returns KT_EXIT_DONE, or an exit code after printing the error. The caller has checked the path with
 * kt_plot_check. */
int kt_plot_shapes(const kt_shape_plot *plot, const char *path);

#endif
