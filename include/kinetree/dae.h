/* Experimental. Differential-algebraic baselines: the equations of motion with multipliers, solved with implicit
 * methods.
 *
 * A baseline has its own steps. A comparison with a baseline measures the gain from the reduction to ordinary
 * differential equations. The functions are in libkinetree-study.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_DAE_H
#define KINETREE_DAE_H

#include "kinetree/integrator.h"
#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The equations of motion with multipliers, without reduction, solved with implicit methods. These formulations are the
 * baseline for the reduction to ordinary differential equations. In tangent coordinates, with q' = E(q) u:
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

/* Allocates a baseline of a model, which must outlive the baseline; kt_dae_free releases the baseline.
 * Errors: KT_ERROR_ARGUMENT (the type, the gains, a method that is not implicit or not of these families),
 * KT_ERROR_UNSUPPORTED without LAPACK, KT_ERROR_MEMORY. */
KT_API KT_CHECKED kt_status kt_dae_create(const kt_model *model, const kt_dae_options *options, kt_dae **dae,
                                          kt_error *error);
/* Releases a baseline; does nothing with NULL. */
KT_API void kt_dae_free(kt_dae *dae);

/* Starts at a state that satisfies the loops (kt_state_assemble), which is copied. A maximal independent set of
 * redundant equations is chosen once, with column pivoting. All other equations have the multiplier 0 in all steps.
 * Computes consistent multipliers and accelerations [MSD 8.54].
 * Errors: KT_ERROR_SINGULAR at a singular position, or without inertia along a joint; as kt_loop_equations. Then the
 * baseline has no state. */
KT_API KT_CHECKED kt_status kt_dae_start(kt_dae *dae, double t, const double *q, const double *v, kt_error *error);

/* Computes the multipliers (equations of all loops) of a closed state, from the equations that the baseline has chosen
 * at its start [MSD 8.54].
 * Errors: KT_ERROR_SINGULAR if these are not independent. */
KT_API KT_CHECKED kt_status kt_dae_consistent(kt_dae *dae, double t, const double *q, const double *v,
                                              double *multipliers, kt_error *error);

/* Takes a step of the length h > 0, with Newton's method to rounding. A method of two steps needs a previous step of
 * the same length. Otherwise, a one-step method takes the step.
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
 * iteration (all stages). Without scaling, the condition number grows as h^-k with the index k. NaN before the first
 * step. O(N^3).
 * Source: L. Petzold, P. Loetstedt, SIAM J. Sci. Stat. Comput. 7 (1986) 720. */
KT_API double kt_dae_condition(kt_dae *dae);

/* Counts of the work of steps since the start. */
typedef struct kt_dae_counts {
    uint64_t steps;      /* steps taken */
    uint64_t iterations; /* of Newton's method, in all */
    uint64_t jacobians;  /* of stages that were differentiated */
} kt_dae_counts;

/* Returns the counts so far. */
KT_API kt_dae_counts kt_dae_counts_of(const kt_dae *dae);

#ifdef __cplusplus
}
#endif
#endif
