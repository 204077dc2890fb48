/* Declarations shared by the files of `kinetree run`. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_RUN_H
#define KT_COMMAND_SUBCOMMANDS_RUN_H

#include "advice/growth.h"
#include "advice/warnings.h"
#include "open/simulated.h"
#include "open/start.h"
#include "records/columns.h"
#include "records/extremes.h"
#include "records/keep.h"
#include "records/lines.h"
#include "records/marks.h"
#include "records/method_words.h"
#include "records/output.h"
#include "records/steps.h"

#include "kinetree/analysis.h"
#include "kinetree/mechanism.h"
#include "kinetree/study.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* ---- the command line -------------------------------------------------------------------------------------------- */

/* Options as given; NaN, NULL or -1: not given. */
typedef struct kt_run_arguments {
    const char *command; /* the subcommand's name, for messages */
    double duration, step, max_step, rho, interval;
    const char *integrator, *tolerance, *record, *markers;
    int formulation, reduction, metric, plan;
    const char *from, *out, *summary, *scene, *plot, *size, *view, *glb, *checkpoint, *resume;
    const char *records, *marks; /* of `view` */
    double checkpoint_interval;
    bool unprojected, native, check_error, dark, boxes, live, modes, quiet;
    struct kt_live *engine; /* engine of the page of --live; NULL: none */
    kt_settings settings;
} kt_run_arguments;

/* The subcommands that run a scene. */
typedef struct kt_run_manner {
    const kt_usage *usage;
    bool has_records; /* records are written, --out or not */
    bool has_view;    /* a view is written, --view or not */
    bool is_careful;  /* existing results are not replaced */
} kt_run_manner;

int kt_run_command(int argc, char **argv, const kt_run_manner *manner);

/* Parses the command line. Returns -1 if the command can continue, else an exit code. */
int kt_run_arguments_read(const kt_usage *usage, int argc, char **argv, kt_run_arguments *arguments);

/* Options of the method as settings of the scene of a live page: the page begins with the run of the command. Adds them
 * to `settings`. Returns -1, or an exit code after printing the error. */
enum { KT_LIVE_SETTINGS = 5 };
typedef struct kt_live_setting {
    char text[128];
} kt_live_setting;
int kt_run_live_settings(const kt_run_arguments *arguments, kt_live_setting texts[KT_LIVE_SETTINGS],
                         kt_settings *settings);

/* view --modes: writes a page that animates the modes of the scene. Returns an exit code. */
int kt_run_view_modes(const kt_run_arguments *arguments, const char *path);

/* view --records: writes a page that shows a motion that has been recorded. Returns an exit code. */
int kt_run_view_records(const kt_run_arguments *arguments, const kt_scene *scene, const kt_model *model,
                        const char *base);

/* Applies the options of the command line to the scene, except for markers. Returns -1 on success, else an exit
 * code. */
int kt_run_override(const kt_run_arguments *arguments, kt_scene *scene);

/* Applies a list of markers, which needs the model; list: NULL if not given. option: for messages, "run: --markers".
 * The caller releases *run_markers with free. Returns -1 on success, else an exit code. */
int kt_run_override_markers(const char *option, const char *list, const kt_model *model, kt_run *run,
                            kt_marker_pair **run_markers);

/* Prints that an option names a body that does not exist, with the nearest name. Returns an exit code. */
int kt_say_no_body(const char *option, const kt_model *model, const char *name);

/* ---- records as lines -------------------------------------------------------------------------------------------- */

/* Records as CSV. */
typedef struct kt_csv {
    const kt_columns *columns;
    kt_output output;
    kt_lines lines;
} kt_csv;

/* Opens the file ("-": standard output; NULL: there are no records to be written; else see output.h) and writes the
 * header. The columns must outlive it. Returns -1 on success, else an exit code. */
int kt_csv_open(kt_csv *csv, const char *path, const kt_columns *columns);
/* Records that a file holds: its first bytes, and their checksum (base/sum.h). */
typedef struct kt_written {
    int64_t bytes;
    uint64_t sum;
} kt_written;

/* Opens records that begin with the records of `before`, in NAME.partial or, if that does not exist, in NAME. The bytes
 * after them are cut off. Other records are rejected. Returns -1 on success, else an exit code. */
