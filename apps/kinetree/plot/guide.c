/* Guides of a panel: slopes of orders, bars of uncertain times, rings, floors, and names next to points.
 *
 * At order p, the error falls like cost^-p. In logarithmic axes this is a straight line. Its slope on the page follows
 * from the lengths of a decade on both axes. A fan of such lines is drawn where it covers the fewest curves. Names are
 * placed next to their points in the same way. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/frame.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { SPOTS_MAX = 20000, BOXES_MAX = 400, ORDERS_MAX = 8 };

/* A rectangle of the page. */
typedef struct kt_box {
    double left, top, right, bottom;
} kt_box;

struct kt_guide {
    double x[SPOTS_MAX], y[SPOTS_MAX]; /* along the curves, a few points of the page apart */
    int spots;
    kt_box boxes[BOXES_MAX]; /* of texts */
    int texts;
};

/* ---- what is covered --------------------------------------------------------------------------------------------- */

static void add_spot(kt_guide *guide, double x, double y) {
    if (guide->spots == SPOTS_MAX)
        return;
    guide->x[guide->spots] = x;
    guide->y[guide->spots++] = y;
}

static void add_curve_spots(kt_guide *guide, const kt_plot_frame *f, const kt_plot_series *series) {
    enum { APART = 5 };
    double x0 = (double)NAN, y0 = (double)NAN;
    for (size_t i = 0; i < series->count; i++) {
        const double x = kt_frame_x(f, series->x[i]), y = kt_frame_y(f, series->y[i]);
        const double far = series->is_scattered ? 0.0 : hypot(x - x0, y - y0);
        if (isfinite(x) && isfinite(y))
            add_spot(guide, x, y);
        for (int k = 1; isfinite(far) && k * APART < far; k++)
            add_spot(guide, x0 + (x - x0) * k * APART / far, y0 + (y - y0) * k * APART / far);
        const double end = series->x_high != NULL ? kt_frame_x(f, series->x_high[i]) : x;
        for (int k = 1; isfinite(y) && x + k * APART < end; k++)
            add_spot(guide, x + k * APART, y);
        x0 = x;
        y0 = y;
    }
}

kt_guide *kt_guide_make(const kt_plot_frame *f, const kt_plot_panel *panel) {
    kt_guide *guide = malloc(sizeof *guide);
    if (guide == NULL)
        return NULL;
    guide->spots = guide->texts = 0;
    for (int i = 0; i < panel->series_count; i++)
        if (!panel->series[i].is_halo)
            add_curve_spots(guide, f, &panel->series[i]);
    return guide;
}

/* Returns the lower edge of the region for guides: the end of the panel, or of the errors that can be resolved. */
static double lower_edge(const kt_plot_frame *f, const kt_plot_panel *panel) {
    const double blind = panel->blind > 0.0 ? kt_frame_y(f, panel->blind) : f->bottom;
    const double noise = panel->noise > 0.0 ? kt_frame_y(f, panel->noise) - 1.2 * kt_small_size : f->bottom;
    return fmin(f->bottom, fmin(blind, noise));
}

/* Returns how much a rectangle covers. Texts count more than points of curves. */
static int covered_by(const kt_guide *guide, const kt_plot_frame *f, kt_box box) {
    enum { TEXT = 20, OUTSIDE = 1000 };
    int cost = box.left < f->left || box.right > f->right || box.top < f->top || box.bottom > f->bottom ? OUTSIDE : 0;
    for (int i = 0; guide != NULL && i < guide->spots; i++)
        cost += guide->x[i] > box.left - 3.0 && guide->x[i] < box.right + 3.0 && guide->y[i] > box.top - 3.0 &&
                guide->y[i] < box.bottom + 3.0;
    for (int i = 0; guide != NULL && i < guide->texts; i++) {
        const kt_box *text = &guide->boxes[i];
        if (text->left < box.right && text->right > box.left && text->top < box.bottom && text->bottom > box.top)
            cost += TEXT;
    }
    return cost;
}

static void add_box(kt_guide *guide, kt_box box) {
    if (guide != NULL && guide->texts < BOXES_MAX)
        guide->boxes[guide->texts++] = box;
}

/* ---- slopes of orders -------------------------------------------------------------------------------------------- */

/* The fan: lines from one point, all as long. */
typedef struct kt_fan {
    double x, y, length;
    double decade_x, decade_y; /* lengths of a decade on the page */
} kt_fan;

