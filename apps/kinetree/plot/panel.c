/* Draws one panel of a chart. The title with the unit is at the top left, and ticks are at round numbers on a light
 * grid. The legend is on the right, where it covers no line. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/frame.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { TICKS_X = 11, TICKS_Y = 7 };

/* ---- grid -------------------------------------------------------------------------------------------------------- */

static void put_tick(cairo_t *c, double x, double y, kt_anchor anchor, const kt_axis *axis, int i) {
    char text[48];
    kt_axis_text(axis, i, text, sizeof text);
    if (axis->is_log)
        kt_paper_power(c, x, y, anchor, text, kt_small_size);
    else
        kt_paper_text(c, x, y, anchor, text);
}

static void draw_line(cairo_t *c, double x1, double y1, double x2, double y2) {
    cairo_move_to(c, x1, y1);
    cairo_line_to(c, x2, y2);
    cairo_stroke(c);
}

/* Draws grid lines at 2 to 9 times each power of ten, if there is room for them. */
static void draw_minor(cairo_t *c, const kt_plot_frame *f, const kt_axis *axis, bool of_x) {
    if (!axis->is_log || axis->step > 1.5 || log10(axis->high / axis->low) > 4.5)
        return;
    cairo_set_line_width(c, 0.5);
    const int first = (int)floor(log10(axis->low)), last = (int)ceil(log10(axis->high));
    for (int decade = first; decade < last; decade++)
        for (int k = 2; k < 10; k++) {
            const double value = k * pow(10.0, decade);
            if (value < axis->low || value > axis->high)
                continue;
            if (of_x)
                draw_line(c, kt_frame_x(f, value), f->top, kt_frame_x(f, value), f->bottom);
            else
                draw_line(c, f->left, kt_frame_y(f, value), f->right, kt_frame_y(f, value));
        }
}

static void draw_grid(cairo_t *c, const kt_plot_frame *f) {
    kt_paper_use(c, f->palette->faint);
    draw_minor(c, f, &f->x, true);
    draw_minor(c, f, &f->y, false);
    cairo_set_line_width(c, 1.0);
    cairo_set_font_size(c, kt_small_size);
    for (int i = 0; i < f->y.count; i++) {
        const double y = kt_frame_y(f, kt_axis_tick(&f->y, i));
        kt_paper_use(c, f->palette->faint);
        draw_line(c, f->left, y, f->right, y);
        kt_paper_use(c, f->palette->ink);
        put_tick(c, f->left - 8.0, y + 0.36 * kt_small_size, KT_ANCHOR_RIGHT, &f->y, i);
    }
    for (int i = 0; i < f->x.count; i++) {
        const double x = kt_frame_x(f, kt_axis_tick(&f->x, i));
        kt_paper_use(c, f->palette->faint);
        draw_line(c, x, f->top, x, f->bottom);
        kt_paper_use(c, f->palette->ink);
        put_tick(c, x, f->bottom + 1.5 * kt_small_size, KT_ANCHOR_MIDDLE, &f->x, i);
    }
    kt_paper_use(c, f->palette->quiet);
    cairo_move_to(c, f->left, f->top);
    cairo_line_to(c, f->left, f->bottom);
    cairo_line_to(c, f->right, f->bottom);
    cairo_stroke(c);
}

/* Draws the grey region of values that cannot be resolved. */
static void draw_blind(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel) {
    const double y = kt_frame_y(f, panel->blind);
    if (!(panel->blind > 0.0) || !(y < f->bottom))
        return;
    const kt_colour quiet = f->palette->quiet;
    cairo_set_source_rgba(c, quiet.red, quiet.green, quiet.blue, 0.16);
    cairo_rectangle(c, f->left, y, f->right - f->left, f->bottom - y);
    cairo_fill(c);
    if (panel->blind_label == NULL)
        return;
    kt_paper_use(c, quiet);
    cairo_set_font_size(c, 0.9 * kt_small_size);
    kt_paper_text(c, f->left + 6.0, fmin(y + 1.2 * kt_small_size, f->bottom - 4.0), KT_ANCHOR_LEFT, panel->blind_label);
}

