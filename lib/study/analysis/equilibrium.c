/* Static equilibrium: a position where the mechanism stays at rest.
 *
 * E is the basis of free velocities that the loop equations allow (independent_coordinates.c; rolling wheels roll). In
 * these directions the force is g = E' M a, whose change along E y is -H y, H = -E' d(M a)/dy. If there is a potential
 * energy V, g is -dV/dy and H its second derivative. A step solves
 *
 *     (H + mu D) y = g,   D the diagonal of E' M E
 *
 * which is an implicit Euler step of size 1 / mu of the overdamped motion D y' = g (pseudo-transient continuation
 * [Kelley & Keyes]). With mu large enough for H + mu D to be positive definite the step leads downhill and past
 * saddles. At a stable equilibrium mu = 0 suffices, which is Newton's method. A step is accepted if the mean of the
 * forces at its two ends does positive work along the step. D is diagonal, so that degrees of freedom without force or
 * stiffness keep their positions.
 *
 * With mu = 0 for any H, and steps accepted if |g| falls, the same iteration finds equilibria nearby, stable or not.
 * The iteration stalls where |g| has a minimum above zero, and at kinks, where a stop or a contact begins. Then other
 * starts are tried around the given one, farther and farther away, and at last the way downhill.
 *
 * A search has arrived where no force is left but rounding errors, and where it stalls, with some room (RESTING).
 *
 * Source: C. T. Kelley, D. E. Keyes, SIAM Journal on Numerical Analysis 35, 1998, 508-523.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"
#include "base/copy.h"
#include "base/generic.h"
#include "base/options.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/open.h"
#include "linear/cholesky.h"
#include "linear/lapack.h"
#include "loop/loop.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { STEPS_MOST = 300, SHORTER_MOST = 40 };

#define REACH 0.3       /* initial bound of a step, in units */
#define TURN_MOST 1.0   /* largest change of an angle in one step, rad, before steps show that the forces are linear */
#define LINEAR 0.1      /* of the forces, by which a linear prediction may be wrong if the next step is to be longer */
#define RUNAWAY 1e9     /* in units: the search ends when its path is this long, */
#define NEUTRAL 1e-10   /* of the largest stiffness: least mu, for directions without stiffness */
#define CLOSE 1e-6      /* in units: shorter steps are also accepted if |a| falls, as Newton's */
#define ASYMMETRY 1e-12 /* of the largest stiffness: rounding errors */
#define ROUNDING (4.0 * DBL_EPSILON)
#define RESTING 1e4 /* times that may be left where no step improves anything: 1e-11 of the forces that cancel */

/* The starts of a search for the nearest, displaced by up to these parts of a unit. */
static const double scatter[] = {0.0, 0.1, 0.3, 1.0, 1.0, 2.0, 3.0};
enum { STARTS = sizeof scatter / sizeof scatter[0] };

/* The state of a search; q0 and a0 of the linearisation are its current position and acceleration. */
typedef struct search {
    kt_linearization *l;
    kt_system_arrays *out;
    bool nearest;
    int dofs;
    size_t dependents; /* coordinates that depend on others */
    double reach;      /* bound of a step */
    double turn;       /* bound of the angles in it, rad */
    double rounding;   /* rounding error of forces times units, J */
    double resting;    /* the same where coordinates are large, too: of a search that has arrived */
} search;

/* ---- matrices ---------------------------------------------------------------------------------------------------- */

/* Lists the coordinates in which columns of E may have entries other than 0 and 1 (dot_column). */
static void find_dependents(search *s) {
    s->dependents = 0;
    for (size_t i = 0; i < s->l->size.v; i++)
        if (s->l->pivot_row[i] >= 0)
            s->l->dependent[s->dependents++] = (int32_t)i;
}

/* E_j' f. The column E_j has 1 at its independent coordinate, and 0 at all other independent coordinates. */
static double dot_column(const search *s, size_t j, const double *f) {
    const kt_linearization *l = s->l;
    const double *e = l->free_velocity + j * l->size.v;
    double sum = f[s->out->velocity_coordinate[j]];
    for (size_t d = 0; d < s->dependents; d++)
        sum += e[l->dependent[d]] * f[l->dependent[d]];
    return sum;
}

