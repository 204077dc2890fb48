/* What serves comparison, and no simulation needs: other formulations of the equations of loops, and the study of what
 * accuracy costs. A library of its own, libkinetree-study.
 *
 * The study of accuracy: a scene is run by every method at many steps and tolerances, each run's error held against a
 * reference whose own uncertainty is known, and its cost is counted and timed.
 *
 *     kt_accuracy_options options = kt_accuracy_options_default();
 *     kt_accuracy *study = NULL;
 *     options.clock = cpu_seconds;
 *     status = kt_accuracy_create(&description, &run, &options, &study, &error);
 *     if (status == KT_OK) {
 *         const int best = kt_accuracy_best(study, 1e-6);
 *         if (best >= 0)
 *             printf("step or tolerance: %g\n", kt_accuracy_get(study)->points[best].setting);
 *         kt_accuracy_free(study);
 *     }
 *
 * The norm of a difference between two states is the largest over all joints of
 *   an angle        the difference on the circle, at most half a turn, rad; the one of a screw, which carries a length
 *                   with it, in full;
 *   a quaternion    the angle of the rotation between the two, rad;
 *   a length        over the scene's length scale, the largest edge of the box in which joints, markers and centre of
 *                   mass stay during the motion; in a scene without angles, in metres.
 * Velocities: the rates of the same. An error is the largest at any record; errors at the end are told beside it.
 *
 * Source of the work-precision diagram: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
 * 2nd ed., Springer 1993, II.10; of growth rates: G. Benettin, L. Galgani, J.-M. Strelcyn, Phys. Rev. A 14 (1976) 2338.
 */
#ifndef KINETREE_STUDY_H
#define KINETREE_STUDY_H

#include "kinetree/reduction.h"
#include "kinetree/simulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- other formulations, for comparison -------------------------------------------------------------------------- */

/* Ways to keep loops closed that do not reduce coordinates: right-hand sides for kt_simulation_options, with dense
 * algebra in tree coordinates. They are here to be compared with the reduction, which does the same faster and loses
 * less. With M a = f + A' lambda (f = tau - h of the tree, effects included), phi(u, t) = 0, A v = b', A a = b'':
 *
 *   gauss       a least in (a - M^-1 f)' M (a - M^-1 f) with A a = b'' [MSD 4.22, 4.29]; loops drift open
 *   baumgarte   the same with A a = b'' - 2 alpha (A v - b') - beta^2 phi [MSD 8.38]
 *   augmented   (M + A' s A) a = f + A' s (b'' - 2 alpha (A v - b') - beta^2 phi) - A' lambda*, lambda* iterated
 *               [MSD 9.6; Bayo, Garcia de Jalon, Serna 1988]
 *   projection  u' = w - A^+ (A w - b'), w' as gauss at u', positions put back after each step [MSD 9.11, 9.17]; what a
 *               simulation calls velocities is w
 *
 * X(id, name) */
#define KT_CONSTRAINT_FORMULATION_LIST(X)                                                                              \
    X(KT_CONSTRAINT_FORMULATION_GAUSS, gauss)           /* accelerations alone; loops drift open */                    \
    X(KT_CONSTRAINT_FORMULATION_BAUMGARTE, baumgarte)   /* Baumgarte's stabilisation */                                \
    X(KT_CONSTRAINT_FORMULATION_AUGMENTED, augmented)   /* the augmented Lagrangian */                                 \
    X(KT_CONSTRAINT_FORMULATION_PROJECTION, projection) /* force projection */

/* The ways to keep loops closed, by name; their equations stand at KT_CONSTRAINT_FORMULATION_LIST. */
typedef enum kt_constraint_formulation_type {
#define KT_CONSTRAINT_FORMULATION_ENUM(id, name) id,
    KT_CONSTRAINT_FORMULATION_LIST(KT_CONSTRAINT_FORMULATION_ENUM)
#undef KT_CONSTRAINT_FORMULATION_ENUM
        KT_CONSTRAINT_FORMULATION_COUNT /* how many */
} kt_constraint_formulation_type;

/* "gauss"; NULL for a value that is none. */
KT_API const char *kt_constraint_formulation_name(kt_constraint_formulation_type type);

