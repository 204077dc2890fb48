/* Experimental. Comparisons, which no simulation needs: other reductions of the loop equations, and a work-precision
 * study. The header includes other formulations (formulation.h) and differential-algebraic baselines (dae.h). The
 * header also runs batches on several threads, because the core library has no threads. These functions form a library
 * of their own, libkinetree-study.
 *
 * An accuracy study runs a scene with every method at many steps and tolerances. The error of each run is measured
 * against a reference of known uncertainty. The cost of each run is counted and timed.
 *
 *     kt_accuracy_options options = kt_accuracy_options_default();
 *     kt_accuracy *study = NULL;
 *     options.clock = cpu_seconds;
 *     status = kt_accuracy_create(&description, &run, &options, &study, &error);
 *     if (status == KT_OK) {
 *         const int best = kt_accuracy_best(study, 1e-6);
 *         if (best >= 0)
 *             printf("step or tolerance: %g\n", kt_accuracy_results_of(study)->points[best].setting);
 *         kt_accuracy_free(study);
 *     }
 *
 * The norm of a difference between two states is the largest over all joints. The difference is
 *   for an angle, the difference on the circle, at most half a turn, rad. The angle of a screw joint counts in full,
 *     because it determines a length.
 *   for a quaternion, the angle of the rotation between the two, rad.
 *   for a length, the difference relative to the scene's length scale. This scale is the largest edge of the box that
 *     contains the joints, markers and centre of mass during the motion. In a scene without angles, lengths are in
 *     metres.
 *
 * The norm of velocities uses the rates of these. An error is the largest at any record; errors at the end are reported
 * separately.
 *
 * Sources:
 *   The work-precision diagram: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd
 *     ed., Springer 1993, II.10.
 *   Growth rates: G. Benettin, L. Galgani, J.-M. Strelcyn, Phys. Rev. A 14 (1976) 2338. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_STUDY_H
#define KINETREE_STUDY_H

#include "kinetree/batch.h"
#include "kinetree/dae.h"
#include "kinetree/formulation.h"
#include "kinetree/mechanism.h"
#include "kinetree/run.h"
#include "kinetree/sensitivity.h"
#include "kinetree/simulation.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- a batch by several threads ---------------------------------------------------------------------------------- */

/* Does a job for all states of a batch (kt_batch_compute) with `threads` threads, the calling thread included. The
 * number of threads is at most the number for which the batch was made. The threads start and end within the call. Each
 * thread computes one block after the other, and the results have the same bits for any number of threads.
 *
 * *used (may be NULL) receives the number of threads that computed. This number is below `threads` if the system does
 * not start more. The core library starts no threads, and this call is therefore not a part of it.
 *
 * Errors: those of kt_batch_compute, of the first state that failed. KT_ERROR_ARGUMENT if `threads` is below 1 or above
 * the number for which the batch was made.
 * Cost: starting a thread takes some 20 us. A job should last longer. */
KT_API KT_CHECKED kt_status kt_batch_run(kt_batch *batch, const kt_batch_job *job, size_t threads, size_t *used,
                                         kt_error *error);

/* ---- derivatives of many motions --------------------------------------------------------------------------------- */

/* A step, and the arrays that receive its derivatives; as for kt_step_derivatives. */
typedef struct kt_step_task {
    kt_step step;            /* with inputs of its own */
    const double *q, *v, *x; /* state before the step; x: auxiliary states; NULL: step.x, or the initial ones */
    double *next_q, *next_v; /* results, or NULL */
    double *next_x;          /* result, or NULL */
    double *A, *B;           /* results, or NULL */
    kt_status status;        /* result */
} kt_step_task;

/* Takes `count` steps with their derivatives (kt_step_derivatives, forward mode) on `threads` threads, the calling
 * thread included. Each thread takes one step after the other. The steps may belong to many motions, or to one motion
 * at all nodes of multiple shooting. Every step has the same bits as alone, for any number of threads.
 *
 * data and work have an entry for each thread. An entry of work has work_size bytes, the most that kt_step_work_size
 * returns for these steps. *used (may be NULL) receives the number of threads.
 *
 * Errors: that of the first step that failed; KT_ERROR_ARGUMENT as of kt_rollout_run. A failed step does not affect the
 * others, and its outputs stay unchanged. */
KT_API KT_CHECKED kt_status kt_step_run(const kt_model *model, kt_data *const *data, void *const *work,
                                        size_t work_size, size_t threads, kt_step_task *tasks, size_t count,
                                        size_t *used, kt_error *error);

