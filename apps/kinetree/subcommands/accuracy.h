/* Declarations shared by the files of `kinetree accuracy`. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SUBCOMMANDS_ACCURACY_H
#define KT_COMMAND_SUBCOMMANDS_ACCURACY_H

#include "command.h"

#include "kinetree/study.h"

#include "plot/size.h"
#include "records/columns.h"
#include "subcommands/accuracy_peers.h"

enum {
    KT_ACCURACY_GOALS_MAX = 6,
    KT_ACCURACY_SETTINGS_MAX = 40,
    KT_ACCURACY_METHODS_MAX = 64,
    KT_COMPARED_FORMULATIONS = 7,
};

typedef struct kt_accuracy_along kt_accuracy_along; /* a study among others along a parameter */

/* ---- the command line -------------------------------------------------------------------------------------------- */

typedef struct kt_accuracy_arguments {
    const char *integrator_list, *step_list, *tolerance_list, *goal_list; /* as given; NULL: not given */
    double duration, budget;
    kt_settings settings, vary;
    kt_accuracy_along *along; /* NULL: a single study */
    const char *of, *reference, *out, *plot, *plot_dark;
    const char *size;
    bool prices, formulations, baselines, peers, all, name_settings, dark, quiet;
    kt_plot_size picture_size;

    /* The parsed lists. */
    const kt_method *methods[KT_ACCURACY_METHODS_MAX];
    double steps[KT_ACCURACY_SETTINGS_MAX], tolerances[KT_ACCURACY_SETTINGS_MAX], goals[KT_ACCURACY_GOALS_MAX];
    bool has_steps;                                            /* --integrators has time stepping */
    int method_count, step_count, tolerance_count, goal_count; /* 0: not given; goals have a default */
} kt_accuracy_arguments;

/* ---- a reference from a file ------------------------------------------------------------------------------------- */

typedef struct kt_reference_file {
    kt_reference reference;
    double *states; /* the states of the reference; released with free */
} kt_reference_file;

/* Reads the records of a run up to `duration` (NaN: all of them) as a reference. Returns -1 on success, else an exit
 * code after printing the error. */
int kt_reference_read(const char *path, const kt_model *model, double duration, kt_reference_file *file);

/* ---- the errors that a study is about ---------------------------------------------------------------------------- */

/* Positions, velocities or a column. The quantity of a column refers to this struct, which must not move. */
typedef struct kt_study_subject {
    kt_accuracy_subject of;
    kt_accuracy_quantity quantity; /* the quantity of a column */
    kt_columns columns;            /* columns, of which the last is the studied one */
    kt_scene scene;                /* the scene with this column as its only own one */
    kt_scene_column column;
    char name[200], unit[32];
} kt_study_subject;

/* Reads --of (NULL: not given). Returns -1, or an exit code after printing the error. kt_study_subject_close releases
 * the subject in any case. */
int kt_study_subject_open(kt_study_subject *subject, const char *of, const kt_scene *scene, const kt_model *model);
void kt_study_subject_close(kt_study_subject *subject);

/* ---- events and hard contacts ------------------------------------------------------------------------------------ */

/* Returns the events of a scene for its study. The scene must outlive the study. */
kt_accuracy_events kt_study_events(const kt_scene *scene);

/* The name of time stepping in --integrators and in the tables. */
#define KT_STEPS_NAME "steps"

/* ---- formulations to compare ------------------------------------------------------------------------------------- */

/* Write the formulations of --formulations (KT_COMPARED_FORMULATIONS variants), and the default methods. The second
 * function returns the number of methods. */
void kt_compared_formulations(const kt_scene *scene, kt_variant *variants);
int kt_compared_methods(const kt_method **methods);

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* All that is printed, drawn and written. */
typedef struct kt_findings {
    const kt_accuracy_arguments *arguments;
    kt_accuracy *study;
    const kt_accuracy_results *results;
    const kt_scene *scene;
    const char *name; /* the scene's name, or the file's if it has none */
    const kt_study_subject *subject;
    const kt_peers *peers; /* other engines; NULL: not asked for */
} kt_findings;

/* Unit of the errors. For positions, it is "m" if all coordinates are lengths, else "rad" (lengths are divided by the
 * length scale). "": the unit of a column is not known. */
const char *kt_findings_unit(const kt_findings *findings);
/* Writes "Position error", "Velocity error" or "Error of COLUMN". */
void kt_findings_title(const kt_findings *findings, char *text, size_t size);
/* Writes "step 1e-3 s" or "tolerance 3e-8". */
void kt_findings_setting(const kt_accuracy_curve *curve, const kt_accuracy_point *point, char *text, size_t size);
/* Returns the name of the method of a curve, as --integrators takes it. */
const char *kt_findings_method(const kt_accuracy_curve *curve);
/* Returns the curve that contains a point. */
const kt_accuracy_curve *kt_findings_curve(const kt_findings *findings, int point);

/* Prints the tables and sentences on standard output. */
void kt_findings_print(const kt_findings *findings);
/* Print the instants of events of the reference, and the table of their errors at the recommended settings. Without
 * events, both print nothing. */
void kt_findings_print_instants(const kt_findings *findings);
void kt_findings_print_instant_errors(const kt_findings *findings);
/* Prints the cost of variants of the simulation (other reduction, metric, plan, formulation, no projection) at one
 * point. Returns an exit code. */
int kt_findings_print_prices(const kt_findings *findings);
/* Prints the table of --formulations instead of the other tables: every formulation at one setting of each method, with
 * a sentence on its errors. Returns an exit code. */
int kt_findings_print_formulations(const kt_findings *findings);
/* Prints only the table of --baselines: differential-algebraic formulations with implicit methods. Returns an exit
 * code. */
int kt_findings_print_baselines(const kt_findings *findings);
/* Writes every point as CSV. Returns an exit code. */
int kt_findings_write(const kt_findings *findings, const char *path);
/* Draws the work-precision diagram. Returns an exit code. */
int kt_findings_draw(const kt_findings *findings, const char *path, bool is_dark);

/* ---- along a parameter ------------------------------------------------------------------------------------------- */

/* Makes a study of a scene, with the settings of the arguments; returns an exit code. */
typedef int kt_accuracy_study(const kt_accuracy_arguments *arguments, const char *path, const char *base);

/* Runs the studies of --vary: one for each value, and a line of CSV for each in --out. Returns an exit code. */
int kt_accuracy_study_all(const kt_accuracy_arguments *arguments, kt_accuracy_study *study, const char *path,
                          const char *base);
/* Writes the line of a study, in place of its report. Returns an exit code. findings: NULL if the study failed. */
int kt_accuracy_along_line(kt_accuracy_along *along, const kt_findings *findings);

#endif