/* The end of the line of an order, or the point behind it where its name stands. */
static void find_fan_end(const kt_fan *fan, int order, double beyond, double *x, double *y) {
    const double dx = fan->decade_x, dy = order * fan->decade_y, size = hypot(dx, dy);
    *x = fan->x + (fan->length + beyond) * dx / size;
    *y = fan->y + (fan->length + beyond) * dy / size;
}

static int cost_of_fan(const kt_guide *guide, const kt_plot_frame *f, const kt_plot_panel *panel, const kt_fan *fan) {
    enum { BELOW = 500 };
    int cost = 0;
    for (int i = 0; i < panel->order_count; i++) {
        double x, y;
        find_fan_end(fan, panel->orders[i], 16.0, &x, &y);
        for (int k = 0; k <= 4; k++) {
            const double at_x = fan->x + 0.25 * k * (x - fan->x), at_y = fan->y + 0.25 * k * (y - fan->y);
            cost += covered_by(guide, f, (kt_box){at_x - 7.0, at_y - 7.0, at_x + 7.0, at_y + 7.0});
        }
        cost += y + 7.0 > lower_edge(f, panel) ? BELOW : 0;
    }
    return cost;
}

/* Finds the place of the fan. Of equal places, the one at the lower left is taken. */
static kt_fan find_fan(const kt_guide *guide, const kt_plot_frame *f, const kt_plot_panel *panel) {
    enum { GRID = 12 };
    const double width = f->right - f->left, height = f->bottom - f->top;
    kt_fan best = {.length = 0.0};
    int least = -1;
    for (int row = GRID; row >= 0; row--)
        for (int column = 0; column <= GRID; column++) {
            const kt_fan fan = {.x = f->left + 10.0 + column * (width - 20.0) / GRID,
                                .y = f->top + 10.0 + row * (height - 20.0) / GRID,
                                .length = 0.23 * fmin(width, height),
                                .decade_x = width / log10(f->x.high / f->x.low),
                                .decade_y = height / log10(f->y.high / f->y.low)};
            const int cost = cost_of_fan(guide, f, panel, &fan);
            if (least < 0 || cost < least) {
                best = fan;
                least = cost;
            }
        }
    return best;
}

/* Finds the places of the names of the first orders, each so far out that it touches none before. */
static void place_orders(const kt_fan *fan, const int *orders, int count, double (*at)[2]) {
    enum { TRIES = 6 };
    const double apart = 10.0;
    for (int i = 0; i < count; i++) {
        bool touches = true;
        for (int k = 0; k < TRIES && touches; k++) {
            find_fan_end(fan, orders[i], 8.0 + k * apart, &at[i][0], &at[i][1]);
            touches = false;
            for (int j = 0; j < i; j++)
                touches = touches || hypot(at[i][0] - at[j][0], at[i][1] - at[j][1]) < apart;
        }
    }
}

void kt_guide_fan(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel, kt_guide *guide) {
    if (panel->order_count == 0 || !f->x.is_log || !f->y.is_log)
        return;
    const kt_fan fan = find_fan(guide, f, panel);
    const int count = panel->order_count < ORDERS_MAX ? panel->order_count : ORDERS_MAX;
    double names[ORDERS_MAX][2];
    place_orders(&fan, panel->orders, count, names);
    cairo_set_font_size(c, 0.9 * kt_small_size);
    for (int i = 0; i < count; i++) {
        double x, y;
        char text[16];
        find_fan_end(&fan, panel->orders[i], 0.0, &x, &y);
        kt_paper_use(c, f->palette->quiet);
        cairo_set_line_width(c, 1.1);
        cairo_move_to(c, fan.x, fan.y);
        cairo_line_to(c, x, y);
        cairo_stroke(c);
        x = names[i][0];
        y = names[i][1];
        (void)snprintf(text, sizeof text, "%d", panel->orders[i]);
        kt_paper_text(c, x, y + 0.32 * kt_small_size, KT_ANCHOR_MIDDLE, text);
        add_box(guide, (kt_box){x - 6.0, y - 6.0, x + 6.0, y + 6.0});
    }
    const double half = 0.5 * kt_paper_width(c, "order");
    const double middle = fmax(fan.x, f->left + half + 4.0);
    kt_paper_text(c, middle, fan.y - 5.0, KT_ANCHOR_MIDDLE, "order");
    add_box(guide, (kt_box){fmin(middle - half, fan.x), fan.y - 16.0, fan.x + fan.length, fan.y + fan.length});
}

