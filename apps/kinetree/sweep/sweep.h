/* Many runs of one scene. plan.c lists the runs, one.c computes one of them, and runs.c computes all of them in
 * several threads. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SWEEP_SWEEP_H
#define KT_COMMAND_SWEEP_SWEEP_H

#include "command.h"
#include "native/native.h"
#include "records/extremes.h"
#include "text/arguments.h"
#include "text/bytes.h"

#include "kinetree/batch.h"
#include "kinetree/ensemble.h"
#include "kinetree/scene.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* ---- random numbers ---------------------------------------------------------------------------------------------- */

/* SplitMix64, a bijection of 64 bits. The numbers of x, x + KT_MIX_STEP, ... are random. Source: Steele, Lea, Flood
 * 2014, "Fast splittable pseudorandom number generators". */
#define KT_MIX_STEP UINT64_C(0x9E3779B97F4A7C15)
uint64_t kt_mix_bits(uint64_t x);

/* ---- which runs -------------------------------------------------------------------------------------------------- */

typedef enum kt_sample { KT_SAMPLE_GRID = 0, KT_SAMPLE_SOBOL, KT_SAMPLE_LATIN } kt_sample;
typedef enum kt_draw { KT_DRAW_UNIFORM = 0, KT_DRAW_NORMAL, KT_DRAW_LOGNORMAL } kt_draw;

enum { KT_SWEEP_AXES_MAX = 32 };

/* A value of the scene that runs differ in. */
typedef struct kt_axis {
    char *path;           /* as of --set: "L", "bodies.arm.mass" */
    bool is_angle;        /* given with a unit; values are in radians */
    bool has_plain;       /* some value other than zero has no unit */
    bool is_random;       /* drawn anew for each run */
    kt_draw draw;         /* random: its distribution */
    double a, b;          /* random: its numbers; of a range: its ends */
    bool is_logarithmic;  /* the range has equal ratios */
    double *values;       /* values of a list or a table; NULL: a range */
    int64_t count;        /* number of values, or of points of the range; 0: not given */
    int64_t *permutation; /* order of the strata of a Latin hypercube */
} kt_axis;

typedef struct kt_sweep_plan {
    kt_axis axes[KT_SWEEP_AXES_MAX];
    int count;
    kt_sample sample;
    bool is_table;   /* axes are read row by row */
    int64_t points;  /* points of the grid, the sample or the table */
    int64_t repeats; /* runs of each point, with different random values */
    uint64_t seed;
    const char *const *columns; /* NULL at the end: those of all lines besides the values, which follow the first one */
} kt_sweep_plan;

typedef struct kt_sweep_arguments {
    kt_settings settings, vary, random;
    const char *sample, *from, *columns, *functionals, *out, *keep, *shard;
    long repeats, seed, jobs;
    bool merge, resume, quiet, one_by_one, native;
} kt_sweep_arguments;

/* Makes the plan of the options. A parameter with the name of one of the columns keeps its section, so that the names
 * of all columns are unique. Returns -1, or an exit code after printing the error. Call kt_sweep_plan_free in any
 * case. */
int kt_sweep_plan_make(const kt_sweep_arguments *arguments, const char *const *columns, kt_sweep_plan *plan);
void kt_sweep_plan_free(kt_sweep_plan *plan);
static inline int64_t kt_sweep_plan_runs(const kt_sweep_plan *plan) { return plan->points * plan->repeats; }

/* Returns -1 if something in the scene uses every parameter that varies, else an exit code after printing the error. */
int kt_sweep_plan_check(const kt_sweep_plan *plan, const kt_scene *scene);

/* The values of all axes in a run, which depend on the plan and the number of the run alone. */
void kt_sweep_plan_values(const kt_sweep_plan *plan, int64_t run, double *values);
/* Returns the run, among the first million, in which the value of an axis is largest in magnitude. */
int64_t kt_sweep_plan_largest(const kt_sweep_plan *plan, int axis);

/* Begins the first line of a file of lines: the first `count` columns, and the values. */
void kt_sweep_plan_head(const kt_sweep_plan *plan, int count, kt_bytes *line);

/* Begins the line of a run: its number and its values, with a comma behind each. */
void kt_sweep_plan_start(const kt_sweep_plan *plan, int64_t run, const double *values, kt_bytes *line);

/* Adds a cell after others: a number with 17 digits. A number that has none is an empty cell. */
void kt_sweep_put_cell(kt_bytes *line, double value);

/* Adds these values to the settings of a scene. Angles have their unit, which the scene checks. The texts are those of
 * the new settings. */
typedef struct kt_sweep_texts {
    char text[KT_SWEEP_AXES_MAX][600];
} kt_sweep_texts;
void kt_sweep_plan_set(const kt_sweep_plan *plan, const double *values, kt_sweep_texts *texts, kt_settings *settings);

/* Returns coordinate `axis`, which is below KT_SOBOL_AXES, of point `index` of Sobol's sequence, in [0, 1)
 * (sobol.c). */
enum { KT_SOBOL_AXES = 16 };
double kt_sobol(int axis, uint64_t index);

/* ---- one run ----------------------------------------------------------------------------------------------------- */

/* Functionals of a column over the records of a run: X(id, name). mean, rms and integral use the trapezoidal rule over
 * time. */
#define KT_FUNCTIONAL_LIST(X)                                                                                          \
    X(END, end)                                                                                                        \
    X(MIN, min)                                                                                                        \
    X(MAX, max)                                                                                                        \
    X(MEAN, mean)                                                                                                      \
    X(RMS, rms)                                                                                                        \
    X(INTEGRAL, integral)