/* Draws lines at events, and their names along them, on the left, where they cover no line nor name before. */
static void draw_events(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel) {
    static const double dashes[] = {3.0, 3.0};
    const double room = 1.2 * kt_small_size;
    double last = (double)-INFINITY, taken = (double)-INFINITY; /* taken: the right edge of lines and names */
    kt_paper_use(c, f->palette->quiet);
    cairo_set_font_size(c, 0.9 * kt_small_size);
    cairo_set_line_width(c, 0.8);
    for (int i = 0; i < panel->event_count; i++) {
        const double x = kt_frame_x(f, panel->events[i].x);
        if (!(x >= last + 1.0) || x > f->right + 0.5)
            continue;
        last = x;
        cairo_set_dash(c, dashes, 2, 0.0);
        draw_line(c, x, f->top, x, f->bottom);
        cairo_set_dash(c, NULL, 0, 0.0);
        const bool fits = x >= taken + room, is_left = x > f->left + room;
        taken = fmax(taken, x);
        if (!panel->names_events || !fits)
            continue;
        taken = is_left ? x : x + room;
        cairo_save(c);
        cairo_translate(c, is_left ? x - 3.0 : x + kt_small_size, f->top + 4.0);
        cairo_rotate(c, -acos(0.0));
        kt_paper_text_short(c, 0.0, 0.0, f->bottom - f->top - 8.0, KT_ANCHOR_RIGHT, panel->events[i].label);
        cairo_restore(c);
    }
}

/* ---- series ------------------------------------------------------------------------------------------------------ */

/* Simplifies a curve while it is drawn. Points are left out as long as all of them stay within SLACK of the chord that
 * replaces them. The difference is invisible, and ten thousand records become some hundred points. */
static const double SLACK = 0.1; /* pt; lines are 1.3 pt wide or more */

enum { PENDING_MAX = 64 };

typedef struct kt_pen {
    cairo_t *c;
    double x[PENDING_MAX], y[PENDING_MAX]; /* the last point drawn, then those after it */
    int count;                             /* 0: the pen is up */
    bool is_point;                         /* no line leads to the last point drawn */
    bool has_dots;                         /* such points are visible */
} kt_pen;

static double distance_to_chord(double x, double y, double x0, double y0, double x1, double y1) {
    const double dx = x1 - x0, dy = y1 - y0, squared = dx * dx + dy * dy;
    const double along = squared > 0.0 ? ((x - x0) * dx + (y - y0) * dy) / squared : 0.0;
    const double nearest = fmin(fmax(along, 0.0), 1.0);
    return hypot(x - x0 - nearest * dx, y - y0 - nearest * dy);
}

static bool is_chord(const kt_pen *pen, double x, double y) {
    for (int i = 1; i < pen->count; i++)
        if (distance_to_chord(pen->x[i], pen->y[i], pen->x[0], pen->y[0], x, y) > SLACK)
            return false;
    return true;
}

/* Draws the line to the last pending point, which becomes the start of the next chord. */
static void pen_draw(kt_pen *pen) {
    if (pen->count < 2)
        return;
    pen->x[0] = pen->x[pen->count - 1];
    pen->y[0] = pen->y[pen->count - 1];
    cairo_line_to(pen->c, pen->x[0], pen->y[0]);
    pen->count = 1;
    pen->is_point = false;
}

static void pen_to(kt_pen *pen, double x, double y) {
    if (pen->count == 0) {
        cairo_move_to(pen->c, x, y);
        pen->is_point = true;
    } else if (pen->count == PENDING_MAX || !is_chord(pen, x, y))
        pen_draw(pen);
    pen->x[pen->count] = x;
    pen->y[pen->count++] = y;
}

/* A point without neighbours, such as the only record, is drawn as a dot. Pictures of other values have such points to
 * widen the axes. */
static void pen_up(kt_pen *pen) {
    pen_draw(pen);
    if (pen->count > 0 && pen->is_point && pen->has_dots) {
        cairo_new_sub_path(pen->c);
        cairo_arc(pen->c, pen->x[0], pen->y[0], 1.0, 0.0, 4.0 * acos(0.0));
        cairo_close_path(pen->c);
    }
    pen->count = 0;
}