int kt_csv_reopen(kt_csv *csv, const char *path, const kt_columns *columns, const kt_written *before);
/* Adds the bytes `from` to `to` - 1 of a file to a sum. Returns false if they cannot be read. */
bool kt_csv_sum(int file, long long from, long long to, uint64_t *sum);
/* Appends a record, given by the values of its columns. Returns 0, or -1 after printing an error if lines could not be
 * written. */
int kt_csv_write(kt_csv *csv, const double *values);
/* Writes the buffer and closes the file, which `fate` names or removes. Returns 0, or -1 after printing the error. */
int kt_csv_close(kt_csv *csv, kt_output_fate fate);

/* Returns the time of a monotonic clock, s. */
double kt_clock(void);
/* Returns the processor time of this process, s; 0 if it is unknown. */
double kt_cpu_clock(void);

/* The observations of kt_watch_stability. */
typedef struct kt_stability_watch {
    int estimates;         /* records at which the fastest mode was estimated */
    int compared, bounded; /* parts of the run between them; those whose steps were at the limit */
    double time, rate;     /* s, 1/s, at the last of them */
    uint64_t steps;        /* taken up to there */
    uint64_t switches;     /* changes of method by auto, up to there */
    double fastest;        /* 1/s, of the bounded parts */
} kt_stability_watch;

/* The pace of adaptive steps (kt_watch_pace). */
typedef struct kt_pace {
    double begin;                 /* s of the clock, of the run */
    double time;                  /* s, where the last window of steps ended */
    uint64_t seen;                /* calls */
    uint64_t steps;               /* with paths: all steps */
    uint64_t breakpoints;         /* up to there, at which steps ended */
    bool said;                    /* the warning has been given */
    struct kt_progress *progress; /* the bar that is cleared before the warning */
} kt_pace;

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* Events with a bit in a word: the first ones of the scene. */
enum { KT_EVENTS_NOTED = 64 };

/* The results of a run so far, as plain numbers, which checkpoints hold. */
typedef struct kt_so_far {
    int64_t records;              /* number of records passed to the recorder */
    uint64_t sound_steps;         /* steps taken at the last record without blow-up */
    double cpu_seconds;           /* processor time, s */
    double corrected_since;       /* s, since when large velocity corrections persist (kt_watch_correction); NaN: no */
    kt_energy_watch energy;       /* watches the energy of all records */
    kt_residual constraint;       /* largest residuals */
    kt_compressions compressions; /* compressions of distances, at all records */
    kt_half_turns half_turns;     /* half turns of effects in angles of loops, at all records */
    kt_stability_watch stability; /* watches adaptive explicit steps */
    kt_growth growth;             /* watches speeds and auxiliary states */
    uint64_t jumped;              /* events of the scene, as bits, that have happened at a jump of atan2 */
    uint64_t held;                /* events of the scene, as bits, whose conditions held at the start */
    kt_moved moved;               /* coordinates, at the ends of steps */
} kt_so_far;

/* The states of a run at its records, and the estimate of their error (--check-error). */
typedef struct kt_error_check {
    double *rows; /* rows of time, q and v */
    size_t width, count, room;
    bool is_short; /* memory did not suffice */

    bool is_known;                            /* the estimate exists; else `reason` states why not */
    bool is_parted;                           /* the two runs part: the error is at least this */
    bool is_at_end;                           /* `velocity` is that at the end, since contacts and events let it jump */
    bool is_fixed;                            /* the settings are steps */
    kt_difference position, velocity, motion; /* the errors; the motion from its first record */
    double time;                              /* s, of the largest error in position */
    double setting, ratio, power;             /* second run's setting; its ratio to the run's; error ~ setting^power */
    int64_t compared;                         /* records */
    char reason[300];
} kt_error_check;

/* Keeps the state of a record. */
void kt_error_check_take(kt_error_check *check, const kt_model *model, const kt_record *record);
/* Makes the second run and the estimate. */
struct kt_outcome;
void kt_error_check_finish(kt_error_check *check, struct kt_outcome *outcome);
/* Prints the estimate. Describes it for the summary. */
void kt_error_check_say(const kt_error_check *check);
json_t *kt_error_check_describe(const kt_error_check *check);
void kt_error_check_free(kt_error_check *check);

/* The reactions that are not unique (advice/shares.c). */
typedef struct kt_shares {
    kt_reaction_share *of; /* share of each joint, by bodies, and each loop, and room for one model's; NULL: unknown */
    size_t bodies, loops;
    const struct kt_model *seen; /* the model of the latest record */
} kt_shares;