/* E' f */
static void reduce_force(const search *s, const double *f, double *force) {
    for (size_t j = 0; j < (size_t)s->dofs; j++)
        force[j] = dot_column(s, j, f);
}

/* E' M a at q; scratch: nv numbers. */
static kt_status force_at(const search *s, const double *q, const double *a, double *scratch, double *force,
                          kt_error *error) {
    memcpy(scratch, a, s->l->size.v * sizeof *a);
    const kt_status status = kt_probe_force(s->l, q, scratch, error);
    reduce_force(s, scratch, force);
    return status;
}

/* D, the diagonal of E' M E. */
static void fill_inertia(const search *s) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    for (size_t j = 0; j < (size_t)s->dofs; j++) {
        const double *e = l->free_velocity + j * nv;
        l->inertia[j] = 0.0;
        for (size_t k = 0; k < nv; k++)
            if (e[k] != 0.0)
                l->inertia[j] += e[k] * dot_column(s, j, l->mass + k * nv);
    }
}

/* g at q0, and the sizes to which its rounding errors are proportional. */
static kt_status fill_equilibrium_force(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    double most = 0.0;
    const kt_status status = force_at(s, l->q0, l->a0, l->ahead, l->force, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < nv; i++)
        most = fmax(most, fmax(fabs(l->ahead[i]), fabs(l->weight[i])) * l->unit[i]);
    for (size_t i = 0; i < nv; i++)
        l->floor[2 * nv + i] = most / l->unit[i];
    return KT_OK;
}

/* d(M a)/dy along the columns of E, and M. */
static kt_status differentiate_force(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    kt_status status = kt_exact_is_possible(l) ? kt_exact_force_derivatives(l, (size_t)s->dofs, l->free_velocity, error)
                                               : KT_ERROR_SINGULAR;
    if (status != KT_ERROR_SINGULAR)
        return status;
    status = kt_dynamics_mass(l->model, l->data, l->q0, l->mass, error);
    for (size_t j = 0; j < (size_t)s->dofs && status == KT_OK; j++)
        status = kt_linearization_differentiate(l, l->free_velocity + j * l->size.v, NULL, 1.0, j, error);
    return status;
}

/* H at q0; entries below their estimated error are set to zero. */
static kt_status fill_stiffness(const search *s, kt_error *error) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v, n = (size_t)s->dofs;
    const kt_status status = differentiate_force(s, error);
    if (status != KT_OK)
        return status;
    for (size_t j = 0; j < n; j++) {
        const double *derivative = l->derivative + j * l->size.f + 2 * nv,
                     *derivative_error = l->derivative_error + j * l->size.f + 2 * nv;
        for (size_t i = 0; i < nv; i++)
            l->step[i] = fabs(derivative[i]) > derivative_error[i] ? -derivative[i] : 0.0;
        reduce_force(s, l->step, l->stiffness + j * n);
    }
    return KT_OK;
}

/* max |H_ij| / sqrt(D_i D_j): up to a small factor a bound of the eigenvalues of D^-1 H. */
static double stiffest(const search *s) {
    const size_t n = (size_t)s->dofs;
    double most = 0.0;
    for (size_t j = 0; j < n; j++) {
        double column = 0.0;
        for (size_t i = 0; i < n; i++)
            column = fmax(column, s->l->stiffness[j * n + i] * s->l->stiffness[j * n + i] / s->l->inertia[i]);
        most = fmax(most, column / s->l->inertia[j]);
    }
    return sqrt(most);
}

/* factor <- H + mu D, or its symmetric part */
static void add_up(const search *s, double mu, bool symmetric) {
    const size_t n = (size_t)s->dofs;
    const double *h = s->l->stiffness;
    double *to = s->l->factor;
    memcpy(to, h, n * n * sizeof *to);
    for (size_t j = 0; j < n && symmetric; j++)
        for (size_t i = j + 1; i < n; i++)
            to[j * n + i] = 0.5 * (h[j * n + i] + h[i * n + j]); /* the lower triangle */
    for (size_t j = 0; j < n; j++)
        to[j * (n + 1)] += mu * s->l->inertia[j];
}

