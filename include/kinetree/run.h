/* A run: the settings of a simulation, and the plan, which lists the computations that follow from these settings.
 *
 *     kt_run run = kt_run_default();
 *     run.duration = 10.0;
 *     status = kt_run_check(&run, &error);
 *
 * A scene file contains these settings in its parts `simulate` and `output`. kt_simulation_create reads these settings.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_RUN_H
#define KINETREE_RUN_H

#include "kinetree/method.h"
#include "kinetree/model.h"
#include "kinetree/record.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the settings of a run --------------------------------------------------------------------------------------- */

/* The values of kt_metric. X(id, name in scene files) */
#define KT_METRIC_LIST(X)                                                                                              \
    X(KT_METRIC_IDENTITY, identity)                                                                                    \
    X(KT_METRIC_MASS, mass)

/* The names of a body and of one of its markers. */
typedef struct kt_marker_pair {
    const char *body, *marker; /* names of the body and of the marker */
} kt_marker_pair;

/* The `simulate` and `output` parts of a scene. */
typedef struct kt_run {
    double duration;               /* s */
    const char *integrator;        /* a name for kt_method_find; NULL: chosen for the model (kt_run_method) */
    double step;                   /* s; > 0: fixed step, and the tolerances are not used */
    double relative, absolute;     /* tolerances of an adaptive method, for the numbers of q and v */
    double max_step;               /* s; the longest step of an adaptive method; 0: only features of functions limit
                                      it */
    double rho;                    /* the spectral radius at infinity of two-step, 0 to 1; other methods ignore it */
    kt_metric metric;              /* for kt_model_options, as is plan: a simulation uses the metric and the plan of its
                                      compiled model */
    kt_plan plan;                  /* as metric */
    double interval;               /* s between records; 0: about 1000 records */
    unsigned record;               /* KT_RECORD_ bits */
    const kt_marker_pair *markers; /* the markers with recorded positions */
    int marker_count;              /* length of markers */
} kt_run;

/* Returns the defaults: a duration of 10 s, and dopri5 with tolerances of 1e-9. Further defaults are rho 0.6, metric
 * identity, plan auto and the default records. Simulations with dopri5 take little memory. If a scene file names no
 * method, its run has integrator NULL (kt_run_method). */
KT_API kt_run kt_run_default(void);

/* The shortest duration above 0, s. Floating-point numbers cannot divide a shorter one into steps and records. */
#define KT_DURATION_LEAST 1e-280

/* Checks the settings of a run. kt_simulation_init makes this check as well.
 *   The times are finite and not negative. The duration is 0, or at least KT_DURATION_LEAST.
 *   The step (max_step if the step is adaptive) exceeds the rounding of times up to the duration.
 *   The number of records is at most 2^53. With an adaptive step, the tolerances are finite and not negative, and at
 * least one is above zero. The relative
 *     tolerance is 0, or at least KT_TOLERANCE_LEAST, the rounding level of numbers.
 *   The value of rho lies between 0 and 1.
 *   The member `record` consists of KT_RECORD_ bits, and marker_count agrees with `markers`.
 * Errors: KT_ERROR_ARGUMENT. error->where is "duration", "step", "max_step", "interval", "tolerance", "rho", "record"
 * or "marker_count".
 * Cost: a few comparisons. */
KT_API KT_CHECKED kt_status kt_run_check(const kt_run *run, kt_error *error);

/* The largest number of velocity coordinates nv for which auto is the default. A simulation with auto takes about 14
 * nv^2 numbers more memory than one with dopri5. */
enum { KT_RUN_IMPLICIT_MOST = 100 /* then 1.1 MB more */ };

/* Returns the method of a run: the built-in method with the name run->integrator, or NULL if the name is unknown. The
 * method two-step has a parameter: the call writes a copy with the rho of the run to *storage.
 * If the run names no method, the default is auto. In three cases the default is dopri5.
 *   The step is fixed.
 *   The model has more than KT_RUN_IMPLICIT_MOST velocity coordinates.
 *   The caller provides other equations of motion (kt_simulation_options.acceleration), and `model` is NULL in this
 * call.
 * The method auto gives the same bits as dopri5 until the motion becomes stiff. If memory is scarce
 * (kt_simulation_size), name dopri5.
 * Ownership: *storage must outlive the use of the method. */
KT_API const kt_method *kt_run_method(const kt_run *run, const kt_model *model, kt_method *storage);

/* Returns the reason for the default method in words ("the default with a fixed step"), and a remedy if another method
 * may be better. Returns NULL if the run names its method. The text is static. */
KT_API const char *kt_run_method_reason(const kt_run *run, const kt_model *model);

/* Returns the KT_RECORD_ bits that a run records for this model: run->record, or the default quantities if that is
 * KT_RECORD_DEFAULT. */
