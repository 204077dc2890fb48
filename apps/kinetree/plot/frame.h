/* The frame of a panel: its axes, and the map from numbers to coordinates of the page. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_FRAME_H
#define KT_COMMAND_PLOT_FRAME_H

#include "plot/paper.h"

typedef struct kt_plot_frame {
    double left, right, top, bottom;
    kt_axis x, y;
    const kt_palette *palette;
} kt_plot_frame;

static inline double kt_frame_x(const kt_plot_frame *f, double x) {
    return f->left + kt_axis_place(&f->x, x) * (f->right - f->left);
}

static inline double kt_frame_y(const kt_plot_frame *f, double y) {
    return f->bottom - kt_axis_place(&f->y, y) * (f->bottom - f->top);
}

/* ---- guides ------------------------------------------------------------------------------------------------------ */

/* Places of the page that texts and guides avoid: those of curves, and rectangles of earlier texts. */
typedef struct kt_guide kt_guide;

/* Lists the curves of a panel. Returns NULL if memory is insufficient: guides then cover curves. The caller releases
 * the guide with free. */
kt_guide *kt_guide_make(const kt_plot_frame *f, const kt_plot_panel *panel);

/* Draws the slopes of orders as a fan of lines, where they cover the fewest curves. */
void kt_guide_fan(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel, kt_guide *guide);
/* Draws the line below which rounding hides errors. */
void kt_guide_noise(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel);
/* Draws the bars of a series: from the points to their upper ends. */
void kt_guide_bars(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour);
/* Draws a ring around a point, or the bar of a floor through it. */
void kt_guide_ring(cairo_t *c, double x, double y, kt_colour colour);
void kt_guide_floor(cairo_t *c, double x, double y, kt_colour colour);
/* Writes the names of a series next to its points, where they cover the least. */
void kt_guide_names(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour,
                    kt_guide *guide);

#endif
