/* One run of a study: its error, its counts, its time.
 *
 * The error comes from a run with records at the reference's times. The error is therefore the error of the results
 * that a user receives, dense output included. Counts and time come from repeated runs without records, from the same
 * start to the same end. Other work on the machine only adds time: the least time is closest to the cost of the run
 * itself. The distance of the median from the least time shows how much the machine was disturbed.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/accuracy.h"

#include "integrator/integrator.h"

#include <math.h>

enum { SAMPLES_LEAST = 3, SAMPLES_MOST = 15 };
static const double sample_least = 2e-4; /* s: shorter runs are repeated within a sample, because of the clock's
                                            resolution */

kt_status kt_accuracy_report(kt_accuracy *study, double done, const char *what, kt_error *error) {
    const kt_accuracy_options *options = &study->options;
    if (options->progress == NULL || options->progress(done, what, options->user) == 0)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_CALLBACK, "accuracy", "the study was stopped before %s", what);
}

static bool is_time_stepping(const kt_method *method) { return method == &kt_method_moreau_jean; }

kt_run kt_accuracy_run(const kt_accuracy *study, const kt_method *method, bool adaptive, double setting) {
    kt_run run = study->run;
    /* An event that ends the reference may come later in a run. */
    run.duration = study->results.cut == KT_ACCURACY_STOPPED ? study->results.asked : study->results.duration;
    run.interval = study->results.interval;
    run.integrator = is_time_stepping(method) ? NULL : method->name; /* time stepping is its own (kt_accuracy_try) */
    run.step = adaptive ? 0.0 : setting;
    run.relative = adaptive ? setting : 1.0; /* fixed steps do not use it */
    run.absolute = run.relative * study->results.absolute_scale;
    run.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY;
    run.markers = NULL;
    run.marker_count = 0;
    return run;
}

double kt_accuracy_most(const kt_accuracy *study) {
    double most = (double)study->options.run_evaluations;
    if (study->options.clock != NULL && study->evaluation > 0.0) {
        /* The last run of a ladder takes about half of the ladder's time. The last run is run once for its error and a
         * few times for its cost. */
        const double seconds = study->options.budget / (8.0 * study->results.curve_count);
        most = fmin(most, seconds / study->evaluation);
    }
    return most;
}

/* ---- guards ------------------------------------------------------------------------------------------------------ */

kt_accuracy_guard kt_accuracy_guard_make(kt_accuracy *study, double part, double runs) {
    kt_accuracy_guard guard = {.study = study};
    guard.until = kt_accuracy_now(study) + part * study->options.budget;
    guard.most = (uint64_t)(runs * (double)study->options.run_evaluations);
    return guard;
}

/* Reading a clock is slow, so that the clock is read only after every sixteen evaluations. */
static int watch_length(const kt_simulation *simulation, void *user) {
    kt_accuracy_guard *guard = user;
    if (guard->log != NULL)
        kt_instants_watch(guard->log, simulation);
    const uint64_t evaluations = kt_simulation_counts_of(simulation).evaluations;
    const bool is_due = guard->study->options.clock != NULL && evaluations >= guard->seen + 16;
    if (is_due)
        guard->seen = evaluations;
    guard->late = evaluations >= guard->most || (is_due && kt_accuracy_now(guard->study) > guard->until);
    return guard->late || (guard->log != NULL && guard->log->is_full);
}

void kt_accuracy_guard_use(kt_accuracy_guard *guard, kt_simulation_options *options) {
    options->progress = watch_length;
    options->progress_steps = 1;
    options->progress_user = guard;
}

/* ---- the error --------------------------------------------------------------------------------------------------- */

typedef struct kt_watcher {
    kt_accuracy *study;
    kt_accuracy_error *error;
    int64_t rows; /* records so far */
} kt_watcher;

/* Compares a record with the reference at the same time: positions and velocities, energy and the chosen quantity. */
static int watch_errors(const kt_record *record, void *user) {
    kt_watcher *watcher = user;
    const kt_accuracy *study = watcher->study;
    kt_accuracy_error *error = watcher->error;
    if (record->index < 0 || record->index > study->results.records)
        return 0; /* of an event, or after the end of the reference */
    watcher->rows = record->index + 1;
    if (study->is_masked[record->index])
        return 0;
    const double energy = record->kinetic + record->potential;
    const kt_accuracy_state reference = kt_accuracy_row(study, &study->reference, record->index);
    kt_accuracy_add(error, kt_accuracy_distance(study, reference, (kt_accuracy_state){record->q, record->v}),
                    record->constraint);
    error->energy = kt_worse(error->energy, fabs(energy - study->reference.energy[record->index]));
    error->quantity = kt_worse(error->quantity,
                               fabs(kt_accuracy_quantity_of(study, record) - study->reference.quantity[record->index]));
    return 0;
}

