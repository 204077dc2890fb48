/* The private struct of an accuracy study, and the functions that the files of this folder share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STUDY_ACCURACY_H
#define KT_STUDY_ACCURACY_H

#include "kinetree/study.h"

#include <math.h>

enum {
    KT_ACCURACY_LADDER_MAX = 40,  /* points of a ladder, or given settings */
    KT_ACCURACY_POINTS_MAX = 80,  /* points of a curve, those next to goals included */
    KT_ACCURACY_EVENTS_MAX = 256, /* events of a simulation; instants of further ones are not compared */
};

/* A run whose error exceeds this part of the amplitude is unusable. */
#define KT_ACCURACY_USABLE 0.1

/* A solution at its records: rows of nq, nv, 1 and 1 numbers. */
typedef struct kt_accuracy_states {
    double *q, *v, *energy, *quantity;
} kt_accuracy_states;

/* The instants of a run so far, from the counts of events after each step. */
typedef struct kt_instant_log {
    const kt_accuracy *study;
    kt_accuracy_instant *instants; /* KT_ACCURACY_INSTANTS_MAX */
    int count;
    bool is_full;             /* more instants have occurred */
    double time;              /* s, at the end of the last step */
    uint64_t contact_changes; /* changes of hard contacts, up to that time */
    int event_count, contact_events;
    uint64_t seen[KT_ACCURACY_EVENTS_MAX]; /* counts of the events up to that time */
} kt_instant_log;

struct kt_accuracy {
    kt_accuracy_results results;
    kt_accuracy_options options;
    const kt_description *description;
    kt_run run; /* the scene's */
    kt_model *model;
    kt_absolute *absolute;   /* the absolute formulation of `model`, if the scene requests it */
    kt_model **models;       /* models of the variants, in their order; NULL until compiled */
    kt_absolute **absolutes; /* theirs; NULL if a variant does not request it */
    kt_variant own;          /* the variant if none is given */
    size_t nq, nv;

    kt_accuracy_states reference, second; /* results.records + 1 rows */
    double *difference;                   /* nv */
    double *begin;                        /* nq + nv: the initial state of the motion */
    bool has_begin;                       /* a simulation has been created, and has set it */
    double *moved;                        /* nq: a neighbouring initial position */
    kt_accuracy_curve *curves;
    kt_accuracy_point *points;
    kt_instant_log log, second_log, run_log; /* logs of the reference, of the second solution, and of the present run */
    bool *is_masked;                         /* records next to an instant: not compared */

    double started, deadline; /* s, by the clock */
    double evaluation;        /* s of clock time of one evaluation; 0: unknown */
    double reference_steps;   /* mean number of steps of the reference per second of the motion */
};

/* Seconds of the clock; 0 where there is none. */
static inline double kt_accuracy_now(const kt_accuracy *study) {
    return study->options.clock != NULL ? study->options.clock(study->options.user) : 0.0;
}

/* Calls the caller's progress function. Returns KT_ERROR_CALLBACK if the progress function stops the study. */
KT_CHECKED kt_status kt_accuracy_report(kt_accuracy *study, double done, const char *what, kt_error *error);

/* The larger of two numbers; NaN if either is NaN. */
static inline double kt_worse(double a, double b) { return b > a || isnan(b) ? b : a; }

/* ---- norm -------------------------------------------------------------------------------------------------------- */

typedef struct kt_accuracy_norm {
    double position, velocity;
} kt_accuracy_norm;

/* A state, for example that in a row of a solution. */
typedef struct kt_accuracy_state {
    const double *q, *v;
} kt_accuracy_state;

static inline kt_accuracy_state kt_accuracy_row(const kt_accuracy *study, const kt_accuracy_states *of, int64_t row) {
    return (kt_accuracy_state){of->q + (size_t)row * study->nq, of->v + (size_t)row * study->nv};
}

/* The norm of the difference of two states of a study. */
kt_accuracy_norm kt_accuracy_distance(const kt_accuracy *study, kt_accuracy_state a, kt_accuracy_state b);

/* Adds a record to the errors of a run: its distance from the reference, and its open loops. */
static inline void kt_accuracy_add(kt_accuracy_error *error, kt_accuracy_norm norm, kt_residual open) {
    error->position = kt_worse(error->position, norm.position);
    error->velocity = kt_worse(error->velocity, norm.velocity);
    error->end_position = norm.position;
    error->end_velocity = norm.velocity;
    error->constraint.position = kt_worse(error->constraint.position, open.position);
    error->constraint.velocity = kt_worse(error->constraint.velocity, open.velocity);
}

/* The unit of errors: whether a scene has angles, lengths or both. */
kt_accuracy_unit kt_accuracy_find_unit(const kt_model *model);

/* ---- guards ------------------------------------------------------------------------------------------------------ */

/* Ends a run that takes too long. Testing at records would not suffice, since a million steps may lie between two
 * records. */
typedef struct kt_accuracy_guard {
    kt_accuracy *study;
    double until;        /* s, by the clock */
    uint64_t seen, most; /* evaluations: when the clock was read last, and their limit */
    bool late;           /* the guard has ended the run */
    kt_instant_log *log; /* receives the instants of events; NULL: none */
} kt_accuracy_guard;

/* A guard with this part of the budget and this multiple of run_evaluations. */
kt_accuracy_guard kt_accuracy_guard_make(kt_accuracy *study, double part, double runs);

/* Makes the guard watch the steps of a run, whose equations remain the equations of `kinetree run`. The guard must
 * outlive the simulation. */
void kt_accuracy_guard_use(kt_accuracy_guard *guard, kt_simulation_options *options);

