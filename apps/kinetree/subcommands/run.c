/* kinetree run: simulates a scene and writes its records. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/checkpoint.h"
#include "records/interrupt.h"
#include "records/sinks.h"

#include "advice/advice.h"
#include "native/native.h"
#include "open/play.h"
#include "plot/run.h"
#include "text/json.h"
#include "view/view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- recording --------------------------------------------------------------------------------------------------- */

/* Keeps the reason for the early end of a run, and for the view the last state. The error is NULL if the reason has
 * been printed or is among the warnings. */
static void note_run_failure(kt_outcome *outcome, kt_motion *motion, const kt_error *error) {
    const kt_simulation *simulation = outcome->simulation;
    const double time = kt_simulation_time(simulation);
    if (error != NULL)
        outcome->failed = *error;
    else
        (void)kt_error_set(&outcome->failed, KT_ERROR_STEP, NULL, "the run has ended at t = %.9g s, before its end",
                           time);
    if (motion != NULL)
        (void)kt_motion_take_state(motion, time, kt_outcome_positions(outcome), kt_outcome_velocities(outcome));
}

static void advise_resume(const char *checkpoint) {
    kt_interrupt_advise("To go on, repeat the command with --resume %s", kt_show(checkpoint).text);
}

/* Prepares the message of Ctrl-C, which a checkpoint changes. */
static void start_interrupt(const kt_run_arguments *arguments, const kt_results *results,
                            const kt_checkpoint *checkpoint) {
    if (results->keep.file != NULL) {
        kt_interrupt_start(results->keep.output.partial, NULL, checkpoint->new_path);
        kt_interrupt_advise("It is no HDF5 file, and cannot be continued. With --out FILE.csv --checkpoint FILE a run "
                            "can be continued by --resume FILE");
        return;
    }
    kt_interrupt_start(results->csv.output.partial, "record", checkpoint->new_path);
    if (arguments->resume != NULL)
        advise_resume(arguments->resume);
    else if (arguments->checkpoint != NULL)
        kt_interrupt_advise("The run cannot be continued, since there was no checkpoint yet. The first one is written "
                            "after %g s (--checkpoint-interval)",
                            arguments->checkpoint_interval);
    else
        kt_interrupt_advise("The run cannot be continued, since it wrote no checkpoint. --checkpoint FILE writes "
                            "checkpoints, and --resume FILE continues from them");
}

/* Runs to the end or to the first failure, which is printed. */
static int simulate_run(kt_outcome *outcome, kt_results *results, kt_checkpoint *checkpoint, kt_mode_watch *modes,
                        bool quiet) {
    kt_error error = {0};
    kt_progress progress = kt_progress_start(quiet);
    outcome->pace.progress = &progress;
    (void)kt_path_watch_add(&outcome->paths, kt_simulation_time(outcome->simulation), kt_outcome_positions(outcome),
                            kt_outcome_velocities(outcome));
    kt_sinks sinks = {
        .results = results, .progress = &progress, .outcome = outcome, .checkpoint = checkpoint, .modes = modes};
    double before = outcome->so_far.cpu_seconds, start = kt_cpu_clock();
    kt_status status;
    for (;;) {
        status = kt_simulated_run(kt_outcome_simulated(outcome), kt_take_record, &sinks, &error);
        outcome->so_far.cpu_seconds = before + kt_cpu_clock() - start - sinks.aside;
        if (!sinks.pauses)
            break;
        sinks.pauses = false;
        const bool is_flushed = kt_lines_flush(&results->csv.lines) == 0;
        const int written = is_flushed ? kt_checkpoint_write(checkpoint, outcome, &results->csv.lines) : -1;
        sinks.failed = written < 0;
        if (sinks.failed)
            break;
        if (written == 0)
            advise_resume(checkpoint->path);
    }
    kt_progress_end(&progress);
    if (status == KT_OK && kt_energy_watch_is_blown_up(&outcome->so_far.energy)) {
        kt_say_blown_up(outcome, kt_simulation_time(outcome->simulation));
        note_run_failure(outcome, results->motion, NULL);
        return KT_EXIT_INTEGRATION;
    }
    if (status == KT_OK)
        return KT_EXIT_DONE;
    if (outcome->excess.code != KT_OK)
        kt_say_excess(outcome);
    else if (!sinks.failed)
        kt_say_error(&error);
    note_run_failure(outcome, results->motion, sinks.failed ? NULL : &error);
    return sinks.failed ? KT_EXIT_INTEGRATION : kt_exit_code(status);
}

