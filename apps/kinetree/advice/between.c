/* Warns if records fall too far apart for the motion: a picture of them shows a slow, false motion (aliasing).
 *
 * The default interval does not depend on the motion, so that a fast oscillation may pass whole periods between two
 * records. The ends of adaptive steps resolve every motion of coordinates. The path of a column over them is compared
 * with its path over the records (records/extremes.h). A steady turn changes its coordinate evenly and needs few steps,
 * while markers go round: their velocities at the records show it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include "kinetree/dynamics.h"

#include <math.h>
#include <stdio.h>

/* Returns the range of a column over records and steps that is at most noise. */
static double noise_of(const kt_outcome *outcome, size_t i) {
    const kt_extreme *e = &outcome->extremes.column[i];
    const bool is_energy = outcome->columns->columns[i].source == KT_COLUMN_ENERGY;
    const double size = fmax(fabs(e->least), fabs(e->greatest));
    return fmax(1e-6 * size, is_energy ? 0.0 : 100.0 * outcome->run->absolute);
}

/* Returns whether a column is compared. The total energy and momenta of a conservative motion are constant up to
 * errors, which vary between records, too. */
static bool is_compared(const kt_outcome *outcome, size_t i) {
    const kt_column *c = &outcome->columns->columns[i];
    const bool moves = outcome->so_far.moved.velocity > 100.0 * outcome->run->absolute;
    return kt_column_has_steps(c->source) && c->source != KT_COLUMN_MOMENTUM &&
           (c->source != KT_COLUMN_ENERGY || (moves && c->component < 2));
}

static double range_of(const kt_outcome *outcome, size_t i) {
    return outcome->extremes.column[i].greatest - outcome->extremes.column[i].least;
}

/* The largest range of the columns on one axis of a picture with column i. */
static double range_of_axis(const kt_outcome *outcome, size_t i) {
    const char *title = kt_column_quantity(outcome->columns, i).title;
    double most = 0.0;
    for (size_t k = 0; k < outcome->extremes.count; k++)
        if (is_compared(outcome, k) && kt_column_quantity(outcome->columns, k).title == title)
            most = fmax(most, range_of(outcome, k));
    return most;
}

double kt_periods_between(const kt_outcome *outcome, size_t column) {
    const kt_extreme *e = &outcome->extremes.column[column];
    const double intervals = (double)(outcome->so_far.records - 1);
    const double path = kt_extreme_is_turned(e, noise_of(outcome, column)) ? fmax(e->path, e->travel) : e->path;
    return path / (2.0 * range_of(outcome, column) * intervals);
}

void kt_watch_turns(kt_outcome *outcome, const kt_record *record) {
    const kt_columns *columns = outcome->columns;
    kt_extreme *column = outcome->extremes.column;
    for (size_t i = 0; columns != NULL && i + 2 < outcome->extremes.count; i++) {
        const kt_column *c = &columns->columns[i];
        if (c->source != KT_COLUMN_MARKER || c->component != 0)
            continue;
        const kt_vec3 at = kt_marker_at(record->model, c->index, c->marker);
        const kt_vec3 v = kt_point_velocity(record->model, record->data, c->index, at);
        const double turns = kt_vec3_norm(kt_body_twist(record->model, record->data, c->index).angular);
        kt_extreme_add_rates(&column[i], record->t, v.x, turns);
        kt_extreme_add_rates(&column[i + 1], record->t, v.y, turns);
        kt_extreme_add_rates(&column[i + 2], record->t, v.z, turns);
    }
}

/* Returns the aliased column with the most periods, among the coordinates or among all others. */
static size_t find_aliased_among(const kt_outcome *outcome, bool states) {
    const kt_extremes *extremes = &outcome->extremes;
    size_t found = extremes->count;
    for (size_t i = 0; i < extremes->count; i++)
        if (kt_column_is_state(outcome->columns->columns[i].source) == states && is_compared(outcome, i) &&
            (kt_extreme_is_aliased(&extremes->column[i], noise_of(outcome, i)) ||
             kt_extreme_is_turned(&extremes->column[i], noise_of(outcome, i))) &&
            range_of(outcome, i) > 1e-3 * range_of_axis(outcome, i) &&
            (found == extremes->count || kt_periods_between(outcome, i) > 1.01 * kt_periods_between(outcome, found)))
            found = i;
    return found;
}

size_t kt_find_aliased(const kt_outcome *outcome) {
    const size_t none = outcome->extremes.count;
    if (outcome->columns == NULL || outcome->so_far.records < 2 || kt_is_held(outcome))
        return none;
    const size_t found = find_aliased_among(outcome, true);
    return found < none ? found : find_aliased_among(outcome, false);
}

void kt_warn_of_aliasing(kt_outcome *outcome) {
    const size_t i = kt_find_aliased(outcome);
    if (i >= outcome->extremes.count || outcome->scene->run.interval > 0.0)
        return;
    const double interval = kt_simulation_time(outcome->simulation) / (double)(outcome->so_far.records - 1);
    const double periods = kt_periods_between(outcome, i);
    char name[200], remedy[120];
    (void)kt_column_name(outcome->columns, i, name, sizeof name);
    (void)snprintf(remedy, sizeof remedy, "Take records every %.1g s (--interval), or a shorter --duration",
                   interval / fmax(10.0 * periods, 2.0));
    const kt_warning warning = kt_warning_of("aliased_records", periods, NULL, remedy);
    kt_warn(&outcome->warnings, &warning,
            "records every %.3g s do not show the motion: '%s' goes through its range and back %.2g times between two "
            "records, and a picture of them shows a false, slow motion. Extremes in the summary include all steps",
            interval, name, periods);
}
