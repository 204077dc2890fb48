/* Comparisons, which no simulation needs: other reductions and formulations of the loop equations, and a work-precision
 * study. The header also runs batches on several threads, because the core library has no threads. These functions form
 * a library of their own, libkinetree-study.
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
 *             printf("step or tolerance: %g\n", kt_accuracy_get(study)->points[best].setting);
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
#ifndef KINETREE_STUDY_H
#define KINETREE_STUDY_H

#include "kinetree/batch.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"
#include "kinetree/simulation.h"

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- a batch by several threads ---------------------------------------------------------------------------------- */

/* Does a job for all states of a batch (kt_batch_compute) with `threads` threads, the calling thread included. There
 * may be at most as many threads as the batch was made for. They start and end within the call. They take blocks one
 * after the other, and the results have the same bits for any number of threads.
 *
 * *used (may be NULL) receives the number of threads that computed. It is below `threads` if the system starts no more.
 * The core library starts no threads, and this call is therefore not a part of it.
 *
 * Errors: those of kt_batch_compute, of the first state that failed. KT_ERROR_ARGUMENT if there are no threads, or the
 * batch was made for fewer.
 * Cost: starting a thread takes some 20 us. A job should last longer. */
KT_API KT_CHECKED kt_status kt_batch_run(kt_batch *batch, const kt_batch_job *job, size_t threads, size_t *used,
                                         kt_error *error);

/* ---- derivatives of many motions --------------------------------------------------------------------------------- */

