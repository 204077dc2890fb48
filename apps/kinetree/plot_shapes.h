/* Shapes of modes as bars, as SVG or PNG: a panel a mode, a bar a joint. */
#ifndef KT_COMMAND_PLOT_SHAPES_H
#define KT_COMMAND_PLOT_SHAPES_H

#include <stdbool.h>

typedef struct kt_shape_panel {
    char title[96];     /* "1: 0.38 Hz, damping ratio 0.01" */
    const double *bars; /* two a joint: in step with what moves most, and a quarter of a period ahead of it */
} kt_shape_panel;

typedef struct kt_shape_plot {
    const char *title;
    const char *subtitle;
    const char *const *names; /* of the joints' coordinates */
    int count;                /* of them */
    const kt_shape_panel *panels;
    int panel_count;
    bool is_dark;
} kt_shape_plot;

/* Returns KT_EXIT_DONE, or an exit code after saying why. kt_plot_check has been asked before. */
int kt_plot_shapes(const kt_shape_plot *plot, const char *path);

#endif