/* What a set is to do. */
typedef struct kt_constraint_formulation_options {
    kt_constraint_formulation_type type; /* which one */

    /* Baumgarte, augmented, 1/s: closure errors obey phi'' + 2 alpha phi' + beta^2 phi = 0, rolling and its like
     * psi' + 2 alpha psi = 0. These are eigenvalues of the equations that an explicit method must be stable for: with
     * alpha = beta, the double one -alpha (and -2 alpha for rolling) asks for steps below 2 / alpha with euler, heun or
     * midpoint, 2.78 / alpha with rk4, 3.3 / alpha with dopri5, whatever the tolerance. */
    double alpha, beta;

    /* Augmented: s = penalty / (smallest independent eigenvalue of A M^-1 A' in the state where the set is placed), so
     * that an iteration divides the equations' residual by 1 + penalty there; rounding grows with penalty, too. */
    double penalty;
    int iterations;   /* augmented: at most */
    double tolerance; /* augmented: the last change of the forces against the forces, where the iteration ends; and
                         where it no longer gets less */

    /* Directions of the equations that are smaller than this fraction of the largest count as dependent, and so do
     * those beyond the rank that the loops have at generic positions (kt_model_mobility), unless `uncapped`: then
     * whatever looks independent is trusted, as textbooks have it. Not read by the augmented set, which decides no
     * rank. */
    double rank_tolerance;
    bool uncapped;
} kt_constraint_formulation_options;

/* For steps of this length (adaptive: the longest that is expected), s, > 0: alpha = beta = 0.1 / step, penalty 1e4, 12
 * iterations, tolerances 1e-11 and 1e-12. On the bundled linkages, alpha = 1 / step made rk4's errors 3 to 100 times
 * larger (the stabilising forces disturb the motion) and dopri5's evaluations 5 to 17 times as many; alpha = 0.1 /
 * step, growing as steps shrink, costs rk4 one or two of its orders (h^3.2 on Andrews' mechanism, h^2.0 on Bricard's,
 * where gains that stay keep h^4.0), but lets it pass the N-four-bar, which the gains that stay do not. */
KT_API kt_constraint_formulation_options kt_constraint_formulation_options_default(kt_constraint_formulation_type type,
                                                                                   double step);

/* A set at work: its matrices, and what it has met. */
typedef struct kt_constraint_formulation kt_constraint_formulation;

/* Bytes that a set takes. */
KT_API size_t kt_constraint_formulation_size(const kt_model *model);

/* Lays a set out in the caller's memory (KT_ALIGNMENT). The model must outlive it; for simulations in the absolute
 * formulation it is kt_model_absolute of theirs. A set is scratch and belongs to one thread at a time. data are scratch
 * of this model.
 * Errors: KT_ERROR_ARGUMENT (an option), KT_ERROR_MEMORY, KT_ERROR_CONSTRAINT (the initial state cannot be assembled),
 * KT_ERROR_SINGULAR where a tree coordinate has no inertia: reduction asks for inertia only along what loops leave
 * free, these sets along every coordinate. */
KT_API KT_CHECKED kt_status kt_constraint_formulation_init(const kt_model *model, kt_data *data,
                                                           const kt_constraint_formulation_options *options,
                                                           void *memory, size_t size, kt_constraint_formulation **set,
                                                           kt_error *error);
/* The same in memory of its own, released with kt_constraint_formulation_free. */
KT_API KT_CHECKED kt_status kt_constraint_formulation_create(const kt_model *model,
                                                             const kt_constraint_formulation_options *options,
                                                             kt_constraint_formulation **set, kt_error *error);
/* Releases what _create made; does nothing with what was placed, nor with NULL. */
KT_API void kt_constraint_formulation_free(kt_constraint_formulation *set);

/* Accelerations a (nv) as kt_acceleration_evaluate has them, by this set; rate (nv; may be NULL) is the velocity that
 * positions follow: v but for force projection. Errors: KT_ERROR_SINGULAR, KT_ERROR_NOT_FINITE. O(nv^3 + nv^2
 * equations). */
KT_API KT_CHECKED kt_status kt_constraint_formulation_evaluate(kt_constraint_formulation *set, kt_data *data, double t,
                                                               const double *q, const double *v, const double *tau,
                                                               const kt_wrench *external, double *rate, double *a,
                                                               kt_error *error);

/* Makes simulations with these options use the set, which must outlive them: one simulation at a time. */
KT_API void kt_constraint_formulation_use(kt_constraint_formulation *set, kt_simulation_options *options);

/* What a set has met since it was placed or reset. */
typedef struct kt_constraint_formulation_statistics {
    uint64_t evaluations;     /* of kt_constraint_formulation_evaluate */
    double least, least_time; /* the last independent direction of the equations, smallest against largest seen; when.
                                 1 for the augmented set, which does not know */
    uint64_t dropped;         /* evaluations where the rank fell below that of generic positions */
    uint64_t trusted;         /* uncapped: evaluations where it exceeded it */
    double open, open_time;   /* the largest |phi|, m or rad; when */
    int iterations;           /* augmented: the most */
    double residual;          /* augmented: the largest |A a - c| left, against its terms */
} kt_constraint_formulation_statistics;

/* What it has met so far. */
KT_API kt_constraint_formulation_statistics
kt_constraint_formulation_statistics_get(const kt_constraint_formulation *set);
/* Forgets it. */
KT_API void kt_constraint_formulation_reset(kt_constraint_formulation *set);

