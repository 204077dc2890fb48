/* What a run does with each of its records. */
#include "records/sinks.h"

#include "advice/advice.h"
#include "advice/excess.h"

#include <math.h>

static double larger_residual(double a, double b) { return a > b ? a : b; }

static void watch_record(kt_outcome *outcome, const kt_record *record) {
    kt_energy_watch_add(&outcome->energy, record);
    if (!isnan(record->constraint.position)) {
        outcome->constraint.position = larger_residual(outcome->constraint.position, record->constraint.position);
        outcome->constraint.velocity = larger_residual(outcome->constraint.velocity, record->constraint.velocity);
    }
    if (outcome->compressions.count > 0 && record->multipliers != NULL)
        kt_compressions_add(&outcome->compressions,
                            kt_integrated_model(kt_simulation_model(outcome->simulation), outcome->absolute),
                            record->time, record->multipliers);
    if (outcome->half_turns.count > 0)
        kt_half_turns_add(&outcome->half_turns, &outcome->warnings, outcome->scene, record);
    outcome->records++;
}

/* Returns whether the energy has been blown up for STEPS steps. In the first steps from rest the kinetic energy may
 * rise before the potential energy falls. Shorter blow-ups therefore do not count. */
static bool stays_blown_up(kt_outcome *outcome) {
    enum { STEPS = 4 };
    const uint64_t steps = kt_simulation_counts_get(outcome->simulation).steps;
    if (!kt_energy_watch_is_blown_up(&outcome->energy))
        outcome->sound_steps = steps;
    return steps >= outcome->sound_steps + STEPS;
}

/* Returns whether a record is a frame of a view. Frames are evenly spaced, except for the end of the run. */
static bool is_frame(const kt_record *record) { return record->event == NULL || record->event->stop; }

int kt_take_record(const kt_record *record, void *user) {
    kt_sinks *sinks = user;
    double start = kt_cpu_clock();
    if (kt_find_excess(record, &sinks->outcome->excess)) {
        sinks->failed = true;
        return -1;
    }
    const kt_contact_counts seen = kt_simulation_contacts(sinks->outcome->simulation);
    if (record->index == KT_INDEX_CONTACT) {
        kt_marks_add_contact(&sinks->outcome->marks, record, &seen);
        return 0;
    }
    kt_marks_sync_contacts(&sinks->outcome->marks, record, &seen);
    kt_marks_add(&sinks->outcome->marks, record);
    watch_record(sinks->outcome, record);
    kt_growth_add(&sinks->outcome->growth, record, sinks->outcome->run->duration);
    kt_watch_step(sinks->modes, sinks->outcome, record);
    kt_watch_stability(sinks->outcome, record);
    kt_watch_correction(sinks->outcome);
    const double *values = kt_columns_evaluate(sinks->columns, record);
    kt_extremes_add(&sinks->outcome->extremes, record->time, values);
    ++*sinks->kept;
    if (kt_csv_write(sinks->csv, values) != 0 || kt_keep_rows(sinks->keep, values, 1, sinks->columns->count) != 0 ||
        (sinks->plot != NULL && kt_plot_run_take(sinks->plot, record, values) != 0) ||
        (sinks->motion != NULL && is_frame(record) && kt_motion_take(sinks->motion, record, values) != 0)) {
        sinks->failed = true;
        return -1;
    }
    if (stays_blown_up(sinks->outcome)) {
        kt_progress_end(sinks->progress);
        kt_say_blown_up(sinks->outcome, record->time);
        sinks->failed = true;
        return -1;
    }
    kt_progress_update(sinks->progress, record->time, sinks->outcome->run->duration);
    sinks->aside += kt_cpu_clock() - start;
    sinks->pauses = kt_checkpoint_is_due(sinks->checkpoint);
    return sinks->pauses ? 1 : 0;
}
