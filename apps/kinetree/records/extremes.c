/* Functionals of the columns of a run. */
#include "records/extremes.h"

#include <math.h>
#include <stdlib.h>

bool kt_extremes_start(kt_extremes *extremes, size_t count) {
    const double nan = (double)NAN;
    const kt_extreme none = {nan, nan, nan, nan, 0.0, 0.0, nan, 0.0, nan, 0.0, nan};
    extremes->column = malloc((count + 1) * sizeof *extremes->column);
    extremes->count = extremes->column != NULL ? count : 0;
    for (size_t i = 0; i < extremes->count; i++)
        extremes->column[i] = none;
    return extremes->column != NULL;
}

void kt_extremes_free(kt_extremes *extremes) {
    free(extremes->column);
    *extremes = (kt_extremes){.column = NULL};
}

void kt_extreme_add(kt_extreme *e, double time, double value, bool is_gap) {
    if (is_gap) {
        e->gap_time = e->gaps > 0.0 ? e->gap_time : time;
        e->gaps++;
        e->time = (double)NAN;
        return;
    }
    if (!(value >= e->least)) { /* also where there is none yet */
        e->least = value;
        e->least_time = time;
    }
    if (!(value <= e->greatest)) {
        e->greatest = value;
        e->greatest_time = time;
    }
    if (!isnan(e->time)) {
        e->covered += time - e->time;
        e->integral += 0.5 * (time - e->time) * (e->last + value);
        e->square += 0.5 * (time - e->time) * (value * value + e->last * e->last);
    }
    e->last = value;
    e->time = time;
}

void kt_extremes_add(kt_extremes *extremes, double time, const double *values) {
    for (size_t i = 0; i < extremes->count; i++)
        kt_extreme_add(&extremes->column[i], time, values[i], !isfinite(values[i]));
}

double kt_extreme_mean(const kt_extreme *e) { return e->covered > 0.0 ? e->integral / e->covered : e->last; }

double kt_extreme_rms(const kt_extreme *e) { return e->covered > 0.0 ? sqrt(e->square / e->covered) : fabs(e->last); }

json_t *kt_extremes_describe(const kt_extremes *extremes, const kt_columns *columns) {
    json_t *object = json_object();
    char name[512];
    for (size_t i = 0; i < extremes->count; i++) {
        const kt_extreme *e = &extremes->column[i];
        if (columns->columns[i].source == KT_COLUMN_TIME)
            continue;
        (void)kt_column_name(columns, i, name, sizeof name);
        json_t *one = json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "min", kt_json_number(e->least), "min_time",
                                kt_json_number(e->least_time), "max", kt_json_number(e->greatest), "max_time",
                                kt_json_number(e->greatest_time), "rms", kt_json_number(kt_extreme_rms(e)), "end",
                                kt_json_number(e->last), "unit", kt_json_text(kt_column_quantity(columns, i).unit));
        if (e->gaps > 0.0)
            json_object_set_new(
                one, "gaps",
                json_pack("{s:I, s:o}", "count", (json_int_t)e->gaps, "time", kt_json_number(e->gap_time)));
        json_object_set_new(object, name, one);
    }
    return object;
}
