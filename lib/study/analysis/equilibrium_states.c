/* Static equilibrium of a model with auxiliary states x: positions q and states at which nothing moves and no
 * state changes.
 *
 * With E the basis of free velocities and g = E' M a (equilibrium.c), and x' = f, Newton's method solves
 *
 *     g(q, x) = 0,   f(q, 0, x) = 0
 *
 *     [ E' D_q E   E' D_x ] [ y  ]   [ g ]
 *     [ F_q E      F_x    ] [ dx ] = [ f ],   D = -d(M a), F = -df          (kt_linearized_fill at a = 0)
 *
 * for a step (E y, dx). The step is shortened until the next step with the same matrix is shorter than this step (P.
 * Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3). An integrating controller has a state on which
 * its own rate does not depend. F_x is then singular, and the whole matrix is not.
 *
 * Newton's method fails if a valve or a controller at its limit has no slope, or if states that nothing holds make the
 * matrix singular. In these cases, the motion is followed from rest with linearly implicit Euler steps of d seconds,
 *
 *     [ E' (M / d^2 + D_v / d + D_q) E   E' D_x     ] [ y  ]   [ g + E' (M / d + D_v) v ]
 *     [ (F_v / d + F_q) E                F_x + 1/d  ] [ dx ] = [ f + F_v v              ],   v+ = E y / d
 *
 * whose length d grows as their displacements decrease, until the steps become Newton's (pseudo-transient continuation:
 * C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35 (1998) 508). Such steps damp oscillations, so that only motions
 * which go away or move on for ever find no rest.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"
#include "base/copy.h"
#include "base/where.h"
#include "derivative/stiffness.h"
#include "dynamics/dynamics.h"
#include "linear/cholesky.h"
#include "linear/lapack.h"

#include <math.h>
#include <string.h>

enum { STEPS_MOST = 100, SHORTER_MOST = 30, FOLLOWED_MOST = 400 };

#define ARRIVED 1e-13       /* in units: length of a step */
#define STALLED 1e-9        /* in units: length of a step of which no part reduces the residual */
#define LONGEST 1.0         /* in units: the longest step */
#define FIRST 1e-2          /* s: the first step in time */
#define LAST 1e9            /* s: the longest step in time, practically Newton's step */
#define FOLLOWED_LENGTH 0.1 /* in units: the longest step in time that is taken */

typedef struct search {
    kt_linearization *l;
    kt_system_arrays *out;
    double t;
    const double *tau;
    int dofs;
} search;

/* E' x for a column x of nv, into to. */
static void reduce_to_independent(const search *s, const double *x, double *to) {
    const kt_linearization *l = s->l;
    for (int j = 0; j < s->dofs; j++)
        to[j] = kt_dense_dot(l->free_velocity + (size_t)j * l->size.v, x, (int)l->size.v);
}

/* (E' f, rates) into to: the right-hand side at q0 and x0, where the accelerations are a0. */
static kt_status write_residual(const search *s, double *to, kt_error *error) {
    kt_linearization *l = s->l;
    memcpy(l->tried_a, l->a0, l->size.v * sizeof *l->a0);
    const kt_status status = kt_probe_force(l, l->q0, l->tried_a, error);
    if (status == KT_OK)
        reduce_to_independent(s, l->tried_a, to);
    kt_copy(to + s->dofs, l->x_rate, l->size.x * sizeof *to);
    return status;
}

/* l->step += (E' (M / d + D_v) v, F_v v). */
static void add_velocities(const search *s, const kt_linearized *w, double d) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    memset(l->tried_a, 0, nv * sizeof *l->tried_a);
    kt_add_columns(w->mass, nv, nv, 1.0, l->v0, l->tried_a);
    for (size_t i = 0; i < nv; i++)
        l->tried_a[i] /= d;
    kt_add_columns(w->d_v, nv, nv, 1.0, l->v0, l->tried_a);
    reduce_to_independent(s, l->tried_a, l->force);
    for (int j = 0; j < s->dofs; j++)
        l->step[j] += l->force[j];
    kt_add_columns(w->rate_v, l->size.x, nv, 1.0, l->v0, l->step + s->dofs);
}

/* Holds states with the rate 0 that nothing reads or changes, such as the position of a foothold. */
static void hold_idle_states(const search *s, double *matrix) {
    const size_t nx = s->l->size.x, n = (size_t)s->dofs + nx;
    for (size_t k = n - nx; k < n; k++) {
        bool idle = s->l->x_rate[k + nx - n] == 0.0;
        for (size_t i = 0; i < n && idle; i++)
            idle = matrix[k * n + i] == 0.0 && matrix[i * n + k] == 0.0;
        matrix[k * n + k] += idle ? 1.0 : 0.0;
    }
}

/* Writes the matrix at q0 and x0 into `factor`. d: the step in time, s; infinite for Newton's matrix. The right-hand
 * side of a step in time, in l->step, gains its terms by v0. */
