/* Draws mode shapes as bars, with cairo. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/plot.h"

#include "plot/paper.h"

#include <math.h>

enum { WIDTH = 900, LEFT = 60, RIGHT = 30, TOP = 78, PANEL = 92, GAP = 44, BOTTOM = 40 };

static int height_of(const kt_shape_plot *plot) { return TOP + plot->panel_count * (PANEL + GAP) + BOTTOM - GAP / 2; }

static void draw_bar(cairo_t *c, kt_colour colour, double x, double width, double middle, double share) {
    const double length = share * 0.5 * PANEL;
    kt_paper_use(c, colour);
    cairo_rectangle(c, x, length > 0.0 ? middle - length : middle, width, fabs(length));
    cairo_fill(c);
}

static void draw_axis(cairo_t *c, const kt_palette *palette, double top) {
    static const char *const marks[] = {"1", "0", "\u22121"};
    cairo_set_font_size(c, kt_small_size);
    cairo_set_line_width(c, 1.0);
    for (int i = 0; i < 3; i++) {
        const double y = top + 0.5 * i * PANEL;
        kt_paper_use(c, i == 1 ? palette->quiet : palette->faint);
        cairo_move_to(c, LEFT, floor(y) + 0.5);
        cairo_line_to(c, WIDTH - RIGHT, floor(y) + 0.5);
        cairo_stroke(c);
        kt_paper_use(c, palette->quiet);
        kt_paper_text(c, LEFT - 8.0, y + 0.35 * kt_small_size, KT_ANCHOR_RIGHT, marks[i]);
    }
}

/* Draws names under the bars; if they need more room than there is, of every second, third, ... bar. */
static void draw_names(cairo_t *c, const kt_palette *palette, const kt_shape_plot *plot, double slot, double y) {
    double widest = 1.0;
    for (int i = 0; i < plot->count; i++)
        widest = fmax(widest, kt_paper_width(c, plot->names[i]) + 10.0);
    const int every = (int)ceil(fmin(widest, 150.0) / slot);
    kt_paper_use(c, palette->quiet);
    for (int i = 0; i < plot->count; i += every) {
        const double room = every * slot - 6.0, width = kt_paper_width(c, plot->names[i]);
        kt_paper_text_within(c, LEFT + (i + 0.5) * slot - 0.5 * fmin(width, room), y, room, plot->names[i]);
    }
}

static void draw_panel(cairo_t *c, const kt_palette *palette, const kt_shape_plot *plot, int panel) {
    const kt_shape_panel *p = &plot->panels[panel];
    const double top = TOP + panel * (PANEL + GAP), slot = (double)(WIDTH - LEFT - RIGHT) / plot->count;
    const double bar = fmin(0.36 * slot, 26.0);
    draw_axis(c, palette, top);
    for (int i = 0; i < plot->count; i++) {
        const double x = LEFT + (i + 0.5) * slot;
        draw_bar(c, palette->series[0], x - bar, bar, top + 0.5 * PANEL, p->bars[2 * i]);
        draw_bar(c, palette->series[1], x, bar, top + 0.5 * PANEL, p->bars[2 * i + 1]);
    }
    draw_names(c, palette, plot, slot, top + PANEL + 1.3 * kt_small_size);
    cairo_set_font_size(c, kt_text_size);
    kt_paper_use(c, palette->ink);
    kt_paper_text(c, LEFT, top - 6.0, KT_ANCHOR_LEFT, p->title);
}

static void draw_order_legend(cairo_t *c, const kt_palette *palette, double y) {
    static const char *const words[] = {"in step with what moves most", "a quarter of a period ahead of it"};
    double x = LEFT;
    cairo_set_font_size(c, kt_small_size);
    for (int i = 0; i < 2; i++) {
        kt_paper_use(c, palette->series[i]);
        cairo_rectangle(c, x, y - 9.0, 14.0, 9.0);
        cairo_fill(c);
        kt_paper_use(c, palette->quiet);
        kt_paper_text(c, x + 20.0, y, KT_ANCHOR_LEFT, words[i]);
        x += 50.0 + kt_paper_width(c, words[i]);
    }
}

static void draw_shapes(cairo_t *c, const void *what) {
    const kt_shape_plot *plot = what;
    const kt_palette *palette = kt_palette_choose(plot->is_dark);
    kt_paper_head(c, palette, 20.0, WIDTH - 40.0, plot->title, plot->subtitle);
    for (int i = 0; i < plot->panel_count; i++)
        draw_panel(c, palette, plot, i);
    draw_order_legend(c, palette, height_of(plot) - 12.0);
}

int kt_plot_shapes(const kt_shape_plot *plot, const char *path) {
    return kt_paper_write(path, WIDTH, height_of(plot), draw_shapes, plot);
}