/* Draws the first, the least, the largest and the last of the points first .. end - 1, in their order. These determine
 * the visible line within one column of pixels. Source: Jugel et al. 2014, Proceedings of the VLDB Endowment 7,
 * 797-808. */
static void pen_column(kt_pen *pen, const kt_plot_frame *f, const kt_plot_series *series, size_t first, size_t end) {
    size_t least = first, largest = first;
    for (size_t i = first; i < end; i++) {
        const double y = kt_frame_y(f, series->y[i]);
        least = y < kt_frame_y(f, series->y[least]) ? i : least;
        largest = y > kt_frame_y(f, series->y[largest]) ? i : largest;
    }
    const size_t kept[] = {first, least < largest ? least : largest, least < largest ? largest : least, end - 1};
    for (size_t i = 0; i < sizeof kept / sizeof kept[0]; i++)
        if (i == 0 || kept[i] != kept[i - 1])
            pen_to(pen, kt_frame_x(f, series->x[kept[i]]), kt_frame_y(f, series->y[kept[i]]));
}

/* A logarithmic axis may end above the least values (axis.c). */
static bool is_above_end(const kt_axis *axis, double value) { return !axis->is_log || value > 0.999 * axis->low; }

static bool is_on_paper(const kt_plot_frame *f, const kt_plot_series *series, size_t i) {
    const double x = series->x[i], y = series->y[i];
    return isfinite(kt_frame_x(f, x)) && isfinite(kt_frame_y(f, y)) && is_above_end(&f->x, x) && is_above_end(&f->y, y);
}

/* In a dense series, whose x is rising, the points are grouped into columns of 1 pt; any other series is drawn point by
 * point. */
static void trace_series(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series) {
    kt_pen pen = {.c = c, .has_dots = series->is_dense};
    for (size_t i = 0; i < series->count;) {
        size_t end = i + 1;
        if (!is_on_paper(f, series, i)) {
            pen_up(&pen);
        } else {
            const double right = series->is_dense ? floor(kt_frame_x(f, series->x[i])) + 1.0 : (double)-INFINITY;
            while (end < series->count && is_on_paper(f, series, end) && kt_frame_x(f, series->x[end]) < right)
                end++;
            pen_column(&pen, f, series, i, end);
        }
        i = end;
    }
    pen_up(&pen);
}

/* Colours whose lightness rises evenly: five of viridis (S. van der Walt, N. Smith 2015). */
static kt_colour colour_of_share(double share) {
    static const kt_colour ramp[] = {{0.267, 0.005, 0.329},
                                     {0.229, 0.322, 0.546},
                                     {0.128, 0.567, 0.551},
                                     {0.369, 0.789, 0.383},
                                     {0.993, 0.906, 0.144}};
    const double at = 4.0 * fmin(fmax(share, 0.0), 1.0);
    const int k = at < 4.0 ? (int)at : 3;
    return kt_colour_mix(ramp[k], ramp[k + 1], at - k);
}

/* The axis along a bar of colours. */
static kt_axis axis_of_colours(double low, double high, bool is_log) {
    if (!(high - low > 1e-12 * fmax(fabs(low), fabs(high)))) {
        const double room = high != 0.0 ? 0.5 * fabs(high) : 1.0;
        low -= room;
        high += room;
    }
    return is_log ? kt_axis_make_log(low, high, 6) : kt_axis_make(low, high, 6);
}

/* The colour of a curve at a share of the scale. The end of the scale that the page would hide is not used. */
static kt_colour colour_of_curve(const kt_plot_frame *f, double share) {
    const bool is_dark = f->palette->paper.green < 0.5;
    const double shown = fmin(fmax(share, 0.0), 1.0);
    return colour_of_share(is_dark ? 0.25 + 0.75 * shown : 0.85 * shown);
}