/* ---- parts of the command ---------------------------------------------------------------------------------------- */

static int write_view(const kt_run_arguments *arguments, const kt_outcome *outcome, const kt_motion *motion,
                      const char *path) {
    const kt_method_words method = kt_describe_method(outcome->run);
    char *notes = kt_json_print(kt_warnings_describe(&outcome->warnings), JSON_COMPACT | JSON_REAL_PRECISION(9));
    if (notes == NULL)
        return KT_EXIT_INTEGRATION;
    const kt_view view = {.name = outcome->name,
                          .marks = &outcome->marks,
                          .method = method.text,
                          .run = outcome->run,
                          .notes = notes,
                          .live = arguments->engine,
                          .failed = outcome->failed.code != KT_OK ? &outcome->failed : NULL};
    const int code = kt_view_write(motion, &view, path);
    free(notes);
    return code;
}

static int write_plot(const kt_run_arguments *arguments, const kt_outcome *outcome, const kt_plot_run *plot,
                      const char *path) {
    kt_plot_size size;
    const int code = kt_plot_size_read(arguments->command, arguments->size, &size);
    return code < 0 ? kt_plot_run_write(plot, outcome, path, size, arguments->dark, arguments->quiet) : code;
}

/* Writes a result other than records. Returns an exit code after printing the error. */
static int write_run_result(const kt_run_arguments *arguments, const kt_outcome *outcome, const kt_results *results,
                            kt_result result, const char *path) {
    switch (result) {
    case KT_RESULT_PLOT:
        return write_plot(arguments, outcome, results->plot, path);
    case KT_RESULT_VIEW:
        return write_view(arguments, outcome, results->motion, path);
    case KT_RESULT_GLB:
        return kt_glb_write(results->motion, outcome->name, path);
    default:
        return kt_summary_write(outcome, path);
    }
}

static int finish_run(const kt_run_arguments *arguments, const kt_outcome *outcome, const kt_result_names *names,
                      const kt_results *results) {
    static const kt_result order[] = {KT_RESULT_PLOT, KT_RESULT_VIEW, KT_RESULT_GLB, KT_RESULT_SUMMARY};
    kt_result_names written = *names;
    int code = KT_EXIT_DONE;
    for (size_t i = 0; i < sizeof order / sizeof order[0]; i++) {
        const char *path = names->all[order[i]];
        const int failed = path != NULL ? write_run_result(arguments, outcome, results, order[i], path) : KT_EXIT_DONE;
        written.all[order[i]] = failed == KT_EXIT_DONE ? path : NULL;
        code = code == KT_EXIT_DONE ? failed : code;
    }
    if (!arguments->quiet)
        kt_report_outcome(outcome, &written);
    return code;
}

static void say_partial_result(const char *part, const char *out) {
    if (strcmp(part, out) == 0)
        kt_say("the run stopped early; its records are in %s", out);
    else
        kt_say("the run stopped early; its records are in %s. %s of an earlier run is unchanged", part, out);
}

/* Writes the last lines of CSV, and takes lines that could not be written off the number of records. The header may be
 * among them. Returns the exit code of the command. */
static int flush_records(kt_outcome *outcome, kt_csv *csv, int code) {
    const bool failed = kt_lines_flush(&csv->lines) != 0;
    outcome->so_far.records = csv->lines.lost < outcome->so_far.records ? outcome->so_far.records - csv->lines.lost : 0;
    return failed && code == KT_EXIT_DONE ? KT_EXIT_INTEGRATION : code;
}

/* Ends the file of records, under the name in `parts` if the run has failed, and writes the other results. Returns the
 * exit code of the command. */
