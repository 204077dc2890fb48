/* Line charts with cairo.
 *
 * Each panel has its title at the top left with the unit in it, round ticks, a light grid, and its legend on the right,
 * where it hides no line. Colours are those of M. Okabe and K. Ito (Color Universal Design, 2008), without the yellow
 * that is lost on white: they stay apart for every kind of colour blindness.
 */
#include "plot.h"

#include "command.h"

#include <cairo-svg.h>
#include <cairo.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    WIDTH = 900,
    PANEL_HEIGHT = 210, /* of the axes */
    LEFT = 70,
    RIGHT = 170, /* the legends */
    TOP = 64,
    GAP = 62, /* between the axes of two panels */
    BOTTOM = 52,
    TICKS_X = 11,
    TICKS_Y = 7,
};

static const double text_size = 13.0, small_size = 11.5, title_size = 16.0;

typedef struct kt_colour {
    double red, green, blue;
} kt_colour;

static const kt_colour colours[KT_PLOT_SERIES_MAX] = {
    {0.000, 0.447, 0.698}, /* blue */
    {0.835, 0.369, 0.000}, /* vermilion */
    {0.000, 0.620, 0.451}, /* bluish green */
    {0.800, 0.475, 0.655}, /* reddish purple */
    {0.902, 0.624, 0.000}, /* orange */
    {0.337, 0.706, 0.914}, /* sky blue */
    {0.000, 0.000, 0.000}, /* black */
};

static const kt_colour ink = {0.13, 0.13, 0.13}, faint = {0.88, 0.88, 0.88}, quiet = {0.42, 0.42, 0.42};

static void use(cairo_t *c, kt_colour colour) { cairo_set_source_rgb(c, colour.red, colour.green, colour.blue); }

/* ---- text -------------------------------------------------------------------------------------------------------- */

typedef enum kt_anchor { KT_ANCHOR_LEFT, KT_ANCHOR_MIDDLE, KT_ANCHOR_RIGHT } kt_anchor;

static double width_of(cairo_t *c, const char *text) {
    cairo_text_extents_t extents;
    cairo_text_extents(c, text, &extents);
    return extents.x_advance;
}

static void put_text(cairo_t *c, double x, double y, kt_anchor anchor, const char *text) {
    double width = width_of(c, text);
    cairo_move_to(c, x - (anchor == KT_ANCHOR_LEFT ? 0.0 : anchor == KT_ANCHOR_RIGHT ? width : 0.5 * width), y);
    cairo_show_text(c, text);
}

/* Where the text is wider than there is room, its beginning with dots; cut between characters. */
static void put_text_within(cairo_t *c, double x, double y, double width, const char *text) {
    char part[128];
    int length = (int)strlen(text);
    if (width_of(c, text) <= width) {
        put_text(c, x, y, KT_ANCHOR_LEFT, text);
        return;
    }
    length = length < 120 ? length : 120;
    do {
        while (length > 0 && ((unsigned char)text[--length] & 0xC0U) == 0x80U)
            ;
        snprintf(part, sizeof part, "%.*s\u2026", length, text);
    } while (length > 0 && width_of(c, part) > width);
    put_text(c, x, y, KT_ANCHOR_LEFT, part);
}

/* "Energy drift, 10^-9 J" with the exponent raised. Returns where it ends. */
static double put_quantity(cairo_t *c, double x, double y, const char *title, const char *unit, int exponent) {
    char text[192], power[16];
    snprintf(text, sizeof text, "%s%s%s", title, unit != NULL || exponent != 0 ? ", " : "",
             exponent != 0  ? "10"
             : unit != NULL ? unit
                            : "");
    put_text(c, x, y, KT_ANCHOR_LEFT, text);
    x += width_of(c, text);
    if (exponent == 0)
        return x;
    snprintf(power, sizeof power, "%s%d", exponent < 0 ? "\u2212" : "", abs(exponent));
    cairo_set_font_size(c, 0.75 * text_size);
    put_text(c, x, y - 0.4 * text_size, KT_ANCHOR_LEFT, power);
    x += width_of(c, power);
    cairo_set_font_size(c, text_size);
    if (unit != NULL) {
        snprintf(text, sizeof text, " %s", unit);
        put_text(c, x, y, KT_ANCHOR_LEFT, text);
        x += width_of(c, text);
    }
    return x;
}

/* ---- a panel ----------------------------------------------------------------------------------------------------- */