static kt_colour series_colour_of(const kt_plot_frame *f, const kt_plot_panel *panel, int place) {
    const kt_plot_series *series = &panel->series[place];
    if (panel->scale != NULL) {
        const kt_axis axis = axis_of_colours(panel->scale->low, panel->scale->high, panel->scale->is_log);
        return colour_of_curve(f, kt_axis_place(&axis, series->value));
    }
    return f->palette->series[(series->colour > 0 ? series->colour - 1 : place) % KT_PLOT_SERIES_MAX];
}

/* Uses the colour of a series, and a width for its lines. */
static void use_series_pen(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour,
                           double width) {
    if (series->is_halo)
        cairo_set_source_rgba(c, f->palette->quiet.red, f->palette->quiet.green, f->palette->quiet.blue, 0.28);
    else
        kt_paper_use(c, colour);
    cairo_set_line_width(c, series->is_halo ? 9.0 : series->mark > 0 ? 1.3 : width);
}

/* Draws the rings or the floors of a series. */
static void draw_remarks(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour) {
    for (size_t i = 0; i < series->count; i++) {
        const double x = kt_frame_x(f, series->x[i]), y = kt_frame_y(f, series->y[i]);
        if (isfinite(x) && isfinite(y))
            (series->is_ringed ? kt_guide_ring : kt_guide_floor)(c, x, y, colour);
    }
}

static void draw_series(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour) {
    static const double dashes[] = {6.0, 3.0};
    cairo_new_path(c);
    if (series->is_ringed || series->is_floor) {
        draw_remarks(c, f, series, colour);
        return;
    }
    kt_guide_bars(c, f, series, colour);
    use_series_pen(c, f, series, colour, 1.6);
    if (series->is_dashed)
        cairo_set_dash(c, dashes, 2, 0.0);
    if (!series->is_scattered)
        trace_series(c, f, series);
    cairo_stroke(c);
    cairo_set_dash(c, NULL, 0, 0.0);
    for (size_t i = 0; i < series->count && series->mark > 0; i++) {
        const double x = kt_frame_x(f, series->x[i]), y = kt_frame_y(f, series->y[i]);
        if (isfinite(x) && isfinite(y))
            kt_paper_trace_mark(c, x, y, series->mark);
    }
    kt_paper_draw_marks(c, series->hollow, colour, f->palette->paper);
}

/* ---- cells ------------------------------------------------------------------------------------------------------- */

static double value_of_cell(const kt_plot_cells *cells, size_t i) {
    return !cells->is_log ? cells->z[i] : cells->z[i] != 0.0 ? fabs(cells->z[i]) : (double)NAN;
}

static kt_axis range_of_cells(const kt_plot_cells *cells) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t i = 0; i < cells->count; i++)
        if (isfinite(value_of_cell(cells, i))) {
            low = fmin(low, value_of_cell(cells, i));
            high = fmax(high, value_of_cell(cells, i));
        }
    if (!(low <= high))
        low = high = 1.0;
    return axis_of_colours(low, high, cells->is_log);
}

static void draw_cells(cairo_t *c, const kt_plot_frame *f, const kt_plot_cells *cells) {
    enum { SQUARE = 4 /* half of its side */ };
    const kt_axis range = range_of_cells(cells);
    cairo_save(c);
    cairo_rectangle(c, f->left, f->top, f->right - f->left, f->bottom - f->top);
    cairo_clip(c);
    cairo_set_antialias(c, CAIRO_ANTIALIAS_NONE); /* no seams between neighbours */
    for (size_t i = 0; i < cells->count; i++) {
        double left = kt_frame_x(f, cells->x[2 * i]), right = kt_frame_x(f, cells->x[2 * i + 1]);
        double bottom = kt_frame_y(f, cells->y[2 * i]), top = kt_frame_y(f, cells->y[2 * i + 1]);
        const double share = kt_axis_place(&range, value_of_cell(cells, i));
        if (!isfinite(left + right + bottom + top + share))
            continue;
        if (!cells->is_grid) {
            left -= SQUARE;
            right += SQUARE;
            top -= SQUARE;
            bottom += SQUARE;
        }
        kt_paper_use(c, colour_of_share(share));
        cairo_rectangle(c, left, top, right - left, bottom - top);
        cairo_fill(c);
    }
    cairo_restore(c);
}