typedef struct kt_outcome {
    const kt_scene *scene;
    const kt_model *model;
    const kt_absolute *absolute; /* the model's absolute formulation, if that is integrated; else NULL */
    const kt_run *run;           /* with the options of the command line applied */
    const kt_settings *settings; /* of the command line; NULL: none */
    kt_simulation *simulation;
    kt_absolute_motion *motion; /* its owner in the absolute formulation; else NULL */
    kt_scene_watch *events;     /* the scene's events; NULL: none */
    const char *name;           /* the scene's name, or the file's if it has none */
    bool unprojected;           /* --unprojected */
    bool is_native;             /* --native */
    kt_error_check *check;      /* --check-error; NULL: not given */
    kt_so_far so_far;
    bool is_blown_up;          /* the blow-up has been reported */
    kt_error excess;           /* a value beyond all reason, which has ended the run */
    kt_pace pace;              /* watches adaptive steps */
    double advised_step;       /* s, the smallest step that a warning has suggested; 0: none */
    kt_shares shares;          /* shares of the reactions that redundant loops share */
    kt_path_watch paths;       /* around surfaces, after all steps */
    const kt_columns *columns; /* columns of the records; NULL: not listed yet */
    kt_extremes extremes;      /* extremes of these columns, at all records and steps */
    kt_steps steps;            /* watches the ends of steps */
    kt_marks marks;            /* marks of the events that have written rows, and of hard contacts */
    json_t *moved;             /* changes of the given values by the assembly (kt_start_moved) */
    kt_error
        failed; /* why the run has ended early; KT_OK: it has not, or a message was printed that no call returned */
    char replaced[800]; /* earlier results that were replaced (kt_note_replaced) */
    kt_warnings warnings;
} kt_outcome;

/* The present state of a run, and its model, in the coordinates of the tree. */
static inline kt_simulated kt_outcome_simulated(const kt_outcome *outcome) {
    return (kt_simulated){outcome->simulation, outcome->motion};
}
static inline const double *kt_outcome_positions(const kt_outcome *outcome) {
    return kt_simulated_positions(kt_outcome_simulated(outcome));
}
static inline const double *kt_outcome_velocities(const kt_outcome *outcome) {
    return kt_simulated_velocities(kt_outcome_simulated(outcome));
}
/* If loops or effects are switched, the model with the present set. */
static inline const kt_model *kt_outcome_model(const kt_outcome *outcome) {
    return outcome->motion != NULL ? outcome->model : kt_simulation_model(outcome->simulation);
}

/* Writes the scene with the end of the run as its initial state. Unless `quiet`, prints what begins anew in the written
 * scene (kt_say_anew). Returns an exit code after printing an error. */
int kt_run_write_end(const kt_outcome *outcome, const char *path, bool quiet);

/* Records as HDF5 (keep.h). The function kt_run_keep_start opens the side file, to which rows are added, and returns
 * -1, or an exit code after printing the error. The function kt_run_keep_end makes the HDF5 file from the side file,
 * and does nothing without a side file. That function returns 0, or -1 after printing the error. */
int kt_run_keep_start(kt_keep *keep, const char *out);
int kt_run_keep_end(kt_keep *keep, const kt_outcome *outcome, size_t rows, int code, kt_output_fate fate);

/* Writes the summary as JSON to a file ("-": standard output). Returns KT_EXIT_DONE, or an exit code after printing the
 * error. */
int kt_summary_write(const kt_outcome *outcome, const char *path);

/* Warns of irregularities that the simulation has counted. Irregularities are iterations and searches that reached a
 * limit, missing Jacobians, and velocities that events could not set. Others are states next to dead points and
 * singular positions. */
void kt_warn_of_counts(kt_outcome *outcome);

/* A warning of a number of events, unless it is 0: "BEFORE 2 MANY AFTER", or ONE for 1. */
typedef struct kt_counted {
    const char *code, *before, *one, *many, *after, *remedy;
} kt_counted;
void kt_warn_of_count(kt_outcome *outcome, uint64_t count, const kt_counted *counted);

/* Sets options so that the simulation can warn while it runs. A warning appears if adaptive steps are so short that the
 * run needs many. The warning reports the number of steps, the time that they take, and the cause. Another one appears
 * if the length of a path jumps (path_jump.c). */