static int end_results(const kt_run_arguments *arguments, kt_outcome *outcome, const kt_result_names *wholes,
                       const kt_result_names *parts, kt_results *results, int code) {
    const bool is_moved = results->csv.output.partial != NULL || results->keep.file != NULL;
    code = flush_records(outcome, &results->csv, code);
    const kt_output_fate fate = code == KT_EXIT_DONE                                        ? KT_OUTPUT_WHOLE
                                : outcome->so_far.records == 0 && arguments->resume == NULL ? KT_OUTPUT_NOTHING
                                                                                            : KT_OUTPUT_PART;
    for (int i = 0; i < KT_RESULTS && fate == KT_OUTPUT_WHOLE && arguments->resume == NULL; i++)
        kt_note_replaced(wholes->all[i], outcome->replaced, sizeof outcome->replaced);
    const bool lost = kt_run_keep_end(&results->keep, outcome, results->kept, code, fate) != 0;
    if ((kt_csv_close(&results->csv, fate) != 0 || lost) && code == KT_EXIT_DONE)
        code = KT_EXIT_INTEGRATION;
    const bool whole = code == KT_EXIT_DONE;
    kt_result_names names = whole ? *wholes : *parts;
    if (!lost && !whole && is_moved && fate != KT_OUTPUT_NOTHING)
        say_partial_result(parts->out, wholes->out);
    if (lost || fate == KT_OUTPUT_NOTHING)
        names.out = NULL;
    const int rest = finish_run(arguments, outcome, &names, results);
    return whole ? rest : code;
}

/* Ends all results, under the names of partial ones if the run has failed. The page of a failed run reports the
 * failure. It therefore replaces an earlier page, unless the run also writes records. */
static int close_results(const kt_run_arguments *arguments, kt_outcome *outcome, const kt_result_names *wholes,
                         kt_results *results, int code) {
    char *owned[KT_RESULTS];
    kt_result_names parts;
    bool fine = true;
    for (int i = 0; i < KT_RESULTS; i++) {
        const char *whole = wholes->all[i];
        const bool replaces = i == KT_RESULT_VIEW && whole != NULL && wholes->out == NULL;
        parts.all[i] = owned[i] = replaces ? strdup(whole) : kt_part_name(whole);
        fine = fine && (owned[i] != NULL || whole == NULL);
    }
    if (fine) {
        code = end_results(arguments, outcome, wholes, &parts, results, code);
    } else {
        kt_say("there is not enough memory");
        (void)kt_csv_close(&results->csv, KT_OUTPUT_AS_IS);
        (void)kt_keep_end(&results->keep, NULL, KT_OUTPUT_AS_IS);
        code = code == KT_EXIT_DONE ? KT_EXIT_INTEGRATION : code;
    }
    for (int i = 0; i < KT_RESULTS; i++)
        free(owned[i]);
    return code;
}

/* Resumes from a checkpoint. Also sets the numbers of the model again that events had set before the checkpoint. */
static int resume(const kt_run_arguments *arguments, kt_outcome *outcome, kt_checkpoint *checkpoint) {
    kt_error error;
    const int code = kt_checkpoint_resume(checkpoint, arguments->resume, outcome);
    if (code >= 0 || outcome->events == NULL ||
        kt_scene_watch_sync(outcome->events, outcome->simulation, &error) == KT_OK)
        return code;
    kt_say_error(&error);
    return KT_EXIT_INTEGRATION;
}

/* Opens the file of records: a new one, or the one to which a checkpoint belongs. */
static int open_records(const kt_run_arguments *arguments, kt_outcome *outcome, kt_checkpoint *checkpoint,
                        const char *out, kt_results *results) {
    if (kt_keep_is_meant(out)) {
        const int code = kt_run_keep_start(&results->keep, out);
        return code < 0 ? kt_csv_open(&results->csv, NULL, &results->columns) : code;
    }
    if (arguments->resume == NULL)
        return kt_csv_open(&results->csv, out, &results->columns);
    const int code = resume(arguments, outcome, checkpoint);
    return code >= 0 ? code : kt_csv_reopen(&results->csv, out, &results->columns, &checkpoint->records);
}