/* ---- the time ---------------------------------------------------------------------------------------------------- */

/* Runs that are timed with records make the records, but nothing uses them. */
static int pass_over_record(const kt_record *record, void *user) {
    (void)record;
    (void)user;
    return 0;
}

/* A run without records also ends where the reference does. */
static kt_status run_once(kt_accuracy *study, kt_accuracy_play *play, bool records) {
    const kt_accuracy_results *results = &study->results;
    const double end = results->cut == KT_ACCURACY_STOPPED ? results->asked : results->duration;
    kt_status status = kt_accuracy_restart(play, study->begin, study->begin + study->nq, NULL);
    if (status == KT_OK)
        status = records ? kt_accuracy_play_run(play, pass_over_record, NULL, NULL)
                         : kt_simulation_advance(play->simulation, end, NULL);
    return status;
}

/* Inserts a sample in increasing order. */
static void insert_time(double *samples, int count, double sample) {
    for (; count > 0 && samples[count - 1] > sample; count--)
        samples[count] = samples[count - 1];
    samples[count] = sample;
}

/* Times repeated runs: the least time, their number, and how far the median exceeds the least. */
static kt_status measure_time(kt_accuracy *study, kt_accuracy_play *play, const kt_variant *variant,
                              kt_accuracy_point *point) {
    double samples[SAMPLES_MOST], start = kt_accuracy_now(study);
    /* Many samples may use 1/60 of a ladder's share of the time; the first three may use up to 1/15. */
    const double share = study->options.budget / study->results.curve_count;
    kt_status status = run_once(study, play, variant->records);
    double last = kt_accuracy_now(study), used = last - start;
    point->counts = kt_simulation_counts_of(play->simulation);
    if (status != KT_OK || study->options.clock == NULL)
        return status;
    const int inner = used < sample_least ? (int)fmin(1000.0, ceil(sample_least / fmax(used, 1e-7))) : 1;
    int count = 0;
    if (inner == 1) /* the first run counts as a sample */
        insert_time(samples, count++, used);
    while (count < SAMPLES_MOST && last - start < (count < SAMPLES_LEAST ? share / 15.0 : share / 60.0)) {
        for (int i = 0; i < inner && status == KT_OK; i++)
            status = run_once(study, play, variant->records);
        const double now = kt_accuracy_now(study);
        insert_time(samples, count++, (now - last) / inner);
        last = now;
    }
    if (count == 0)
        insert_time(samples, count++, used);
    point->cpu = samples[0];
    point->repeats = count * inner;
    point->spread = samples[0] > 0.0 ? samples[count / 2] / samples[0] - 1.0 : 0.0;
    return status;
}

/* ---- both -------------------------------------------------------------------------------------------------------- */

void kt_accuracy_judge(const kt_accuracy *study, kt_accuracy_point *point) {
    const kt_accuracy_results *results = &study->results;
    const double most = KT_ACCURACY_USABLE * kt_accuracy_amplitude(study);
    kt_accuracy_select(study, &point->error);
    if (point->status != KT_OK || isnan(point->error.judged))
        point->error.position = point->error.velocity = point->error.quantity = point->error.judged = HUGE_VAL;
    point->usable = point->error.judged <= most;
    point->believed = point->error.judged > results->uncertainty.judged;
}

/* The timed run. The timed run records nothing, unless the variant times the records that the scene requests. */
static kt_status time_it(kt_accuracy *study, const kt_model *model, const kt_absolute *absolute,
                         const kt_variant *variant, kt_run run, kt_simulation_options options, kt_accuracy_point *point,
                         kt_error *error) {
    kt_accuracy_play play;
    options.record = 0U;
    if (variant->records) {
        run.interval = study->run.interval;
        run.record = study->run.record;
        run.markers = study->run.markers;
        run.marker_count = study->run.marker_count;
    }
    kt_status status = kt_accuracy_open(study, model, absolute, &run, &options, &play, error);
    if (status != KT_OK)
        return status;
    if (measure_time(study, &play, variant, point) != KT_OK) { /* cannot fail: the same run has succeeded */
        point->usable = false;
        point->status = KT_ERROR_STEP;
    }
    return kt_accuracy_close(&play, error);
}

/* A run that an event ends before the reference has no error at the records that follow. */
static void reject_early_end(const kt_watcher *watcher, kt_accuracy_point *point) {
    const kt_accuracy *study = watcher->study;
    for (int64_t k = watcher->rows; k <= study->results.records && point->status == KT_OK; k++)
        if (!study->is_masked[k])
            point->error.position = point->error.velocity = point->error.quantity = HUGE_VAL;
}