/* Computes the gradients of `count` motions on `threads` threads, the calling thread included. Each thread computes one
 * group of motions after the other with kt_rollout_gradients. The size of a group is kt_rollout_width of the first
 * motion. Every motion has the same bits as alone, for any number of threads. Several threads call the cost at the same
 * time.
 *
 * data and work have an entry for each thread. An entry of work has work_size bytes: the most that
 * kt_rollout_gradients_work_size returns for these motions. If an entry has only kt_rollout_work_size bytes, motions
 * are computed one by one. *used (may be NULL) receives the number of threads that computed.
 *
 * Errors: that of the first motion that failed. KT_ERROR_ARGUMENT if `threads` is below 1 or above 256, or if a
 * thread has no entry. A failed motion does not affect the others, and its outputs stay unchanged. */
KT_API KT_CHECKED kt_status kt_rollout_run(const kt_model *model, kt_data *const *data, void *const *work,
                                           size_t work_size, size_t threads, kt_rollout_task *tasks, size_t count,
                                           kt_cost *cost, size_t *used, kt_error *error);

/* ---- other reductions, for comparison ---------------------------------------------------------------------------- */

/* Returns the name, such as "qr"; NULL for a value out of range. */
KT_API const char *kt_reduction_name(kt_reduction reduction);

/* Returns the method of a reduction, for kt_model_options. The result is NULL for QR, the default, and for any value
 * out of range. */
KT_API const kt_reduction_method *kt_reduction_method_of(kt_reduction reduction);

/* ---- accuracy study ---------------------------------------------------------------------------------------------- */

/* A variant of the computation of the same motion: options of the compilation and of the run. A study compares methods
 * in each variant of a list. */
typedef struct kt_variant {
    const char *label;                /* for output; NULL: the scene's own settings. The string belongs to the caller */
    kt_model_options model;           /* options of the compilation */
    kt_simulation_options simulation; /* method, max_steps and record are set by the study */
    kt_formulation formulation;       /* the integrated coordinates */
    bool records;                     /* the timed runs produce the scene's records; false: none */
    bool has_constraint_formulation;  /* loops are kept closed by a constraint formulation with its default options */
    kt_constraint_formulation_type constraint_formulation; /* which one */
    double gain; /* the gains of the formulation as a multiple of the default; 0: 1 */
} kt_variant;

/* Returns the variant with the settings of `run`: QR decomposition, in tree coordinates. */
KT_API kt_variant kt_variant_default(const kt_run *run);

/* A given reference: states at k * interval, k = 0 .. count - 1. */
typedef struct kt_reference {
    double interval;     /* s */
    int count;           /* at least 2 */
    const double *q, *v; /* count rows of nq positions; of nv velocities */
} kt_reference;

/* The errors that goals, curves and fronts of a study are about. */
typedef enum kt_accuracy_subject {
    KT_ACCURACY_POSITIONS = 0, /* of positions, in the norm above */
    KT_ACCURACY_VELOCITIES,    /* of velocities, in that norm */
    KT_ACCURACY_QUANTITY,      /* of a quantity of the caller */
} kt_accuracy_subject;

/* A quantity of the caller: a number of each record, such as a reaction. */
typedef struct kt_accuracy_quantity {
    unsigned record;                                         /* KT_RECORD_ bits that evaluate reads */
    double (*evaluate)(const kt_record *record, void *user); /* the record's model may be that of a variant */
    void *user;                                              /* for evaluate */
} kt_accuracy_quantity;

/* The events of a scene, which every simulation of a study has. A function that fails ends the study. */
typedef struct kt_accuracy_events {
    int count; /* the number of events that `add` adds (kt_simulation_options.events) */
    /* Adds the events to a new simulation of the model. *watch receives their memory. */
    kt_status (*add)(kt_simulation *simulation, const kt_model *model, void **watch, void *user, kt_error *error);
    /* Called after each kt_simulation_set_state, which returns to the start: returns parameters that events have set to
     * their initial values. NULL: events set none. */
    kt_status (*restart)(void *watch, const kt_simulation *simulation, kt_error *error);
    void (*release)(void *watch); /* releases the memory, after the simulation */
    void *user;                   /* for add */
} kt_accuracy_events;

