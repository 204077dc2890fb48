/* The parts of `kinetree run`. */
#ifndef KT_COMMAND_RUN_H
#define KT_COMMAND_RUN_H

#include "lines.h"
#include "output.h"
#include "start.h"
#include "warnings.h"

#include "kinetree/analysis.h"

#include <stdbool.h>
#include <stdint.h>

/* ---- the command line -------------------------------------------------------------------------------------------- */

/* What was given; NaN, NULL or -1 where it was not. */
typedef struct kt_run_arguments {
    double duration, step, interval;
    const char *integrator, *tolerance, *record, *markers;
    int formulation, reduction, metric, plan;
    const char *out, *summary, *plot, *checkpoint, *resume;
    double checkpoint_interval;
    bool unprojected, dark, quiet;
} kt_run_arguments;

/* `kinetree run`; careful: what is there already is not replaced. */
int kt_run_command(int argc, char **argv, bool careful);

/* Returns -1 to go on, or an exit code. */
int kt_run_arguments_read(int argc, char **argv, kt_run_arguments *arguments);

/* Puts the command line's words over the scene's, but for markers. Returns -1 to go on, or an exit code. */
int kt_run_override(const kt_run_arguments *arguments, kt_run *run);

/* The same for markers, which need the model; NULL: none were given. *run_markers is released by the caller with free.
 * Returns -1 to go on, or an exit code. */
int kt_run_override_markers(const char *list, const kt_model *model, kt_run *run, kt_marker_pair **run_markers);

/* ---- records as lines -------------------------------------------------------------------------------------------- */

/* Records as CSV. */
typedef struct kt_csv {
    const kt_model *model;
    const kt_run *run;
    unsigned record;
    kt_output output;
    kt_lines lines;
} kt_csv;

/* Opens the file ("-": standard output; else see output.h) and writes the header. Returns -1 to go on, or an exit code.
 */
int kt_csv_open(kt_csv *csv, const char *path, const kt_model *model, const kt_run *run);
/* The same for records of which the first `written` bytes stand, in NAME.partial or, where that is not there, in NAME;
 * what follows them is cut off. */
int kt_csv_reopen(kt_csv *csv, const char *path, const kt_model *model, const kt_run *run, long long written);
/* Returns 0, or -1 where lines could not be written, which has been said. */
int kt_csv_write(kt_csv *csv, const kt_record *record);
/* Writes what was gathered and closes; whole records that could not be written are a part. Returns 0, or -1 where
 * something failed, which has been said. */
int kt_csv_close(kt_csv *csv, kt_output_fate fate);

/* kinetic + potential + dissipated - supplied: what a run keeps constant. NaN where the works are not known. */
static inline double kt_balance_of(const kt_record *record) {
    return record->kinetic + record->potential + record->work.dissipated - record->work.supplied;
}

/* s, of a clock that only goes forward. */
double kt_clock(void);

/* ---- what came out ----------------------------------------------------------------------------------------------- */

typedef struct kt_outcome {
    const kt_scene *scene;
    const kt_model *model;
    const kt_run *run; /* as run: the command line's words put in */
    kt_simulation *simulation;
    const char *name;       /* the scene's, or else the file's */
    bool unprojected;       /* --unprojected */
    int64_t records;        /* handed over */
    kt_energy_watch energy; /* as the records have shown it */
    uint64_t sound_steps;   /* taken when the energy had last not blown up */
    bool is_blown_up;       /* which has been said */
    double
        corrected_since; /* s, from when on velocities were put right by much (kt_watch_correction); NaN: they are not */
    double advised_step;    /* s, the least that a warning has named; 0: none */
    kt_residual constraint; /* largest residuals */
    json_t *moved;          /* by the assembly, of the values given (kt_start_moved) */
    double cpu_seconds;
    char replaced[800]; /* earlier results of the same names (kt_note_replaced) */
    kt_warnings warnings;
} kt_outcome;

/* Writes the summary as JSON to a file ("-": standard output). Returns KT_EXIT_DONE, or an exit code after saying why.
 */
int kt_summary_write(const kt_outcome *outcome, const char *path);

/* A watch on the fastest mode for runs with fixed steps; NULL for others, and where there is no memory, which is warned
 * of. */
kt_mode_watch *kt_watch_steps(kt_outcome *outcome);
/* Looks at a record, unless that would cost more than a fiftieth of what the run has. watch may be NULL. */
void kt_watch_step(kt_mode_watch *watch, const kt_outcome *outcome, const kt_record *record);
/* Warns where the step was outside of the method's region of stability at the state of the fastest mode or at the last
 * one, or takes too few a period of what oscillates there; once each, with the least step. A run that was not stable
 * tells little of the motion: its scene is then followed by adaptive steps, some 10,000 at most, for that step. */
void kt_warn_of_step(kt_outcome *outcome, const kt_mode_watch *watch);

/* Fixed steps: looks, at a record, at how far velocities in loops were off after a step; warns where that was
 * KT_CORRECTION_ERROR of the velocities themselves, or more. */
#define KT_CORRECTION_ERROR 0.1
void kt_watch_correction(kt_outcome *outcome);
void kt_warn_of_correction(kt_outcome *outcome);

/* Where the energy is off by more than KT_ENERGY_ERROR, warns of it. */
void kt_warn_of_energy(kt_outcome *outcome);

/* Says at this time that the motion has blown up, and lists it. */
void kt_say_blown_up(kt_outcome *outcome, double time);

/* A few lines for people, on standard error. */
void kt_report_outcome(const kt_outcome *outcome, const char *out, const char *summary, const char *plot);

/* ---- progress ---------------------------------------------------------------------------------------------------- */

/* A bar on standard error where that is a terminal, from the first second on. */
typedef struct kt_progress {
    bool is_shown; /* may be */
    bool is_drawn; /* there is one to be cleared */
    bool has_utf8;
    double start, last; /* s, of a clock that only goes forward */
} kt_progress;

kt_progress kt_progress_start(bool quiet);
void kt_progress_update(kt_progress *progress, double done, double whole);
/* The same with words of the caller's in the place of the time; part: 0 to 1. */
void kt_progress_show(kt_progress *progress, double part, const char *words);
void kt_progress_end(kt_progress *progress);

#endif
