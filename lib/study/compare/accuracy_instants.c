/* Instants of events in a study, and the windows about them.
 *
 * An event is one of the scene, or a change of a hard contact. Steps end at events, and a step of the run reports the
 * counts of all events (kt_simulation_event_count). A count that has grown during the step to t1 belongs to the
 * beginning t0 of that step: the event was found at the end of the step before, and acted before this step.
 *
 * Two solutions have the same events at slightly different instants. Between the two instants of an impact one solution
 * still has the velocity before the jump, and the difference of velocities has the size of the jump for any accuracy.
 * Hence errors are measured outside of windows about the instants of the reference, and the error of the instants is a
 * separate result. Instants with the same name are matched in their order. An instant without a partner is counted.
 *
 * The windows are a fixed part of the interval between records, so that few records are left out, and are equal for all
 * runs of a study. A run whose instants are off by more than a window shows the difference of the jump.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/accuracy.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double window_part = 0.1; /* of the interval between records */

/* ---- simulations with events ------------------------------------------------------------------------------------- */

static const kt_accuracy_events *events_of(const kt_accuracy *study) { return study->options.events; }

/* In the absolute formulation, the motion owns the simulation. */
static void release_play(kt_accuracy_play *play) {
    if (play->motion == NULL)
        kt_simulation_free(play->simulation);
    kt_absolute_motion_free(play->motion);
    if (play->watch != NULL)
        events_of(play->study)->release(play->watch);
    play->simulation = NULL;
    play->motion = NULL;
    play->watch = NULL;
}

kt_status kt_accuracy_open(kt_accuracy *study, const kt_model *model, const kt_absolute *absolute, const kt_run *run,
                           const kt_simulation_options *options, kt_accuracy_play *play, kt_error *error) {
    const kt_accuracy_events *events = events_of(study);
    kt_simulation_options own = *options;
    own.events = events != NULL ? events->count : 0;
    *play = (kt_accuracy_play){.study = study};
    kt_status status = absolute != NULL ? kt_absolute_motion_create(absolute, run, &own, &play->motion, error)
                                        : kt_simulation_create(model, run, &own, &play->simulation, error);
    if (play->motion != NULL)
        play->simulation = kt_absolute_motion_simulation(play->motion);
    if (status == KT_OK && events != NULL)
        status = events->add(play->simulation, model, &play->watch, events->user, error);
    if (status != KT_OK) {
        release_play(play);
        return status;
    }
    if (!study->has_begin) {
        memcpy(study->begin, kt_simulation_positions(play->simulation), study->nq * sizeof(double));
        memcpy(study->begin + study->nq, kt_simulation_velocities(play->simulation), study->nv * sizeof(double));
        study->has_begin = true;
    }
    return KT_OK;
}

kt_status kt_accuracy_play_run(kt_accuracy_play *play, kt_recorder *record, void *user, kt_error *error) {
    return play->motion != NULL ? kt_absolute_motion_run(play->motion, record, user, error)
                                : kt_simulation_run(play->simulation, record, user, error);
}

kt_status kt_accuracy_restart(kt_accuracy_play *play, const double *q, const double *v, kt_error *error) {
    const kt_accuracy_events *events = events_of(play->study);
    const kt_status status = play->motion != NULL ? kt_absolute_motion_set_state(play->motion, 0.0, q, v, error)
                                                  : kt_simulation_set_state(play->simulation, 0.0, q, v, error);
    if (status != KT_OK || events == NULL || events->restart == NULL)
        return status;
    return events->restart(play->watch, play->simulation, error);
}

kt_status kt_accuracy_close(kt_accuracy_play *play, kt_error *error) {
    const kt_accuracy *study = play->study;
    kt_status status = KT_OK;
    if (study->options.events != NULL && study->options.events->restart != NULL)
        status = kt_accuracy_restart(play, study->begin, study->begin + study->nq, error);
    release_play(play);
    return status;
}

/* ---- the instants of a run --------------------------------------------------------------------------------------- */

/* The number of changes of hard contacts. */
static uint64_t count_contact_changes(const kt_simulation *simulation) {
    const kt_contact_counts counts = kt_simulation_contacts(simulation);
    return counts.impacts + counts.closings + counts.openings + counts.sticks + counts.slips;
}

/* The number of events of a simulation, and the number of events of hard contacts, which come first. */
static int count_events(const kt_instant_log *log, const kt_simulation *simulation, int *of_contacts) {
    const kt_accuracy_events *events = events_of(log->study);
    int count = 0;
    while (count < KT_ACCURACY_EVENTS_MAX && kt_simulation_event_name(simulation, (size_t)count) != NULL)
        count++;
    *of_contacts = count - (events != NULL ? events->count : 0);
    return count;
}