/* From numbers to places on the paper. */
typedef struct kt_plot_frame {
    double left, right, top, bottom;
    kt_axis x, y;
} kt_plot_frame;

static double to_x(const kt_plot_frame *f, double x) {
    return f->left + (x - f->x.low) / (f->x.high - f->x.low) * (f->right - f->left);
}

static double to_y(const kt_plot_frame *f, double y) {
    return f->bottom - (y - f->y.low) / (f->y.high - f->y.low) * (f->bottom - f->top);
}

static void draw_grid(cairo_t *c, const kt_plot_frame *f) {
    char text[48];
    cairo_set_line_width(c, 1.0);
    cairo_set_font_size(c, small_size);
    for (int i = 0; i < f->y.count; i++) {
        double y = to_y(f, kt_axis_tick(&f->y, i));
        use(c, faint);
        cairo_move_to(c, f->left, y);
        cairo_line_to(c, f->right, y);
        cairo_stroke(c);
        use(c, ink);
        kt_axis_text(&f->y, i, text, sizeof text);
        put_text(c, f->left - 8.0, y + 0.36 * small_size, KT_ANCHOR_RIGHT, text);
    }
    for (int i = 0; i < f->x.count; i++) {
        double x = to_x(f, kt_axis_tick(&f->x, i));
        use(c, faint);
        cairo_move_to(c, x, f->top);
        cairo_line_to(c, x, f->bottom);
        cairo_stroke(c);
        use(c, ink);
        kt_axis_text(&f->x, i, text, sizeof text);
        put_text(c, x, f->bottom + 1.5 * small_size, KT_ANCHOR_MIDDLE, text);
    }
    use(c, quiet);
    cairo_move_to(c, f->left, f->top);
    cairo_line_to(c, f->left, f->bottom);
    cairo_line_to(c, f->right, f->bottom);
    cairo_stroke(c);
}

/* All points of a quarter pixel's column as one stroke from the least to the largest: the same picture, and no more
 * points than the paper has room for. */
static void draw_series(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series) {
    bool is_open = false;
    for (size_t i = 0; i < series->count;) {
        double x = to_x(f, series->x[i]), y = to_y(f, series->y[i]);
        if (!isfinite(x) || !isfinite(y)) {
            is_open = false;
            i++;
            continue;
        }
        double least = y, largest = y, last = y;
        size_t next = i + 1;
        for (; next < series->count && to_x(f, series->x[next]) < x + 0.25 && isfinite(series->y[next]); next++) {
            last = to_y(f, series->y[next]);
            least = fmin(least, last);
            largest = fmax(largest, last);
        }
        (is_open ? cairo_line_to : cairo_move_to)(c, x, y);
        is_open = true;
        if (next > i + 1) {
            cairo_line_to(c, x, least);
            cairo_line_to(c, x, largest);
            cairo_line_to(c, x, last);
        }
        i = next;
    }
    cairo_stroke(c);
}

static void draw_legend(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel) {
    const double x = f->right + 16.0, line = 1.6 * small_size;
    double y = f->top + small_size;
    cairo_set_font_size(c, small_size);
    for (int i = 0; i < panel->series_count; i++) {
        use(c, colours[i]);
        cairo_set_line_width(c, 3.0);
        cairo_move_to(c, x, y - 0.36 * small_size);
        cairo_line_to(c, x + 18.0, y - 0.36 * small_size);
        cairo_stroke(c);
        use(c, ink);
        put_text_within(c, x + 24.0, y, RIGHT - 48.0, panel->series[i].label);
        y += line;
    }
    if (panel->left_out > 0) {
        char text[48];
        snprintf(text, sizeof text, "and %d more", panel->left_out);
        use(c, quiet);
        put_text(c, x, y, KT_ANCHOR_LEFT, text);
    }
}

/* The range of all finite numbers; one around them where they are all equal, or where there are none. */
static void find_range(const kt_plot_panel *panel, bool of_y, double *low, double *high) {
    *low = HUGE_VAL;
    *high = -HUGE_VAL;
    for (int s = 0; s < panel->series_count; s++)
        for (size_t i = 0; i < panel->series[s].count; i++) {
            double value = of_y ? panel->series[s].y[i] : panel->series[s].x[i];
            *low = isfinite(value) ? fmin(*low, value) : *low;
            *high = isfinite(value) ? fmax(*high, value) : *high;
        }
    if (!(*low <= *high))
        *low = *high = 0.0;
    double room = of_y ? 0.05 * (*high - *low) : 0.0;
    if (!(*high - *low > 1e-12 * fmax(fabs(*low), fabs(*high))))
        room = *high != 0.0 ? 0.5 * fabs(*high) : 1.0;
    *low -= room;
    *high += room;
}

