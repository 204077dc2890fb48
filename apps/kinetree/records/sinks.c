/* What a run does with each of its records. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/sinks.h"

#include "advice/excess.h"

#include <math.h>

static double larger_residual(double a, double b) { return a > b ? a : b; }

static void watch_record(kt_outcome *outcome, const kt_record *record) {
    if (!isnan(record->constraint.position)) {
        outcome->so_far.constraint.position =
            larger_residual(outcome->so_far.constraint.position, record->constraint.position);
        outcome->so_far.constraint.velocity =
            larger_residual(outcome->so_far.constraint.velocity, record->constraint.velocity);
    }
    if (outcome->so_far.compressions.count > 0 && record->multipliers != NULL)
        kt_compressions_add(&outcome->so_far.compressions, kt_simulation_model(outcome->simulation), record->t,
                            record->multipliers);
    if (outcome->so_far.half_turns.count > 0)
        kt_half_turns_add(&outcome->so_far.half_turns, &outcome->warnings, outcome->scene, record);
    outcome->so_far.records++;
}

/* Returns whether the energy has been blown up for STEPS steps. In the first steps from rest the kinetic energy may
 * rise before the potential energy falls. Shorter blow-ups therefore do not count. */
static bool stays_blown_up(kt_outcome *outcome) {
    enum { STEPS = 4 };
    const uint64_t steps = kt_simulation_counts_of(outcome->simulation).steps;
    if (!kt_energy_watch_is_blown_up(&outcome->so_far.energy))
        outcome->so_far.sound_steps = steps;
    return steps >= outcome->so_far.sound_steps + STEPS;
}

/* Returns whether a record is a frame of a view. Frames are evenly spaced, except for the end of the run. */
static bool is_frame(const kt_record *record) { return record->event == NULL || record->event->stop; }

int kt_take_record(const kt_record *record, void *user) {
    kt_sinks *sinks = user;
    double start = kt_cpu_clock();
    if (kt_find_excess(record, &sinks->outcome->excess) ||
        kt_find_lost_impulses(sinks->outcome->simulation, record->t, &sinks->outcome->excess)) {
        sinks->failed = true;
        return -1;
    }
    const kt_contact_counts seen = kt_simulation_contacts(sinks->outcome->simulation);
    if (record->index == KT_INDEX_CONTACT) {
        kt_marks_add_contact(&sinks->outcome->marks, record, &seen);
        kt_steps_take_jump(&sinks->outcome->steps, record);
        return 0;
    }
    kt_marks_sync_contacts(&sinks->outcome->marks, record, &seen);
    kt_marks_add(&sinks->outcome->marks, record);
    watch_record(sinks->outcome, record);
    kt_watch_event_jump(sinks->outcome, record);
    kt_watch_shares(sinks->outcome, record);
    if (sinks->outcome->check != NULL)
        kt_error_check_take(sinks->outcome->check, sinks->outcome->model, record);
    kt_watch_motion(sinks->outcome, sinks->modes, record);
    kt_results *results = sinks->results;
    const double *values = kt_columns_evaluate(&results->columns, record);
    kt_extremes_add(&sinks->outcome->extremes, record->t, values);
    kt_watch_turns(sinks->outcome, record);
    results->kept++;
    if (kt_csv_write(&results->csv, values) != 0 ||
        kt_keep_rows(&results->keep, values, 1, results->columns.count) != 0 ||
        (results->plot != NULL && kt_plot_run_take(results->plot, record, values) != 0) ||
        (results->motion != NULL && is_frame(record) && kt_motion_take(results->motion, record, values) != 0)) {
        sinks->failed = true;
        return -1;
    }
    if (stays_blown_up(sinks->outcome)) {
        kt_progress_end(sinks->progress);
        kt_say_blown_up(sinks->outcome, record->t);
        sinks->failed = true;
        return -1;
    }
    kt_progress_update(sinks->progress, record->t, sinks->outcome->run->duration);
    sinks->aside += kt_cpu_clock() - start;
    sinks->pauses = kt_checkpoint_is_due(sinks->checkpoint);
    return sinks->pauses ? 1 : 0;
}
