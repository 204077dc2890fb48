/* One line a measure: a dot for each engine on a logarithmic axis, a tick where the bound is. A value of zero, or below
 * the axis, is drawn on the left edge. An engine that could not run a case is named at the right. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw.h"

#include "../../apps/kinetree/command.h"
#include "../../apps/kinetree/plot/paper.h"

#include <math.h>
#include <string.h>

enum { LINE = 19, TOP = 76, LEFT = 470, WIDTH = 420, RIGHT = 160, BOTTOM = 44, LOWEST = -16, HIGHEST = 2 };

typedef struct page {
    const kt_palette *palette;
    const kt_hard_dots *dots;
    int count;
    const char *const *names;
} page;

static double place(double value) {
    const double power = value > 0.0 ? log10(value) : LOWEST;
    return LEFT + WIDTH * (fmin(fmax(power, LOWEST), HIGHEST) - LOWEST) / (HIGHEST - LOWEST);
}

static void draw_mark(cairo_t *c, const page *p, double x, double y, int engine) {
    kt_paper_trace_mark(c, x, y, engine + 1);
    kt_paper_draw_marks(c, engine > 0, p->palette->series[engine], p->palette->paper);
}

static void draw_axis(cairo_t *c, const page *p) {
    const double bottom = TOP + LINE * p->count;
    char text[16];
    cairo_set_line_width(c, 1.0);
    for (int power = LOWEST; power <= HIGHEST; power += 2) {
        const double x = place(pow(10.0, power));
        kt_paper_use(c, p->palette->faint);
        cairo_move_to(c, x, TOP - 6);
        cairo_line_to(c, x, bottom);
        cairo_stroke(c);
        kt_paper_use(c, p->palette->quiet);
        (void)snprintf(text, sizeof text, "%s%d", power < 0 ? "\u2212" : "", power < 0 ? -power : power);
        kt_paper_power(c, x, bottom + 18, KT_ANCHOR_MIDDLE, text, kt_small_size);
    }
}

static void draw_line(cairo_t *c, const page *p, int i) {
    const kt_hard_dots *d = &p->dots[i];
    const double y = TOP + LINE * (i + 0.5);
    char words[100] = "";
    cairo_set_font_size(c, kt_small_size);
    kt_paper_use(c, p->palette->ink);
    kt_paper_text(c, LEFT - 12, y + 4, KT_ANCHOR_RIGHT, d->label);
    cairo_set_line_width(c, 2.0);
    cairo_move_to(c, place(d->bound), y - 6);
    cairo_line_to(c, place(d->bound), y + 6);
    cairo_stroke(c);
    for (int k = KT_HARD_ENGINES - 1; k >= 0; k--) {
        if (isfinite(d->value[k]))
            draw_mark(c, p, place(d->value[k]), y, k);
        else if (d->words[k][0] && strcmp(d->words[k], "-") != 0)
            (void)snprintf(words + strlen(words), sizeof words - strlen(words), "%s%s", *words ? ", " : "without ",
                           p->names[k]);
    }
    kt_paper_use(c, p->palette->quiet);
    kt_paper_text_within(c, LEFT + WIDTH + 12, y + 4, RIGHT - 16, words);
}

static void draw_legend(cairo_t *c, const page *p) {
    double x = LEFT;
    cairo_set_font_size(c, kt_text_size);
    for (int k = 0; k < KT_HARD_ENGINES; k++) {
        draw_mark(c, p, x + 4, 50, k);
        kt_paper_use(c, p->palette->ink);
        kt_paper_text(c, x + 14, 55, KT_ANCHOR_LEFT, p->names[k]);
        x += 38 + kt_paper_width(c, p->names[k]);
    }
    cairo_set_line_width(c, 2.0);
    cairo_move_to(c, x + 4, 44);
    cairo_line_to(c, x + 4, 56);
    cairo_stroke(c);
    kt_paper_text(c, x + 14, 55, KT_ANCHOR_LEFT, "bound of the test");
}

static void draw(cairo_t *c, const void *what) {
    const page *p = what;
    cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    kt_paper_use(c, p->palette->paper);
    cairo_paint(c);
    kt_paper_use(c, p->palette->ink);
    cairo_set_font_size(c, kt_title_size);
    kt_paper_text(c, 24, 30, KT_ANCHOR_LEFT, "Hard cases: measured errors; smaller is better");
    draw_axis(c, p);
    draw_legend(c, p);
    for (int i = 0; i < p->count; i++)
        draw_line(c, p, i);
}

bool kt_hard_draw(const char *path, bool is_dark, const kt_hard_dots *dots, int count,
                  const char *const names[KT_HARD_ENGINES]) {
    const page p = {kt_palette_choose(is_dark), dots, count, names};
    return kt_paper_write(path, LEFT + WIDTH + RIGHT, TOP + LINE * count + BOTTOM, draw, &p) == KT_EXIT_DONE;
}