KT_API unsigned kt_run_record(const kt_run *run, const kt_model *model);

/* Returns the name of a choice in scene files ("identity", "auto"; "energy" for one bit), or NULL for any other
 * value. */
KT_API const char *kt_metric_name(kt_metric metric);
KT_API const char *kt_plan_name(kt_plan plan);

/* ---- other choices of `simulate` ------------------------------------------------------------------------------------
 *
 * These choices are no members of a run. A program passes them to other functions (kt_scene).
 */

/* Formulations. X(id, name in scene files) */
#define KT_FORMULATION_LIST(X)                                                                                         \
    X(KT_FORMULATION_TREE, tree)         /* coordinates of the tree's joints */                                        \
    X(KT_FORMULATION_ABSOLUTE, absolute) /* all bodies free, all joints loops */

/* The integrated coordinates. The tree formulation, the default of every simulation, has the coordinates of the tree's
 * joints. The absolute formulation is a reference for comparison. It has the positions of all bodies in the world, and
 * every joint is a constraint between two bodies [MSD 7.1]. */
typedef enum kt_formulation {
#define KT_FORMULATION_ENUM(id, name) id,
    KT_FORMULATION_LIST(KT_FORMULATION_ENUM)
#undef KT_FORMULATION_ENUM
        KT_FORMULATION_COUNT /* how many */
} kt_formulation;

/* Reductions of loops. X(id, name in scene files) */
#define KT_REDUCTION_LIST(X)                                                                                           \
    X(KT_REDUCTION_QR, qr)               /* QR decomposition with column pivoting */                                   \
    X(KT_REDUCTION_PARTITION, partition) /* independent coordinates, by elimination with pivoting */                   \
    X(KT_REDUCTION_SVD, svd)             /* singular values */                                                         \
    X(KT_REDUCTION_EIGEN, eigen)         /* zero eigenvalues of A'A: half the digits near singular positions */

/* The method that solves the equations of loops. */
typedef enum kt_reduction {
#define KT_REDUCTION_ENUM(id, name) id,
    KT_REDUCTION_LIST(KT_REDUCTION_ENUM)
#undef KT_REDUCTION_ENUM
        KT_REDUCTION_COUNT /* how many */
} kt_reduction;

/* How a simulation steps over hard contacts, stops, slack ropes and friction that sticks. X(id, name in scene files) */
#define KT_CONTACT_SCHEME_LIST(X)                                                                                      \
    X(KT_CONTACT_EVENTS, events) /* impacts and transitions are events at which steps end */                           \
    X(KT_CONTACT_STEPS, steps)   /* time stepping: fixed steps with impulses, which end at no event */

/* The scheme of a simulation. Time stepping is Moreau's midpoint rule, of first order. Time stepping needs a fixed step
 * (kt_run.step), replaces the integration method, and supports only Newton's rule of impacts. */
typedef enum kt_contact_scheme {
#define KT_CONTACT_SCHEME_ENUM(id, name) id,
    KT_CONTACT_SCHEME_LIST(KT_CONTACT_SCHEME_ENUM)
#undef KT_CONTACT_SCHEME_ENUM
        KT_CONTACT_SCHEME_COUNT /* how many */
} kt_contact_scheme;

/* ---- the plan ---------------------------------------------------------------------------------------------------- */

/* The time at which a step of the plan is executed. */
typedef enum kt_phase {
    KT_PHASE_EVALUATION = 0, /* at every evaluation of accelerations */
    KT_PHASE_STEP,           /* after every step */
    KT_PHASE_RECORD,         /* at every record */
    KT_PHASE_COUNT           /* the number of phases */
} kt_phase;

/* One step of the plan: a kernel and the number of items that it processes. If the scene does not need the kernel, the
 * step has the reason instead. Texts are static. */
typedef struct kt_plan_step {
    kt_phase phase;      /* when the kernel runs */
    const char *name;    /* the kernel's name: "effect spring" */
    int64_t count;       /* the number of items: 12; 0 if it is left out */
    const char *unit;    /* the kind of the items: "links" */
    const char *dropped; /* why the kernel is left out; NULL if it runs */
} kt_plan_step;

/* The largest number of steps in a plan. */
enum { KT_PLAN_STEPS_MAX = 48 /* the length of an array for kt_plan_steps */ };

/* Lists the computations of a run of this model in the order of execution. Returns the number of steps. If run is NULL,
 * the defaults apply.
 * Shape: steps has room for KT_PLAN_STEPS_MAX entries.
 * Cost: O(bodies + loops depth + effects). */
KT_API int kt_plan_steps(const kt_model *model, const kt_run *run, kt_plan_step *steps);

#ifdef __cplusplus
}
#endif
#endif
