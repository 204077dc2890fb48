/* The inside of an accuracy study, for the files of this folder. */
#ifndef KT_STUDY_ACCURACY_H
#define KT_STUDY_ACCURACY_H

#include "kinetree/study.h"

enum {
    KT_ACCURACY_POINTS_MAX = 40, /* of a curve */
};

/* A run whose error is above this part of the amplitude says nothing. */
#define KT_ACCURACY_USABLE 0.1

/* The reference at its records; rows of nq, nv and one. */
typedef struct kt_accuracy_states {
    double *q, *v, *energy;
} kt_accuracy_states;

struct kt_accuracy {
    kt_accuracy_results results;
    kt_accuracy_options options;
    const kt_description *description;
    kt_run run; /* the scene's */
    kt_model *model;
    kt_model **models; /* of the variants, in turn; NULL while not compiled */
    kt_variant own;    /* the variant where none are given */
    size_t nq, nv;

    kt_accuracy_states reference, second; /* results.records + 1 rows */
    double *difference;                   /* nv */
    double *begin;                        /* nq + nv: where the motion begins */
    double *moved;                        /* nq: a neighbour of it */
    kt_accuracy_curve *curves;
    kt_accuracy_point *points;

    double started, deadline; /* of the clock */
    double evaluation;        /* s of the clock that one takes; 0: unknown */
    double reference_steps;   /* mean number a second */
};

/* Seconds of the clock; 0 where there is none. */
static inline double kt_accuracy_now(const kt_accuracy *study) {
    return study->options.clock != NULL ? study->options.clock(study->options.user) : 0.0;
}

/* Tells what comes next. KT_ERROR_CALLBACK: stop. */
KT_CHECKED kt_status kt_accuracy_tell(kt_accuracy *study, double done, const char *what, kt_error *error);

/* ---- norm -------------------------------------------------------------------------------------------------------- */

typedef struct kt_accuracy_norm {
    double position, velocity;
} kt_accuracy_norm;

/* The norm of the difference of two states; dv: nv numbers of scratch. */
kt_accuracy_norm kt_accuracy_distance(const kt_model *model, double length, const double *q, const double *v,
                                      const double *q_other, const double *v_other, double *dv);

/* Whether a scene has angles, lengths or both. */
kt_accuracy_unit kt_accuracy_find_unit(const kt_model *model);

/* ---- guards ------------------------------------------------------------------------------------------------------ */

/* Ends a run that takes too long, wherever it is: records alone cannot, for there may be a million steps between two.
 */
typedef struct kt_accuracy_guard {
    kt_accuracy *study;
    double until;               /* of the clock */
    uint64_t evaluations, most; /* done, and the most */
    bool late;                  /* it has ended the run */
} kt_accuracy_guard;

/* For a part of the budget, and this many times run_evaluations. */
kt_accuracy_guard kt_accuracy_guard_make(kt_accuracy *study, double part, double runs);

/* Makes it the right-hand side, with the engine's behind it. It must outlive the simulation. */
void kt_accuracy_guard_use(kt_accuracy_guard *guard, kt_simulation_options *options);

/* ---- reference --------------------------------------------------------------------------------------------------- */

/* Finds scales, horizon, reference and its uncertainty. */
KT_CHECKED kt_status kt_accuracy_find_reference(kt_accuracy *study, kt_error *error);

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* The options that a run of the study has: the study's duration and records, the method at its setting, and the limit
 * on its length. */
kt_run kt_accuracy_run(const kt_accuracy *study, const kt_variant *variant, const kt_method *method, bool adaptive,
                       double setting);

/* How many evaluations one run may take now. */
double kt_accuracy_most(const kt_accuracy *study);

/* Runs once for the error and, if it is usable, repeatedly for the time. Errors of the run are in the point; those
 * returned end the study. */
KT_CHECKED kt_status kt_accuracy_try(kt_accuracy *study, const kt_model *model, const kt_variant *variant,
                                     const kt_method *method, bool adaptive, double setting, kt_accuracy_point *point,
                                     kt_error *error);

/* All points of a curve, which has its variant, method, `adaptive` and `first`; deadline: of the clock. */
KT_CHECKED kt_status kt_accuracy_climb(kt_accuracy *study, kt_accuracy_curve *curve, double deadline, kt_error *error);

/* ---- what the points say ----------------------------------------------------------------------------------------- */

/* An error as far as it is known: not below the reference's uncertainty. */
static inline double kt_accuracy_known(const kt_accuracy *study, const kt_accuracy_point *point) {
    const double least = study->results.uncertainty.position;
    return point->error.position > least ? point->error.position : least;
}

/* The motion's amplitude, not above 1: what errors are held against. */
double kt_accuracy_amplitude(const kt_accuracy *study);

/* Whether the steps at a tighter tolerance are as many as at a looser one: stability has chosen them. */
bool kt_accuracy_is_held(const kt_accuracy_curve *curve, const kt_accuracy_point *loose,
                         const kt_accuracy_point *tight);

/* Fills a curve's slope, floor and fitted. */
void kt_accuracy_fit(const kt_accuracy *study, kt_accuracy_curve *curve);

/* Marks the points on the two fronts. */
void kt_accuracy_mark_front(kt_accuracy *study);

#endif