static kt_status write_search_matrix(const search *s, double d, kt_error *error) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v, nx = l->size.x, n = (size_t)s->dofs + nx;
    kt_linearized w;
    (void)kt_linearized_init(&w, l->work, l->model, l->data, l->t, kt_linearized_is_dense(l->model));
    const kt_dynamic_state at = {.t = l->t, .q = l->q0, .v = l->v0, .tau = l->tau};
    const kt_status status = kt_linearized_fill(&w, &at, l->model->zero, error);
    const bool in_time = !isinf(d);
    if (in_time && status == KT_OK)
        add_velocities(s, &w, d);
    for (size_t i = 0; i < nv * nv && in_time && status == KT_OK; i++)
        w.d_q[i] += (w.d_v[i] + w.mass[i] / d) / d;
    for (size_t i = 0; i < nx * nv && in_time && status == KT_OK; i++)
        w.rate_q[i] += w.rate_v[i] / d;
    for (size_t j = 0; j < n && status == KT_OK; j++) {
        double *to = l->factor + j * n;
        const double *e = l->free_velocity + j * nv;
        memset(to, 0, n * sizeof *to);
        if (j < (size_t)s->dofs) {
            memset(l->tried_a, 0, nv * sizeof *l->tried_a);
            kt_add_columns(w.d_q, nv, nv, 1.0, e, l->tried_a);
            reduce_to_independent(s, l->tried_a, to);
            kt_add_columns(w.rate_q, nx, nv, 1.0, e, to + s->dofs);
        } else {
            reduce_to_independent(s, w.force_x + (j - (size_t)s->dofs) * nv, to);
            kt_copy(to + s->dofs, w.rate_x + (j - (size_t)s->dofs) * nx, nx * sizeof *to);
            to[j] += in_time ? 1.0 / d : 0.0;
        }
    }
    if (status == KT_OK)
        hold_idle_states(s, l->factor);
    return status;
}

/* The length of a step, in units. */
static double search_step_length(const search *s, const double *step) {
    const kt_linearization *l = s->l;
    double most = 0.0;
    for (int j = 0; j < s->dofs; j++)
        most = fmax(most, fabs(step[j]) / l->unit[s->out->velocity_coordinate[j]]);
    for (size_t k = 0; k < l->size.x; k++)
        most = fmax(most, fabs(step[s->dofs + (int)k]) / l->x_unit[k]);
    return most;
}

/* Moves to `part` of the step from tried_q and x_begin, which takes d seconds, or leads to rest. */
static kt_status move_search(const search *s, double part, double d, kt_error *error) {
    kt_linearization *l = s->l;
    kt_linear_system unused = {0};
    memset(l->direction, 0, l->size.v * sizeof *l->direction);
    for (int j = 0; j < s->dofs; j++)
        for (size_t i = 0; i < l->size.v; i++)
            l->direction[i] += part * l->step[j] * l->free_velocity[(size_t)j * l->size.v + i];
    for (size_t k = 0; k < l->size.x; k++)
        l->x0[k] = l->x_begin[k] + part * l->step[s->dofs + (int)k];
    kt_position_add(l->model, l->tried_q, l->direction, l->q);
    for (size_t i = 0; i < l->size.v; i++)
        l->direction[i] /= d;
    return kt_linearization_begin(l, s->t, l->q, l->direction, s->tau, &unused, error);
}

static kt_status reject_search(const search *s, const char *why, kt_error *error) {
    const char *name = kt_auxiliary_state_name(s->l->model, (int)kt_auxiliary_state_varying(s->l->model));
    return kt_error_set(
        error, KT_ERROR_STEP, kt_where_format("auxiliary state '%.60s', t = %.9g s", name, s->t).text,
        "no equilibrium of positions and auxiliary states was found: %s; start nearer to one, or let a run "
        "come to rest and go on from it",
        why);
}

/* The residual at q0 and x0, which are kept, and the matrix of a step of d seconds, HUGE_VAL: to rest. */
static kt_status begin_search_step(search *s, double d, kt_error *error) {
    kt_linearization *l = s->l;
    kt_linear_system system = {0};
    kt_status status = kt_independent_coordinates_choose(l, s->out, &system, error);
    s->dofs = system.velocities;
    if (status == KT_OK)
        status = write_residual(s, l->step, error);
    if (status == KT_OK)
        status = write_search_matrix(s, d, error);
    kt_copy(l->tried_q, l->q0, l->size.q * sizeof *l->q0);
    kt_copy(l->x_begin, l->x0, l->size.x * sizeof *l->x0);
    return status;
}

/* The unit of an auxiliary state is 1, or its size, or the largest size so far, because a state that swings through
 * zero is not small. */
static void choose_units(const search *s, bool so_far) {
    const kt_linearization *l = s->l;
    for (size_t k = 0; k < l->size.x; k++)
        l->x_unit[k] = fmax(so_far ? l->x_unit[k] : 1.0, fabs(l->x_begin[k]));
}