/* A step, and the arrays that receive its derivatives; as for kt_step_derivatives. */
typedef struct kt_step_task {
    kt_step step; /* with inputs of its own */
    const double *q, *v,
        *x; /* state before the step; x: auxiliary states (kt_own_state_count); NULL: step.x, or the initial ones */
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

/* Computes the gradients of `count` motions on `threads` threads, the calling thread included. Each thread takes one
 * group of motions after the other and computes it with kt_rollout_gradients. The size of a group is kt_rollout_width
 * of the first motion. Every motion has the same bits as alone, for any number of threads. Several threads call the
 * cost at the same time.
 *
 * data and work have an entry for each thread. An entry of work has work_size bytes: the most that
 * kt_rollout_gradients_work_size returns for these motions. If it has kt_rollout_work_size bytes only, motions are
 * computed one by one. *used (may be NULL) receives the number of threads that computed.
 *
 * Errors: that of the first motion that failed. KT_ERROR_ARGUMENT if there are no threads or more than 256, or if a
 * thread has no entry. A failed motion does not affect the others, and its outputs stay unchanged. */
KT_API KT_CHECKED kt_status kt_rollout_run(const kt_model *model, kt_data *const *data, void *const *work,
                                           size_t work_size, size_t threads, kt_rollout_task *tasks, size_t count,
                                           kt_cost *cost, size_t *used, kt_error *error);

/* ---- other reductions, for comparison ---------------------------------------------------------------------------- */

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

/* Returns the name, such as "qr"; NULL for a value out of range. */
KT_API const char *kt_reduction_name(kt_reduction reduction);

/* Returns the method of a reduction, for kt_model_options. It is NULL for QR, the default, and for any value out of
 * range. A library that was built without loops has no other method. */
KT_API const kt_reduction_method *kt_reduction_method_of(kt_reduction reduction);

/* ---- the absolute formulation ------------------------------------------------------------------------------------ */

/* Formulations. X(id, name in scene files) */
#define KT_FORMULATION_LIST(X)                                                                                         \
    X(KT_FORMULATION_TREE, tree)         /* coordinates of the tree's joints */                                        \
    X(KT_FORMULATION_ABSOLUTE, absolute) /* all bodies free, all joints loops */

/* The integrated coordinates. The tree formulation has the coordinates of the tree's joints, as every simulation
 * without options. The absolute formulation is a reference for it. It has the positions of all bodies in the world, and
 * every joint is a constraint between two bodies [MSD 7.1]. */
typedef enum kt_formulation {
#define KT_FORMULATION_ENUM(id, name) id,
    KT_FORMULATION_LIST(KT_FORMULATION_ENUM)
#undef KT_FORMULATION_ENUM
        KT_FORMULATION_COUNT /* how many */
} kt_formulation;

/* Returns the name, such as "tree"; NULL for a value out of range. */
KT_API const char *kt_formulation_name(kt_formulation formulation);

/* The absolute formulation of a model. */
typedef struct kt_absolute kt_absolute;

/* Compiles the absolute formulation of a model. The model was compiled from this description and must outlive the
 * absolute formulation. *absolute is allocated and released with kt_absolute_free; threads may share it. options may be
 * NULL.
 * Errors: those of kt_model_compile; KT_ERROR_UNSUPPORTED without loops.
 * Cost: O(size), and the ranks of as many equations as the joints have. */
KT_API KT_CHECKED kt_status kt_absolute_create(const kt_description *description, const kt_model_options *options,
                                               const kt_model *model, kt_absolute **absolute, kt_error *error);
/* Releases an absolute formulation; does nothing with NULL. */
KT_API void kt_absolute_free(kt_absolute *absolute);

/* Returns the model that is integrated. Every body is free. Every joint becomes a loop with the name of its body; these
 * loops follow those of the description. Bodies are in the description's order. Massless bodies, NAME.position and
 * NAME.cross, may follow. Relations, effects and oblique universal joints are attached to them. NULL for NULL. */
KT_API const kt_model *kt_absolute_model(const kt_absolute *absolute);

/* Makes simulations of the model with these options integrate its absolute formulation, which must outlive them. If
 * `absolute` is NULL, the model itself is integrated.
 *
 * Angles count whole turns under one condition. In every step, each joint must turn by the mean of its rates at both
 * ends to within half a turn. */
KT_API void kt_absolute_use(const kt_absolute *absolute, kt_simulation_options *options);

/* ---- other formulations, for comparison -------------------------------------------------------------------------- */

/* Formulations that keep loops closed without reducing coordinates. They are right-hand sides for
 * kt_simulation_options, with dense algebra in tree coordinates. They serve for comparison with the reduction, which is
 * faster and more accurate. With M a = f + A' lambda (f = tau - h of the tree, effects included), phi(u, t) = 0, A v =
 * b', A a = b'':
 *
 *     gauss       a minimises (a - M^-1 f)' M (a - M^-1 f) with A a = b'' [MSD 4.22, 4.29]; loops drift open
 *     baumgarte   the same with A a = b'' - 2 alpha (A v - b') - beta^2 phi [MSD 8.38]
 *     augmented   (M + A' s A) a = f + A' s (b'' - 2 alpha (A v - b') - beta^2 phi) - A' lambda*, lambda* iterated
 *                 [MSD 9.6; Bayo, Garcia de Jalon, Serna 1988]
 *     projection  u' = w - A^+ (A w - b'), w' as gauss at u', positions projected after each step [MSD 9.11, 9.17]; the
 *                 velocities of the simulation are w
 *
 * X(id, name) */
#define KT_CONSTRAINT_FORMULATION_LIST(X)                                                                              \
    X(KT_CONSTRAINT_FORMULATION_GAUSS, gauss)           /* accelerations alone; loops drift open */                    \
    X(KT_CONSTRAINT_FORMULATION_BAUMGARTE, baumgarte)   /* Baumgarte's stabilisation */                                \
    X(KT_CONSTRAINT_FORMULATION_AUGMENTED, augmented)   /* the augmented Lagrangian */                                 \
    X(KT_CONSTRAINT_FORMULATION_PROJECTION, projection) /* force projection */

/* The constraint formulations by name; KT_CONSTRAINT_FORMULATION_LIST has their equations. */
typedef enum kt_constraint_formulation_type {
#define KT_CONSTRAINT_FORMULATION_ENUM(id, name) id,
    KT_CONSTRAINT_FORMULATION_LIST(KT_CONSTRAINT_FORMULATION_ENUM)
#undef KT_CONSTRAINT_FORMULATION_ENUM
        KT_CONSTRAINT_FORMULATION_COUNT /* the number of formulations */
} kt_constraint_formulation_type;

/* Returns the name, such as "gauss"; NULL for a value out of range. */
KT_API const char *kt_constraint_formulation_name(kt_constraint_formulation_type type);

/* Options of a constraint formulation. */
typedef struct kt_constraint_formulation_options {
    size_t size;                         /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    kt_constraint_formulation_type type; /* which one */

    /* Baumgarte, augmented, 1/s: closure errors obey phi'' + 2 alpha phi' + beta^2 phi = 0. Errors of rolling and other
     * velocity constraints obey psi' + 2 alpha psi = 0. An explicit method must be stable for the eigenvalues of these
     * equations, for all tolerances. With alpha = beta, there is a double eigenvalue -alpha (and -2 alpha for rolling).
     * The product of alpha and the step is then limited to
     *   2 with euler, heun or midpoint.
     *   2.78 with rk4.
     *   3.3 with dopri5. */
    double alpha, beta;

    /* Augmented: s = penalty / (smallest independent eigenvalue of A M^-1 A' in the state at initialisation). An
     * iteration divides the residual of the equations by 1 + penalty there. Rounding errors grow with the penalty, too.
     */
    double penalty;
    int iterations;   /* augmented: the largest number of iterations */
    double tolerance; /* augmented: the iteration ends if the forces change by less than this fraction of them, or if
                         the change no longer decreases */

    /* Directions of the equations that are smaller than this fraction of the largest count as dependent. So do those
     * beyond the rank that the loops have at generic positions (kt_model_mobility). With `uncapped`, every direction
     * above the tolerance counts as independent, as in textbooks. The augmented formulation determines no rank and does
     * not read these members. */
    double rank_tolerance;
    bool uncapped;
} kt_constraint_formulation_options;

/* The defaults for steps of this length, s, > 0 (adaptive: the longest expected). They are alpha = beta = 0.1 / step,
 * penalty 1e4 and 12 iterations. The tolerances are 1e-11 and 1e-12.
 *
 * The reasons for the gains come from the bundled linkages:
 *   Ten times this gain made the errors of rk4 larger by 3 to 100, because the stabilising forces disturb the motion.
 *   With the same gain dopri5 took 5 to 17 times as many evaluations.
 *   The gain alpha = 0.1 / step grows as steps shrink and costs rk4 one or two orders. The order was 3.2 on Andrews'
 *     mechanism and 2.0 on Bricard's. Constant gains keep the order 4.0.
 *   With alpha = 0.1 / step rk4 passes the N-four-bar. With constant gains it does not. */
static inline kt_constraint_formulation_options
kt_constraint_formulation_options_default(kt_constraint_formulation_type type, double step) {
    kt_constraint_formulation_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.type = type;
    options.alpha = 0.1 / step;
    options.beta = 0.1 / step;
    options.penalty = 1e4;
    options.iterations = 12;
    options.tolerance = 1e-11;
    options.rank_tolerance = 1e-12;
    return options;
}

/* A constraint formulation of a model: its matrices and statistics. */
typedef struct kt_constraint_formulation kt_constraint_formulation;

/* Returns the bytes that a formulation needs. */
KT_API size_t kt_constraint_formulation_size(const kt_model *model);

/* Initialises a formulation in the caller's memory (KT_ALIGNMENT). The model must outlive it. For simulations in the
 * absolute formulation, the model is their kt_absolute_model. The object is scratch and belongs to one thread at a
 * time. data are scratch of this model.
 *
 * Errors:
 *   KT_ERROR_ARGUMENT: an option.
 *   KT_ERROR_MEMORY: the memory is too small or misaligned.
 *   KT_ERROR_CONSTRAINT: the initial state cannot be assembled.
 *   KT_ERROR_SINGULAR: a tree coordinate has no inertia. The reduction needs inertia only along the degrees of freedom
 *     that loops leave. These formulations need it along every coordinate. */
KT_API KT_CHECKED kt_status kt_constraint_formulation_init(const kt_model *model, kt_data *data,
                                                           const kt_constraint_formulation_options *options,
                                                           void *memory, size_t size,
                                                           kt_constraint_formulation **formulation, kt_error *error);
/* Creates a formulation in allocated memory, which kt_constraint_formulation_free releases. */
KT_API KT_CHECKED kt_status kt_constraint_formulation_create(const kt_model *model,
                                                             const kt_constraint_formulation_options *options,
                                                             kt_constraint_formulation **formulation, kt_error *error);
/* Releases memory that _create allocated. Does nothing for an object initialised with _init, nor for NULL. */
KT_API void kt_constraint_formulation_free(kt_constraint_formulation *formulation);

/* Computes accelerations a (nv) as kt_acceleration_evaluate does, with this formulation. rate (nv; may be NULL)
 * receives the velocity with which positions change: v except for force projection.
 * Errors: KT_ERROR_SINGULAR, KT_ERROR_NOT_FINITE.
 * Cost: O(nv^3 + nv^2 equations). */
KT_API KT_CHECKED kt_status kt_constraint_formulation_evaluate(kt_constraint_formulation *formulation, kt_data *data,
                                                               double t, const double *q, const double *v,
                                                               const double *tau, const kt_wrench *external,
                                                               double *rate, double *a, kt_error *error);

/* Computes the eigenvalues of small differences from (t, q, v) under a formulation, 2 nv of each: real and imaginary
 * parts, by rising modulus. A formulation adds eigenvalues to those of the mechanism. Baumgarte's stabilisation adds
 * -alpha +- sqrt(alpha^2 - beta^2) for every equation. Force projection and Gauss' principle add zeros. About a state
 * that is no equilibrium, the eigenvalues hold for an instant.
 *
 * Method: central differences. The error is some 1e-8 of the largest eigenvalue, and for multiple ones the root of
 * that. Allocates, and releases, its matrices.
 * Errors: KT_ERROR_MEMORY, KT_ERROR_NOT_FINITE; as kt_constraint_formulation_evaluate.
 * Cost: 4 nv evaluations, and O(nv^3). */
KT_API KT_CHECKED kt_status kt_constraint_formulation_spectrum(kt_constraint_formulation *formulation, kt_data *data,
                                                               double t, const double *q, const double *v, double *real,
                                                               double *imaginary, kt_error *error);

/* Makes simulations with these options use the formulation, which must outlive them. It serves one simulation at a
 * time. */
KT_API void kt_constraint_formulation_use(kt_constraint_formulation *formulation, kt_simulation_options *options);

/* Statistics of a formulation since it was initialised or reset. */
typedef struct kt_constraint_formulation_statistics {
    uint64_t evaluations;     /* of kt_constraint_formulation_evaluate */
    double least, least_time; /* the last independent direction of the equations, smallest over largest so far; and
                                 its time, s. It is 1 for the augmented formulation, which does not determine it */
    uint64_t dropped;         /* evaluations in which the rank fell below that of generic positions */
    uint64_t trusted;         /* uncapped: evaluations in which the rank exceeded that of generic positions */
    double open, open_time;   /* the largest |phi|, m or rad; and its time, s */
    int iterations;           /* augmented: the largest number of iterations */
    double residual;          /* augmented: the largest remaining |A a - c|, relative to the size of its terms */
} kt_constraint_formulation_statistics;

/* The statistics so far. */
KT_API kt_constraint_formulation_statistics
kt_constraint_formulation_statistics_get(const kt_constraint_formulation *formulation);
/* Clears the statistics. */
KT_API void kt_constraint_formulation_reset(kt_constraint_formulation *formulation);

/* Returns whether the statistics allow the results to be trusted. KT_OK: they do. Otherwise there is a message.
 * Errors: KT_ERROR_CONSTRAINT (loops came apart, redundant equations were treated as independent). KT_ERROR_SINGULAR
 * (the motion passed a singular position, which this formulation cannot cross). */
KT_API KT_CHECKED kt_status kt_constraint_formulation_verdict(const kt_constraint_formulation *formulation,
                                                              kt_error *error);

/* ---- differential-algebraic baselines ---------------------------------------------------------------------------- */

/* The equations of motion with multipliers, without reduction, solved with implicit methods. They are the baseline for
 * the reduction to ordinary differential equations. In tangent coordinates, with q' = E(q) u:
 *
 *     M v' = f + A' lambda,   u = v (+ A' mu, ggl alone),   and as equations of the loops
 *
 *     index3      phi = 0                                          [MSD 8.31; of rolling A v = b']
 *     index2      A v = b'                                         [MSD 8.29]; positions drift
 *     index1      A v' = b''                                       [MSD 8.26]; positions and velocities drift
 *     ggl         phi = 0 and A v = b', mu being their multipliers [MSD 8.36; Gear, Leimkuhler, Gupta 1985]
 *     stabilised  A v' = b'' - 2 alpha (A v - b') - beta^2 phi     [MSD 8.38; Baumgarte 1972]
 *
 * X(id, name) */
#define KT_DAE_LIST(X)                                                                                                 \
    X(KT_DAE_INDEX3, index3)         /* positions alone */                                                             \
    X(KT_DAE_INDEX2, index2)         /* velocities alone */                                                            \
    X(KT_DAE_INDEX1, index1)         /* accelerations alone */                                                         \
    X(KT_DAE_GGL, ggl)               /* positions and velocities, with a multiplier of their own */                    \
    X(KT_DAE_STABILISED, stabilised) /* accelerations after Baumgarte */

/* The baselines by name; KT_DAE_LIST has their equations. */
typedef enum kt_dae_type {
#define KT_DAE_ENUM(id, name) id,
    KT_DAE_LIST(KT_DAE_ENUM)
#undef KT_DAE_ENUM
        KT_DAE_COUNT /* how many */
} kt_dae_type;

/* Returns the name, such as "index3"; NULL for a value out of range. */
KT_API const char *kt_dae_name(kt_dae_type type);

/* Options of a baseline. */
typedef struct kt_dae_options {
    size_t size;             /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    kt_dae_type type;        /* which one */
    const kt_method *method; /* implicit-euler, crank-nicolson, bdf2, two-step or radau5; the method must outlive it */
    double alpha, beta;      /* stabilised: the gains, 1/s */
} kt_dae_options;

/* The baseline by Radau IIA, with gains of 10 1/s. */
static inline kt_dae_options kt_dae_options_default(kt_dae_type type) {
    kt_dae_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.type = type;
    options.method = kt_method_find("radau5");
    options.alpha = 10.0;
    options.beta = 10.0;
    return options;
}

/* A baseline of a model: its state with multipliers, its matrices. */
typedef struct kt_dae kt_dae;

/* Allocates a baseline of a model, which must outlive it; kt_dae_free releases it.
 * Errors: KT_ERROR_ARGUMENT (the type, the gains, a method that is not implicit or not of these families),
 * KT_ERROR_UNSUPPORTED without LAPACK, KT_ERROR_MEMORY. */
KT_API KT_CHECKED kt_status kt_dae_create(const kt_model *model, const kt_dae_options *options, kt_dae **dae,
                                          kt_error *error);
/* Releases a baseline; does nothing with NULL. */
KT_API void kt_dae_free(kt_dae *dae);

/* Starts at a state that satisfies the loops (kt_state_assemble), which is copied. From redundant equations, a maximal
 * independent set is chosen with column pivoting, once. The others have the multiplier 0 from here on. Computes
 * consistent multipliers and accelerations [MSD 8.54].
 * Errors: KT_ERROR_SINGULAR at a singular position, or without inertia along a joint; as kt_loop_equations. There is
 * then no state. */
KT_API KT_CHECKED kt_status kt_dae_start(kt_dae *dae, double t, const double *q, const double *v, kt_error *error);

/* Computes the multipliers (equations of all loops) of a closed state, from the equations that the baseline has chosen
 * at its start [MSD 8.54].
 * Errors: KT_ERROR_SINGULAR if these are not independent. */
KT_API KT_CHECKED kt_status kt_dae_consistent(kt_dae *dae, double t, const double *q, const double *v,
                                              double *multipliers, kt_error *error);

/* Takes a step of the length h > 0, with Newton's method to rounding. A method of two steps needs a previous step of
 * the same length. Otherwise, the method that starts it takes the step.
 * Errors: each contains the time, and the state is then unchanged. KT_ERROR_STEP if the iteration does not converge.
 * KT_ERROR_SINGULAR if its matrix is singular: the chosen equations are not independent any more.
 * Cost: a Jacobian takes 4 nv + 1 evaluations of the equations. A step takes O(N^3), N the unknowns of all stages. */
KT_API KT_CHECKED kt_status kt_dae_step(kt_dae *dae, double h, kt_error *error);

/* In turn: the present time; positions (nq); velocities (nv); multipliers (equations of all loops, kt_loop_equations).
 * The arrays belong to the baseline and change with its steps. */
KT_API double kt_dae_time(const kt_dae *dae);
KT_API const double *kt_dae_positions(const kt_dae *dae);
KT_API const double *kt_dae_velocities(const kt_dae *dae);
KT_API const double *kt_dae_multipliers(const kt_dae *dae);

/* Computes the largest |phi| (m or rad) and |A v - b'| (m/s or rad/s) of the present state. */
KT_API KT_CHECKED kt_status kt_dae_residual(kt_dae *dae, kt_residual *residual, kt_error *error);

/* Returns the condition number, from singular values, of the matrix dF/dy + dF/dy' / (h a) of the last step's Newton
 * iteration (all stages). It grows as h^-k with the index k, if nothing is scaled. NaN before the first step. O(N^3).
 * Source: L. Petzold, P. Loetstedt, SIAM J. Sci. Stat. Comput. 7 (1986) 720. */
KT_API double kt_dae_condition(kt_dae *dae);

/* Counts of the work of steps since the start. */
typedef struct kt_dae_counts {
    uint64_t steps;      /* steps taken */
    uint64_t iterations; /* of Newton's method, in all */
    uint64_t jacobians;  /* of stages that were differentiated */
} kt_dae_counts;

/* Returns the counts so far. */
KT_API kt_dae_counts kt_dae_counts_get(const kt_dae *dae);

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
    int tolerance_count;             /* length of tolerances */
    const kt_variant *variants;      /* every method is run in each; NULL: in the scene's own settings */
    int variant_count;               /* length of variants */
    const kt_variant *own;           /* the scene's own settings; NULL: kt_variant_default of the run */
    const kt_reference *reference;   /* NULL: computed */
    uint64_t run_evaluations;        /* the largest number of evaluations of one run */
    double amplification;            /* the study ends where a small error has grown by this factor */

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
    kt_residual constraint;            /* the largest at any record */
} kt_accuracy_error;

