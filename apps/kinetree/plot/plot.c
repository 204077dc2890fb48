/* Draws charts with cairo: the page, its panels in a column or in a row, and the file. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/plot.h"

#include "command.h"
#include "plot/paper.h"
#include "records/output.h"

#include <cairo.h>
#include <math.h>

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
    SCREEN = 1000, /* height of a page, if no other is given */
    STACKED = 5,   /* panels under each other, at most */
    NARROW = 720,  /* width of a column, where there are several */
    LEAST = 60,    /* width and height of the axes */

    STACKED_BELOW = 260, /* panels of a row that would be narrower than this are under each other */
    STACKED_LEFT = 62,
    STACKED_RIGHT = 14,
    STACKED_TOP = 94, /* with three lines of a subtitle */
    STACKED_GAP = 6,
    LEGEND_CELL = 150,
};

/* ---- the page ---------------------------------------------------------------------------------------------------- */

/* The layout of panels: in a row, or in columns that are filled one after the other. */
typedef struct layout {
    int width, height;
    int columns, rows;
    double cell, panel_width, panel_height, gap; /* cell: width of a column */
} layout;

/* Panels under each other share their x axis and its title; one with a title of its own needs more room. */
static double panel_gap_of(const kt_plot *plot) {
    bool titled = false;
    for (int i = 0; i < plot->panel_count; i++)
        titled = titled || plot->panels[i].x_title != NULL;
    return titled ? GAP + 30 : GAP;
}

static layout lay_out_row(const kt_plot *plot) {
    const int n = plot->panel_count > 0 ? plot->panel_count : 1;
    layout l = {.columns = n, .rows = 1, .panel_width = ROW_PANEL, .panel_height = ROW_HEIGHT};
    const double around = LEFT + (n - 1) * ROW_GAP + ROW_RIGHT, above = TOP + HEAD + BOTTOM;
    if (plot->size.width > 0) {
        l.panel_width = fmax((plot->size.width - around) / n, LEAST);
        l.panel_height = fmax(plot->size.height - above, LEAST);
    }
    l.width = plot->size.width > 0 ? plot->size.width : (int)(around + n * l.panel_width);
    l.height = plot->size.width > 0 ? plot->size.height : (int)(above + l.panel_height);
    return l;
}

/* Panels in so many columns, on a page of a given size or as high as a screen. */
static layout lay_out_in(const kt_plot *plot, int columns) {
    const int n = plot->panel_count > 0 ? plot->panel_count : 1;
    layout l = {.columns = columns, .rows = (n + columns - 1) / columns, .gap = panel_gap_of(plot)};
    const double around = TOP + HEAD + BOTTOM + (l.rows - 1) * l.gap;
    l.panel_height = fmin(PANEL_HEIGHT, floor((SCREEN - around) / l.rows));
    l.width = columns > 1 ? columns * NARROW : WIDTH;
    l.height = (int)(around + l.rows * l.panel_height);
    if (plot->size.width > 0) {
        l.panel_height = (plot->size.height - around) / l.rows;
        l.width = plot->size.width;
        l.height = plot->size.height;
    }
    l.cell = (double)l.width / columns;
    l.panel_width = l.cell - LEFT - RIGHT;
    return l;
}

/* As many panels are under each other as the page has room for; more of them are in further columns. */
static layout lay_out_columns(const kt_plot *plot) {
    layout l = lay_out_in(plot, plot->size.width > 0 ? 1 : 1 + (plot->panel_count - 1) / STACKED);
    while (l.panel_height < LEAST && l.rows > 1 &&
           (plot->size.width == 0 || l.width / (l.columns + 1) >= LEFT + RIGHT + LEAST))
        l = lay_out_in(plot, l.columns + 1);
    l.panel_height = fmax(l.panel_height, 0.5 * LEAST);
    return l;
}

/* ---- a narrow page ----------------------------------------------------------------------------------------------- */

/* On a phone or in a column of text, panels of a row are under each other, and the legend is under the last. */
static bool is_stacked(const kt_plot *plot) {
    return plot->is_row && plot->panel_count > 0 && plot->size.width > 0 &&
           plot->size.width < LEFT + ROW_RIGHT + plot->panel_count * STACKED_BELOW;
}

static int legend_columns_of(const kt_plot *plot) {
    const int columns = (plot->size.width - STACKED_LEFT - STACKED_RIGHT) / LEGEND_CELL;
    return columns > 1 ? columns : 1;
}