/* The name of the colours above them, and the unit. */
static void name_colours(cairo_t *c, double x, double y, double room, const kt_plot_panel *panel, int exponent) {
    const char *name = panel->scale != NULL ? panel->scale->label : panel->cells->label;
    const char *unit = panel->scale == NULL && panel->cells->unit != NULL ? panel->cells->unit : "";
    char label[160], power[24] = "";
    if (exponent != 0)
        (void)snprintf(power, sizeof power, "1e%d", exponent);
    if (unit[0] != '\0') { /* a line of its own, since names fill the room */
        kt_paper_text_within(c, x, y - 1.25 * kt_small_size, room, name);
        (void)snprintf(label, sizeof label, "%s%s%.60s", power, power[0] != '\0' ? " " : "", unit);
    } else
        (void)snprintf(label, sizeof label, "%.100s%s%s", name, power[0] != '\0' ? ", " : "", power);
    kt_paper_text_within(c, x, y, room, label);
}

/* The colours and their values, right of the panel. */
static void draw_colours(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel, double room) {
    enum { STRIPES = 64, WIDTH = 14 };
    const kt_plot_scale *scale = panel->scale;
    const kt_axis range =
        scale != NULL ? axis_of_colours(scale->low, scale->high, scale->is_log) : range_of_cells(panel->cells);
    const double x = f->right + 16.0, top = f->top + 1.4 * kt_small_size, height = f->bottom - top;
    for (int i = 0; i < STRIPES; i++) {
        const double share = (i + 0.5) / STRIPES;
        kt_paper_use(c, scale != NULL ? colour_of_curve(f, share) : colour_of_share(share));
        cairo_rectangle(c, x, f->bottom - height * (i + 1) / STRIPES, WIDTH, height / STRIPES + 0.5);
        cairo_fill(c);
    }
    kt_paper_use(c, f->palette->ink);
    cairo_set_font_size(c, kt_small_size);
    for (int i = 0; i < range.count; i++) {
        const double place = kt_axis_place(&range, kt_axis_tick(&range, i));
        if (place >= 0.0 && place <= 1.0)
            put_tick(c, x + WIDTH + 6.0, f->bottom - place * height + 0.36 * kt_small_size, KT_ANCHOR_LEFT, &range, i);
    }
    name_colours(c, x, f->top + 2.0, room - 24.0, panel, range.exponent);
}

/* Returns whether any point of a series is on the page. */
static bool is_seen(const kt_plot_frame *f, const kt_plot_series *series) {
    for (size_t i = 0; i < series->count; i++)
        if (isfinite(kt_frame_x(f, series->x[i])) && isfinite(kt_frame_y(f, series->y[i])))
            return true;
    return false;
}

/* Draws the line and the mark of a series in the legend. */
static void draw_legend_key(cairo_t *c, const kt_plot_frame *f, const kt_plot_series *series, kt_colour colour,
                            double x, double middle) {
    static const double dashes[] = {5.0, 2.5};
    if (series->is_ringed) {
        kt_guide_ring(c, x + 9.0, middle, colour);
        return;
    }
    if (series->is_floor) {
        kt_guide_floor(c, x + 9.0, middle - 8.0, colour);
        return;
    }
    use_series_pen(c, f, series, colour, 3.0);
    if (series->is_dashed)
        cairo_set_dash(c, dashes, 2, 0.0);
    if (!series->is_scattered)
        draw_line(c, x, middle, x + 18.0, middle);
    cairo_set_dash(c, NULL, 0, 0.0);
    if (series->mark > 0) {
        kt_paper_trace_mark(c, x + 9.0, middle, series->mark);
        kt_paper_draw_marks(c, series->hollow, colour, f->palette->paper);
    }
}

