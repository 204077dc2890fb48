/* A warning of own columns whose formulas have no finite value at some records. */
#include "subcommands/run.h"

#include <math.h>
#include <stdio.h>

/* "tension (12 records from t = 0.5 s on)" of each, the first of them; returns how many there are. */
static int list_gaps(const kt_columns *columns, const kt_extremes *extremes, char *text, size_t size) {
    enum { NAMED = 4 };
    size_t used = 0;
    int count = 0;
    text[0] = '\0';
    for (size_t i = 0; i < extremes->count; i++) {
        const kt_extreme *e = &extremes->column[i];
        char name[96];
        if (columns->columns[i].source != KT_COLUMN_OWN || !(e->gaps > 0.0) || count++ >= NAMED)
            continue;
        (void)kt_column_name(columns, i, name, sizeof name);
        used += (size_t)snprintf(text + used, size - used, "%s'%s' at %.0f record%s, first at t = %.6g s",
                                 used > 0 ? "; " : "", name, e->gaps, e->gaps > 1.0 ? "s" : "", e->gap_time);
    }
    if (count > NAMED)
        (void)snprintf(text + used, size - used, "; and %d more columns", count - NAMED);
    return count;
}

void kt_warn_of_gaps(kt_outcome *outcome) {
    const kt_extremes *extremes = &outcome->extremes;
    char text[900];
    double records = 0.0, time = HUGE_VAL;
    if (outcome->columns == NULL || list_gaps(outcome->columns, extremes, text, sizeof text) == 0)
        return;
    for (size_t i = 0; i < extremes->count; i++)
        if (outcome->columns->columns[i].source == KT_COLUMN_OWN && extremes->column[i].gaps > 0.0) {
            records += extremes->column[i].gaps;
            time = fmin(time, extremes->column[i].gap_time);
        }
    kt_warning warning = kt_warning_of("not_finite", records, NULL,
                                       "Keep formulas within their domain, as sqrt(max(x, 0)) and x/max(y, 1e-9) do");
    warning.time = time;
    kt_warn(&outcome->warnings, &warning, "own columns are not finite, and are gaps in pictures: %s", text);
}