/* The scope of a study, and its cost. */
typedef struct kt_accuracy_options {
    size_t size;                     /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    double duration;                 /* s; 0: that of the run */
    int records;                     /* number of intervals at whose ends errors are measured; a given reference
                                        determines its own */
    const kt_method *const *methods; /* NULL: all built-in methods */
    int method_count;                /* length of methods */
    const double *steps;             /* s, of methods without error estimate; NULL: chosen */
    int step_count;                  /* length of steps */
    const double *tolerances;        /* of adaptive methods; NULL: chosen */
    const double *goals;             /* errors of interest: settings are refined until they just reach each of them */
    int goal_count;                  /* length of goals; 0: none */
    int tolerance_count;             /* length of tolerances */
    const kt_variant *variants;      /* every method is run in each; NULL: in the scene's own settings */
    int variant_count;               /* length of variants */
    const kt_variant *own;           /* the scene's own settings; NULL: kt_variant_default of the run */
    const kt_reference *reference;   /* NULL: computed */
    kt_accuracy_subject subject;     /* the errors that goals are about */
    const kt_accuracy_quantity *quantity; /* with KT_ACCURACY_QUANTITY, which needs a computed reference */
    const kt_accuracy_events *events;     /* of the scene; NULL: none */
    bool contact_steps;                   /* the last curve of each variant is time stepping (KT_CONTACT_STEPS), in
                                             addition to the methods; for scenes with hard contacts */
    uint64_t run_evaluations;             /* the largest number of evaluations of one run */
    double amplification;                 /* the study ends where a small error has grown by this factor */

    /* The library has no clock of its own. clock returns monotonic seconds, preferably of processor time. NULL: nothing
     * is timed, and the budget is ignored. The cheapest run is then the one with the fewest evaluations. */
    double (*clock)(void *user);

    double budget; /* s of clock time for the whole study */
    /* Called before each run with the part that is done (0 to 1) and a name of the next run. Returns 0 to continue.
     * NULL: none. */
    int (*progress)(double done, const char *what, void *user);
    void *user; /* for clock and progress */
} kt_accuracy_options;

/* All methods, automatic steps and tolerances, 200 records, 2e6 evaluations per run. The amplification is 1e6, the
 * budget 20 s, and there is no clock. */
