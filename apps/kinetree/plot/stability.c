/* Draws the eigenvalues times a step, and the boundary of a method's region of stability.
 *
 * The boundary |R| = 1 is found by marching squares on a grid. In each square with corners on both sides, the boundary
 * crosses the edges at points that follow from linear interpolation of ln |R|. A line connects these points. The window
 * is fitted to the region in several passes, because the region of a stabilised method is long and narrow. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/stability.h"
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { GRID = 201, LINES_MAX = 4 * GRID * GRID, FITS = 6 };

typedef struct window {
    kt_complex low, high;
} window;

/* Points of line segments: two points, then a gap. */
typedef struct lines {
    double *x, *y;
    size_t count, room;
} lines;

static bool lines_make(lines *l, size_t room) {
    *l = (lines){calloc(room, sizeof(double)), calloc(room, sizeof(double)), 0, room};
    return l->x != NULL && l->y != NULL;
}

static void lines_free(lines *l) {
    free(l->x);
    free(l->y);
}

static void put_line_point(lines *l, double x, double y) {
    if (l->count >= l->room)
        return;
    l->x[l->count] = x;
    l->y[l->count++] = y;
}

/* Adds a single point: it is drawn if the series has marks, and otherwise only extends the range of the axes. */
static void put_point(lines *l, double x, double y) {
    put_line_point(l, x, y);
    put_line_point(l, (double)NAN, (double)NAN);
}

/* ---- the region -------------------------------------------------------------------------------------------------- */

static double grid_position(double low, double high, int i) { return low + (high - low) * i / (GRID - 1.0); }

/* Returns the part of the window that contains the region, plus one row or column on each side. The region of an
 * implicit method surrounds its complement (surrounds). The part then contains the complement. */
static window fit_window(const window *w, const double *gain, bool surrounds) {
    int left = GRID, right = -1, bottom = GRID, top = -1;
    for (int i = 0; i < GRID; i++)
        for (int j = 0; j < GRID; j++)
            if ((gain[i * GRID + j] <= 1.0) != surrounds) {
                left = j < left ? j : left;
                right = j > right ? j : right;
                bottom = i < bottom ? i : bottom;
                top = i > top ? i : top;
            }
    const window fitted = {
        {grid_position(w->low.re, w->high.re, left - 1), grid_position(w->low.im, w->high.im, bottom - 1)},
        {grid_position(w->low.re, w->high.re, right + 1), grid_position(w->low.im, w->high.im, top + 1)}};
    return right < 0 ? *w : fitted;
}

static void widen_window(window *w, double part) {
    const double x = part * (w->high.re - w->low.re), y = part * (w->high.im - w->low.im);
    *w = (window){{w->low.re - x, w->low.im - y}, {w->high.re + x, w->high.im + y}};
}

static window find_region(const kt_stability *s, double *gain) {
    const double reach = kt_stability_real_limit(s), size = isfinite(reach) && reach > 0.0 ? reach : 2.0;
    const bool surrounds = s->poles > 0;
    window w = {{-1.5 * size, -1.5 * size - 0.013}, {0.6 * size, 1.5 * size + 0.013}};
    if (surrounds) /* poles lie within 1 / gamma, and the unstable area around them within several times that */
        w = (window){{-40.0, -40.013}, {40.0, 40.013}};
    for (int i = 0; i < FITS; i++) {
        kt_stability_grid(s, w.low, w.high, GRID, GRID, gain);
        w = fit_window(&w, gain, surrounds);
    }
    return w;
}

/* Position of the boundary between two corners with gains a and b, as a fraction of the edge. */
static double crossing_part(double a, double b) {
    const double u = log(fmax(a, 1e-300)), v = log(fmax(b, 1e-300));
    return u == v ? 0.5 : u / (u - v);
}

/* Adds the boundary within one square, whose corners 0 .. 3 are counted around it from the lower left. Two edges are
 * crossed, or four at a saddle, which are then joined in the order of the edges. */