/* One run. */
typedef struct kt_accuracy_point {
    double setting;              /* step, s, or tolerance (relative = absolute) */
    kt_status status;            /* of the run; if it is not KT_OK, the rest describes the part of the run before the
                                    failure */
    kt_status verdict;           /* kt_constraint_formulation_verdict after the run, if a formulation is used */
    bool usable;                 /* the run reached its end, with an error below a tenth of the motion's amplitude */
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
    X(KT_ACCURACY_BUDGET, "the time was used up")                                                                      \
    X(KT_ACCURACY_UNUSABLE, "no setting worked")

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
    double slope;       /* d log(error) / d log(setting): the order, or for tolerances the proportionality, ideally 1 */
    double floor;       /* the error at which it stops falling; NaN: not reached */
    double stable_step; /* s, the largest stable step, if stability and not accuracy bounds it; else 0 */
    kt_accuracy_end end; /* why the curve has no further point */
} kt_accuracy_curve;

/* Why the study ends before the requested duration. */
typedef enum kt_accuracy_cut {
    KT_ACCURACY_WHOLE = 0,    /* it does not end early */
    KT_ACCURACY_GROWTH,       /* small errors have grown by the factor options.amplification: chaos */
    KT_ACCURACY_DISAGREEMENT, /* the two reference solutions diverge */
    KT_ACCURACY_LATE,         /* the reference would take too long */
} kt_accuracy_cut;