/* Whether what the set has met lets its results be believed: KT_OK, or KT_ERROR_CONSTRAINT (loops came apart, redundant
 * equations were trusted) or KT_ERROR_SINGULAR (a singular position was passed, which this set has no means to cross),
 * in words. */
KT_API KT_CHECKED kt_status kt_constraint_formulation_verdict(const kt_constraint_formulation *set, kt_error *error);

/* ---- accuracy study ---------------------------------------------------------------------------------------------- */

/* A way to compute the same motion: how the model is compiled and how it is run. What is compared besides methods is a
 * list of these. */
typedef struct kt_variant {
    const char *label;                /* for people; NULL: the scene's own way. Stays the caller's */
    kt_model_options model;           /* how it is compiled */
    kt_simulation_options simulation; /* method, max_steps and record are set by the study */
    bool records;                     /* the timed runs hand over the scene's records; else none */
    bool has_set;                     /* loops are kept closed by another coordinate set, with its options by default */
    kt_constraint_formulation_type set; /* which one */
    double gain;                        /* of the set: its gains, in parts of those by default; 0: 1 */
} kt_variant;

/* The scene's own way: what `run` asks for. */
KT_API kt_variant kt_variant_default(const kt_run *run);

/* States that are known already, at k * interval, k = 0 .. count - 1. */
typedef struct kt_reference {
    double interval;     /* s */
    int count;           /* at least 2 */
    const double *q, *v; /* count rows of nq positions; of nv velocities */
} kt_reference;

/* What is studied, and at what expense. */
typedef struct kt_accuracy_options {
    double duration;                 /* s; 0: the run's */
    int records;                     /* intervals at whose ends errors are measured; a given reference has its own */
    const kt_method *const *methods; /* NULL: all that there are */
    int method_count;                /* length of methods */
    const double *steps;             /* s, of methods without error estimate; NULL: chosen */
    int step_count;                  /* length of steps */
    const double *tolerances;        /* of adaptive methods; NULL: chosen */
    int tolerance_count;             /* length of tolerances */
    const kt_variant *variants;      /* every method is run in each; NULL: in the scene's own way */
    int variant_count;               /* length of variants */
    const kt_reference *reference;   /* NULL: computed */
    uint64_t run_evaluations;        /* the most that one run may take */
    double amplification;            /* the study ends where a small error has grown by this factor */

    /* The library has no clock of its own. clock returns seconds that only rise, of the processor best; NULL: nothing
     * is timed, no budget holds, and what is cheapest is what takes the fewest evaluations. */
    double (*clock)(void *user);

    double budget; /* s of the clock for the whole study */
    /* Called before each run: how much is done (0 to 1) and what comes next. Returns 0 to go on. NULL: none. */
    int (*progress)(double done, const char *what, void *user);
    void *user; /* for clock and progress */
} kt_accuracy_options;

/* All methods, steps and tolerances chosen, 200 records, 2e6 evaluations a run, amplification 1e6, no clock, 20 s. */
KT_API kt_accuracy_options kt_accuracy_options_default(void);

/* ---- what comes out ---------------------------------------------------------------------------------------------- */

/* How far a run is from the reference. */
typedef struct kt_accuracy_error {
    double position, velocity;         /* the largest over all records, in the norm above */
    double end_position, end_velocity; /* at the end */
    double energy;                     /* J, the largest difference from the reference's total energy */
    kt_residual constraint;            /* the largest at any record */
} kt_accuracy_error;

/* One run. */
typedef struct kt_accuracy_point {
    double setting;              /* step, s, or tolerance (relative = absolute) */
    kt_status status;            /* of the run; where it is not KT_OK, what follows is of the part before */
    kt_status verdict;           /* kt_constraint_formulation_verdict after it, where there is a set */
    bool usable;                 /* it came to the end, with an error below a tenth of the motion's amplitude */
    bool believed;               /* the error is above the reference's uncertainty; else all that is known is that */
    bool cheapest, fewest;       /* on the Pareto front of error and time, of error and evaluations */
    kt_accuracy_error error;     /* infinite where it failed */
    kt_simulation_counts counts; /* of a run without records */
    double cpu;                  /* s, the least of the repeated runs; NaN where there is no clock */
    double spread;               /* median over least of them, less one */
    int repeats;                 /* how often it was run */
} kt_accuracy_point;

/* Why there is no further point. X(id, text) */
#define KT_ACCURACY_END_LIST(X)                                                                                        \
    X(KT_ACCURACY_LISTED, "all settings were run")                                                                     \
    X(KT_ACCURACY_FLOOR, "the error stopped falling")                                                                  \
    X(KT_ACCURACY_REFERENCE, "the error reached the reference's uncertainty")                                          \
    X(KT_ACCURACY_LENGTH, "the next run would be too long")                                                            \
    X(KT_ACCURACY_BUDGET, "the time was used up")                                                                      \
    X(KT_ACCURACY_UNUSABLE, "no setting worked")