/* ---- marks ------------------------------------------------------------------------------------------------------- */

void kt_guide_noise(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel) {
    static const double dashes[] = {6.0, 3.0, 1.5, 3.0};
    const double y = kt_frame_y(f, panel->noise);
    if (!(panel->noise > 0.0) || !(y < f->bottom) || !(y > f->top))
        return;
    kt_paper_use(c, f->palette->quiet);
    cairo_set_line_width(c, 1.2);
    cairo_set_dash(c, dashes, 4, 0.0);
    cairo_move_to(c, f->left, y);
    cairo_line_to(c, f->right, y);
    cairo_stroke(c);
    cairo_set_dash(c, NULL, 0, 0.0);
    cairo_set_font_size(c, 0.9 * kt_small_size);
    kt_paper_text(c, f->right - 4.0, y - 3.0, KT_ANCHOR_RIGHT, panel->noise_label);
}

void kt_guide_bars(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour) {
    for (size_t i = 0; series->x_high != NULL && i < series->count; i++) {
        const double x = kt_frame_x(f, series->x[i]), end = kt_frame_x(f, series->x_high[i]);
        const double y = kt_frame_y(f, series->y[i]);
        if (!isfinite(x) || !isfinite(y) || !(end > x + 1.0))
            continue;
        cairo_move_to(c, x, y);
        cairo_line_to(c, end, y);
        cairo_move_to(c, end, y - 2.5);
        cairo_line_to(c, end, y + 2.5);
    }
    kt_paper_stroke(c, colour, 0.8);
}

void kt_guide_ring(cairo_t *c, double x, double y, kt_colour colour) {
    enum { RADIUS = 9 };
    cairo_new_sub_path(c);
    cairo_arc(c, x, y, RADIUS, 0.0, 4.0 * acos(0.0));
    cairo_close_path(c);
    kt_paper_stroke(c, colour, 1.8);
}

void kt_guide_floor(cairo_t *c, double x, double y, kt_colour colour) {
    enum { HALF = 11, BELOW = 8 };
    cairo_move_to(c, x - HALF, y + BELOW);
    cairo_line_to(c, x + HALF, y + BELOW);
    kt_paper_stroke(c, colour, 2.4);
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

static void put_point_name(cairo_t *c, const kt_plot_frame *f, double x, double y, const char *name, kt_guide *guide) {
    static const double sides[][2] = {{1.0, 0.0},  {-1.0, 0.0},  {0.0, -1.0}, {0.0, 1.0},
                                      {0.8, -0.8}, {-0.8, -0.8}, {0.8, 0.8},  {-0.8, 0.8}};
    const double width = kt_paper_width(c, name), height = 0.75 * kt_small_size;
    kt_box best = {0.0, 0.0, 0.0, 0.0};
    int least = -1;
    for (int ring = 0; ring < 2; ring++)
        for (size_t i = 0; i < sizeof sides / sizeof sides[0]; i++) {
            const double away = ring == 0 ? 11.0 : 20.0;
            const double cx = x + sides[i][0] * (away + 0.5 * width);
            const double cy = y + sides[i][1] * (away + 0.5 * height);
            const kt_box box = {cx - 0.5 * width, cy - 0.5 * height, cx + 0.5 * width, cy + 0.5 * height};
            const int cost = covered_by(guide, f, box);
            if (least < 0 || cost < least) {
                best = box;
                least = cost;
            }
        }
    kt_paper_text(c, best.left, best.bottom, KT_ANCHOR_LEFT, name);
    add_box(guide, best);
}

void kt_guide_names(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour,
                    kt_guide *guide) {
    if (series->names == NULL)
        return;
    kt_paper_use(c, colour);
    cairo_set_font_size(c, series->is_ringed ? 0.9 * kt_small_size : 0.72 * kt_small_size);
    for (size_t i = 0; i < series->count; i++) {
        const double x = kt_frame_x(f, series->x[i]), y = kt_frame_y(f, series->y[i]);
        if (isfinite(x) && isfinite(y))
            put_point_name(c, f, x, y, series->names[i], guide);
    }
}