/* The unit of errors in position. */
typedef enum kt_accuracy_unit {
    KT_ACCURACY_RADIAN = 0, /* angles only, rad */
    KT_ACCURACY_METRE,      /* lengths only, m */
    KT_ACCURACY_MIXED,      /* angles, and lengths over the length scale */
} kt_accuracy_unit;

/* The results of a study. The arrays belong to the study. */
typedef struct kt_accuracy_results {
    double asked, duration; /* s: requested; studied */
    kt_accuracy_cut cut;    /* why they differ, if they do */
    double interval;        /* s between records */
    int records;            /* intervals */
    kt_accuracy_unit unit;  /* of errors in position */
    double length;          /* m, the length scale */
    double amplitude;       /* of the motion, in the norm: the largest distance from the initial state */
    double amplification;   /* the largest growth factor of a small error up to the end of the study */
    double growth;          /* 1/s, log(amplification) / duration */

    const kt_method *reference;                  /* method of the reference; NULL: the reference was given */
    const kt_method *check;                      /* method of the second solution */
    double reference_tolerance, check_tolerance; /* of the two */
    double check_step; /* s: the longest step of the check, a hundredth of the shortest feature of functions of time,
                          or the limit that a tenth of the budget allows; 0: no limit */
    kt_accuracy_error uncertainty; /* the difference of the two solutions */

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
 * moves); KT_ERROR_CALLBACK (progress stopped it); the error that stopped the reference. */