static double legend_height_of(const kt_plot *plot) {
    const kt_plot_panel *panel = &plot->panels[plot->panel_count - 1];
    const int entries = panel->has_legend ? panel->series_count + (panel->left_out > 0) : 0;
    const int columns = legend_columns_of(plot);
    const int lines = (entries + columns - 1) / columns;
    return lines * KT_LEGEND_LINE * kt_small_size;
}

static layout lay_out_stack(const kt_plot *plot) {
    const int n = plot->panel_count;
    layout l = {.width = plot->size.width, .height = plot->size.height, .columns = 1, .rows = n};
    const double around = STACKED_TOP + n * (HEAD + BOTTOM) + (n - 1) * STACKED_GAP + legend_height_of(plot) + 12.0;
    l.panel_width = fmax(l.width - STACKED_LEFT - STACKED_RIGHT, LEAST);
    l.panel_height = fmax((l.height - around) / n, LEAST);
    return l;
}

static void draw_stack(cairo_t *c, const kt_plot *plot, const layout *l, const kt_palette *palette) {
    double top = STACKED_TOP + HEAD;
    for (int i = 0; i < plot->panel_count; i++) {
        const bool is_last = i == plot->panel_count - 1;
        const kt_panel_place at = {STACKED_LEFT,    top, l->panel_width,
                                   l->panel_height, 0.0, is_last ? legend_columns_of(plot) : 0};
        (void)kt_panel_draw(c, palette, &plot->panels[i], &at);
        top += l->panel_height + BOTTOM + STACKED_GAP + HEAD;
    }
}

/* ---- any page ---------------------------------------------------------------------------------------------------- */

static layout lay_out_plot(const kt_plot *plot) {
    return is_stacked(plot) ? lay_out_stack(plot) : plot->is_row ? lay_out_row(plot) : lay_out_columns(plot);
}

static void draw_row(cairo_t *c, const kt_plot *plot, const layout *l, const kt_palette *palette) {
    double left = LEFT;
    for (int i = 0; i < plot->panel_count; i++) {
        const kt_panel_place at = {left, TOP + HEAD, l->panel_width, l->panel_height, ROW_RIGHT, 0};
        (void)kt_panel_draw(c, palette, &plot->panels[i], &at);
        left += l->panel_width + ROW_GAP;
    }
}

static void draw_columns(cairo_t *c, const kt_plot *plot, const layout *l, const kt_palette *palette) {
    for (int i = 0; i < plot->panel_count; i++) {
        const int row = i % l->rows, column = i / l->rows;
        const double left = LEFT + column * l->cell, top = TOP + HEAD + row * (l->panel_height + l->gap);
        const kt_panel_place at = {left, top, l->panel_width, l->panel_height, RIGHT, 0};
        const int exponent = kt_panel_draw(c, palette, &plot->panels[i], &at);
        const bool is_last = row == l->rows - 1 || i == plot->panel_count - 1;
        if (!is_last || plot->panels[i].x_title != NULL)
            continue;
        kt_paper_use(c, palette->ink);
        kt_paper_quantity(c, left + 0.5 * l->panel_width, top + l->panel_height + 3.2 * kt_small_size, KT_ANCHOR_MIDDLE,
                          plot->x_title, plot->x_unit, exponent);
    }
}

static void draw_all(cairo_t *c, const kt_plot *plot) {
    const kt_palette *palette = kt_palette_choose(plot->is_dark);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    const layout l = lay_out_plot(plot);
    const double left = is_stacked(plot) ? 12.0 : LEFT - 50.0;
    kt_paper_head(c, palette, left, l.width - (is_stacked(plot) ? 24.0 : LEFT), plot->title, plot->subtitle);
    (is_stacked(plot) ? draw_stack : plot->is_row ? draw_row : draw_columns)(c, plot, &l, palette);
}

/* ---- the file ---------------------------------------------------------------------------------------------------- */

bool kt_plot_is_possible(void) { return true; }

int kt_plot_check(const char *path) {
    if (kt_stem_length(path, ".svg|.png|.pdf") > 0)
        return kt_check_writable(path);
    return kt_misuse("%s cannot be drawn: a picture's name ends in .svg, .png or .pdf", path);
}

static void draw_plot(cairo_t *c, const void *what) { draw_all(c, what); }

int kt_plot_draw(const kt_plot *plot, const char *path) {
    const layout l = lay_out_plot(plot);
    return kt_paper_write(path, l.width, l.height, draw_plot, plot);
}
