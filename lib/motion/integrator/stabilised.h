/* The family of Runge-Kutta-Chebyshev methods: its polynomials, and the parts that it shares with the estimate of the
 * spectral radius (stabilised.c, radius.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_STABILISED_H
#define KT_INTEGRATOR_STABILISED_H

#include "integrator/integrator.h"

/* ---- polynomials ------------------------------------------------------------------------------------------------- */

/* R(z) = a + b T_s(w0 + w1 z) */
typedef struct kt_chebyshev {
    int stages;
    double w0, w1, a, b;
} kt_chebyshev;

/* The damping epsilon of a method's family, and the number of step sequences that the method combines. rkc2 has a
 * single sequence. rkc4 extrapolates from three sequences, of one, two and three steps. */
double kt_chebyshev_damping(const kt_method *method);
int kt_chebyshev_copies(const kt_method *method);

/* The member of s stages, with s at least 2. Cost: O(s). */
kt_chebyshev kt_chebyshev_make(int stages, double damping);

/* R decays on -reach <= z < 0. */
double kt_chebyshev_reach(const kt_chebyshev *family);

/* The least number of stages, at least 2, whose reach is at least z. z must not be negative. Returns
 * KT_STABILISED_STAGES_MAX + 1 if the maximum is not enough. */
int kt_chebyshev_stages(double z, double damping);

/* T_j, T_j' and T_j'' at a point, for j and j - 1. kt_chebyshev_first sets j = 1. kt_chebyshev_next increases j by
 * 1. */
typedef struct kt_chebyshev_values {
    double t, dt, ddt;
    double t1, dt1, ddt1;
} kt_chebyshev_values;

static inline kt_chebyshev_values kt_chebyshev_first(double x) {
    kt_chebyshev_values values = {x, 1.0, 0.0, 1.0, 0.0, 0.0}; /* j = 1 */
    return values;
}

/* Advances T_j and its derivatives with the recurrence
 *
 *     T_{j+1} = 2 x T_j - T_{j-1} */
static inline void kt_chebyshev_next(kt_chebyshev_values *v, double x) {
    const double t = 2.0 * x * v->t - v->t1, dt = 2.0 * (v->t + x * v->dt) - v->dt1,
                 ddt = 2.0 * (2.0 * v->dt + x * v->ddt) - v->ddt1;
    v->t1 = v->t;
    v->dt1 = v->dt;
    v->ddt1 = v->ddt;
    v->t = t;
    v->dt = dt;
    v->ddt = ddt;
}

/* ---- the spectral radius ----------------------------------------------------------------------------------------- */

/* The number of stages is chosen for this factor times the estimated spectral radius. */
#define KT_RADIUS_MARGIN 1.2

enum { KT_RADIUS_VECTORS = 8 }; /* the largest number of directions in which f is differenced for its spectral radius */

/* The history of a motion: the spectral radius of f_y with its margin, in 1/s, and the number of steps since its
 * estimate. The radius is negative before the first estimate. */
enum { KT_HISTORY_RADIUS, KT_HISTORY_AGE, KT_STABILISED_HISTORY };

#define KT_STABILISED_FIELDS(X)                                                                                        \
    X(double, moved, 2 * n, "two stages less y")                                                                       \
    X(double, krylov, (KT_RADIUS_VECTORS + 1) * n, "directions")

/* Scratch of a step, laid out at its beginning (kt_need_radius). */
typedef struct kt_stabilised_scratch {
    double radius;         /* the spectral radius that the tries of this step use, 1/s */
    bool radius_is_of_now; /* the radius was estimated at this step's beginning */
    KT_ARENA_DECLARE(KT_STABILISED_FIELDS)
} kt_stabilised_scratch;

size_t kt_stabilised_scratch_size(size_t n);

static inline kt_stabilised_scratch *kt_stabilised_scratch_of(const kt_integrator *it) {
    return (kt_stabilised_scratch *)(void *)it->scratch;
}

static inline double kt_stabilised_radius(const kt_integrator *it) { return kt_stabilised_scratch_of(it)->radius; }

/* The longest step for which the largest number of stages suffices; HUGE_VAL if nothing decays. */
double kt_stabilised_reach(const kt_integrator *it);

/* Before a try: sets `radius`. The radius is estimated again if the radius in the history is too old, or if a try was
 * rejected. */
kt_try_result kt_need_radius(kt_integrator *it, bool rejected, kt_try *result);

/* Updates the history after a step; clears the history before the first step of a motion. */
void kt_radius_accept(kt_integrator *it);
void kt_radius_forget(kt_integrator *it);

#endif