/* Computes the rounding error of forces. The error follows from the weights, and from the force of the stiffest degree
 * of freedom displaced by a unit. For the rest criterion, the force by the rounding of its position counts, too. */
static void expect_force_rounding(search *s) {
    kt_linearization *l = s->l;
    double most = 0.0, resting = 0.0;
    for (size_t i = 0; i < l->size.v; i++)
        most = fmax(most, l->floor[2 * l->size.v + i] * l->unit[i]);
    for (size_t j = 0; j < (size_t)s->dofs; j++) {
        const int at = s->out->velocity_coordinate[j];
        const double stiff = fabs(l->stiffness[j * (size_t)s->dofs + j]) * l->unit[at];
        most = fmax(most, stiff * l->unit[at]);
        resting = fmax(resting, stiff * l->floor[at]);
    }
    s->rounding = ROUNDING * most;
    s->resting = RESTING * ROUNDING * fmax(most, resting);
}

/* Whether the remaining forces are small enough for rest. */
static bool is_at_rest(const search *s) {
    bool rests = true;
    for (int j = 0; j < s->dofs; j++)
        rests &= fabs(s->l->force[j]) * s->l->unit[s->out->velocity_coordinate[j]] <= s->resting;
    return rests;
}

/* Sets forces below their rounding error to zero, so that they cause no step where nothing resists; returns whether any
 * force remains. */
static bool clear_force_rounding(const search *s) {
    bool any = false;
    for (int j = 0; j < s->dofs; j++) {
        const bool zero = fabs(s->l->force[j]) * s->l->unit[s->out->velocity_coordinate[j]] <= s->rounding;
        s->l->force[j] = zero ? 0.0 : s->l->force[j];
        any |= !zero;
    }
    return any;
}

/* Whether H is symmetric except for rounding errors, like the H of a potential energy. */
static bool is_symmetric(const search *s, double stiff) {
    const size_t n = (size_t)s->dofs;
    const double *h = s->l->stiffness, *d = s->l->inertia;
    double most = 0.0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = j + 1; i < n; i++) {
            const double apart = h[j * n + i] - h[i * n + j];
            most = fmax(most, apart * apart / (d[i] * d[j]));
        }
    return most <= ASYMMETRY * ASYMMETRY * stiff * stiff;
}