/* Runs with records at the reference's times for the error; if the error is usable, times further runs. */
static kt_status try_with(kt_accuracy *study, const kt_model *model, const kt_absolute *absolute,
                          const kt_variant *variant, const kt_run *run, const kt_simulation_options *options,
                          kt_accuracy_point *point, kt_error *error) {
    kt_simulation_options recorded = *options;
    kt_accuracy_play play;
    kt_watcher watcher = {study, &point->error, 0};
    kt_accuracy_guard guard = kt_accuracy_guard_make(study, 1.0 / study->results.curve_count, 1.0);
    recorded.record = KT_RECORD_ENERGY | KT_RECORD_CONSTRAINT;
    kt_accuracy_record_quantity(study, &recorded);
    guard.most = (uint64_t)fmin(4.0 * kt_accuracy_most(study), (double)guard.most) + 1;
    guard.log = &study->run_log;
    kt_accuracy_guard_use(&guard, &recorded);
    kt_status status = kt_accuracy_open(study, model, absolute, run, &recorded, &play, error);
    if (status != KT_OK)
        return status;
    kt_instants_start(guard.log, play.simulation);
    point->status = kt_accuracy_play_run(&play, watch_errors, &watcher, NULL);
    kt_instants_watch(guard.log, play.simulation);
    point->counts = kt_simulation_counts_of(play.simulation);
    point->late = guard.late;
    kt_instants_compare(study, &study->log, guard.log, &point->error);
    reject_early_end(&watcher, point);
    kt_accuracy_judge(study, point);
    status = kt_accuracy_close(&play, error);
    return status == KT_OK && point->usable ? time_it(study, model, absolute, variant, *run, *options, point, error)
                                            : status;
}

/* The options of a constraint formulation for this setting. The steps of an adaptive method are assumed to be twice as
 * long as the steps of the reference. */
static kt_constraint_formulation_options choose_set(const kt_accuracy *study, const kt_variant *variant, bool adaptive,
                                                    double setting) {
    const double mean = study->reference_steps > 0.0 ? 1.0 / study->reference_steps : study->results.interval;
    kt_constraint_formulation_options options =
        kt_constraint_formulation_options_default(variant->constraint_formulation, adaptive ? 2.0 * mean : setting);
    if (variant->gain > 0.0) {
        options.alpha *= variant->gain;
        options.beta *= variant->gain;
    }
    return options;
}

kt_status kt_accuracy_compile(const kt_accuracy *study, const kt_variant *variant, kt_model **model,
                              kt_absolute **absolute, kt_error *error) {
    kt_status status = kt_model_compile(study->description, &variant->model, model, error);
    if (status != KT_OK || variant->formulation != KT_FORMULATION_ABSOLUTE)
        return status;
    status = kt_absolute_create(study->description, &variant->model, *model, absolute, error);
    if (status != KT_OK) {
        kt_model_free(*model);
        *model = NULL;
    }
    return status;
}

kt_status kt_accuracy_try(kt_accuracy *study, const kt_model *model, const kt_absolute *absolute,
                          const kt_variant *variant, const kt_method *method, bool adaptive, kt_accuracy_point *point,
                          kt_error *error) {
    const double setting = point->setting;
    const kt_run run = kt_accuracy_run(study, method, adaptive, setting);
    kt_simulation_options options = variant->simulation;
    kt_status status = KT_OK;
    kt_constraint_formulation *formulation = NULL;
    *point = (kt_accuracy_point){.setting = setting, .cpu = (double)NAN};
    options.method = is_time_stepping(method) ? NULL : method;
    options.contact = is_time_stepping(method) ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
    if (variant->has_constraint_formulation) {
        const kt_constraint_formulation_options settings = choose_set(study, variant, adaptive, setting);
        const kt_model *integrated = absolute != NULL ? kt_absolute_model(absolute) : model;
        status = kt_constraint_formulation_create(integrated, &settings, &formulation, error);
        if (status == KT_ERROR_SINGULAR) { /* the formulation cannot compute this scene */
            point->status = point->verdict = status;
            kt_accuracy_judge(study, point);
            return KT_OK;
        }
        if (status == KT_OK)
            kt_constraint_formulation_use(formulation, &options);
    }
    if (status == KT_OK)
        status = try_with(study, model, absolute, variant, &run, &options, point, error);
    if (status == KT_OK && formulation != NULL)
        point->verdict = kt_constraint_formulation_verdict(formulation, NULL);
    kt_constraint_formulation_free(formulation);
    return status;
}
