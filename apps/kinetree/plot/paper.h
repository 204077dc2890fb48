/* Declarations shared by the files that draw with cairo: text, marks. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_PAPER_H
#define KT_COMMAND_PLOT_PAPER_H

#include "plot/palette.h"
#include "plot/plot.h"

#include <cairo.h>

extern const double kt_text_size, kt_small_size, kt_title_size;

typedef enum kt_anchor { KT_ANCHOR_LEFT, KT_ANCHOR_MIDDLE, KT_ANCHOR_RIGHT } kt_anchor;

void kt_paper_use(cairo_t *c, kt_colour colour);
/* Strokes the path; the second function fills it before. */
void kt_paper_stroke(cairo_t *c, kt_colour colour, double width);
void kt_paper_fill(cairo_t *c, kt_colour fill, kt_colour edge, double width);
double kt_paper_width(cairo_t *c, const char *text);
void kt_paper_text(cairo_t *c, double x, double y, kt_anchor anchor, const char *text);
/* Draws text left-aligned at x; text wider than `width` is cut and ends with dots. */
void kt_paper_text_within(cairo_t *c, double x, double y, double width, const char *title);
/* Draws a text of at most this width. A longer text is cut in its middle, since names often differ at both ends. */
void kt_paper_text_short(cairo_t *c, double x, double y, double width, kt_anchor anchor, const char *label);
/* Fills the page and draws title and subtitle from x on, which may be `width` wide. */
void kt_paper_head(cairo_t *c, const kt_palette *palette, double x, double width, const char *title,
                   const char *subtitle);
/* Draws ten to the power `exponent`. */
void kt_paper_power(cairo_t *c, double x, double y, kt_anchor anchor, const char *exponent, double size);
/* Draws "Energy drift, 10^-9 J" with the exponent raised. */
void kt_paper_quantity(cairo_t *c, double x, double y, kt_anchor anchor, const char *title, const char *unit,
                       int exponent);
/* The first function adds a mark to the path (mark: 1 to KT_PLOT_MARK_COUNT); the second draws all marks in the
 * path. */
void kt_paper_trace_mark(cairo_t *c, double x, double y, int mark);
void kt_paper_draw_marks(cairo_t *c, bool hollow, kt_colour colour, kt_colour paper);

/* Height of a line of a legend, in sizes of its text. */
#define KT_LEGEND_LINE 1.6

/* The rectangle of a panel's axes. The legend to the right of it is `room` wide. If legend_columns is above 0, the
 * legend is under the panel, in so many columns. */
typedef struct kt_panel_place {
    double left, top, width, height, room;
    int legend_columns;
} kt_panel_place;

/* Draws one panel. Returns the power of ten by which the numbers of the x axis must be multiplied; it is printed with
 * the axis's title. */
int kt_panel_draw(cairo_t *c, const kt_palette *palette, const kt_plot_panel *panel, const kt_panel_place *at);

typedef void kt_paper_draw(cairo_t *c, const void *what);

/* Writes a picture that the function `draw` draws: SVG, PNG or PDF, selected by the file's extension. Returns
 * KT_EXIT_DONE, or an exit code after printing the error. */
int kt_paper_write(const char *path, int width, int height, kt_paper_draw *draw, const void *what);

/* Returns the text of an SVG of that size, which the caller frees; NULL after printing the error. */
char *kt_paper_svg(int width, int height, kt_paper_draw *draw, const void *what);

#endif