static inline kt_accuracy_options kt_accuracy_options_default(void) {
    kt_accuracy_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.records = 200;
    options.run_evaluations = 2000000;
    options.amplification = 1e6;
    options.budget = 20.0;
    return options;
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* The differences of a run from the reference. */
typedef struct kt_accuracy_error {
    double position, velocity;         /* the largest over all records, in the norm above */
    double end_position, end_velocity; /* at the end */
    double energy;                     /* J, the largest difference from the reference's total energy */
    double quantity;                   /* of options.quantity, the largest over all records; 0 without it */
    double judged;                     /* of the study's subject: position, velocity or quantity */
    double instant;                    /* s, the largest error of the instant of an event */
    int missed;                        /* instants of the reference without a partner in the run, and vice versa */
    kt_residual constraint;            /* the largest at any record */
} kt_accuracy_error;

/* One run. */
typedef struct kt_accuracy_point {
    double setting;              /* step, s, or tolerance (relative = absolute) */
    kt_status status;            /* of the run; if it is not KT_OK, the rest describes the part of the run before the
                                    failure */
    bool late;                   /* the run was ended, since it took more than its share of the budget or of the
                                    evaluations */
    kt_status verdict;           /* kt_constraint_formulation_verdict after the run, if a formulation is used */
    bool usable;                 /* the run reached its end, with an error below a tenth of the subject's range */
    bool believed;               /* the error exceeds the reference's uncertainty; otherwise the error is below that
                                    uncertainty */
    bool cheapest, fewest;       /* on the Pareto front of error and time, or of error and evaluations */
    kt_accuracy_error error;     /* infinite if the run failed */
    kt_simulation_counts counts; /* of a run without records */
    double cpu;                  /* s, the least of the repeated runs; NaN without a clock */
    double spread;               /* median over least of these times, minus one */
    int repeats;                 /* how often it was run */
} kt_accuracy_point;

/* Why a curve has no further point. X(id, text) */
#define KT_ACCURACY_END_LIST(X)                                                                                        \
    X(KT_ACCURACY_LISTED, "all settings were run")                                                                     \
    X(KT_ACCURACY_FLOOR, "the error stopped falling")                                                                  \
    X(KT_ACCURACY_REFERENCE, "the error reached the reference's uncertainty")                                          \
    X(KT_ACCURACY_LENGTH, "the next run would be too long")                                                            \
    X(KT_ACCURACY_BUDGET, "the time was used up (--budget)")                                                           \
    X(KT_ACCURACY_FAILED, "the next run failed")                                                                       \
    X(KT_ACCURACY_UNUSABLE, "no setting came near the motion")                                                         \
    X(KT_ACCURACY_UNSUPPORTED, "the method cannot run this scene")

/* Why a curve has no further point. */
typedef enum kt_accuracy_end {
#define KT_ACCURACY_END_ENUM(id, text) id,
    KT_ACCURACY_END_LIST(KT_ACCURACY_END_ENUM)
#undef KT_ACCURACY_END_ENUM
} kt_accuracy_end;

/* One method in one variant: points by decreasing setting. */
typedef struct kt_accuracy_curve {
    int variant;             /* index of the variant */
    const kt_method *method; /* the method */
    bool adaptive;           /* settings are tolerances, not steps */
    int first, count;        /* the first point and the number of points */
    int fitted;              /* points of the asymptotic range, to which `slope` is fitted; 0: too few for a fit */
    double slope; /* d log(error) / d log(setting): the order, or for tolerances the proportionality, ideally 1 */
    double slope_spread; /* the standard error of the slope */
    double floor;        /* the error at which it stops falling; NaN: not reached */
    double stable_step;  /* s, the largest stable step, if stability and not accuracy bounds it; else 0 */
    kt_accuracy_end end; /* why the curve has no further point */
} kt_accuracy_curve;

/* Why the study ends before the requested duration. */
typedef enum kt_accuracy_cut {
    KT_ACCURACY_WHOLE = 0,    /* it does not end early */
    KT_ACCURACY_GROWTH,       /* small errors have grown by the factor options.amplification: chaos */
    KT_ACCURACY_DISAGREEMENT, /* the two reference solutions diverge */
    KT_ACCURACY_LATE,         /* the reference would take too long */
    KT_ACCURACY_STOPPED,      /* an event ends the run */
    KT_ACCURACY_CROWDED,      /* there are more than KT_ACCURACY_INSTANTS_MAX instants of events */
} kt_accuracy_cut;

/* The unit of errors in position. */
typedef enum kt_accuracy_unit {
    KT_ACCURACY_RADIAN = 0, /* angles only, rad */
    KT_ACCURACY_METRE,      /* lengths only, m */
    KT_ACCURACY_MIXED,      /* angles, and lengths over the length scale */
} kt_accuracy_unit;

/* The largest number of instants of events that a study compares. */
enum { KT_ACCURACY_INSTANTS_MAX = 2000 /* instants of events */ };

/* The instant of an event of the scene, or of an event of a hard contact, stop, slack rope or sticking friction
 * (kt_simulation_event_name). A contact has an instant whenever it closes, opens, sticks, slips or bounces. */
typedef struct kt_accuracy_instant {
    double time;   /* s */
    char name[56]; /* the name of the event; a longer one is cut */
} kt_accuracy_instant;

/* The results of a study. The arrays belong to the study. */
typedef struct kt_accuracy_results {
    double asked, duration;      /* s: requested; studied */
    kt_accuracy_cut cut;         /* why they differ, if they do */
    double interval;             /* s between records */
    int records;                 /* intervals */
    kt_accuracy_unit unit;       /* of errors in position */
    double length;               /* m, the length scale */
    double amplitude;            /* of the motion, in the norm: the largest distance from the initial state */
    kt_accuracy_subject subject; /* of error.judged */
    /* Of the subject: the amplitude, the largest speed in the norm, or the largest value of the quantity minus its
     * least one. If the quantity changes by less than a millionth of its magnitude, the range is the magnitude. */
    double range;
    double absolute_scale; /* absolute tolerances over relative ones: 1, or less if the amplitude is far below 1 */
    double amplification;  /* the largest growth factor of a small error up to the end of the study */
    double growth;         /* 1/s, log(amplification) / duration */

    const kt_method *reference;                  /* method of the reference; NULL: the reference was given */
    const kt_method *check;                      /* method of the second solution */
    double reference_tolerance, check_tolerance; /* of the two */
    double check_step; /* s: the longest step of the check, a hundredth of the shortest feature of functions of time,
                          or the limit that a tenth of the budget allows; 0: no limit */
    kt_accuracy_error uncertainty; /* the difference of the two solutions */

    /* Errors are measured outside of windows about the instants of events. Velocities jump there, and the jump of a run
     * comes earlier or later than that of the reference. Instants of equal names are compared in their order. */
    const kt_accuracy_instant *instants; /* of the reference, in the order of time */
    int instant_count;                   /* length of instants */
    double window;                       /* s: records no further from an instant are left out */
    int left_out;                        /* the number of these records */

    const kt_variant *variants;      /* the variants of the options */
    int variant_count;               /* length of variants */
    const kt_accuracy_curve *curves; /* one per method and variant */
    int curve_count;                 /* length of curves */
    const kt_accuracy_point *points; /* of all curves */
    int point_count;                 /* length of points */
} kt_accuracy_results;

/* ---- the study --------------------------------------------------------------------------------------------------- */

/* A study: its runs, its reference, its results. */
typedef struct kt_accuracy kt_accuracy;

/* Performs the whole study; kt_accuracy_free releases it. options may be NULL. A run that fails becomes a point of the
 * study and is not an error of the call.
 * Errors: those of kt_model_compile and kt_simulation_create; KT_ERROR_ARGUMENT (an option, a scene in which nothing
 * moves); KT_ERROR_CALLBACK (the progress function stopped the study); the error that stopped the reference. */
KT_API KT_CHECKED kt_status kt_accuracy_create(const kt_description *description, const kt_run *run,
                                               const kt_accuracy_options *options, kt_accuracy **study,
                                               kt_error *error);
/* Releases a study; NULL is allowed. */
KT_API void kt_accuracy_free(kt_accuracy *study);

/* Returns the results, valid until the study is released. */
KT_API const kt_accuracy_results *kt_accuracy_results_of(const kt_accuracy *study);

/* Returns the model of the scene, compiled with the scene's own settings. */
KT_API const kt_model *kt_accuracy_model(const kt_accuracy *study);

/* The size of a difference of two states: the largest angle or rotation, and the largest length. Differences of
 * positions are in rad and m, differences of velocities in rad/s and m/s. */
typedef struct kt_difference {
    double angle, length; /* the largest change of an angle, rad or rad/s, and of a length, m or m/s */
} kt_difference;

/* Measures a difference of positions (kt_position_subtract) or of velocities, of nv numbers. Angles are measured on the
 * circle. Numbers of a joint that form one vector count by its length. A number that is not finite gives NaN, and so
 * does NULL. */
KT_API kt_difference kt_difference_size(const kt_model *model, const double *difference, bool of_velocities);

/* Returns the index of the cheapest point that reaches a goal; -1: none. The error of this point (error.judged),
 * including the reference's uncertainty, is at most `goal`, and so are the errors of all tighter settings of its curve
 * that ran to the end. A setting whose error is small by chance does not count. */
KT_API int kt_accuracy_best(const kt_accuracy *study, double goal);

/* The same for one curve: `count` points by decreasing setting, of this study or of another program. Returns the index
 * in `points`. */
KT_API int kt_accuracy_best_of(const kt_accuracy *study, const kt_accuracy_point *points, int count, double goal);

/* Makes one more run, of any variant, like those of the study, and writes its point. Errors: as kt_accuracy_create. */
KT_API KT_CHECKED kt_status kt_accuracy_measure(kt_accuracy *study, const kt_variant *variant, const kt_method *method,
                                                bool adaptive, double setting, kt_accuracy_point *point,
                                                kt_error *error);

/* Compares a run of another program with the study's reference. `poses` has a row for each record, from the start on
 * (results.records + 1). A row has seven numbers for each body of the model but the world, in the model's order: the
 * origin of its frame (m, world axes) and the quaternion w, x, y, z of its rotation.
 * Sets point->status, usable, believed and error.position and end_position; other errors are NaN. If a number is not
 * finite, or a quaternion is zero, the status is KT_ERROR_STEP and the error infinite.
 * Errors: those of kt_absolute_create; KT_ERROR_MEMORY. */
KT_API KT_CHECKED kt_status kt_accuracy_compare(kt_accuracy *study, const double *poses, kt_accuracy_point *point,
                                                kt_error *error);

/* A run of a differential-algebraic baseline, against the study's reference. */
typedef struct kt_accuracy_baseline {
    kt_status status;        /* of the run; if it is not KT_OK, the rest describes the part before the failure */
    kt_accuracy_error error; /* as of a point */
    double multiplier;       /* the largest error of a multiplier at a record, over the largest of the reference */
    double condition;        /* of Newton's matrix, at the last step */
    double step;             /* s, as taken */
    kt_dae_counts counts;    /* of the run */
} kt_accuracy_baseline;

/* Runs a baseline over the study's duration, in tree or absolute coordinates. The step divides the interval of its
 * records and is at most `step`. Errors: those of kt_dae_create and kt_absolute_create. */
KT_API KT_CHECKED kt_status kt_accuracy_measure_baseline(kt_accuracy *study, const kt_dae_options *options,
                                                         kt_formulation formulation, double step,
                                                         kt_accuracy_baseline *baseline, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