/* Lists the columns, and starts to collect the plot and the motion. Returns false if memory is insufficient. */
static bool start_results(kt_outcome *outcome, const kt_result_names *names, unsigned record, kt_results *results) {
    const bool has_reactions = (record & KT_RECORD_REACTION) != 0;
    kt_energy_watch *energy = (record & KT_RECORD_ENERGY) != 0 ? &outcome->so_far.energy : NULL;
    kt_error error;
    if (!kt_columns_list(&results->columns, outcome->scene, outcome->model, outcome->run,
                         kt_run_record(outcome->run, outcome->model)))
        return false;
    outcome->columns = &results->columns;
    if (kt_columns_add_own(&results->columns, outcome->scene, &record, &error) != KT_OK) /* names have been checked */
        return false;
    if (!kt_shares_begin(&outcome->shares, outcome->model) ||
        !kt_extremes_start(&outcome->extremes, results->columns.count))
        return false;
    outcome->steps = (kt_steps){.of = kt_outcome_simulated(outcome),
                                .columns = &results->columns,
                                .extremes = &outcome->extremes,
                                .energy = energy,
                                .moved = &outcome->so_far.moved};
    if (!kt_steps_start(&outcome->steps))
        return false;
    if (names->plot != NULL)
        results->plot = kt_plot_run_start(&results->columns, outcome->run);
    if (names->view != NULL || names->glb != NULL)
        results->motion = kt_motion_start(outcome->scene, &results->columns,
                                          kt_simulation_record_count(outcome->simulation), has_reactions);
    return (results->plot != NULL || names->plot == NULL) &&
           (results->motion != NULL || (names->view == NULL && names->glb == NULL));
}

/* Reports the quantities of --record that give no columns: multipliers without loops, for example. */
static void note_empty(const char *command, unsigned empty) {
    for (unsigned bit = 1; empty != 0; empty &= ~bit, bit *= 2)
        if ((empty & bit) != 0)
            kt_say("%s: --record: the scene has no %s to record", command, kt_record_name(bit));
}

/* Runs a simulation that has been created. names: the final names of all files. record: all quantities of the
 * records. */
static int run_simulation(const kt_run_arguments *arguments, kt_outcome *outcome, const kt_result_names *names,
                          unsigned record, kt_checkpoint *checkpoint, kt_mode_watch *modes) {
    kt_results results = {.keep.output.lock = -1};
    int code = -1;
    if (!start_results(outcome, names, record, &results))
        code = kt_say_no_memory("the results");
    if (results.motion != NULL) {
        results.motion->boxes = arguments->boxes;
        results.motion->simulation = outcome->simulation;
    }
    if (code < 0 && arguments->record != NULL && !arguments->quiet)
        note_empty(arguments->command, results.columns.empty);
    if (code < 0)
        code = open_records(arguments, outcome, checkpoint, names->out, &results);
    if (code < 0) {
        start_interrupt(arguments, &results, checkpoint);
        code = simulate_run(outcome, &results, checkpoint, modes, arguments->quiet);
        kt_interrupt_end();
        kt_warn_of_rest(outcome);
        kt_warn_of_aliasing(outcome);
        kt_warn_of_motion(outcome, modes);
        kt_warn_of_shares(outcome);
        kt_warn_of_held_events(outcome);
        kt_warn_of_gaps(outcome);
        kt_warn_of_frames(outcome, results.motion);
        if (outcome->check != NULL && code == KT_EXIT_DONE)
            kt_error_check_finish(outcome->check, outcome);
        code = close_results(arguments, outcome, names, &results, code);
        if (code == KT_EXIT_DONE && arguments->scene != NULL)
            code = kt_run_write_end(outcome, arguments->scene, arguments->quiet);
    }
    kt_motion_free(results.motion);
    kt_plot_run_free(results.plot);
    kt_steps_free(&outcome->steps);
    kt_extremes_free(&outcome->extremes);
    kt_shares_free(&outcome->shares);
    kt_columns_free(&results.columns);
    return code;
}

/* Rejects loops with the name of a joint if reactions are recorded, because joints and loops share the column names of
 * reactions. */
static int check_columns(const char *command, const kt_model *model, const kt_run *run) {
    for (int i = 0; i < kt_loop_count(model) && (kt_run_record(run, model) & KT_RECORD_REACTION) != 0; i++)
        if (kt_body_of_joint(model, kt_loop_name(model, i)) > 0)
            return kt_reject(KT_EXIT_SCENE,
                             "%s: loop '%s' has the name of a joint, and with 'reaction' recorded both would have the "
                             "same columns; rename one of them",
                             command, kt_loop_name(model, i));
    return -1;
}

