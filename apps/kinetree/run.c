/* kinetree run: simulates a scene and writes its records. */
#include "checkpoint.h"

#include "advice.h"
#include "plot_run.h"
#include "touch.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static double cpu_now(void) {
    struct timespec time;
    if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) != 0)
        return 0.0;
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* ---- recording --------------------------------------------------------------------------------------------------- */

/* Data of the recorder. */
typedef struct kt_sinks {
    kt_csv *csv;
    kt_plot_run *plot; /* NULL: none */
    kt_progress *progress;
    kt_outcome *outcome;
    kt_mode_watch *modes; /* NULL: none */
    const kt_checkpoint *checkpoint;
    double aside; /* s, CPU time for writing, which does not count as cost of the simulation */
    bool failed;  /* a line could not be written */
    bool pauses;  /* the run pauses for a checkpoint */
} kt_sinks;

static double larger(double a, double b) { return a > b ? a : b; }

static void watch(kt_outcome *outcome, const kt_record *record) {
    kt_energy_watch_add(&outcome->energy, record);
    if (!isnan(record->constraint.position)) {
        outcome->constraint.position = larger(outcome->constraint.position, record->constraint.position);
        outcome->constraint.velocity = larger(outcome->constraint.velocity, record->constraint.velocity);
    }
    outcome->records++;
}

/* Squares of velocities overflow long before the velocities do; the integration checks only the velocities. */
static bool has_energy_beyond_numbers(const kt_record *record) {
    return !isnan(record->kinetic) && !isfinite(record->kinetic + record->potential);
}

/* In the first steps from rest the kinetic energy may appear before the corresponding fall of the potential energy, so
 * that a blow-up counts only if it lasts for STEPS steps. */
static bool stays_blown_up(kt_outcome *outcome) {
    enum { STEPS = 4 };
    const uint64_t steps = kt_simulation_counts_get(outcome->simulation).steps;
    if (!kt_energy_watch_is_blown_up(&outcome->energy))
        outcome->sound_steps = steps;
    return steps >= outcome->sound_steps + STEPS;
}