/* Why a curve has no further point. */
typedef enum kt_accuracy_end {
#define KT_ACCURACY_END_ENUM(id, text) id,
    KT_ACCURACY_END_LIST(KT_ACCURACY_END_ENUM)
#undef KT_ACCURACY_END_ENUM
} kt_accuracy_end;

/* One method in one variant: points by falling setting. */
typedef struct kt_accuracy_curve {
    int variant;             /* index of it */
    const kt_method *method; /* the one */
    bool adaptive;           /* settings are tolerances */
    int first, count;        /* of its points */
    int fitted;              /* points of the asymptotic range, on which `slope` rests; 0: too few for one */
    double slope;       /* of log error over log setting: the order, or for tolerances the proportionality, ideally 1 */
    double floor;       /* where the error stops falling; NaN: it was not reached */
    double stable_step; /* s, the largest stable step, where stability and not accuracy bounds it; else 0 */
    kt_accuracy_end end; /* why there is no further point */
} kt_accuracy_curve;

/* Why the study ends before the duration asked for. */
typedef enum kt_accuracy_cut {
    KT_ACCURACY_WHOLE = 0,    /* it does not */
    KT_ACCURACY_GROWTH,       /* small errors have grown by options.amplification: chaos */
    KT_ACCURACY_DISAGREEMENT, /* the two reference solutions go different ways */
    KT_ACCURACY_LATE,         /* the reference would take too long */
} kt_accuracy_cut;

/* In what errors are told. */
typedef enum kt_accuracy_unit {
    KT_ACCURACY_RADIAN = 0, /* angles alone */
    KT_ACCURACY_METRE,      /* lengths alone */
    KT_ACCURACY_MIXED,      /* angles, and lengths over the length scale */
} kt_accuracy_unit;

/* What a study has found. Arrays are the study's. */
typedef struct kt_accuracy_results {
    double asked, duration; /* s: asked for, studied */
    kt_accuracy_cut cut;    /* why they differ, if they do */
    double interval;        /* s between records */
    int records;            /* intervals */
    kt_accuracy_unit unit;  /* of errors in position */
    double length;          /* m, the length scale */
    double amplitude;       /* of the motion, in the norm: the largest distance from the initial state */
    double amplification;   /* of a small error, the largest up to the end of the study */
    double growth;          /* 1/s, log(amplification) / duration */

    const kt_method *reference;                  /* NULL: it was given */
    const kt_method *check;                      /* the second one */
    double reference_tolerance, check_tolerance; /* of the two */
    kt_accuracy_error uncertainty;               /* the difference of the two */

    const kt_variant *variants;      /* that were asked for */
    int variant_count;               /* length of variants */
    const kt_accuracy_curve *curves; /* one a method and variant */
    int curve_count;                 /* length of curves */
    const kt_accuracy_point *points; /* of all curves */
    int point_count;                 /* length of points */
} kt_accuracy_results;

/* ---- the study --------------------------------------------------------------------------------------------------- */

/* A study: its runs, its reference, its results. */
typedef struct kt_accuracy kt_accuracy;

/* Makes the whole study; it is to be released with kt_accuracy_free. options may be NULL. Runs that fail are points of
 * it and no errors of the call. Errors: those of kt_model_compile and kt_simulation_create; KT_ERROR_ARGUMENT (an
 * option, a scene in which nothing moves); KT_ERROR_CALLBACK (progress stopped it); what stops the reference. */
KT_API KT_CHECKED kt_status kt_accuracy_create(const kt_description *description, const kt_run *run,
                                               const kt_accuracy_options *options, kt_accuracy **study,
                                               kt_error *error);
/* NULL is allowed. */
KT_API void kt_accuracy_free(kt_accuracy *study);

/* What it has found, valid until the study is released. */
KT_API const kt_accuracy_results *kt_accuracy_get(const kt_accuracy *study);

/* The model of the scene, compiled its own way. */
KT_API const kt_model *kt_accuracy_model(const kt_accuracy *study);

/* The cheapest point with a position error of at most `goal`, the reference's uncertainty included; -1: there is none.
 */
KT_API int kt_accuracy_best(const kt_accuracy *study, double goal);

/* One more run, of any variant, as those of the study: its point. Errors: as kt_accuracy_create. */
KT_API KT_CHECKED kt_status kt_accuracy_measure(kt_accuracy *study, const kt_variant *variant, const kt_method *method,
                                                bool adaptive, double setting, kt_accuracy_point *point,
                                                kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
