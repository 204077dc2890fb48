/* Experimental. Other formulations of the equations of motion, for comparison.
 *
 * The absolute formulation gives each body six coordinates, and makes a loop of each joint. The constraint formulations
 * keep the coordinates of the tree, and treat the equations of its loops in another way than the library does. Both use
 * simulations as any other program does: the absolute formulation has a model of its own, and the constraint
 * formulations are right-hand sides. The functions are in libkinetree-study.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_FORMULATION_H
#define KINETREE_FORMULATION_H

#include "kinetree/run.h"
#include "kinetree/simulation.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the absolute formulation ------------------------------------------------------------------------------------ */

/* Returns the name, such as "tree"; NULL for a value out of range. */
KT_API const char *kt_formulation_name(kt_formulation formulation);

/* The absolute formulation of a model. */
typedef struct kt_absolute kt_absolute;

/* Compiles the absolute formulation of a model. The model was compiled from this description and must outlive the
 * absolute formulation. kt_absolute_free releases *absolute; threads may share the object. options may be
 * NULL.
 * Errors: those of kt_model_compile.
 * Cost: O(size), and the ranks of as many equations as the joints have. */
KT_API KT_CHECKED kt_status kt_absolute_create(const kt_description *description, const kt_model_options *options,
                                               const kt_model *model, kt_absolute **absolute, kt_error *error);
/* Releases an absolute formulation; does nothing with NULL. */
KT_API void kt_absolute_free(kt_absolute *absolute);

/* Returns the model that is integrated. Every body is free. Every joint becomes a loop with the name of its body; these
 * loops follow those of the description. Bodies are in the description's order. Massless bodies, NAME.position and
 * NAME.cross, may follow. Relations, effects and oblique universal joints are attached to these bodies. NULL for
 * NULL. */
KT_API const kt_model *kt_absolute_model(const kt_absolute *absolute);

/* The next four functions convert between the tree and the absolute model. Free states, free wrenches and free
 * reactions belong to the absolute model; all others belong to the tree's. The functions do nothing if an argument is
 * NULL that may not be.
 *
 * Computes the free state of a state. The data belong to the tree's model and have the kinematics of the state
 * (kt_kinematics_update). */
KT_API void kt_absolute_from_tree(const kt_absolute *absolute, const kt_data *data, const double *q, const double *v,
                                  double *free_q, double *free_v);

/* Computes the state and the accelerations from a free state with closed loops; free_a and a may both be NULL. On entry
 * q and v hold the state `ago` seconds earlier (negative: later). It selects one of the numbers that represent the same
 * rotation: a joint must turn by the mean of its rates at both times to within half a turn. */
KT_API void kt_absolute_to_tree(const kt_absolute *absolute, const double *free_q, const double *free_v,
                                const double *free_a, double ago, double *q, double *v, double *a);

/* Computes the wrenches on all free bodies, for kt_simulation_set_wrenches and similar calls. They consist of
 * `external`, the wrenches on the tree's bodies (NULL: none), and of the wrenches that tau (NULL: zero) exerts in its
 * joints. */
KT_API void kt_absolute_wrenches(const kt_absolute *absolute, const double *free_q, const double *tau,
                                 const kt_wrench *external, kt_wrench *wrenches);

/* Computes the reactions in joints (one for each body, as in kt_joint_reactions) and in loops (NULL: the tree has
 * none), under tau (NULL: zero). free_reactions are the reactions in all loops of the absolute model. */
KT_API void kt_absolute_reactions(const kt_absolute *absolute, const double *free_q, const double *tau,
                                  const kt_wrench *free_reactions, kt_wrench *joints, kt_wrench *loops);

/* A simulation of the absolute model, and its state and records in the coordinates of the tree. */
typedef struct kt_absolute_motion kt_absolute_motion;

/* Creates a simulation in the assembled initial state of the tree. kt_absolute_motion_free releases *motion. run and
 * options may be NULL; markers and records are those of the tree. The absolute formulation must outlive the motion.
 * Restrictions: the motion has no events, and no torques in joints. Checkpoints of the simulation do not contain the
 * number of whole turns of the joints. Parameters cannot change.
 * Errors: those of kt_simulation_create. KT_ERROR_UNSUPPORTED (options.events; hard contacts; loops or effects that are
 * switched). */
KT_API KT_CHECKED kt_status kt_absolute_motion_create(const kt_absolute *absolute, const kt_run *run,
                                                      const kt_simulation_options *options, kt_absolute_motion **motion,
                                                      kt_error *error);
/* Releases a motion and its simulation; does nothing with NULL. */
KT_API void kt_absolute_motion_free(kt_absolute_motion *motion);