static int take_record(const kt_record *record, void *user) {
    kt_sinks *sinks = user;
    double start = cpu_now();
    if (has_energy_beyond_numbers(record)) {
        kt_say("t = %.9g s: the energy exceeds the range of numbers: the motion has diverged; take smaller steps, or "
               "see what "
               "drives it",
               record->time);
        sinks->failed = true;
        return -1;
    }
    watch(sinks->outcome, record);
    kt_watch_step(sinks->modes, sinks->outcome, record);
    kt_watch_correction(sinks->outcome);
    if (kt_csv_write(sinks->csv, record) != 0) {
        sinks->failed = true;
        return -1;
    }
    if (sinks->plot != NULL && kt_plot_run_take(sinks->plot, record) != 0) {
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
    sinks->aside += cpu_now() - start;
    sinks->pauses = kt_checkpoint_is_due(sinks->checkpoint);
    return sinks->pauses ? 1 : 0;
}

/* Runs to the end or to the first failure, which is printed. */
static int simulate(kt_outcome *outcome, kt_csv *csv, kt_plot_run *plot, kt_checkpoint *checkpoint,
                    kt_mode_watch *modes, bool quiet) {
    kt_error error = {0};
    kt_progress progress = kt_progress_start(quiet);
    kt_sinks sinks = {
        .csv = csv, .plot = plot, .progress = &progress, .outcome = outcome, .checkpoint = checkpoint, .modes = modes};
    double before = outcome->cpu_seconds, start = cpu_now();
    kt_status status;
    for (;;) {
        status = kt_simulation_run(outcome->simulation, take_record, &sinks, &error);
        outcome->cpu_seconds = before + cpu_now() - start - sinks.aside;
        if (!sinks.pauses)
            break;
        sinks.pauses = false;
        sinks.failed =
            kt_lines_flush(&csv->lines) != 0 || kt_checkpoint_write(checkpoint, outcome, csv->lines.written) != 0;
        if (sinks.failed)
            break;
    }
    kt_progress_end(&progress);
    if (status == KT_OK && kt_energy_watch_is_blown_up(&outcome->energy)) {
        kt_say_blown_up(outcome, kt_simulation_time(outcome->simulation));
        return KT_EXIT_INTEGRATION;
    }
    if (status == KT_OK)
        return KT_EXIT_DONE;
    if (!sinks.failed)
        kt_say_error(&error);
    return sinks.failed ? KT_EXIT_INTEGRATION : kt_exit_code(status);
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

static int check_files(const kt_run_arguments *arguments, const char *path, const char *out) {
    const kt_file_use uses[] = {{"the scene", path, false},
                                {"the checkpoint", arguments->resume, false},
                                {"--out", out, true},
                                {"--summary", arguments->summary, true},
                                {"--plot", arguments->plot, true}};
    /* A resumed run may continue to write the checkpoint file from which it started. */
    const kt_file_use checkpoint[] = {{"the scene", path, false},
                                      {"--checkpoint", arguments->checkpoint, true},
                                      {"--out", out, true},
                                      {"--summary", arguments->summary, true},
                                      {"--plot", arguments->plot, true}};
    int code = kt_check_files("run", uses, sizeof uses / sizeof uses[0]);
    if (code < 0)
        code = kt_check_files("run", checkpoint, sizeof checkpoint / sizeof checkpoint[0]);
    return code < 0 && arguments->plot != NULL ? kt_plot_check(arguments->plot) : code;
}

/* `kinetree demo` must not replace existing results of the user. */
static int spare_results(const kt_run_arguments *arguments, const char *out) {
    const char *const results[] = {out, arguments->summary, arguments->plot};
    for (size_t i = 0; i < sizeof results / sizeof results[0] && arguments->resume == NULL; i++) {
        struct stat status;
        if (results[i] != NULL && strcmp(results[i], "-") != 0 && stat(results[i], &status) == 0 &&
            S_ISREG(status.st_mode)) {
            kt_say("demo: %s exists already; --force replaces it%s", results[i],
                   i == 0 ? ", --out FILE writes elsewhere" : "");
            return KT_EXIT_USAGE;
        }
    }
    return -1;
}

/* ---- parts of the command ---------------------------------------------------------------------------------------- */

/* The final names of the results. */
typedef struct kt_result_names {
    const char *out, *summary, *plot; /* NULL: none */
} kt_result_names;

static int finish(const kt_run_arguments *arguments, const kt_outcome *outcome, const kt_result_names *names,
                  kt_plot_run *plot) {
    int picture = KT_EXIT_DONE, summary = KT_EXIT_DONE;
    if (plot != NULL)
        picture = kt_plot_run_write(plot, outcome, names->plot, arguments->dark);
    if (names->summary != NULL)
        summary = kt_summary_write(outcome, names->summary);
    if (!arguments->quiet) /* reports the files that have been written */
        kt_report_outcome(outcome, names->out, summary == KT_EXIT_DONE ? names->summary : NULL,
                          picture == KT_EXIT_DONE ? names->plot : NULL);
    return picture != KT_EXIT_DONE ? picture : summary;
}

static void say_part(const char *part, const char *out) {
    if (strcmp(part, out) == 0)
        kt_say("the run did not come to its end: its records until then are in %s", out);
    else
        kt_say("the run did not come to its end: its records until then are in %s, and %s, which an earlier run has "
               "left, is not touched",
               part, out);
}

/* Ends the file of records, under the name in `parts` if the run has failed, and writes the other results. Returns the
 * exit code of the command. */
static int end_results(const kt_run_arguments *arguments, kt_outcome *outcome, const kt_result_names *wholes,
                       const kt_result_names *parts, kt_csv *csv, kt_plot_run *plot, int code) {
    const bool is_moved = csv->output.partial != NULL;
    const kt_output_fate fate = code == KT_EXIT_DONE                                 ? KT_OUTPUT_WHOLE
                                : outcome->records == 0 && arguments->resume == NULL ? KT_OUTPUT_NOTHING
                                                                                     : KT_OUTPUT_PART;
    if (fate == KT_OUTPUT_WHOLE && arguments->resume == NULL) {
        kt_note_replaced(wholes->out, outcome->replaced, sizeof outcome->replaced);
        kt_note_replaced(wholes->summary, outcome->replaced, sizeof outcome->replaced);
        kt_note_replaced(wholes->plot, outcome->replaced, sizeof outcome->replaced);
    }
    if (kt_csv_close(csv, fate) != 0 && code == KT_EXIT_DONE)
        code = KT_EXIT_INTEGRATION;
    const bool whole = code == KT_EXIT_DONE;
    if (!whole && is_moved && fate != KT_OUTPUT_NOTHING)
        say_part(parts->out, wholes->out);
    const int rest = finish(arguments, outcome, whole ? wholes : parts, plot);
    return whole ? rest : code;
}

static int close_results(const kt_run_arguments *arguments, kt_outcome *outcome, const char *out, kt_csv *csv,
                         kt_plot_run *plot, int code) {
    const kt_result_names wholes = {out, arguments->summary, arguments->plot};
    char *part_out = kt_part_name(out), *part_summary = kt_part_name(wholes.summary),
         *part_plot = kt_part_name(wholes.plot);
    if (part_out == NULL || (part_summary == NULL && wholes.summary != NULL) ||
        (part_plot == NULL && wholes.plot != NULL)) {
        kt_say("there is not enough memory");
        (void)kt_csv_close(csv, KT_OUTPUT_AS_IS);
        code = code == KT_EXIT_DONE ? KT_EXIT_INTEGRATION : code;
    } else {
        const kt_result_names parts = {part_out, part_summary, part_plot};
        code = end_results(arguments, outcome, &wholes, &parts, csv, plot, code);
    }
    free(part_out);
    free(part_summary);
    free(part_plot);
    return code;
}

/* Opens the file of records: a new one, or the one to which a checkpoint belongs. */
static int open_records(const kt_run_arguments *arguments, kt_outcome *outcome, kt_checkpoint *checkpoint,
                        const char *out, kt_csv *csv) {
    long long lines = 0;
    if (arguments->resume == NULL)
        return kt_csv_open(csv, out, outcome->model, outcome->run);
    int code = kt_checkpoint_resume(checkpoint, arguments->resume, outcome, &lines);
    return code >= 0 ? code : kt_csv_reopen(csv, out, outcome->model, outcome->run, lines);
}

/* Runs a simulation that has been created, with the names of all files known. */
static int run_simulation(const kt_run_arguments *arguments, kt_outcome *outcome, const char *out,
                          kt_checkpoint *checkpoint) {
    kt_csv csv;
    kt_plot_run *plot = NULL;
    if (arguments->plot != NULL) {
        plot = kt_plot_run_start(outcome->model, outcome->run);
        if (plot == NULL) {
            kt_say("there is not enough memory for the picture");
            return KT_EXIT_INTEGRATION;
        }
    }
    int code = open_records(arguments, outcome, checkpoint, out, &csv);
    if (code < 0) {
        kt_mode_watch *modes = kt_watch_steps(outcome);
        code = simulate(outcome, &csv, plot, checkpoint, modes, arguments->quiet);
        kt_warn_of_step(outcome, modes);
        kt_mode_watch_free(modes);
        kt_warn_of_correction(outcome);
        kt_warn_of_energy(outcome);
        code = close_results(arguments, outcome, out, &csv, plot, code);
    }
    kt_plot_run_free(plot);
    return code;
}

/* Joints and loops share the column names of reactions, so that their names must differ. */
static int check_columns(const kt_model *model, const kt_run *run) {
    for (int i = 0; i < kt_loop_count(model) && (kt_run_record(run, model) & KT_RECORD_REACTION) != 0; i++)
        if (kt_body_find(model, kt_loop_name(model, i)) > 0) {
            kt_say("run: loop '%s' has the name of a body, and with 'reaction' recorded both would have the same "
                   "columns; rename one of them",
                   kt_loop_name(model, i));
            return KT_EXIT_SCENE;
        }
    return -1;
}

static void warn_of_long_step(kt_outcome *outcome) {
    const kt_run *run = outcome->run;
    const kt_warning warning = {.code = "long_step",
                                .time = (double)NAN,
                                .value = run->step,
                                .unit = "s",
                                .remedy = "Give a shorter step, or a longer duration"};
    if (run->duration > 0.0 && run->step > run->duration)
        kt_warn(&outcome->warnings, &warning, "the step, %g s, is longer than the duration: one step of %g s is taken",
                run->step, run->duration);
}

/* Warns if the velocity of a driven joint jumps at the rows of its table. */
static void warn_of_jumps(kt_outcome *outcome) {
    const char *loop = kt_start_jumping(outcome->scene);
    const kt_warning warning = {.code = "speed_jump",
                                .time = (double)NAN,
                                .value = (double)NAN,
                                .remedy = "Give the table 'interpolation: cubic' or 'monotone'"};
    if (loop != NULL)
        kt_warn(&outcome->warnings, &warning, "the speed of loop '%s' jumps at the rows of its table", loop);
}

static void tell_start(kt_outcome *outcome, bool quiet) {
    const double *q = kt_simulation_positions(outcome->simulation);
    const double *v = kt_simulation_velocities(outcome->simulation);
    warn_of_long_step(outcome);
    warn_of_jumps(outcome);
    (void)kt_touch_warn(&outcome->warnings, outcome->scene, outcome->model, q);
    outcome->moved = kt_start_moved(outcome->model, q, v);
    if (!quiet)
        (void)kt_start_say_moved(NULL, outcome->scene, outcome->model, q, v);
}

/* Runs a compiled scene: applies the remaining options, checks the files, then creates and runs the simulation. Returns
 * an exit code. */
static int run_model(const kt_run_arguments *arguments, const char *path, const kt_scene *scene, const kt_model *model,
                     const char *base, bool careful) {
    kt_run run = scene->run;
    kt_marker_pair *markers;
    int code = kt_run_override_markers(arguments->markers, model, &run, &markers);
    if (code >= 0)
        return code;
    size_t room = strlen(base) + sizeof ".csv";
    char *csv_name = malloc(room);
    if (csv_name == NULL)
        kt_say("there is not enough memory");
    else
        snprintf(csv_name, room, "%s.csv", base);
    const char *out = arguments->out != NULL ? arguments->out : csv_name;
    code = csv_name == NULL ? KT_EXIT_INTEGRATION : check_files(arguments, path, out);
    code = code < 0 && careful ? spare_results(arguments, out) : code;
    code = code < 0 ? check_columns(model, &run) : code;

    kt_error error = {0};
    kt_simulation_options options = kt_simulation_options_default();
    options.unprojected = arguments->unprojected;
    if (kt_loop_count(model) > 0)
        options.record = KT_RECORD_CONSTRAINT; /* the report states the largest residuals, recorded or not */
    if (arguments->summary != NULL || arguments->plot != NULL)
        options.record |= KT_RECORD_ENERGY | KT_RECORD_CONSTRAINT;
    kt_outcome outcome = {.scene = scene,
                          .model = model,
                          .run = &run,
                          .unprojected = arguments->unprojected,
                          .energy = kt_energy_watch_start(model),
                          .corrected_since = (double)NAN,
                          .warnings.quiet = arguments->quiet};
    if (outcome.energy.energetics != KT_ENERGY_SUPPLIED) /* otherwise the energy alone does not show errors */
        options.record |= KT_RECORD_ENERGY;
    outcome.name = kt_model_name(model) != NULL && *kt_model_name(model) != '\0' ? kt_model_name(model) : base;
    if (code < 0) {
        kt_status status = kt_simulation_create(model, &run, &options, &outcome.simulation, &error);
        code = status != KT_OK ? kt_exit_code(status) : -1;
        if (status != KT_OK)
            kt_say_error(&error);
        else
            tell_start(&outcome, arguments->quiet);
        if (status == KT_ERROR_CONSTRAINT)
            kt_say_open_loops(scene, model);
    }
    kt_checkpoint checkpoint = {.path = NULL};
    if (code < 0 && (arguments->checkpoint != NULL || arguments->resume != NULL))
        code =
            kt_checkpoint_open(&checkpoint, arguments->checkpoint, arguments->checkpoint_interval, &outcome, &options);
    if (code < 0)
        code = run_simulation(arguments, &outcome, out, &checkpoint);
    kt_checkpoint_close(&checkpoint);
    kt_simulation_free(outcome.simulation);
    kt_warnings_free(&outcome.warnings);
    json_decref(outcome.moved);
    free(csv_name);
    free(markers);
    return code;
}

int kt_command_run(int argc, char **argv) { return kt_run_command(argc, argv, false); }

int kt_run_command(int argc, char **argv, bool careful) {
    kt_run_arguments arguments;
    kt_scene scene;
    kt_model *model = NULL;
    int code = kt_run_arguments_read(argc, argv, &arguments);
    if (code >= 0)
        return code;
    const char *path = argv[1];
    code = kt_read_scene(path, &scene);
    if (code != KT_EXIT_DONE)
        return code;
    char *base = kt_base_name(path);
    if (base == NULL) {
        kt_say("there is not enough memory");
        code = KT_EXIT_INTEGRATION;
    } else {
        code = kt_run_override(&arguments, &scene.run);
        if (code < 0)
            code = kt_compile_scene(&scene, &model);
        if (code == KT_EXIT_DONE && model != NULL)
            code = run_model(&arguments, path, &scene, model, base, careful);
    }
    free(base);
    kt_model_free(model);
    kt_scene_free(&scene);
    return code;
}