void kt_watch_pace(kt_outcome *outcome, kt_simulation_options *options);

/* Warns once of own columns that are not finite at some records. The warning reports their number and the first
 * time. */
void kt_warn_of_gaps(kt_outcome *outcome);

/* Warns if restitutions of hard contacts were reduced, or if their friction left several motions or reactions
 * possible. */
void kt_warn_of_contacts(kt_outcome *outcome);

/* Creates a watch on the fastest mode for runs with fixed steps. Returns NULL for other runs, and, after a warning, if
 * memory is insufficient. */
kt_mode_watch *kt_watch_steps(kt_outcome *outcome);
/* Estimates the fastest mode at a record, unless the watch has used more than 60 evaluations plus a fiftieth of the
 * run's. watch may be NULL. */
void kt_watch_step(kt_mode_watch *watch, const kt_outcome *outcome, const kt_record *record);
/* Warns if the step is outside of the method's region of stability, or if there are too few steps per period of an
 * oscillation. Examines the state with the fastest mode and the last state. Each warning is given once, with the
 * smallest suggested step. The states of an unstable run differ from the true motion. The true motion is then computed
 * with adaptive steps (at most 10,000), and its modes decide. */
void kt_warn_of_step(kt_outcome *outcome, const kt_mode_watch *watch);

/* kt_watch_correction examines, at a record, the velocity corrections of the projection onto the loops.
 * kt_warn_of_correction warns of large corrections. With fixed steps, a correction is large from KT_CORRECTION_ERROR of
 * the velocities on. With adaptive steps, it must have acted as an impact where the path bends next to a singular
 * position. */
#define KT_CORRECTION_ERROR 0.1
void kt_watch_correction(kt_outcome *outcome);
void kt_warn_of_correction(kt_outcome *outcome);
/* Warns if a run without projection has let loops drift open by a millionth of the mechanism's extent or more. */
void kt_warn_of_drift(kt_outcome *outcome);

/* For adaptive steps of an explicit method. The function kt_watch_stability estimates the fastest mode at a dozen
 * records, with at most 17 evaluations each. The function kt_warn_of_stability warns if stability bounded the steps for
 * most of the run. */
void kt_watch_stability(kt_outcome *outcome, const kt_record *record);
void kt_warn_of_stability(kt_outcome *outcome);

/* kt_watch_motion hands a record to all watches: energy, step, stability, corrections and growth. kt_warn_of_motion
 * prints, at the end of a run, the warnings of these watches, of drift, and of counts of the simulation.
 * modes: those of kt_watch_steps; NULL: fixed steps are not examined. */
void kt_watch_motion(kt_outcome *outcome, kt_mode_watch *modes, const kt_record *record);
void kt_warn_of_motion(kt_outcome *outcome, const kt_mode_watch *modes);

/* Returns the bound of evaluations at which a fixed step on hard contacts stalls (stall_evaluations of
 * kt_simulation_options). Returns 0 if the run has no such steps, or if time stepping does not support the scene. */
uint64_t kt_bound_of_fixed_steps(const kt_outcome *outcome, kt_simulation_options options);

/* Returns whether the work done is estimated at the ends of steps, to watch the energy. This holds for motions that are
 * damped or driven by forces, if the estimate costs little. If loops drive the motion, powers need accelerations and
 * reactions, so that the balance is recorded only on request. */
bool kt_watches_works(const kt_outcome *outcome);
/* Returns the reason, in words, why the energy is not watched; NULL: it is watched. */
const char *kt_energy_not_watched(const kt_outcome *outcome);
/* Warns if a motion with adaptive steps passed near a singular position and has a large error of the energy. The error
 * is large if it exceeds the usual error of such steps. */
void kt_warn_of_passages(kt_outcome *outcome);
/* Warns if the scene was at rest from the start to the end because no force accelerates it, whether effects exist or
 * not. Also warns if all motion is so small that the absolute tolerance does not resolve it. */
void kt_warn_of_rest(kt_outcome *outcome);
/* Returns whether forces hold the scene in equilibrium: all that has moved is within the errors of steps. Then the
 * energy of the motion is noise. */
bool kt_is_held(const kt_outcome *outcome);
/* If the motion varies more between records than they show, the column with the largest part of it; extremes.count:
 * there is none. kt_periods_between returns how often a column goes through its range and back between two records. */