/* Draws the legend in columns, within a rectangle that begins at (left, top). */
static void draw_panel_legend(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel, double left, double top,
                              double width, int columns) {
    const double cell = width / columns;
    int shown = 0;
    cairo_set_font_size(c, kt_small_size);
    for (int i = 0; i < panel->series_count; i++) {
        const kt_plot_series *series = &panel->series[i];
        if (!is_seen(f, series))
            continue;
        const int line = shown / columns;
        const double x = left + shown % columns * cell, y = top + line * KT_LEGEND_LINE * kt_small_size;
        draw_legend_key(c, f, series, series_colour_of(f, panel, i), x, y - 0.36 * kt_small_size);
        kt_paper_use(c, f->palette->ink);
        kt_paper_text_short(c, x + 24.0, y, cell - 30.0, KT_ANCHOR_LEFT, series->label);
        shown++;
    }
    if (panel->left_out > 0) {
        char text[48];
        const int line = shown / columns;
        snprintf(text, sizeof text, "and %d more", panel->left_out);
        kt_paper_use(c, f->palette->quiet);
        kt_paper_text(c, left + shown % columns * cell, top + line * KT_LEGEND_LINE * kt_small_size, KT_ANCHOR_LEFT,
                      text);
    }
}

/* ---- ranges ------------------------------------------------------------------------------------------------------ */

/* Finds the range of all numbers that the axis can show. Without any, both ends are 0, or 1 on a logarithmic axis.
 * Curves over a rising x use all values of x, also those without a value to show. Panels above each other therefore
 * have one axis. */
static void find_axis_range(const kt_plot_panel *panel, bool of_y, bool is_log, double *low, double *high) {
    *low = HUGE_VAL;
    *high = -HUGE_VAL;
    for (int s = 0; s < panel->series_count; s++)
        for (size_t i = 0; i < panel->series[s].count; i++) {
            const double value = of_y ? panel->series[s].y[i] : panel->series[s].x[i];
            const double other = of_y ? panel->series[s].x[i] : panel->series[s].y[i];
            if (!isfinite(value) || (!isfinite(other) && (of_y || !panel->series[s].is_dense)) ||
                (is_log && !(value > 0.0)))
                continue;
            *low = fmin(*low, value);
            *high = fmax(*high, value);
            if (!of_y && panel->series[s].x_high != NULL && isfinite(panel->series[s].x_high[i]))
                *high = fmax(*high, panel->series[s].x_high[i]);
        }
    if (!(*low <= *high))
        *low = *high = is_log ? 1.0 : 0.0;
    if (is_log) /* values smaller by 20 powers of ten are below any rounding: 1e-222 would flatten all others */
        *low = fmax(*low, 1e-20 * *high);
}

static kt_axis make_axis(const kt_plot_panel *panel, bool of_y, int most) {
    double low, high;
    const bool is_log = of_y ? panel->y_log : panel->x_log;
    find_axis_range(panel, of_y, is_log, &low, &high);
    if (is_log) {
        const double room = pow(high / low, 0.04);
        if (of_y && panel->blind > 0.0) /* the grey region stays visible and has room for its label */
            low = fmin(low, panel->blind * pow(high / low, -0.05));
        if (of_y && panel->noise > 0.0)
            low = fmin(low, panel->noise * pow(high / low, -0.03));
        return kt_axis_make_log(low / fmax(room, 1.1), high * fmax(room, 1.1), most);
    }
    bool has_marks = false;
    for (int s = 0; s < panel->series_count; s++)
        has_marks = has_marks || panel->series[s].mark > 0;
    double room = of_y || has_marks || panel->x_title != NULL ? 0.05 * (high - low) : 0.0;
    if (!(high - low > 1e-12 * fmax(fabs(low), fabs(high))))
        room = high != 0.0 ? 0.5 * fabs(high) : 1.0;
    return kt_axis_make(low - room, high + room, most);
}

/* Widens one axis so that both have the same scale. */
static void equalize(kt_plot_frame *f, int most_x, int most_y) {
    const double width = f->right - f->left, height = f->bottom - f->top;
    const double x = 0.5 * (f->x.low + f->x.high), y = 0.5 * (f->y.low + f->y.high);
    const double scale = fmax((f->x.high - f->x.low) / width, (f->y.high - f->y.low) / height);
    f->x = kt_axis_make(x - 0.5 * scale * width, x + 0.5 * scale * width, most_x);
    f->y = kt_axis_make(y - 0.5 * scale * height, y + 0.5 * scale * height, most_y);
}

