/* The choice of the columns that a chart shows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "plot/choice.h"
#include "command.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *kt_label_of_column(const char *name) {
    const char *dot = strchr(name, '.');
    return dot != NULL && dot > name && dot[-1] != ']' ? dot + 1 : name;
}

/* Differences below this share of the largest value of a family are rounding. It covers some hundred operations, each
 * of 1e-16, and the remainder that the tolerance of a projection leaves. */
static const double NOISE = 1e-11;

/* Residuals may be as small as rounding of anything. Values below this bound are zero in any unit, in every column. */
static const double NOTHING = 1e-30;

static void measure_candidate(kt_candidate *one, size_t rows) {
    double least = HUGE_VAL, greatest = -HUGE_VAL;
    for (size_t i = 0; i < rows; i++)
        if (isfinite(one->y[i])) {
            least = fmin(least, one->y[i]);
            greatest = fmax(greatest, one->y[i]);
        }
    one->is_empty = !(least <= greatest);
    one->size = least <= greatest ? fmax(fabs(least), fabs(greatest)) : 0.0;
    one->range = least <= greatest ? greatest - least : 0.0;
}

/* The largest magnitude in the family of a column. */
static double size_of_family(const kt_candidate *candidates, int count, const kt_candidate *one) {
    double size = 0.0;
    for (int i = 0; i < count; i++)
        if (candidates[i].family == one->family)
            size = fmax(size, candidates[i].size);
    return size;
}

/* The rank of a column in its panel: moving columns before constant ones, the largest variation first. */
static double rank_of(const kt_candidate *one, double size) {
    return one->range > NOISE * size ? 2.0 + one->range / size : 1.0;
}

/* The number of columns that its panel shows before a column; the first of equal ones comes first. */
static int panel_place_of(const kt_candidate *candidates, int count, int column, double size) {
    const double rank = rank_of(&candidates[column], size);
    int before = 0;
    for (int i = 0; i < count; i++) {
        const kt_candidate *other = &candidates[i];
        const double its = rank_of(other, size);
        before += other->panel == candidates[column].panel && !other->is_noise && !other->is_empty &&
                  (its > rank || (its >= rank && i < column));
    }
    return before;
}

/* Whether a column is noise compared with others of its family. Zeros always are, and they have no logarithm. */
static bool column_is_noise(const kt_candidate *candidates, int count, const kt_candidate *one) {
    const double size = size_of_family(candidates, count, one);
    return !one->is_empty && !(one->size > (one->is_error ? NOTHING : fmax(NOTHING, NOISE * size)));
}

static bool is_any_shown(const kt_candidate *candidates, int count) {
    for (int i = 0; i < count; i++)
        if (!candidates[i].is_noise && !candidates[i].is_empty)
            return true;
    return false;
}

void kt_candidates_choose(kt_candidate *candidates, int count, size_t rows) {
    for (int i = 0; i < count; i++)
        measure_candidate(&candidates[i], rows);
    for (int i = 0; i < count; i++)
        candidates[i].is_noise = column_is_noise(candidates, count, &candidates[i]);
    if (!is_any_shown(candidates, count)) /* a picture of zeros shows them, except residuals */
        for (int i = 0; i < count; i++)
            candidates[i].is_noise = candidates[i].is_noise && candidates[i].is_error;
    for (int i = 0; i < count; i++)
        candidates[i].is_shown = !candidates[i].is_noise && !candidates[i].is_empty &&
                                 panel_place_of(candidates, count, i,
                                                size_of_family(candidates, count, &candidates[i])) < KT_PLOT_SERIES_MAX;
}

static int count_left_out(const kt_candidate *candidates, int count, int panel) {
    int left_out = 0;
    for (int i = 0; i < count; i++)
        left_out += candidates[i].panel == panel && !candidates[i].is_shown && !candidates[i].is_noise &&
                    !candidates[i].is_empty;
    return left_out;
}

bool kt_plot_is_rising(const double *x, size_t count) {
    for (size_t i = 1; i < count; i++)
        if (!(x[i] >= x[i - 1]))
            return false;
    return true;
}

kt_plot_panel kt_candidates_panel(const kt_candidate *candidates, int count, int panel, const double *x, size_t rows,
                                  kt_plot_series *series) {
    const bool is_dense = kt_plot_is_rising(x, rows);
    int shown = 0;
    for (int i = 0; i < count; i++)
        if (candidates[i].panel == panel && candidates[i].is_shown)
            series[shown++] = (kt_plot_series){
                .label = candidates[i].label, .x = x, .y = candidates[i].y, .count = rows, .is_dense = is_dense};
    return (kt_plot_panel){.series = series,
                           .series_count = shown,
                           .left_out = count_left_out(candidates, count, panel),
                           .has_legend = true};
}

void kt_panels_mark(kt_plot_panel *panels, int count, const kt_marks *marks, kt_plot_event *events) {
    for (int i = 0; i < marks->count; i++)
        events[i] = (kt_plot_event){marks->mark[i].time, marks->mark[i].name};
    for (int i = 0; i < count; i++) {
        panels[i].events = events;
        panels[i].event_count = marks->count;
        panels[i].names_events = i == 0;
    }
}

kt_noise_words kt_candidates_note_noise(const kt_candidate *candidates, int count) {
    kt_noise_words words = {""};
    int noise = 0, empty = 0;
    for (int i = 0; i < count; i++) {
        noise += candidates[i].is_noise;
        empty += candidates[i].is_empty;
    }
    size_t used = 0;
    if (noise > 0)
        used = (size_t)snprintf(words.text, sizeof words.text, "; %d column%s of zeros or rounding noise left out",
                                noise, noise == 1 ? "" : "s");
    if (empty > 0)
        (void)snprintf(words.text + used, sizeof words.text - used, "; %d without a finite value", empty);
    return words;
}

/* Writes the names of the first columns with a property. Returns false if there are none. */
static bool name_those(const kt_candidate *candidates, int count, bool empty, char *names, size_t size) {
    enum { NAMED = 6 };
    size_t used = 0;
    int found = 0;
    for (int i = 0; i < count; i++)
        if ((empty ? candidates[i].is_empty : candidates[i].is_noise) && found++ < NAMED)
            used += (size_t)snprintf(names + used, size - used, "%s%.80s", used > 0 ? ", " : "", candidates[i].name);
    if (found > NAMED)
        (void)snprintf(names + used, size - used, " and %d more", found - NAMED);
    return found > 0;
}

void kt_candidates_say_noise(const char *command, const kt_candidate *candidates, int count) {
    char names[600];
    if (name_those(candidates, count, false, names, sizeof names))
        kt_say("%s: note: left out of the picture, since zero or rounding noise: %s", command, names);
    if (name_those(candidates, count, true, names, sizeof names))
        kt_say("%s: note: left out of the picture, since no value is finite: %s", command, names);
}