static void march(lines *l, const window *w, const double *gain, int i, int j) {
    static const int di[4] = {0, 0, 1, 1}, dj[4] = {0, 1, 1, 0};
    double x[4], y[4];
    int crossed = 0;
    for (int k = 0; k < 4; k++) {
        const int n = (k + 1) % 4;
        const double a = gain[(i + di[k]) * GRID + j + dj[k]], b = gain[(i + di[n]) * GRID + j + dj[n]];
        if ((a <= 1.0) == (b <= 1.0))
            continue;
        const double part = crossing_part(a, b);
        x[crossed] = grid_position(w->low.re, w->high.re, j) +
                     (w->high.re - w->low.re) / (GRID - 1.0) * (dj[k] + part * (dj[n] - dj[k]));
        y[crossed++] = grid_position(w->low.im, w->high.im, i) +
                       (w->high.im - w->low.im) / (GRID - 1.0) * (di[k] + part * (di[n] - di[k]));
    }
    for (int k = 0; k + 1 < crossed; k += 2) {
        put_line_point(l, x[k], y[k]);
        put_point(l, x[k + 1], y[k + 1]);
    }
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

/* Extends the window from the region to the eigenvalues, except those beyond three times its size. Returns the number
 * of the latter. */
static int include_modes(const kt_stability_subject *subject, double step, window *w) {
    const window region = *w;
    const double far_x = 3.0 * (region.high.re - region.low.re), far_y = 3.0 * (region.high.im - region.low.im);
    int left_out = 0;
    for (int i = 0; i < kt_spectrum_count(subject->spectrum); i++) {
        const kt_mode mode = kt_spectrum_at(subject->spectrum, i).mode;
        const double x = step * mode.real, y = step * fabs(mode.imaginary);
        if (x < region.low.re - far_x || x > region.high.re + far_x || y > region.high.im + far_y) {
            left_out++;
            continue;
        }
        w->low.re = fmin(w->low.re, x);
        w->high.re = fmax(w->high.re, x);
        w->high.im = fmax(w->high.im, y);
        w->low.im = fmin(w->low.im, -y);
    }
    return left_out;
}

/* Widens the window to the ratio of the panel, 350 by 380, of which the axes add a twentieth above and below. */
static void make_even(window *w) {
    const double width = w->high.re - w->low.re, height = w->high.im - w->low.im, wanted = 380.0 / 1.1 / 350.0;
    const double more_x = fmax(height / wanted - width, 0.0) / 2.0, more_y = fmax(width * wanted - height, 0.0) / 2.0;
    *w = (window){{w->low.re - more_x, w->low.im - more_y}, {w->high.re + more_x, w->high.im + more_y}};
}

static void put_mode_points(const kt_stability_subject *subject, const kt_stability *s, double step, const window *w,
                            lines *in, lines *out) {
    for (int i = 0; i < kt_spectrum_count(subject->spectrum); i++) {
        const kt_mode mode = kt_spectrum_at(subject->spectrum, i).mode;
        const kt_complex lambda = {mode.real, mode.imaginary}, z = {step * mode.real, step * mode.imaginary};
        lines *to = kt_stability_growth(s, lambda, step, subject->duration) <= KT_STABILITY_GROWTH * 1.0001 ? in : out;
        if (z.re < w->low.re || z.re > w->high.re || fabs(z.im) > w->high.im)
            continue;
        put_point(to, z.re, z.im);
        if (mode.count == 2)
            put_point(to, z.re, -z.im);
    }
}

static int draw_stability(const kt_stability_subject *subject, const kt_stability *s, double step, const char *about,
                          double *gain, lines parts[3], const char *path, bool is_dark) {
    char subtitle[256], more[64] = "", stages[32] = "", verdict[64], kind[96] = "";
    window w = find_region(s, gain);
    const int left_out = include_modes(subject, step, &w);
    widen_window(&w, 0.06);
    if (!kt_method_stages_vary(subject->method))
        make_even(&w);
    kt_stability_grid(s, w.low, w.high, GRID, GRID, gain);
    for (int i = 0; i + 1 < GRID; i++)
        for (int j = 0; j + 1 < GRID; j++)
            march(&parts[0], &w, gain, i, j);
    put_point(&parts[0], w.low.re, w.low.im);
    put_point(&parts[0], w.high.re, w.high.im);
    put_mode_points(subject, s, step, &w, &parts[1], &parts[2]);
    if (left_out > 0)
        snprintf(more, sizeof more, "; %d modes are further out", left_out);
    if (kt_method_stages_vary(subject->method))
        snprintf(stages, sizeof stages, " (%d stages)", s->degree);
    kt_write_verdict(subject->method, verdict, sizeof verdict);
    if (verdict[0] != '\0')
        snprintf(kind, sizeof kind, "; %s: stable outside", verdict);
    snprintf(subtitle, sizeof subtitle, "%s%s with steps of %.4g s%s%s%s", subject->method->name, stages, step, about,
             kind, more);
    kt_plot_series series[3] = {
        {.label = s->steps > 0 ? "boundary |\316\276| = 1" : "boundary |R| = 1",
         .x = parts[0].x,
         .y = parts[0].y,
         .count = parts[0].count,
         .colour = 1},
        {.label = "modes, stable", .x = parts[1].x, .y = parts[1].y, .count = parts[1].count, .colour = 3, .mark = 1},
        {.label = "modes, unstable", .x = parts[2].x, .y = parts[2].y, .count = parts[2].count, .colour = 2, .mark = 2},
    };
    const kt_plot_panel panel = {.title = "Im(h \316\273)",
                                 .series = series,
                                 .has_legend = true,
                                 .series_count = parts[2].count > 0 ? 3 : 2,
                                 .x_title = "Re(h \316\273)"};
    const kt_plot plot = {.title = subject->name,
                          .subtitle = subtitle,
                          .x_title = "Re(h \316\273)",
                          .panels = &panel,
                          .panel_count = 1,
                          .is_row = true,
                          .is_dark = is_dark};
    return kt_plot_draw(&plot, path);
}

int kt_stability_draw(const kt_stability_subject *subject, const char *path, bool is_dark) {
    const int fastest = kt_spectrum_fastest(subject->spectrum);
    const size_t marks = 4 * (size_t)kt_spectrum_count(subject->spectrum) + 4;
    double step = subject->step;
    const char *about = "";
    if (!(step > 0.0)) {
        step = kt_spectrum_limit(subject->spectrum, subject->method, subject->duration, 0.0).step;
        about = ", the largest that is stable";
    }
    if (fastest < 0 || !isfinite(step))
        return kt_misuse("stability: no mode bounds the step, so there is nothing to draw; give a --step");
    const kt_mode mode = kt_spectrum_at(subject->spectrum, fastest).mode;
    kt_stability s;
    int stages = kt_stability_stages(subject->method, step * hypot(mode.real, mode.imaginary));
    stages = stages > KT_STABILISED_STAGES_MAX ? KT_STABILISED_STAGES_MAX : stages;
    kt_error error = {0};
    kt_status status = kt_stability_make(subject->method, stages, &s, &error);
    lines parts[3] = {{NULL, NULL, 0, 0}, {NULL, NULL, 0, 0}, {NULL, NULL, 0, 0}};
    double *gain = calloc((size_t)GRID * GRID, sizeof *gain);
    int code = status == KT_OK ? KT_EXIT_INTEGRATION : kt_exit_code(status);
    if (status != KT_OK)
        kt_say_error(&error);
    else if (gain == NULL || !lines_make(&parts[0], LINES_MAX) || !lines_make(&parts[1], marks) ||
             !lines_make(&parts[2], marks))
        kt_say("there is not enough memory for the picture");
    else
        code = draw_stability(subject, &s, step, about, gain, parts, path, is_dark);
    for (int i = 0; i < 3; i++)
        lines_free(&parts[i]);
    free(gain);
    return code;
}