static void draw_panel(cairo_t *c, const kt_plot_panel *panel, kt_plot_frame *f) {
    double low, high;
    find_range(panel, false, &low, &high);
    f->x = kt_axis_make(low, high, TICKS_X);
    find_range(panel, true, &low, &high);
    f->y = kt_axis_make(low, high, TICKS_Y);
    draw_grid(c, f);
    use(c, ink);
    cairo_set_font_size(c, text_size);
    put_quantity(c, f->left - 50.0, f->top - 12.0, panel->title, panel->unit, f->y.exponent);
    cairo_set_line_width(c, 1.6);
    for (int i = 0; i < panel->series_count; i++) {
        use(c, colours[i]);
        draw_series(c, f, &panel->series[i]);
    }
    if (panel->has_legend)
        draw_legend(c, f, panel);
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

static int height_of(const kt_plot *plot) {
    return TOP + plot->panel_count * PANEL_HEIGHT + (plot->panel_count - 1) * GAP + GAP / 2 + BOTTOM;
}

static void draw_all(cairo_t *c, const kt_plot *plot) {
    cairo_set_source_rgb(c, 1.0, 1.0, 1.0);
    cairo_paint(c);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    use(c, ink);
    cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
    cairo_set_font_size(c, title_size);
    put_text_within(c, LEFT - 50.0, 28.0, WIDTH - LEFT, plot->title);
    cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c, text_size);
    use(c, quiet);
    put_text(c, LEFT - 50.0, 48.0, KT_ANCHOR_LEFT, plot->subtitle);
    kt_plot_frame frame = {.left = LEFT, .right = WIDTH - RIGHT, .bottom = TOP};
    for (int i = 0; i < plot->panel_count; i++) {
        frame.top = frame.bottom + (i == 0 ? GAP / 2 : GAP);
        frame.bottom = frame.top + PANEL_HEIGHT;
        draw_panel(c, &plot->panels[i], &frame);
    }
    cairo_set_font_size(c, text_size);
    use(c, ink);
    double y = frame.bottom + 3.2 * small_size;
    char text[96];
    snprintf(text, sizeof text, "%s, %s", plot->x_title, plot->x_unit);
    put_text(c, 0.5 * (frame.left + frame.right), y, KT_ANCHOR_MIDDLE, text);
}

static bool ends_in(const char *path, const char *ending) {
    size_t length = strlen(path), tail = strlen(ending);
    return length > tail && strcmp(path + length - tail, ending) == 0;
}

int kt_plot_check(const char *path) {
    if (ends_in(path, ".svg") || ends_in(path, ".png"))
        return -1;
    kt_say("%s cannot be drawn: a picture's name ends in .svg or .png", path);
    return KT_EXIT_USAGE;
}

/* PNG pictures have two pixels a unit, for sharp screens. */
static cairo_status_t draw_to(const kt_plot *plot, const char *path) {
    const bool is_svg = ends_in(path, ".svg");
    const int height = height_of(plot), scale = is_svg ? 1 : 2;
    cairo_surface_t *surface = is_svg ? cairo_svg_surface_create(path, WIDTH, height)
                                      : cairo_image_surface_create(CAIRO_FORMAT_RGB24, scale * WIDTH, scale * height);
    cairo_t *c = cairo_create(surface);
    cairo_scale(c, scale, scale);
    draw_all(c, plot);
    cairo_status_t status = cairo_status(c);
    cairo_destroy(c);
    if (status == CAIRO_STATUS_SUCCESS && !is_svg)
        status = cairo_surface_write_to_png(surface, path);
    cairo_surface_finish(surface);
    if (status == CAIRO_STATUS_SUCCESS)
        status = cairo_surface_status(surface);
    cairo_surface_destroy(surface);
    return status;
}

int kt_plot_draw(const kt_plot *plot, const char *path) {
    cairo_status_t status = draw_to(plot, path);
    if (status == CAIRO_STATUS_SUCCESS)
        return KT_EXIT_DONE;
    kt_say("%s cannot be written: %s", path, cairo_status_to_string(status));
    return KT_EXIT_INTEGRATION;
}