/* Draws the quantity of the vertical axis. "Energies - 84.0314 J, 10^-7 J": labels are differences. */
static void draw_panel_title(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel) {
    char title[256];
    const double offset = f->y.offset;
    const bool has_unit = panel->unit != NULL && f->y.exponent != 0;
    if (offset == 0.0)
        (void)snprintf(title, sizeof title, "%.200s", panel->title);
    else
        (void)snprintf(title, sizeof title, "%.160s %s %.15g%s%.40s", panel->title, offset < 0.0 ? "+" : "−",
                       fabs(offset), has_unit ? " " : "", has_unit ? panel->unit : "");
    kt_paper_quantity(c, f->left - 50.0, f->top - 12.0, KT_ANCHOR_LEFT, title, panel->unit, f->y.exponent);
}

/* Returns the number of ticks whose labels have room along an axis: at most `most`, and enough to show the scale. */
static int ticks_with_room(double length, double pitch, int most) { return (int)fmax(4.0, fmin(most, length / pitch)); }

/* Draws curves, and on top of them the names of points. */
static void draw_all_series(cairo_t *c, const kt_plot_frame *f, const kt_plot_panel *panel, kt_guide *guide) {
    for (int halo = 1; halo >= 0; halo--)
        for (int i = 0; i < panel->series_count; i++)
            if (panel->series[i].is_halo == (halo == 1))
                draw_series(c, f, &panel->series[i], series_colour_of(f, panel, i));
    for (int ringed = 1; ringed >= 0; ringed--) /* there is room for names of rings first */
        for (int i = 0; i < panel->series_count; i++)
            if (panel->series[i].is_ringed == (ringed == 1))
                kt_guide_names(c, f, &panel->series[i], series_colour_of(f, panel, i), guide);
}

int kt_panel_draw(cairo_t *c, const kt_palette *palette, const kt_plot_panel *panel, const kt_panel_place *at) {
    const int most_x = ticks_with_room(at->width, 2.5 * kt_small_size, at->width < 500.0 ? 8 : TICKS_X),
              most_y = ticks_with_room(at->height, 1.4 * kt_small_size, at->height > 250.0 ? 2 * TICKS_Y : TICKS_Y);
    kt_plot_frame f = {.left = at->left,
                       .right = at->left + at->width,
                       .top = at->top,
                       .bottom = at->top + at->height,
                       .x = make_axis(panel, false, most_x),
                       .y = make_axis(panel, true, most_y),
                       .palette = palette};
    if (panel->is_equal)
        equalize(&f, most_x, most_y);
    kt_axis_shift(&f.y);
    kt_guide *guide = kt_guide_make(&f, panel);
    draw_grid(c, &f);
    if (panel->cells != NULL)
        draw_cells(c, &f, panel->cells);
    draw_blind(c, &f, panel);
    kt_guide_noise(c, &f, panel);
    draw_events(c, &f, panel);
    kt_guide_fan(c, &f, panel, guide);
    kt_paper_use(c, palette->ink);
    draw_panel_title(c, &f, panel);
    if (panel->x_title != NULL)
        kt_paper_quantity(c, 0.5 * (f.left + f.right), f.bottom + 3.2 * kt_small_size, KT_ANCHOR_MIDDLE, panel->x_title,
                          panel->x_unit, f.x.exponent);
    draw_all_series(c, &f, panel, guide);
    free(guide);
    if (panel->cells != NULL || panel->scale != NULL)
        draw_colours(c, &f, panel, at->room);
    else if (panel->has_legend && at->legend_columns > 0)
        draw_panel_legend(c, &f, panel, f.left, f.bottom + 5.6 * kt_small_size, at->width, at->legend_columns);
    else if (panel->has_legend)
        draw_panel_legend(c, &f, panel, f.right + 16.0, f.top + kt_small_size, at->room - 18.0, 1);
    return f.x.exponent;
}
