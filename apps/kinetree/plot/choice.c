/* The choice of the columns that a chart shows. */
#include "plot/choice.h"
#include "command.h"
#include "plot/plot.h"

#include <math.h>
#include <stdio.h>

/* Of what is recorded in one unit, a difference below this share of the largest value is rounding: some hundred
 * operations, each of 1e-16, and what the tolerance of a projection leaves. */
static const double NOISE = 1e-11;

/* Residuals may be as small as rounding of anything; what is smaller than this is zero in any unit. */
static const double NOTHING = 1e-30;

static void measure(kt_candidate *one, size_t rows) {
    double least = HUGE_VAL, greatest = -HUGE_VAL;
    for (size_t i = 0; i < rows; i++)
        if (isfinite(one->y[i])) {
            least = fmin(least, one->y[i]);
            greatest = fmax(greatest, one->y[i]);
        }
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

/* The rank of a column among those of its panel: what moves, by how much, before what is constant. */
static double rank_of(const kt_candidate *one, double size) {
    return one->range > NOISE * size ? 2.0 + one->range / size : 1.0;
}

/* How many of its panel are shown before a column: the first of equal ones. */
static int place_of(const kt_candidate *candidates, int count, int column, double size) {
    const double rank = rank_of(&candidates[column], size);
    int before = 0;
    for (int i = 0; i < count; i++) {
        const kt_candidate *other = &candidates[i];
        const double its = rank_of(other, size);
        before +=
            other->panel == candidates[column].panel && !other->is_noise && (its > rank || (its >= rank && i < column));
    }
    return before;
}

void kt_candidates_choose(kt_candidate *candidates, int count, size_t rows) {
    for (int i = 0; i < count; i++)
        measure(&candidates[i], rows);
    for (int i = 0; i < count; i++) { /* where all are zeros, none is noise next to another; zeros have no logarithm */
        const double size = size_of_family(candidates, count, &candidates[i]);
        candidates[i].is_noise = (size > 0.0 || candidates[i].is_error) &&
                                 !(candidates[i].size > (candidates[i].is_error ? NOTHING : NOISE * size));
    }
    for (int i = 0; i < count; i++)
        candidates[i].is_shown =
            !candidates[i].is_noise &&
            place_of(candidates, count, i, size_of_family(candidates, count, &candidates[i])) < KT_PLOT_SERIES_MAX;
}

int kt_candidates_left_out(const kt_candidate *candidates, int count, int panel) {
    int left_out = 0;
    for (int i = 0; i < count; i++)
        left_out += candidates[i].panel == panel && !candidates[i].is_shown && !candidates[i].is_noise;
    return left_out;
}

kt_noise_words kt_candidates_note_noise(const kt_candidate *candidates, int count) {
    kt_noise_words words = {""};
    int noise = 0;
    for (int i = 0; i < count; i++)
        noise += candidates[i].is_noise;
    if (noise > 0)
        snprintf(words.text, sizeof words.text, "; %d column%s of zeros or rounding noise left out", noise,
                 noise == 1 ? "" : "s");
    return words;
}

void kt_candidates_say_noise(const char *command, const kt_candidate *candidates, int count) {
    enum { NAMED = 6 };
    char names[600] = "";
    size_t used = 0;
    int noise = 0;
    for (int i = 0; i < count; i++)
        if (candidates[i].is_noise && noise++ < NAMED)
            used += (size_t)snprintf(names + used, sizeof names - used, "%s%.80s", used > 0 ? ", " : "",
                                     candidates[i].name);
    if (noise > NAMED)
        (void)snprintf(names + used, sizeof names - used, " and %d more", noise - NAMED);
    if (noise > 0)
        kt_say("%s: left out of the picture, since zero or rounding noise: %s", command, names);
}