/* Chooses the options of the simulation, with the quantities that records have besides the written ones. */
static kt_simulation_options choose_simulation_options(const kt_run_arguments *arguments, const kt_result_names *names,
                                                       const kt_outcome *outcome, const kt_run_manner *manner) {
    kt_simulation_options options = kt_simulation_options_default();
    options.unprojected = arguments->unprojected;
    /* Contacts are marked in pictures and listed in summaries. A resumed run may request these after the break. */
    options.record_contacts = names->view != NULL || names->plot != NULL || names->summary != NULL ||
                              arguments->checkpoint != NULL || arguments->resume != NULL;
    options.kinematics = names->view != NULL || names->glb != NULL || outcome->so_far.half_turns.count > 0;
    if (kt_loop_count(outcome->model) > 0)
        options.record = KT_RECORD_CONSTRAINT; /* the report states the largest residuals, recorded or not */
    if (outcome->so_far.compressions.count > 0)
        options.record |= KT_RECORD_MULTIPLIER; /* and whether distances push */
    /* A resumed run may also write a summary. Its values for the time before the break need a watch from the start. */
    if (names->summary != NULL || names->plot != NULL || arguments->checkpoint != NULL || arguments->resume != NULL)
        options.record |= KT_RECORD_ENERGY | KT_RECORD_CONSTRAINT;
    options.watch_works = kt_watches_works(outcome);
    if (outcome->so_far.energy.energetics != KT_ENERGY_SUPPLIED || options.watch_works)
        options.record |= KT_RECORD_ENERGY; /* which otherwise shows no errors by itself */
    if (names->view != NULL && !manner->has_records)
        options.record |= KT_RECORD_REACTION;
    return options;
}

uint64_t kt_bound_of_fixed_steps(const kt_outcome *outcome, kt_simulation_options options) {
    options.stall_evaluations = KT_STALL_EVALUATIONS;
    options.contact = outcome->scene->contact;
    const bool has_fixed_steps = outcome->run->step > 0.0 && options.contact == KT_CONTACT_EVENTS;
    const bool is_supported = outcome->absolute == NULL && kt_contact_count(outcome->model) > 0 &&
                              kt_simulation_size(outcome->model, outcome->run, &options) > 0;
    return has_fixed_steps && is_supported ? options.stall_evaluations : 0;
}

/* Creates the simulation, with the scene's events. Calls of a program are left out with a warning. */
static kt_status create_run_simulation(kt_outcome *outcome, kt_simulation_options *options, kt_error *error) {
    kt_simulated made;
    const kt_status status = kt_simulate_scene(outcome->scene, outcome->model, outcome->run, outcome->absolute, options,
                                               &made, &outcome->events, error);
    outcome->simulation = made.simulation;
    outcome->motion = made.motion;
    for (int i = 0; status == KT_OK && i < outcome->scene->event_count; i++) {
        const kt_scene_event *event = &outcome->scene->events[i];
        const kt_warning warning = kt_warning_of("call", (double)event->call_count, NULL,
                                                 "Run the scene from a program that has it (kt_scene_watch_create)");
        if (event->call_count > 0)
            kt_warn(&outcome->warnings, &warning, "event '%s' calls '%s', an action of a program, which is left out",
                    event->name, event->call[0]);
    }
    return status;
}

/* Creates and runs the simulation. names: the final names of all files. native: NULL for accelerations by the library.
 * Returns an exit code. */