/* Solves for the step, into l->step; returns false if the matrix is singular. */
static bool solve_equilibrium_step(const search *s, double stiff) {
    kt_linearization *l = s->l;
    bool positive = false;
    double mu = NEUTRAL * (stiff > 0.0 ? stiff : 1.0);
    memcpy(l->step, l->force, (size_t)s->dofs * sizeof *l->step);
    for (int i = 0; i < 60 && !s->nearest && !positive; i++) {
        if (i)
            mu *= mu < 1e-3 * stiff ? 16.0 : 2.0;
        add_up(s, mu, true);
        positive = kt_lapack_potrf(s->dofs, l->factor) == 0;
    }
    if (positive && is_symmetric(s, stiff)) {
        kt_dense_solve(l->factor, s->dofs, l->step);
        return true;
    }
    add_up(s, mu, false);
    return kt_lapack_gesv(s->dofs, l->factor, l->pivot, l->step) == 0;
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* |x|^2 in units. */
static double sum_of_squares(const kt_linearization *l, const double *x) {
    double sum = 0.0;
    for (size_t i = 0; i < l->size.v; i++)
        sum += x[i] / l->unit[i] * (x[i] / l->unit[i]);
    return sum;
}

/* g' D^-1 g */
static double square_of_force(const search *s, const double *force) {
    double sum = 0.0;
    for (int j = 0; j < s->dofs; j++)
        sum += force[j] * force[j] / s->l->inertia[j];
    return sum;
}

/* The step E y of all coordinates, shortened to its bounds, into l->direction; returns its length in units. *share: the
 * part of E y that is left. */
static double expand_step(const search *s, double *share) {
    kt_linearization *l = s->l;
    const size_t nv = l->size.v;
    double part = 1.0;
    memset(l->direction, 0, nv * sizeof *l->direction);
    for (size_t j = 0; j < (size_t)s->dofs; j++)
        for (size_t i = 0; i < nv; i++)
            l->direction[i] += l->free_velocity[j * nv + i] * l->step[j];
    const double length = kt_largest_in_units(l, l->direction);
    for (size_t k = 1; k < l->model->n.link; k++) {
        const kt_link *link = &l->model->link[k];
        for (int i = 0; i < kt_link_dofs(link); i++) {
            const double most = i < kt_link_lengths(link) ? s->reach * l->unit[link->v + i] : fmin(s->reach, s->turn);
            part = fmin(part, most / fmax(fabs(l->direction[link->v + i]), most));
        }
    }
    for (size_t i = 0; i < nv; i++)
        l->direction[i] *= part;
    *share = part;
    return part * length;
}

/* Whether the forces at the end of a step, in l->behind, agree with the prediction by H. If so, the next step may be
 * longer, because a geared motor may turn by hundreds of radians while its arm hardly moves. */
static bool is_predicted(const search *s, double share) {
    const kt_linearization *l = s->l;
    const size_t n = (size_t)s->dofs;
    double wrong = 0.0;
    for (size_t i = 0; i < n; i++) {
        double force = l->force[i];
        for (size_t j = 0; j < n; j++)
            force -= share * l->stiffness[j * n + i] * l->step[j];
        wrong += (l->behind[i] - force) * (l->behind[i] - force) / l->inertia[i];
    }
    return wrong <= LINEAR * LINEAR * square_of_force(s, l->force);
}

/* Evaluates the position `part` of the step away, into tried_q and tried_a. */
static kt_status try_equilibrium_step(const search *s, double part, kt_error *error) {
    kt_linearization *l = s->l;
    for (size_t i = 0; i < l->size.v; i++) {
        l->ahead[i] = part * l->direction[i];
        l->v[i] = 0.0;
    }
    kt_position_add(l->model, l->q0, l->ahead, l->tried_q);
    kt_status status = kt_state_project(l->model, l->data, l->t, l->tried_q, l->v, NULL, error);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(l->model, l->data, l->t, l->tried_q, l->v0, l->tau, NULL, l->tried_a, error);
    return status;
}

/* Whether the tried position is closer to an equilibrium. */
static bool is_better(const search *s, double length) {
    kt_linearization *l = s->l;
    if (force_at(s, l->tried_q, l->tried_a, l->ahead, l->behind, NULL) != KT_OK)
        return false;
    if (s->nearest) /* in the freedoms of the start, in which the step is Newton's, |g| falls at first */
        return square_of_force(s, l->behind) < square_of_force(s, l->force);
    const double work = kt_dense_dot(l->force, l->step, s->dofs) + kt_dense_dot(l->behind, l->step, s->dofs);
    return work > 0.0 || (length < CLOSE && sum_of_squares(l, l->tried_a) < sum_of_squares(l, l->a0));
}

/* One step of the search. Returns its length in units, or 0 if no part of the step is an improvement. */
static double take_equilibrium_step(search *s, kt_error *error) {
    kt_linearization *l = s->l;
    double share;
    const double whole = expand_step(s, &share);
    for (int i = 0; i < SHORTER_MOST; i++) {
        const double part = ldexp(1.0, -i);
        if (try_equilibrium_step(s, part, error) == KT_OK && is_better(s, part * whole)) {
            s->reach = i ? fmax(part * s->reach, REACH) : 2.0 * s->reach;
            s->turn = fmax(is_predicted(s, part * share) ? 2.0 * s->turn : 0.5 * s->turn, TURN_MOST);
            memcpy(l->q0, l->tried_q, l->size.q * sizeof *l->q0);
            memcpy(l->a0, l->tried_a, l->size.v * sizeof *l->a0);
            return part * whole;
        }
        if (part * whole < DBL_EPSILON)
            break;
    }
    return 0.0;
}

/* ---- the search -------------------------------------------------------------------------------------------------- */

/* Rejects a loop that is driven at t: such a loop does not permit rest. */
static kt_status reject_driven(const kt_linearization *l, kt_error *error) {
    for (size_t i = 0; i < l->model->n.loop; i++) {
        const kt_loop_record *loop = &l->model->loop[i];
        double f[3] = {0.0, 0.0, 0.0};
        if (kt_loop_is_off(loop))
            continue;
        if (loop->term_count) {
            const kt_relation_row row = kt_loop_kinds_baseline[loop->kind]->relate(loop, l->model->number, 0.0, l->t);
            f[1] = row.rate;
            f[2] = row.drift;
        } else if (loop->curve.type != KT_FUNCTION_NONE) {
            kt_curve_evaluate(&loop->curve, l->model->number, l->t, f);
        }
        if (f[1] != 0.0 || f[2] != 0.0)
            return kt_error_set(error, KT_ERROR_CONSTRAINT,
                                kt_where_format("loop '%s'", l->model->text + loop->name).text,
                                "it drives the mechanism at t = %g s, so there is no equilibrium; use a time without "
                                "this motion, or a constant",
                                l->t);
    }
    return KT_OK;
}

/* The name of the joint whose acceleration is largest over its unit, that acceleration, and its SI unit. */
static const char *fastest_joint_of(const kt_linearization *l, const double *x, double *acceleration,
                                    const char **unit) {
    const char *name = "";
    double most = 0.0;
    *acceleration = 0.0;
    *unit = "rad/s^2";
    for (size_t i = 1; i < l->model->n.link; i++) {
        const kt_link *link = &l->model->link[i];
        for (int k = 0; k < kt_link_dofs(link); k++)
            if (fabs(x[link->v + k]) / l->unit[link->v + k] >= most) {
                most = fabs(x[link->v + k]) / l->unit[link->v + k];
                *acceleration = fabs(x[link->v + k]);
                *unit = k < kt_link_lengths(link) ? "m/s^2" : "rad/s^2";
                name = l->model->text + l->model->body[link->body].joint_name;
            }
    }
    return name;
}

/* Reports the joint that is farthest from rest. limited: the search has ended at its largest number of steps. */
static kt_status give_up(const search *s, int steps, bool limited, double path, kt_error *error) {
    double acceleration;
    const char *unit, *name = fastest_joint_of(s->l, s->l->a0, &acceleration, &unit);
    const kt_where_text where = kt_where_format("joint '%.120s'", name);
    if (path >= RUNAWAY)
        return kt_error_set(error, KT_ERROR_STEP, where.text,
                            "there is no equilibrium: this joint accelerates without bound, by %.3g %s after %d steps; "
                            "add a force that holds it, such as a spring",
                            acceleration, unit, steps);
    if (limited)
        return kt_error_set(
            error, KT_ERROR_STEP, where.text,
            "no equilibrium was found within the limit of %d steps: after a path of %.3g rad or lengths "
            "this joint still accelerates by %.3g %s; add a force that holds it, such as a spring, or "
            "try a start that is nearer",
            steps, path, acceleration, unit);
    return kt_error_set(error, KT_ERROR_STEP, where.text,
                        "no equilibrium was found: this joint still accelerates by %.3g %s after %d steps; %s",
                        acceleration, unit, steps,
                        s->nearest ? "try another start" : "try another start, or the search for the nearest one");
}

/* Moves q0 to an equilibrium, or reports why there is none. */
static kt_status search_equilibrium(search *s, int most, kt_equilibrium *found, kt_error *error) {
    kt_linearization *l = s->l;
    kt_linear_system system = {0};
    double length = 0.0, path = 0.0;
    s->reach = REACH;
    s->turn = TURN_MOST;
    int steps = 0;
    for (; steps < most && path < RUNAWAY; steps++, found->steps++) {
        found->distance = length;
        found->acceleration = kt_largest_in_units(l, l->a0);
        if (found->acceleration == 0.0)
            return KT_OK;
        kt_status status = kt_independent_coordinates_choose(l, s->out, &system, error);
        s->dofs = system.velocities;
        find_dependents(s);
        kt_probe_floor(l);
        if (status == KT_OK)
            status = fill_equilibrium_force(s, error);
        if (status == KT_OK)
            status = fill_stiffness(s, error);
        if (status != KT_OK)
            return status;
        fill_inertia(s);
        expect_force_rounding(s);
        if (!clear_force_rounding(s))
            return KT_OK;
        if (!solve_equilibrium_step(s, stiffest(s)))
            break;
        const double before = length;
        length = take_equilibrium_step(s, error);
        path += length;
        /* Short steps that get no shorter are due to rounding. */
        if (is_at_rest(s) && (length == 0.0 || (length <= CLOSE && 2.0 * length >= before && steps > 0)))
            return KT_OK;
        if (length == 0.0)
            break;
    }
    return give_up(s, found->steps, steps == most, path, error);
}

/* Moves q0 to the given positions, displaced by up to `size` units and projected; returns whether that can be done. */
static bool start_search_at(const search *s, const double *given, double size, int start) {
    kt_linearization *l = s->l;
    for (size_t i = 0; i < l->size.v; i++) {
        l->ahead[i] = size * l->unit[i] * kt_generic(i + 131 * (size_t)start);
        l->v[i] = 0.0;
    }
    kt_position_add(l->model, given, l->ahead, l->q0);
    return kt_state_project(l->model, l->data, l->t, l->q0, l->v, NULL, NULL) == KT_OK &&
           kt_acceleration_evaluate(l->model, l->data, l->t, l->q0, l->v0, l->tau, NULL, l->a0, NULL) == KT_OK;
}

/* Searches from the start, and for the nearest from others; reports why the first has failed. */
static kt_status run_from(search *s, const double *given, int most, kt_equilibrium *found, kt_error *error) {
    const bool nearest = s->nearest;
    const kt_status status = search_equilibrium(s, most, found, error);
    found->starts = 1;
    if (status == KT_OK || !nearest)
        return status;
    for (int start = 1; start <= STARTS; start++) { /* the last one is downhill */
        s->nearest = start < STARTS;
        found->starts++;
        if (start_search_at(s, given, s->nearest ? scatter[start] : 0.0, start) &&
            search_equilibrium(s, most, found, NULL) == KT_OK)
            return KT_OK;
    }
    return status;
}

/* A failed search does not change the auxiliary states. */
static kt_status find_with_states(kt_linearization *l, const kt_equilibrium_options *options, double t, const double *q,
                                  const double *tau, kt_equilibrium *found, kt_error *error) {
    kt_copy(l->x_given, l->x0, l->size.x * sizeof *l->x0);
    const kt_status status = kt_equilibrium_of_states(l, options, t, q, tau, found, error);
    if (status != KT_OK)
        kt_copy(l->x0, l->x_given, l->size.x * sizeof *l->x0);
    return status;
}

kt_status kt_equilibrium_find(kt_linearization *l, const kt_equilibrium_options *options, double t, double *q,
                              const double *tau, kt_equilibrium *found, kt_error *error) {
    if (KT_IS_MISSING(error, l, q || !l->model->n.q))
        return KT_ERROR_ARGUMENT;
    kt_equilibrium_options own = kt_equilibrium_options_default();
    const kt_equilibrium_options *settings = KT_OPTIONS(kt_equilibrium_options, most, &own, options, error);
    if (settings == NULL)
        return KT_ERROR_ARGUMENT;
    if (settings->most < 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options.most", "%d: must be above zero, or zero for %d steps",
                            settings->most, STEPS_MOST);
    search s = {.l = l, .out = &l->arrays[l->next], .nearest = settings->nearest};
    kt_linear_system system = {0};
    kt_equilibrium result = {0};
    kt_status status = kt_lapack_open(error);
    if (status != KT_OK)
        return status;
    status = kt_linearization_begin(l, t, q, l->model->zero, tau, &system, error);
    if (status == KT_OK)
        status = reject_driven(l, error);
    memcpy(l->v0, l->model->zero, l->size.v * sizeof *l->v0);
    l->of_force = true;
    if (status == KT_OK && kt_auxiliary_state_varying(l->model) < l->size.x) /* constant ones are held */
        status = find_with_states(l, settings, t, q, tau, &result, error);
    else if (status == KT_OK)
        status = run_from(&s, q, settings->most > 0 ? settings->most : STEPS_MOST, &result, error);
    l->of_force = false;
    if (status == KT_OK)
        status = kt_open_contacts_check(l->model, l->data, t, l->q0, l->model->zero, error);
    if (status != KT_OK)
        return status;
    kt_copy(q, l->q0, l->size.q * sizeof *q);
    if (found)
        *found = result;
    return KT_OK;
}