void kt_instants_start(kt_instant_log *log, const kt_simulation *simulation) {
    log->count = 0;
    log->is_full = false;
    log->time = kt_simulation_time(simulation);
    log->contact_changes = count_contact_changes(simulation);
    log->event_count = count_events(log, simulation, &log->contact_events);
    for (int k = 0; k < log->event_count; k++)
        log->seen[k] = kt_simulation_event_count(simulation, kt_simulation_event_name(simulation, (size_t)k));
}

/* Adds an instant at log->time, the beginning of the step that reported the event. A full log stays as it is and ends
 * the run (watch_length). */
static void add_instant(kt_instant_log *log, const char *name) {
    log->is_full = log->is_full || log->count == KT_ACCURACY_INSTANTS_MAX;
    if (log->is_full)
        return;
    kt_accuracy_instant *instant = &log->instants[log->count++];
    instant->time = log->time;
    (void)snprintf(instant->name, sizeof instant->name, "%s", name);
}

/* A contact may arrive or part within rounding while others carry the body, which changes nothing. */
void kt_instants_watch(kt_instant_log *log, const kt_simulation *simulation) {
    const uint64_t changes = count_contact_changes(simulation);
    for (int k = 0; k < log->event_count; k++) {
        const char *name = kt_simulation_event_name(simulation, (size_t)k);
        const uint64_t count = kt_simulation_event_count(simulation, name);
        if (count > log->seen[k] && (k >= log->contact_events || changes != log->contact_changes))
            add_instant(log, name);
        log->seen[k] = count;
    }
    log->contact_changes = changes;
    log->time = kt_simulation_time(simulation);
}

/* ---- windows ----------------------------------------------------------------------------------------------------- */

static bool is_near_instant(const kt_instant_log *log, double t, double window) {
    for (int i = 0; i < log->count; i++)
        if (fabs(log->instants[i].time - t) <= window)
            return true;
    return false;
}

void kt_accuracy_mask(kt_accuracy *study, const kt_instant_log *log) {
    kt_accuracy_results *results = &study->results;
    results->window = log->count > 0 ? window_part * results->interval : 0.0;
    results->left_out = 0;
    for (int k = 0; k <= results->records; k++) {
        study->is_masked[k] = log->count > 0 && is_near_instant(log, k * results->interval, results->window);
        results->left_out += study->is_masked[k];
    }
}

/* ---- errors of instants ------------------------------------------------------------------------------------------ */

/* Returns the next instant of this name from `i` on; the count: there is none. */
static int next_of_name(const kt_instant_log *log, const char *name, int i) {
    while (i < log->count && strcmp(log->instants[i].name, name) != 0)
        i++;
    return i;
}

static bool is_first_of_name(const kt_instant_log *log, int i) {
    return next_of_name(log, log->instants[i].name, 0) == i;
}

/* The number of instants of a name from `i` on, up to the time `end`. */
static int count_rest(const kt_instant_log *log, const char *name, int i, double end) {
    int count = 0;
    for (i = next_of_name(log, name, i); i < log->count; i = next_of_name(log, name, i + 1))
        count += log->instants[i].time < end;
    return count;
}

/* Matches the instants with one name. */
static void match_name(const kt_instant_log *a, const kt_instant_log *b, const char *name, double end,
                       kt_accuracy_error *error) {
    int i = next_of_name(a, name, 0), k = next_of_name(b, name, 0);
    while (i < a->count && k < b->count) {
        if (fmin(a->instants[i].time, b->instants[k].time) <= end)
            error->instant = fmax(error->instant, fabs(a->instants[i].time - b->instants[k].time));
        i = next_of_name(a, name, i + 1);
        k = next_of_name(b, name, k + 1);
    }
    error->missed += count_rest(a, name, i, end) + count_rest(b, name, k, end);
}

void kt_instants_compare(const kt_accuracy *study, const kt_instant_log *reference, const kt_instant_log *run,
                         kt_accuracy_error *error) {
    const kt_accuracy_results *results = &study->results;
    /* An instant at the very end may lie behind it in the other solution, unless it ends both. */
    const double end = results->cut == KT_ACCURACY_STOPPED ? HUGE_VAL : results->duration - results->window;
    error->instant = 0.0;
    error->missed = 0;
    for (int i = 0; i < reference->count; i++)
        if (is_first_of_name(reference, i))
            match_name(reference, run, reference->instants[i].name, end, error);
    for (int i = 0; i < run->count; i++) /* names that the reference does not have */
        error->missed +=
            run->instants[i].time < end && next_of_name(reference, run->instants[i].name, 0) == reference->count;
}