static int run_with_names(const kt_run_arguments *arguments, kt_outcome *outcome, const kt_result_names *names,
                          const kt_run_manner *manner, kt_native_code *native) {
    kt_error error = {0};
    kt_compressions_begin(&outcome->so_far.compressions, outcome->scene,
                          kt_integrated_model(outcome->model, outcome->absolute));
    kt_half_turns_begin(&outcome->so_far.half_turns, outcome->model);
    kt_path_watch_begin(&outcome->paths, outcome->scene, outcome->model, &outcome->warnings);
    kt_simulation_options options = choose_simulation_options(arguments, names, outcome, manner);
    unsigned record = 0;
    kt_status status = kt_columns_own_record(outcome->scene, outcome->model, &record, &error);
    options.record |= record;
    kt_watch_pace(outcome, &options);
    if (status == KT_OK && native != NULL)
        status = kt_native_use(&native->native, outcome->model, &options, &error);
    options.stall_evaluations = kt_bound_of_fixed_steps(outcome, options);
    if (status == KT_OK)
        status = create_run_simulation(outcome, &options, &error);
    int code = status != KT_OK ? kt_exit_code(status) : -1;
    if (status != KT_OK)
        kt_say_error(&error);
    else
        kt_report_start(outcome, arguments->quiet);
    if (status == KT_ERROR_CONSTRAINT)
        kt_say_open_loops(outcome->scene, outcome->model);
    if (status == KT_ERROR_CONSTRAINT && names->view != NULL &&
        kt_view_write_start(outcome->scene, outcome->model, outcome->name, names->view) == KT_EXIT_DONE)
        kt_say("the view shows the positions that the scene gives, and those that assembly has reached: %s",
               names->view);
    kt_checkpoint checkpoint = {.lock = -1};
    kt_mode_watch *modes = code < 0 ? kt_watch_steps(outcome) : NULL;
    if (code < 0 && (arguments->checkpoint != NULL || arguments->resume != NULL))
        code = kt_checkpoint_open(&checkpoint, arguments->checkpoint, arguments->checkpoint_interval, outcome, &options,
                                  modes);
    if (code < 0)
        code = run_simulation(arguments, outcome, names, kt_run_record(outcome->run, outcome->model) | options.record,
                              &checkpoint, modes);
    kt_checkpoint_close(&checkpoint);
    kt_mode_watch_free(modes);
    kt_path_watch_free(&outcome->paths);
    if (native != NULL && outcome->simulation != NULL && !arguments->quiet)
        kt_native_report(native, outcome->simulation);
    kt_simulated made = kt_outcome_simulated(outcome);
    kt_simulated_free(&made);
    kt_scene_watch_free(outcome->events);
    kt_warnings_free(&outcome->warnings);
    kt_marks_free(&outcome->marks);
    json_decref(outcome->moved);
    return code;
}

/* Makes the code of --native. If the library is faster, there is no code. Returns -1, or an exit code after printing
 * the error. */
static int load_code(const kt_run_arguments *arguments, const kt_scene *scene, const kt_model *model,
                     kt_native_file *file, kt_native_code *code) {
    kt_error error = {0};
    if (kt_native_is_slow(model)) {
        if (!arguments->quiet)
            kt_say("--native: the library computes the accelerations, since it is faster for planar trees of more than "
                   "12 coordinates; leave --native out");
        return -1;
    }
    const int failed = kt_native_file_make(file, arguments->command, scene, model);
    if (failed >= 0)
        return failed;
    const kt_status status = kt_native_code_begin(code, file, model, &error);
    if (status != KT_OK)
        kt_say_error(&error);
    return status == KT_OK ? -1 : kt_exit_code(status);
}

/* Runs a compiled scene: applies the remaining options, names and checks the files, then runs. Returns an exit code. */
static int run_model(const kt_run_arguments *arguments, const char *path, const kt_scene *scene, const kt_model *model,
                     const kt_absolute *absolute, const char *base, const kt_run_manner *manner) {
    kt_run run = scene->run;
    kt_marker_pair *markers;
    kt_method storage;
    if (absolute != NULL && (arguments->checkpoint != NULL || arguments->resume != NULL))
        return kt_misuse("%s: --checkpoint and --resume need the formulation 'tree', since a checkpoint does not count "
                         "the turns of joints that are loops; leave 'formulation: absolute' out",
                         arguments->command);
    run.integrator = kt_scene_method_name(scene, kt_integrated_model(model, absolute), &storage);
    char option[32];
    snprintf(option, sizeof option, "%s: --markers", arguments->command);
    int code = kt_run_override_markers(option, arguments->markers, model, &run, &markers);
    if (code >= 0)
        return code;
    char *csv = kt_join_texts(base, ".csv", ""), *page = kt_join_texts(base, ".html", "");
    const bool has_own_name = manner->has_records && arguments->out != NULL; /* then no result has one by itself */
    const kt_result_names names = {.out = arguments->out != NULL || !manner->has_records ? arguments->out : csv,
                                   .summary = arguments->summary,
                                   .plot = arguments->plot,
                                   .glb = arguments->glb,
                                   .view = arguments->view != NULL ? arguments->view
                                           : manner->has_view && !has_own_name && arguments->resume == NULL ? page
                                                                                                            : NULL};
    code = csv == NULL || page == NULL ? kt_say_no_memory(NULL) : kt_run_check_files(arguments, path, &names);
    code = code < 0 && manner->is_careful && arguments->resume == NULL ? kt_run_spare_results(&names) : code;
    code = code < 0 ? check_columns(arguments->command, model, &run) : code;
    if (!manner->has_records && run.interval == 0.0)
        run.interval = kt_frame_interval(run.duration);
    if (code < 0) {
        kt_outcome outcome = {.scene = scene,
                              .model = model,
                              .absolute = absolute,
                              .run = &run,
                              .settings = &arguments->settings,
                              .unprojected = arguments->unprojected,
                              .so_far.energy = kt_energy_watch_of(scene, model),
                              .so_far.corrected_since = (double)NAN,
                              .warnings.quiet = arguments->quiet};
        kt_error_check check = {.reason = "the run stopped early"};
        outcome.check = arguments->check_error ? &check : NULL;
        outcome.name = kt_title_of(model, base);
        kt_native_file file = {.library = NULL};
        kt_native_code native = {.file = NULL};
        code = arguments->native ? load_code(arguments, scene, model, &file, &native) : -1;
        outcome.is_native = native.file != NULL;
        if (code < 0)
            code = run_with_names(arguments, &outcome, &names, manner, native.file != NULL ? &native : NULL);
        kt_native_code_free(&native);
        kt_native_file_free(&file);
        kt_error_check_free(&check);
    }
    free(csv);
    free(page);
    free(markers);
    return code;
}

