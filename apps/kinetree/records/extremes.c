/* Functionals of the columns of a run. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/extremes.h"

#include <math.h>
#include <stdlib.h>

bool kt_extremes_start(kt_extremes *extremes, size_t count) {
    const double nan = (double)NAN;
    const kt_extreme none = {.least = nan,
                             .greatest = nan,
                             .least_time = nan,
                             .greatest_time = nan,
                             .last = nan,
                             .time = nan,
                             .gap_time = nan,
                             .record = nan,
                             .pending = nan,
                             .pending_time = nan,
                             .rate_time = nan};
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

/* Adds a point of the motion, of a record or of the end of a step. */
static void add_point(kt_extreme *e, double time, double value) {
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
        e->path += fabs(value - e->last);
    }
    e->low = fmin(e->low, value);
    e->high = fmax(e->high, value);
    e->last = value;
    e->time = time;
}

/* Adds the pending end of a step, if it is not after `time`. */
static void add_pending(kt_extreme *e, double time) {
    if (!(e->pending_time <= time))
        return;
    add_point(e, e->pending_time, e->pending);
    e->pending_time = (double)NAN;
}

void kt_extreme_step(kt_extreme *e, double time, double value) {
    add_pending(e, HUGE_VAL);
    if (!isfinite(value))
        return;
    e->pending = value;
    e->pending_time = time;
}

void kt_extreme_add(kt_extreme *e, double time, double value, bool is_gap) {
    add_pending(e, time);
    if (is_gap) {
        e->gap_time = e->gaps > 0.0 ? e->gap_time : time;
        e->gaps++;
        e->time = e->record = (double)NAN;
        return;
    }
    add_point(e, time, value);
    if (!isnan(e->record)) {
        e->shown += fabs(value - e->record);
        e->between = fmax(e->between, e->high - e->low - fabs(value - e->record));
    }
    e->record = e->low = e->high = value;
}

/* Returns whether a path is much longer than the path that the records show. */
static bool is_path_hidden(const kt_extreme *e, double path, double noise) {
    const double range = e->greatest - e->least;
    return range > noise && path > 1.5 * e->shown && path - e->shown > 10.0 * range;
}

bool kt_extreme_is_aliased(const kt_extreme *e, double noise) {
    return is_path_hidden(e, e->path, noise) && e->between > 0.05 * (e->greatest - e->least);
}

void kt_extreme_add_rates(kt_extreme *e, double time, double velocity, double turn_rate) {
    const double speed = fabs(velocity);
    if (!isnan(e->rate_time)) {
        e->travel += 0.5 * (time - e->rate_time) * (e->speed + speed);
        e->turned += 0.5 * (time - e->rate_time) * (e->turn_rate + turn_rate);
        e->spans++;
    }
    e->speed = speed;
    e->turn_rate = turn_rate;
    e->rate_time = time;
}

bool kt_extreme_is_turned(const kt_extreme *e, double noise) {
    static const double half_turn = 3.14159265358979323846;
    return e->turned > half_turn * e->spans && is_path_hidden(e, e->travel, noise);
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
        const bool has_steps = kt_column_has_steps(columns->columns[i].source);
        json_t *one = json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:s}", "min", kt_json_number(e->least), "min_time",
                                kt_json_number(e->least_time), "max", kt_json_number(e->greatest), "max_time",
                                kt_json_number(e->greatest_time), "rms", kt_json_number(kt_extreme_rms(e)), "end",
                                kt_json_number(e->last), "unit", kt_json_text(kt_column_quantity(columns, i).unit),
                                "from", has_steps ? "steps" : "records");
        if (e->gaps > 0.0)
            json_object_set_new(
                one, "gaps",
                json_pack("{s:I, s:o}", "count", (json_int_t)e->gaps, "time", kt_json_number(e->gap_time)));
        json_object_set_new(object, name, one);
    }
    return object;
}
