/* Warnings of columns without a finite value at some records. They are own columns whose formulas have no finite value,
 * and forces of contacts whose direction of slip is undetermined. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>

static bool is_of(const kt_columns *columns, size_t column, kt_column_source source) {
    const kt_column *c = &columns->columns[column];
    return c->source == source &&
           (source == KT_COLUMN_OWN || kt_effect_type_of(columns->model, c->index) == KT_EFFECT_CONTACT);
}

/* Writes the names, counts and first times of the first columns with gaps: "'tension' at 12 records, first at t = 0.5
 * s". Returns the number of all columns with gaps. */
static int list_column_gaps(const kt_columns *columns, kt_column_source source, const kt_extremes *extremes, char *text,
                            size_t size) {
    enum { NAMED = 4 };
    size_t used = 0;
    int count = 0;
    text[0] = '\0';
    for (size_t i = 0; i < extremes->count; i++) {
        const kt_extreme *e = &extremes->column[i];
        char name[96];
        if (!is_of(columns, i, source) || !(e->gaps > 0.0) || count++ >= NAMED)
            continue;
        (void)kt_column_name(columns, i, name, sizeof name);
        used += (size_t)snprintf(text + used, size - used, "%s'%s' at %.0f record%s, first at t = %.6g s",
                                 used > 0 ? "; " : "", name, e->gaps, e->gaps > 1.0 ? "s" : "", e->gap_time);
    }
    if (count > NAMED)
        (void)snprintf(text + used, size - used, "; and %d more columns", count - NAMED);
    return count;
}

static void warn_of(kt_outcome *outcome, kt_column_source source, const char *what, const char *remedy) {
    const kt_extremes *extremes = &outcome->extremes;
    char text[900];
    double records = 0.0, time = HUGE_VAL;
    if (outcome->columns == NULL || list_column_gaps(outcome->columns, source, extremes, text, sizeof text) == 0)
        return;
    for (size_t i = 0; i < extremes->count; i++)
        if (is_of(outcome->columns, i, source) && extremes->column[i].gaps > 0.0) {
            records += extremes->column[i].gaps;
            time = fmin(time, extremes->column[i].gap_time);
        }
    const kt_warning warning = kt_warning_at("not_finite", time, records, NULL, remedy);
    kt_warn(&outcome->warnings, &warning, "%s: %s", what, text);
}

void kt_warn_of_gaps(kt_outcome *outcome) {
    warn_of(outcome, KT_COLUMN_OWN, "own columns are not finite, and are gaps in pictures",
            "Keep formulas within their domain, as sqrt(max(x, 0)) and x/max(y, 1e-9) do");
    warn_of(outcome, KT_COLUMN_EFFECT,
            "the direction of friction is unknown where slip begins or ends, and leaves gaps",
            "Use `friction`, its magnitude, or another interval of records");
}