size_t kt_find_aliased(const kt_outcome *outcome);
/* Adds the velocities of markers at a record to what this needs. */
void kt_watch_turns(kt_outcome *outcome, const kt_record *record);
double kt_periods_between(const kt_outcome *outcome, size_t column);
/* Warns of this if the program chose the interval. Intervals that the user has chosen are meant, and the report alone
 * states the number. */
void kt_warn_of_aliasing(kt_outcome *outcome);
/* Warns if the error of the energy exceeds KT_ENERGY_ERROR. */
void kt_warn_of_energy(kt_outcome *outcome);

/* Warns of what the start shows. */
void kt_warn_of_start(kt_outcome *outcome);
/* Lists the notes of an import, warns of what the start shows, and reports initial values that assembly has moved. */
void kt_report_start(kt_outcome *outcome, bool quiet);

/* Warns if a view shows the run incompletely: lost meshes, records without a frame, and rotations too fast for the
 * frames. motion: NULL if there is no view. */
struct kt_motion;
void kt_warn_of_frames(kt_outcome *outcome, const struct kt_motion *motion);

/* Returns whether the formula of an event reads atan2; `event` counts `until` last. */
bool kt_event_reads_angle(const kt_scene *scene, int event);
/* Warns if the formula of an event that happens now is not next to zero: atan2 has jumped there. Returns whether it
 * has. */
bool kt_warn_of_event_jump(kt_warnings *warnings, const kt_scene *scene, kt_scene_watch *events,
                           const kt_simulation *simulation, int event);
/* Warns, once for each event, if an event has happened at a jump of atan2 in its formula. */
void kt_watch_event_jump(kt_outcome *outcome, const kt_record *record);

/* Watches reactions that are recorded or read, and warns after the run of those that the model does not determine:
 * redundant loops share a reaction, or a coupling loads no bearing. kt_shares_begin returns false if memory is
 * insufficient. */
bool kt_shares_begin(kt_shares *shares, const kt_model *model);
void kt_watch_shares(kt_outcome *outcome, const kt_record *record);
void kt_warn_of_shares(kt_outcome *outcome);
/* Warns of each event that has not happened because its condition holds from the start. */
void kt_warn_of_held_events(kt_outcome *outcome);
void kt_shares_free(kt_shares *shares);

/* Reports the value beyond all reason, and adds a warning to the list. */
void kt_say_excess(kt_outcome *outcome);

/* Reports that the integration has blown up at this time, and adds a warning to the list. */
void kt_say_blown_up(kt_outcome *outcome, double time);

/* The results of a run: records, a summary, a picture, a page and glTF. */
typedef enum kt_result { KT_RESULT_OUT, KT_RESULT_SUMMARY, KT_RESULT_PLOT, KT_RESULT_VIEW, KT_RESULT_GLB } kt_result;
enum { KT_RESULTS = KT_RESULT_GLB + 1 };

/* The file names of the results; NULL: none. */
typedef union kt_result_names {
    struct {
        const char *out, *summary, *plot, *view, *glb;
    };
    const char *all[KT_RESULTS];
} kt_result_names;

/* Checks the names of all files. A resumed run may continue to write the checkpoint file from which it started. */
int kt_run_check_files(const kt_run_arguments *arguments, const char *path, const kt_result_names *names);

/* Rejects existing files as results, because `kinetree demo` must not replace results of the user. Returns -1, or an
 * exit code after printing the error. */
int kt_run_spare_results(const kt_result_names *names);

/* Prints a short report on standard error. */
void kt_report_outcome(const kt_outcome *outcome, const kt_result_names *names);

/* Prints the step or the tolerances: " with steps of 0.01 s", " at tolerance 1e-06". */
void kt_print_steps(const kt_run *run, FILE *to);

/* ---- progress ---------------------------------------------------------------------------------------------------- */

/* A progress bar on standard error if that is a terminal, shown after the first second. */
typedef struct kt_progress {
    bool is_shown; /* the bar may be shown */
    bool is_drawn; /* a bar is drawn and must be cleared */
    bool has_utf8;
    double start, last; /* s, values of kt_clock */
} kt_progress;

kt_progress kt_progress_start(bool quiet);
void kt_progress_update(kt_progress *progress, double done, double whole);
/* Draws the bar with a text of the caller instead of the time; part: 0 to 1. */
void kt_progress_show(kt_progress *progress, double part, const char *words);
void kt_progress_end(kt_progress *progress);

#endif
