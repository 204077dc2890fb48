/* What the files that draw with cairo share: colours, text, marks. */
#ifndef KT_COMMAND_PLOT_PAPER_H
#define KT_COMMAND_PLOT_PAPER_H

#include "plot.h"

#include <cairo.h>

typedef struct kt_colour {
    double red, green, blue;
} kt_colour;

/* A light or a dark page. */
typedef struct kt_palette {
    kt_colour paper, ink, quiet, faint;
    kt_colour series[KT_PLOT_SERIES_MAX];
} kt_palette;

const kt_palette *kt_palette_choose(bool is_dark);

extern const double kt_text_size, kt_small_size, kt_title_size;

typedef enum kt_anchor { KT_ANCHOR_LEFT, KT_ANCHOR_MIDDLE, KT_ANCHOR_RIGHT } kt_anchor;

void kt_paper_use(cairo_t *c, kt_colour colour);
double kt_paper_width(cairo_t *c, const char *text);
void kt_paper_text(cairo_t *c, double x, double y, kt_anchor anchor, const char *text);
/* Where the text is wider than there is room, its beginning with dots. */
void kt_paper_text_within(cairo_t *c, double x, double y, double width, const char *title);
/* Ten to the power that the text says. */
void kt_paper_power(cairo_t *c, double x, double y, kt_anchor anchor, const char *exponent, double size);
/* "Energy drift, 10^-9 J" with the exponent raised. */
void kt_paper_quantity(cairo_t *c, double x, double y, kt_anchor anchor, const char *title, const char *unit,
                       int exponent);
/* Adds a mark to the path (mark: 1 to KT_PLOT_MARK_COUNT); draws all that are in the path. */
void kt_paper_trace_mark(cairo_t *c, double x, double y, int mark);
void kt_paper_draw_marks(cairo_t *c, bool hollow, kt_colour colour, kt_colour paper);

/* One panel within the rectangle of its axes; the legend to the right of it, `room` wide. Returns the power of ten by
 * which the numbers of its x axis are to be multiplied, which stands with the axis's title. */
int kt_panel_draw(cairo_t *c, const kt_palette *palette, const kt_plot_panel *panel, double left, double top,
                  double width, double height, double room);

/* A picture, as SVG or PNG by its name, drawn by `draw`. Returns KT_EXIT_DONE, or an exit code after saying why. */
int kt_paper_write(const char *path, int width, int height, void (*draw)(cairo_t *c, const void *what),
                   const void *what);

#endif