/* Returns the simulation of the absolute model, for counts, times, steps and similar calls. NULL for NULL. */
KT_API kt_simulation *kt_absolute_motion_simulation(const kt_absolute_motion *motion);

/* Restarts at time t from the tree's q and v (NULL: at rest), as kt_simulation_set_state does. */
KT_API KT_CHECKED kt_status kt_absolute_motion_set_state(kt_absolute_motion *motion, double t, const double *q,
                                                         const double *v, kt_error *error);

/* Runs the simulation as kt_simulation_run does. The records have the coordinates, kinematics and reactions of the
 * tree. Energies, works, residuals of constraints and multipliers are those of the absolute model.
 * Errors: those of kt_simulation_run. */
KT_API KT_CHECKED kt_status kt_absolute_motion_run(kt_absolute_motion *motion, kt_recorder *record, void *user,
                                                   kt_error *error);

/* Returns the tree's positions (nq), or velocities (nv), in the simulation's present state. The pointers are valid for
 * the life of the motion, and their contents until the next call with the motion or its simulation. NULL for NULL.
 * Whole turns count under the condition of kt_absolute_to_tree: in every step of kt_absolute_motion_run, or from one
 * of these calls to the next. */
KT_API const double *kt_absolute_motion_positions(kt_absolute_motion *motion);
KT_API const double *kt_absolute_motion_velocities(kt_absolute_motion *motion);

/* Computes the tree's accelerations (nv) in the present state, as kt_simulation_acceleration does. */
KT_API KT_CHECKED kt_status kt_absolute_motion_acceleration(kt_absolute_motion *motion, double *a, kt_error *error);

/* ---- constraint formulations ------------------------------------------------------------------------------------- */

/* Formulations that keep loops closed without reducing coordinates. Each formulation is a right-hand side for
 * kt_simulation_options, with dense algebra in tree coordinates. The formulations serve for comparison with the
 * reduction, which is faster and more accurate. With M a = f + A' lambda (f = tau - h of the tree, effects included),
 * phi(u, t) = 0, A v = b', A a = b'':
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

/* Returns the defaults for steps of this length in s, > 0 (adaptive: the longest expected step): alpha = beta = 0.1 /
 * step, penalty 1e4 and 12 iterations. The tolerances are 1e-11 and 1e-12.
 *
 * The reasons for the gains come from the bundled linkages:
 *   Ten times this gain made the errors of rk4 larger by 3 to 100, because the stabilising forces disturb the motion.
 *   With the same gain dopri5 took 5 to 17 times as many evaluations.
 *   The gain alpha = 0.1 / step grows as steps shrink and costs rk4 one or two orders. The order was 3.2 on Andrews'
 *     mechanism and 2.0 on Bricard's. Constant gains keep the order 4.0.
 *   With alpha = 0.1 / step, rk4 passes the singular positions of the N-four-bar; with constant gains, rk4 fails. */
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

/* Initialises a formulation in the caller's memory (KT_ALIGNMENT). The model must outlive the formulation. For
 * simulations in the absolute formulation, the model is their kt_absolute_model. The object is scratch and belongs to
 * one thread at a time. data are scratch of this model.
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
 * Method: central differences. The error is some 1e-8 of the largest eigenvalue, or 1e-4 for multiple eigenvalues.
 * Allocates, and releases, its matrices.
 * Errors: KT_ERROR_MEMORY, KT_ERROR_NOT_FINITE; as kt_constraint_formulation_evaluate.
 * Cost: 4 nv evaluations, and O(nv^3). */
KT_API KT_CHECKED kt_status kt_constraint_formulation_spectrum(kt_constraint_formulation *formulation, kt_data *data,
                                                               double t, const double *q, const double *v, double *real,
                                                               double *imaginary, kt_error *error);

/* Makes simulations with these options use the formulation, which must outlive these simulations. A formulation serves
 * one simulation at a time. */
KT_API void kt_constraint_formulation_use(kt_constraint_formulation *formulation, kt_simulation_options *options);

/* Statistics of a formulation since its initialisation or last reset. */
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
kt_constraint_formulation_statistics_of(const kt_constraint_formulation *formulation);
/* Clears the statistics. */
KT_API void kt_constraint_formulation_reset(kt_constraint_formulation *formulation);

/* Returns KT_OK if the statistics show no sign of wrong results. Errors: KT_ERROR_CONSTRAINT (loops came apart,
 * redundant equations were treated as independent). KT_ERROR_SINGULAR (the motion passed a singular position, which
 * this formulation cannot cross). */
KT_API KT_CHECKED kt_status kt_constraint_formulation_verdict(const kt_constraint_formulation *formulation,
                                                              kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
