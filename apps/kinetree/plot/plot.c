/* Draws charts with cairo: the page, its panels in a column or in a row, and the file. */
#include "plot/plot.h"

#include "command.h"
#include "plot/paper.h"

#include <cairo.h>
#include <stdio.h>
#include <string.h>

enum {
    WIDTH = 900,
    PANEL_HEIGHT = 210, /* of the axes */
    LEFT = 70,
    RIGHT = 170, /* for the legends */
    TOP = 64,
    HEAD = 31, /* a panel's title */
    GAP = 62,  /* between the axes of two panels, one under the other */
    BOTTOM = 52,
    ROW_HEIGHT = 380, /* panels in a row */
    ROW_PANEL = 350,
    ROW_GAP = 84,
    ROW_RIGHT = 185,
};

/* ---- the page ---------------------------------------------------------------------------------------------------- */

/* Panels in a column share their x axis and its title; a panel with a title of its own needs more room. */
static int gap_after(const kt_plot *plot, int panel) { return plot->panels[panel].x_title != NULL ? GAP + 30 : GAP; }

static int height_of(const kt_plot *plot) {
    if (plot->is_row)
        return TOP + HEAD + ROW_HEIGHT + BOTTOM;
    int height = TOP + plot->panel_count * PANEL_HEIGHT + HEAD + BOTTOM;
    for (int i = 0; i + 1 < plot->panel_count; i++)
        height += gap_after(plot, i);
    return height;
}

static int width_of(const kt_plot *plot) {
    return plot->is_row ? LEFT + plot->panel_count * ROW_PANEL + (plot->panel_count - 1) * ROW_GAP + ROW_RIGHT : WIDTH;
}

static void draw_row(cairo_t *c, const kt_plot *plot, const kt_palette *palette) {
    double left = LEFT;
    for (int i = 0; i < plot->panel_count; i++) {
        (void)kt_panel_draw(c, palette, &plot->panels[i], left, TOP + HEAD, ROW_PANEL, ROW_HEIGHT, ROW_RIGHT);
        left += ROW_PANEL + ROW_GAP;
    }
}

static void draw_column(cairo_t *c, const kt_plot *plot, const kt_palette *palette) {
    double top = TOP + HEAD;
    int exponent = 0;
    for (int i = 0; i < plot->panel_count; i++) {
        exponent = kt_panel_draw(c, palette, &plot->panels[i], LEFT, top, WIDTH - LEFT - RIGHT, PANEL_HEIGHT, RIGHT);
        top += PANEL_HEIGHT + gap_after(plot, i);
    }
    if (plot->panel_count == 0 || plot->panels[plot->panel_count - 1].x_title != NULL)
        return;
    kt_paper_use(c, palette->ink);
    kt_paper_quantity(c, 0.5 * (LEFT + WIDTH - RIGHT), top - GAP + 3.2 * kt_small_size, KT_ANCHOR_MIDDLE, plot->x_title,
                      plot->x_unit, exponent);
}

static void draw_all(cairo_t *c, const kt_plot *plot) {
    const kt_palette *palette = kt_palette_choose(plot->is_dark);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    kt_paper_head(c, palette, LEFT - 50.0, width_of(plot) - LEFT, plot->title, plot->subtitle);
    (plot->is_row ? draw_row : draw_column)(c, plot, palette);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

static bool ends_in(const char *path, const char *ending) {
    size_t length = strlen(path), tail = strlen(ending);
    return length > tail && strcmp(path + length - tail, ending) == 0;
}

bool kt_plot_is_possible(void) { return true; }

int kt_plot_check(const char *path) {
    if (ends_in(path, ".svg") || ends_in(path, ".png"))
        return kt_check_writable(path);
    kt_say("%s cannot be drawn: a picture's name ends in .svg or .png", path);
    return KT_EXIT_USAGE;
}

static void draw_plot(cairo_t *c, const void *what) { draw_all(c, what); }

int kt_plot_draw(const kt_plot *plot, const char *path) {
    return kt_paper_write(path, width_of(plot), height_of(plot), draw_plot, plot);
}