KT_API KT_CHECKED kt_status kt_accuracy_create(const kt_description *description, const kt_run *run,
                                               const kt_accuracy_options *options, kt_accuracy **study,
                                               kt_error *error);
/* Releases a study; NULL is allowed. */
KT_API void kt_accuracy_free(kt_accuracy *study);

/* Returns the results, valid until the study is released. */
KT_API const kt_accuracy_results *kt_accuracy_get(const kt_accuracy *study);

/* Returns the model of the scene, compiled with the scene's own settings. */
KT_API const kt_model *kt_accuracy_model(const kt_accuracy *study);

/* Returns the index of the cheapest point with a position error of at most `goal`, the reference's uncertainty
 * included; -1: none. */
KT_API int kt_accuracy_best(const kt_accuracy *study, double goal);

/* Makes one more run, of any variant, like those of the study, and writes its point. Errors: as kt_accuracy_create. */
KT_API KT_CHECKED kt_status kt_accuracy_measure(kt_accuracy *study, const kt_variant *variant, const kt_method *method,
                                                bool adaptive, double setting, kt_accuracy_point *point,
                                                kt_error *error);

/* Compares a run of another program with the study's reference. `poses` has a row for each record, from the start on
 * (results.records + 1). A row has seven numbers for each body of the model but the world, in the model's order: the
 * origin of its frame (m, world axes) and the quaternion w, x, y, z of its rotation.
 * Sets point->status, usable, believed and error.position and end_position; other errors are NaN. If a number is not
 * finite, or a quaternion is none, the status is KT_ERROR_STEP and the error infinite.
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
