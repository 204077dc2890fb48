/* Lines, arrows, hatching, springs and dampers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"

#include <math.h>

/* ---- lines ------------------------------------------------------------------------------------------------------- */

kt_spot kt_spot_between(kt_spot a, kt_spot b, double share) {
    return (kt_spot){a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
}

double kt_spot_distance(kt_spot a, kt_spot b) { return hypot(b.x - a.x, b.y - a.y); }

/* The unit direction from a to b, or to the right if they are equal. */
kt_spot kt_spot_direction(kt_spot a, kt_spot b) {
    const double length = kt_spot_distance(a, b);
    return length > 1e-9 ? (kt_spot){(b.x - a.x) / length, (b.y - a.y) / length} : (kt_spot){1.0, 0.0};
}

/* Goes `ahead` along a direction and `aside` to its right (down, where it points right). */
kt_spot kt_spot_offset(kt_spot from, kt_spot along, double ahead, double aside) {
    return (kt_spot){from.x + ahead * along.x - aside * along.y, from.y + ahead * along.y + aside * along.x};
}

void kt_trace_line(cairo_t *c, kt_spot from, kt_spot to) {
    cairo_move_to(c, from.x, from.y);
    cairo_line_to(c, to.x, to.y);
}

void kt_paint_line(const kt_sheet *sheet, kt_spot from, kt_spot to, double width, kt_colour colour) {
    kt_trace_line(sheet->c, from, to);
    kt_paper_stroke(sheet->c, colour, width);
}

void kt_paint_arrow(const kt_sheet *sheet, kt_spot from, kt_spot to, double width, kt_colour colour) {
    const kt_spot along = kt_spot_direction(from, to);
    const double head = 3.0 + 3.0 * width;
    const kt_spot neck = kt_spot_offset(to, along, -head, 0.0);
    const kt_spot left = kt_spot_offset(to, along, -head, -0.42 * head),
                  right = kt_spot_offset(to, along, -head, 0.42 * head);
    kt_paint_line(sheet, from, neck, width, colour);
    cairo_move_to(sheet->c, to.x, to.y);
    cairo_line_to(sheet->c, left.x, left.y);
    cairo_line_to(sheet->c, right.x, right.y);
    cairo_close_path(sheet->c);
    cairo_fill(sheet->c);
}

void kt_paint_hatching(const kt_sheet *sheet, kt_spot from, kt_spot to) {
    const kt_spot along = kt_spot_direction(from, to);
    const double length = kt_spot_distance(from, to), step = 6.0;
    const int count = (int)fmin(fmax(round(length / step), 2.0), 1000.0);
    const kt_colour colour = kt_sheet_faded(sheet, sheet->palette->quiet);
    kt_paint_line(sheet, from, to, 1.4, colour);
    for (int i = 0; i < count; i++) {
        const kt_spot top = kt_spot_offset(from, along, (i + 0.75) * length / count, 0.0);
        const kt_spot foot = kt_spot_offset(top, along, -0.75 * step, 0.75 * step);
        kt_trace_line(sheet->c, top, foot);
    }
    kt_paper_stroke(sheet->c, colour, 0.9);
}

void kt_paint_dashes(const kt_sheet *sheet, kt_spot from, kt_spot to, kt_colour colour, double width) {
    const double dashes[] = {5.0, 4.0};
    cairo_set_dash(sheet->c, dashes, 2, 0.0);
    kt_paint_line(sheet, from, to, width, colour);
    cairo_set_dash(sheet->c, NULL, 0, 0.0);
}

/* ---- springs and dampers ----------------------------------------------------------------------------------------- */

/* A triangular wave: 0, 1, 0, -1, 0 at u = 0, 1/4, 1/2, 3/4, 1. */
static double wave(double u) { return 1.0 - 4.0 * fabs(u + 0.25 - floor(u + 0.25) - 0.5); }

typedef struct wire {
    kt_spot from, to;
    double width, aside; /* of the coil, and of its middle from the line between the ends */
    int turns;
} wire;

static const double lead = 0.14; /* share of a spring that is straight at each end */

static kt_spot wire_at(const wire *w, double share) {
    const double coil = fmin(fmax((share - lead) / (1.0 - 2.0 * lead), 0.0), 1.0);
    return kt_spot_offset(kt_spot_between(w->from, w->to, share), kt_spot_direction(w->from, w->to), 0.0,
                          w->aside + w->width * wave(coil * w->turns));
}

/* Traces a spring from share a to share b, corner by corner. */
static void trace_wire(cairo_t *c, const wire *w, double a, double b) {
    const kt_spot first = wire_at(w, a), last = wire_at(w, b), in = wire_at(w, lead), out = wire_at(w, 1.0 - lead);
    cairo_move_to(c, first.x, first.y);
    if (a < lead && lead < b)
        cairo_line_to(c, in.x, in.y);
    for (int k = 0; k < 2 * w->turns; k++) {
        const double share = lead + (1.0 - 2.0 * lead) * (0.5 * k + 0.25) / w->turns;
        const kt_spot corner = wire_at(w, share);
        if (share > a && share < b)
            cairo_line_to(c, corner.x, corner.y);
    }
    if (a < 1.0 - lead && 1.0 - lead < b)
        cairo_line_to(c, out.x, out.y);
    cairo_line_to(c, last.x, last.y);
}

/* The part of a line from share low to share high that is within shares a to b. */
static void trace_part(cairo_t *c, kt_spot from, kt_spot to, double low, double high, double a, double b) {
    const double begin = fmax(low, a), end = fmin(high, b);
    if (begin < end)
        kt_trace_line(c, kt_spot_between(from, to, begin), kt_spot_between(from, to, end));
}

/* A line across the way from one spot to another, at a share of it, if that is within shares a to b. */
static void trace_across(cairo_t *c, kt_spot from, kt_spot to, double share, double half, double a, double b) {
    const kt_spot along = kt_spot_direction(from, to), middle = kt_spot_between(from, to, share);
    if (a <= share && b >= share)
        kt_trace_line(c, kt_spot_offset(middle, along, 0.0, -half), kt_spot_offset(middle, along, 0.0, half));
}

/* Traces the part of a spring around a bar that is in front of the bar. */
static void trace_coil(cairo_t *c, const wire *w, double a, double b) {
    for (int k = 0; k < w->turns; k++) {
        const double share = lead + (1.0 - 2.0 * lead) * (k + 0.75) / w->turns,
                     half = 0.5 * (1.0 - 2.0 * lead) / w->turns;
        if (share >= a && share <= b && k + 1 != w->turns)
            kt_trace_line(c, wire_at(w, share), wire_at(w, share + half));
    }
}

/* A dashpot: a cup that is open at one end, and a piston in it. */
static void trace_dashpot(cairo_t *c, kt_spot from, kt_spot to, double width, double a, double b) {
    const kt_spot along = kt_spot_direction(from, to);
    const kt_spot bottom = kt_spot_between(from, to, 0.36), mouth = kt_spot_between(from, to, 0.62);
    const double depth = kt_spot_distance(bottom, mouth);
    trace_part(c, from, to, 0.0, 0.36, a, b);
    trace_part(c, from, to, 0.5, 1.0, a, b);
    for (int side = -1; side <= 1; side += 2)
        trace_part(c, kt_spot_offset(bottom, along, 0.0, side * width),
                   kt_spot_offset(bottom, along, depth, side * width), 0.0, 1.0, (a - 0.36) / 0.26, (b - 0.36) / 0.26);
    trace_across(c, from, to, 0.36, width, a, b);
    trace_across(c, from, to, 0.5, 0.72 * width, a, b);
}

/* Bars across the ends of a spring and a damper side by side. */
static void trace_bars(cairo_t *c, kt_spot from, kt_spot to, double aside, double a, double b) {
    trace_across(c, from, to, 0.07, aside, a, b);
    trace_across(c, from, to, 0.93, aside, a, b);
    trace_part(c, from, to, 0.0, 0.07, a, b);
    trace_part(c, from, to, 0.93, 1.0, a, b);
}

void kt_paint_spring(const kt_sheet *sheet, kt_spot from, kt_spot to, double a, double b, bool has_stiffness,
                     bool has_damping, double around) {
    cairo_t *c = sheet->c;
    const double length = kt_spot_distance(from, to), width = fmin(fmax(1.15 * sheet->pin, around), 0.3 * length);
    const bool is_pair = has_stiffness && has_damping && around <= 0.0;
    const double aside = is_pair ? 1.35 * width : 0.0;
    const kt_spot along = kt_spot_direction(from, to);
    const double pitch = around > 0.0 ? 1.3 : 2.2; /* in half widths */
    const int turns = (int)fmin(fmax(round(length / (pitch * fmax(width, 0.1))), 4.0), 16.0);
    if (length < 2.0)
        return;
    if (is_pair) {
        trace_bars(c, from, to, aside, a, b);
        from = kt_spot_offset(from, along, 0.07 * length, 0.0);
        to = kt_spot_offset(to, along, -0.07 * length, 0.0);
        a = fmin(fmax((a - 0.07) / 0.86, 0.0), 1.0);
        b = fmin(fmax((b - 0.07) / 0.86, 0.0), 1.0);
    }
    const wire w = {from, to, width, -aside, turns};
    if (around > 0.0)
        trace_coil(c, &w, a, b);
    else if (has_stiffness || !has_damping)
        trace_wire(c, &w, a, b);
    if (has_damping && around <= 0.0)
        trace_dashpot(c, kt_spot_offset(from, along, 0.0, aside), kt_spot_offset(to, along, 0.0, aside), 0.85 * width,
                      a, b);
    kt_paper_stroke(c, kt_sheet_faded(sheet, sheet->palette->ink), fmin(1.3, 0.3 + 0.2 * sheet->pin));
}