int kt_command_run(int argc, char **argv) {
    const kt_run_manner manner = {.usage = &kt_usage_run, .has_records = true};
    return kt_run_command(argc, argv, &manner);
}

int kt_command_view(int argc, char **argv) {
    const kt_run_manner manner = {.usage = &kt_usage_view, .has_view = true};
    return kt_run_command(argc, argv, &manner);
}

/* Reads the engine and the scene of a live page. Returns -1, or an exit code after printing the error. */
static int prepare_live(kt_run_arguments *arguments, const char *path, const kt_scene *scene, kt_live *live) {
    if (!arguments->live)
        return -1;
    kt_settings all = arguments->settings;
    kt_live_setting texts[KT_LIVE_SETTINGS];
    int code = kt_run_live_settings(arguments, texts, &all);
    code = code < 0 ? kt_live_find_engine(live) : code;
    arguments->engine = live;
    return code < 0 ? kt_live_take_scene(live, path, &all, scene) : code;
}

int kt_run_command(int argc, char **argv, const kt_run_manner *manner) {
    kt_run_arguments arguments;
    kt_live live = {0};
    kt_scene scene;
    kt_model *model = NULL;
    kt_absolute *absolute = NULL;
    int code = kt_run_arguments_read(manner->usage, argc, argv, &arguments);
    if (code >= 0)
        return code;
    if (!manner->has_records && arguments.out == NULL && (arguments.checkpoint != NULL || arguments.resume != NULL))
        return kt_misuse("%s: --checkpoint and --resume need records: give --out FILE", manner->usage->command);
    const char *path = argv[1];
    if (arguments.modes)
        return kt_run_view_modes(&arguments, path);
    arguments.settings.is_quiet = arguments.quiet;
    arguments.settings.gives_step = !isnan(arguments.step);
    code = kt_read_scene_from(path, &arguments.settings, arguments.from, &scene);
    if (code != KT_EXIT_DONE)
        return code;
    char *base = kt_base_name(path);
    if (base == NULL) {
        code = kt_say_no_memory(NULL);
    } else {
        code = kt_run_override(&arguments, &scene);
        code = code < 0 ? prepare_live(&arguments, path, &scene, &live) : code;
        if (code < 0)
            code = kt_compile_scene(&scene, &model);
        if (code == KT_EXIT_DONE && model != NULL && arguments.records == NULL)
            code = kt_compile_absolute(&scene, model, &absolute);
        if (code == KT_EXIT_DONE && model != NULL && arguments.records != NULL)
            code = kt_run_view_records(&arguments, &scene, model, base);
        else if (code == KT_EXIT_DONE && model != NULL)
            code = run_model(&arguments, path, &scene, model, absolute, base, manner);
    }
    free(base);
    kt_live_free(&live);
    kt_absolute_free(absolute);
    kt_model_free(model);
    kt_scene_free(&scene);
    return code;
}