/* Whether a model has hard contacts, stops, slack ropes or sticking friction. */
bool kt_accuracy_has_contacts(const kt_model *model);

/* ---- events ------------------------------------------------------------------------------------------------------ */

/* A simulation of a study, with the events of the scene. */
typedef struct kt_accuracy_play {
    kt_accuracy *study;
    kt_simulation *simulation;  /* NULL: not open */
    kt_absolute_motion *motion; /* its owner in the absolute formulation; else NULL */
    void *watch;                /* memory of the events; NULL: none */
} kt_accuracy_play;

/* Creates a simulation with the events; kt_accuracy_close releases it. After an error, nothing has to be released.
 * absolute: NULL for the coordinates of the tree. */
KT_CHECKED kt_status kt_accuracy_open(kt_accuracy *study, const kt_model *model, const kt_absolute *absolute,
                                      const kt_run *run, const kt_simulation_options *options, kt_accuracy_play *play,
                                      kt_error *error);
/* Runs it from its present state (kt_simulation_run). */
KT_CHECKED kt_status kt_accuracy_play_run(kt_accuracy_play *play, kt_recorder *record, void *user, kt_error *error);
/* Releases a simulation. Parameters that events have set return to their initial values first, for the next simulation
 * of the model. */
KT_CHECKED kt_status kt_accuracy_close(kt_accuracy_play *play, kt_error *error);

/* Returns to the start, in the state q (nq) and v (nv). */
KT_CHECKED kt_status kt_accuracy_restart(kt_accuracy_play *play, const double *q, const double *v, kt_error *error);

/* Begins a log, before the first step. */
void kt_instants_start(kt_instant_log *log, const kt_simulation *simulation);
/* Adds the instants since the last call: after each step, and after the run. */
void kt_instants_watch(kt_instant_log *log, const kt_simulation *simulation);

/* Chooses the windows about the instants of a log, and masks the records within these windows. */
void kt_accuracy_mask(kt_accuracy *study, const kt_instant_log *log);

/* Sets `instant` and `missed` of an error. */
void kt_instants_compare(const kt_accuracy *study, const kt_instant_log *reference, const kt_instant_log *run,
                         kt_accuracy_error *error);

/* ---- reference --------------------------------------------------------------------------------------------------- */

/* Computes the scales, the horizon, the reference and its uncertainty. */
KT_CHECKED kt_status kt_accuracy_find_reference(kt_accuracy *study, kt_error *error);

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* The options of a run of the study: the study's duration and records, and the method at its setting. */
kt_run kt_accuracy_run(const kt_accuracy *study, const kt_method *method, bool adaptive, double setting);

/* The largest number of evaluations of one run. */
double kt_accuracy_most(const kt_accuracy *study);

/* Compiles the model of a variant, in the formulation that the variant requests. On failure *model is NULL. */
KT_CHECKED kt_status kt_accuracy_compile(const kt_accuracy *study, const kt_variant *variant, kt_model **model,
                                         kt_absolute **absolute, kt_error *error);

/* Runs once for the error and, if the run is usable, repeatedly for the time, at point->setting. Errors of the run are
 * stored in the point; a returned error ends the study. */
KT_CHECKED kt_status kt_accuracy_try(kt_accuracy *study, const kt_model *model, const kt_absolute *absolute,
                                     const kt_variant *variant, const kt_method *method, bool adaptive,
                                     kt_accuracy_point *point, kt_error *error);

/* Fills `usable` and `believed` of a point whose status and error are set. The error of a run that failed becomes
 * infinite. */
void kt_accuracy_judge(const kt_accuracy *study, kt_accuracy_point *point);

/* Computes all points of a curve, whose variant, method, `adaptive` and `first` are set; deadline: by the clock, s. */
KT_CHECKED kt_status kt_accuracy_climb(kt_accuracy *study, kt_accuracy_curve *curve, double deadline, kt_error *error);

/* ---- evaluation of the points ------------------------------------------------------------------------------------ */

/* The error of a point, at least the reference's uncertainty. */
static inline double kt_accuracy_known(const kt_accuracy *study, const kt_accuracy_point *point) {
    const double least = study->results.uncertainty.judged;
    return point->error.judged > least ? point->error.judged : least;
}

/* The value of the caller's quantity in a record; 0: the study has none. */
static inline double kt_accuracy_quantity_of(const kt_accuracy *study, const kt_record *record) {
    const kt_accuracy_quantity *quantity = study->options.quantity;
    return quantity != NULL ? quantity->evaluate(record, quantity->user) : 0.0;
}

/* Adds the items that records need for the caller's quantity. */
static inline void kt_accuracy_record_quantity(const kt_accuracy *study, kt_simulation_options *options) {
    if (study->options.quantity == NULL)
        return;
    options->record |= study->options.quantity->record;
    options->kinematics = true;
}

/* Sets the error that the study's subject selects. */
void kt_accuracy_select(const kt_accuracy *study, kt_accuracy_error *error);

/* The scale of errors: the range of the study's subject. For positions, the scale is at most 1. */
double kt_accuracy_amplitude(const kt_accuracy *study);

/* Whether a tighter tolerance needs hardly more steps than a looser tolerance, because stability determines the
 * step. */
bool kt_accuracy_is_held(const kt_accuracy_curve *curve, const kt_accuracy_point *loose,
                         const kt_accuracy_point *tight);

/* Fills a curve's slope, its spread, floor and fitted. */
void kt_accuracy_fit(const kt_accuracy *study, kt_accuracy_curve *curve);

/* Marks the points on the two Pareto fronts. */
void kt_accuracy_mark_front(kt_accuracy *study);

#endif