/* Takes one step from q0 and x0. *length: the length of the step in units, or 0 if no part of the step reduces the
 * residual. */
static kt_status take_search_step(search *s, double *length, kt_error *error) {
    kt_linearization *l = s->l;
    kt_status status = begin_search_step(s, HUGE_VAL, error);
    if (status != KT_OK)
        return status;
    const int n = s->dofs + (int)l->size.x;
    choose_units(s, false);
    *length = 0.0;
    if (search_step_length(s, l->step) == 0.0) /* no residual: the scene rests */
        return KT_OK;
    memcpy(l->matrix, l->factor, (size_t)n * (size_t)n * sizeof *l->factor);
    if (kt_lapack_gesv(n, l->factor, l->pivot, l->step) != 0)
        return reject_search(s, "nothing holds a position or a state where it is", error);
    const double whole = search_step_length(s, l->step);
    *length = whole;
    if (whole <= ARRIVED)
        return KT_OK;
    for (int i = 0; i < SHORTER_MOST; i++) {
        const double part = ldexp(fmin(1.0, LONGEST / whole), -i);
        if (move_search(s, part, HUGE_VAL, NULL) != KT_OK || write_residual(s, l->force, NULL) != KT_OK)
            continue;
        memcpy(l->factor, l->matrix, (size_t)n * (size_t)n * sizeof *l->factor);
        if (kt_lapack_gesv(n, l->factor, l->pivot, l->force) == 0 && search_step_length(s, l->force) < whole) {
            *length = part * whole;
            return KT_OK;
        }
    }
    status = move_search(s, 0.0, HUGE_VAL, error);
    *length = 0.0;
    return status == KT_OK && whole > STALLED ? reject_search(s, "no part of a step leads nearer", error) : status;
}

/* ---- the motion itself ------------------------------------------------------------------------------------------- */

/* Takes a step of d seconds, unless the step is too long. *length: the length of the step in units. */
static kt_status step_in_time(search *s, double d, double *length, kt_error *error) {
    kt_linearization *l = s->l;
    const kt_status status = begin_search_step(s, d, error);
    if (status != KT_OK)
        return status;
    const int n = s->dofs + (int)l->size.x;
    choose_units(s, true);
    if (kt_lapack_gesv(n, l->factor, l->pivot, l->step) != 0)
        return reject_search(s, "nothing holds a position or a state where it is", error);
    *length = search_step_length(s, l->step);
    return *length > FOLLOWED_LENGTH ? KT_OK : move_search(s, 1.0, d, error);
}

/* Follows the motion until a step of any duration leads nowhere. */
static kt_status follow_to_rest(search *s, kt_equilibrium *found, double *length, kt_error *error) {
    double d = FIRST;
    kt_status status = KT_OK;
    for (size_t k = 0; k < s->l->size.x; k++)
        s->l->x_unit[k] = 1.0;
    for (int i = 0; i < FOLLOWED_MOST && status == KT_OK; i++) {
        status = step_in_time(s, d, length, error);
        found->steps++;
        if (d >= LAST && *length <= ARRIVED)
            return status == KT_OK ? move_search(s, 1.0, HUGE_VAL, error) : status; /* there, at rest */
        if (*length > FOLLOWED_LENGTH)
            d *= 0.25;
        else if (*length < 0.5 * FOLLOWED_LENGTH)
            d = fmin(2.0 * d, LAST);
    }
    return status == KT_OK ? reject_search(s, "the motion from there does not come to rest", error) : status;
}

/* ---- the call ---------------------------------------------------------------------------------------------------- */

kt_status kt_equilibrium_of_states(kt_linearization *l, const kt_equilibrium_options *options, double t,
                                   const double *q, const double *tau, kt_equilibrium *found, kt_error *error) {
    search s = {.l = l, .out = &l->arrays[l->next], .t = t, .tau = tau};
    kt_linear_system system = {0};
    const int most = options->most > 0 ? options->most : STEPS_MOST;
    double length = HUGE_VAL;
    kt_status status = kt_linearization_begin(l, t, q, l->model->zero, tau, &system, error);
    found->starts = 1;
    while (status == KT_OK && length > ARRIVED && found->steps < most) {
        status = take_search_step(&s, &length, error);
        found->steps += length > 0.0;
    }
    if (status == KT_OK && length > ARRIVED)
        status = reject_search(&s, "the most steps are taken", error);
    if (status == KT_ERROR_STEP) {
        kt_copy(l->x0, l->x_given, l->size.x * sizeof *l->x0);
        status = kt_linearization_begin(l, t, q, l->model->zero, tau, &system, error);
        found->followed = true;
        if (status == KT_OK)
            status = follow_to_rest(&s, found, &length, error);
    }
    found->distance = length;
    if (status == KT_OK)
        found->acceleration = kt_largest_in_units(l, l->a0);
    return status;
}