#define KT_FUNCTIONAL_ID(id, name) KT_FUNCTIONAL_##id,
typedef enum kt_functional { KT_FUNCTIONAL_LIST(KT_FUNCTIONAL_ID) KT_FUNCTIONALS } kt_functional;

/* The data that all runs share. */
typedef struct kt_sweep {
    const kt_sweep_arguments *arguments;
    kt_sweep_plan plan;
    const char *path;
    char *text; /* text of the scene */
    size_t size;
    struct kt_sweep_column {
        char *name, *unit;
    } * columns; /* columns of the records of which lines have extremes */
    size_t column_count;
    kt_functional functionals[KT_FUNCTIONALS]; /* functionals of each of these columns, in this order */
    int functional_count;
    char **events; /* names of the events that lines count */
    size_t event_count;
    bool is_absolute;      /* the scene's formulation; its runs are simulated one after the other */
    kt_native_file native; /* --native: the file of the first run; without a library: none */
} kt_sweep;

/* The data that a thread keeps from run to run. If runs differ only in numbers, these are replaced in the scene. A
 * struct of zeros is an empty worker. */
typedef struct kt_sweep_worker {
    kt_scene scene;
    bool has_scene;
    int64_t runs, anew;      /* lines, and those of them for which the scene was read */
    int64_t unmade;          /* lines of runs without a simulation */
    int64_t natively;        /* lines whose runs took the file of --native */
    uint64_t computed, left; /* accelerations of these runs by the file, and by the library */
    int64_t together;        /* lines whose runs were computed in lanes */
    size_t width;            /* lanes in which these runs were computed */
    const char *alone;       /* why others were not; NULL: all were */
    char why[KT_WHERE_SIZE]; /* place where more than a number follows from a value that varies; "": nowhere */
} kt_sweep_worker;

void kt_sweep_worker_free(kt_sweep_worker *worker);

/* The result of a run. */
typedef struct kt_sweep_result {
    char *line;      /* with its newline; NULL: not enough memory */
    int code;        /* kt_exit_code */
    double *records; /* with --keep: the time and the columns of the lines, row by row; NULL: none */
    size_t rows, room;
} kt_sweep_result;

void kt_sweep_result_free(kt_sweep_result *result);

/* The columns of the lines besides the values. Columns of events and records follow the first KT_SWEEP_LEADING. */
extern const char *const kt_sweep_line_columns[];
enum { KT_SWEEP_LEADING = 6 };
#define KT_SWEEP_WHY "why"

extern const char *const kt_sweep_functional_names[KT_FUNCTIONALS];
double kt_sweep_functional_of(const kt_extreme *of, kt_functional which);

/* Reads --functionals. Returns -1, or an exit code after printing the error. */
int kt_sweep_list_functionals(kt_sweep *sweep);

/* The first line, which the caller frees; NULL: not enough memory. */
char *kt_sweep_header(const kt_sweep *sweep);

/* A run that has been prepared; NULL: not enough memory. Results do not depend on earlier runs of the worker. */
typedef struct kt_sweep_run kt_sweep_run;
kt_sweep_run *kt_sweep_begin(const kt_sweep *sweep, kt_sweep_worker *worker, int64_t number);
int64_t kt_sweep_number(const kt_sweep_run *run);
/* The model; NULL: the run has none, since its scene is wrong. */
const kt_model *kt_sweep_model(const kt_sweep_run *run);
/* Fills in the run's simulation, whose records the run receives as the user. Returns false if there is none to run. */
bool kt_sweep_member(kt_sweep_run *run, kt_ensemble_member *member);
/* Returns the result after the simulation has ended with this status and error, and releases the run. */
kt_sweep_result kt_sweep_end(kt_sweep_run *run, kt_status status, const kt_error *error);

/* All three, by itself. */
kt_sweep_result kt_sweep_one(const kt_sweep *sweep, kt_sweep_worker *worker, int64_t number);

/* Makes the file of --native from the first run. If the library is faster, there is no file. Returns -1, or an exit
 * code after printing the error. */
int kt_sweep_make_native(kt_sweep *sweep, const kt_scene *scene, const kt_model *model);

/* Finds the columns of the first run whose scene is right; an exit code after printing the errors of the scene, -1
 * if there are none. */
int kt_sweep_list_columns(kt_sweep *sweep);
void kt_sweep_free(kt_sweep *sweep);

/* ---- all of them ------------------------------------------------------------------------------------------------- */

/* Takes the result of a run. Any thread may call it, one at a time. Returns 0 to continue. */
typedef int kt_sweep_sink(void *user, int64_t run, const kt_sweep_result *result);

/* Computes the runs first, first + 1, ... before `end` in several threads, and passes their lines to the sink in
 * this order. *all receives the sums of the threads' counts. Returns 0, or -1 if the sink stopped or memory or
 * threads ran out. */
int kt_sweep_run_all(const kt_sweep *sweep, int64_t first, int64_t end, int threads, kt_sweep_sink *sink, void *user,
                     kt_sweep_worker *all);

/* Requests a confirmation of more than 100,000 runs, with the expected time, if standard input and standard error
 * are terminals. Otherwise, it prints the number of runs. With --quiet, it does nothing. threads: 0 for the
 * processes of MPI, which need no confirmation. Returns -1 to start, else an exit code after printing the reason. */
int kt_sweep_confirm(const kt_sweep *sweep, int64_t first, int64_t end, int threads);

#endif
