/* The columns that a panel of a chart shows: those that move most, and none of rounding noise next to them. The panels
 * of 'run --plot' and of 'plot' come from here. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_CHOICE_H
#define KT_COMMAND_PLOT_CHOICE_H

#include "plot/plot.h"
#include "records/marks.h"

#include <stdbool.h>
#include <stddef.h>

/* A column that could be shown, of `rows` numbers. */
typedef struct kt_candidate {
    const char *name, *label; /* label: in the legend */
    const double *y;
    int panel;  /* columns of one panel have one unit */
    int family; /* a panel: columns of one family are noise next to each other. Moments are so next to forces: a length
                      between them is not as small as rounding */
    bool is_error; /* a residual, which is drawn on a logarithmic axis and may be as small as 1e-30 */
    /* Found by kt_candidates_choose: */
    double size, range; /* largest magnitude; largest less least value */
    bool is_shown;
    bool is_noise; /* zero, or rounding next to the others */
    bool is_empty; /* without a finite value */
} kt_candidate;

/* The part of a column's name that the title of its panel lacks: "crank" of "position.crank". An effect without a name
 * keeps its number: "effect[0].force". */
const char *kt_label_of_column(const char *name);

/* Chooses the columns to show. S is the largest magnitude in a family. A column moves if it varies by more than 1e-11
 * S. A column that does not move and is not larger than that is noise, and so is a column below 1e-30. A panel shows at
 * most KT_PLOT_SERIES_MAX columns: first the moving ones that vary most, then constant ones. Columns of zeros are shown
 * only if the picture has nothing else. Residuals of zero and columns without a finite value are never shown. */
void kt_candidates_choose(kt_candidate *candidates, int count, size_t rows);

/* The number of columns that were left out as noise or without a finite value, in words for a subtitle. Example: "; 3
 * columns of zeros or rounding noise left out". Empty if none were left out. */
typedef struct kt_noise_words {
    char text[160];
} kt_noise_words;
kt_noise_words kt_candidates_note_noise(const kt_candidate *candidates, int count);

/* Prints which columns were left out as noise, and which have no finite value, if there are any. */
void kt_candidates_say_noise(const char *command, const kt_candidate *candidates, int count);

/* Returns a panel of the shown columns over x, in the memory of KT_PLOT_SERIES_MAX series. The legend has the number of
 * columns that are neither shown nor noise. */
kt_plot_panel kt_candidates_panel(const kt_candidate *candidates, int count, int panel, const double *x, size_t rows,
                                  kt_plot_series *series);

/* Returns whether the numbers never fall. */
bool kt_plot_is_rising(const double *x, size_t count);

/* Adds lines at marks to all panels, which are over the time. The first one has their names. The events have room for
 * KT_MARKS_MAX. */
void kt_panels_mark(kt_plot_panel *panels, int count, const kt_marks *marks, kt_plot_event *events);

#endif
