/* Problems of more contacts than the matrices of the cone solver have room for (cone.h), on a working set.
 *
 * Contacts outside of the set have no impulse. The problem of the set is solved as if they did not exist. At its
 * impulses, the contact outside that closes fastest joins the set. If none closes, the impulses obey the laws of all
 * contacts:
 *
 *     u = W p + b,    p_i = 0 and u_n,i >= 0    of each contact i outside
 *
 * If the set is full, contacts without an impulse leave it. The set has room for more contacts than degrees of freedom.
 * Dry friction and contacts with a least impulse stay in the set. Impulses of many contacts are not unique; this
 * solution has impulses at few contacts.
 *
 * The set changes by one contact at a time, so that most of its problems are small. Each problem starts from the
 * impulses of the previous problem.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The least tolerance of rates outside of the set, relative to the largest rate. Residuals within the set are
 * smaller. */
static const double closing = 1e-10;
/* Impulses below this part of the largest are none. */
static const double no_impulse = 1e-12;
/* The number of changes of the set, for each contact for which the set has room. */
enum { SET_CHANGES = 4 };

/* ---- the set ----------------------------------------------------------------------------------------------------- */

/* Dry friction and contacts with a least impulse have impulses at any rate. */
static bool must_stay(const kt_cone_problem *problem, int i) {
    return (problem->limit != NULL && problem->limit[i] > 0.0) || (problem->least != NULL && problem->least[i] > 0.0);
}

/* Whether an item has no impulse at any rate. */
static bool stays_open(const kt_cone_problem *problem, int i) {
    return problem->limit != NULL && problem->limit[i] == 0.0;
}

static void join_set(kt_cone *cone, int i, int *count) {
    cone->is_member[i] = true;
    cone->member[(*count)++] = i;
}

/* Begins with the items that stay, and with contacts that have impulses at the start. Returns false if the set has no
 * room for the items that stay. */
static bool begin_set(kt_cone *cone, const kt_cone_problem *problem, double *p, int *count) {
    double w[9];
    *count = 0;
    for (int i = 0; i < problem->n; i++) {
        problem->blocks->block(problem->blocks->user, i, i, w);
        const double most = fmax(w[0], fmax(w[4], w[8]));
        cone->unit[i] = most > 0.0 ? 1.0 / sqrt(most) : 1.0;
        cone->is_member[i] = false;
        if (must_stay(problem, i) && *count == cone->most)
            return false;
        if (must_stay(problem, i))
            join_set(cone, i, count);
    }
    for (int i = 0; i < problem->n; i++) {
        if (!cone->is_member[i] && p[3 * i] > 0.0 && !stays_open(problem, i) && *count < cone->most)
            join_set(cone, i, count);
        if (!cone->is_member[i])
            memset(p + 3 * i, 0, 3 * sizeof *p);
    }
    return true;
}

/* Keeps the members that are still marked. */
static void close_ranks(kt_cone *cone, double *p, int *count) {
    int kept = 0;
    for (int k = 0; k < *count; k++) {
        const int i = cone->member[k];
        if (cone->is_member[i])
            cone->member[kept++] = i;
        else
            memset(p + 3 * i, 0, 3 * sizeof *p);
    }
    *count = kept;
}

/* Makes room in a full set: removes contacts without an impulse. Returns whether there is room. */
static bool free_place(kt_cone *cone, const kt_cone_problem *problem, double *p, int *count) {
    double most = 0.0;
    for (int k = 0; k < *count; k++)
        most = fmax(most, p[3 * cone->member[k]]);
    for (int k = 0; k < *count; k++) {
        const int i = cone->member[k];
        cone->is_member[i] = must_stay(problem, i) || p[3 * i] > no_impulse * most;
    }
    close_ranks(cone, p, count);
    return *count < cone->most;
}

/* ---- the solution ------------------------------------------------------------------------------------------------ */

/* The contact outside of the set that closes fastest, or -1. *speed: relative to the largest rates and impulses. */
static int find_closing(kt_cone *cone, const kt_cone_problem *problem, const double *p, double *speed) {
    double size = 0.0, fastest = 0.0, sum = 0.0; /* the sum finds a NaN */
    int found = -1;
    problem->blocks->rates(problem->blocks->user, p, cone->rate);
    for (int i = 0; i < problem->n; i++) {
        const double unit = cone->unit[i], rate = (cone->rate[3 * i] + problem->b[3 * i]) * unit;
        for (int k = 0; k < 3; k++)
            size = fmax(size, fmax(fabs(problem->b[3 * i + k]) * unit, fabs(p[3 * i + k]) / unit));
        sum += rate;
        if (!cone->is_member[i] && !stays_open(problem, i) && -rate > fastest) {
            fastest = -rate;
            found = i;
        }
    }
    *speed = isfinite(sum) ? size > 0.0 ? fastest / size : 0.0 : (double)INFINITY;
    return found;
}

kt_cone_result kt_cone_solve_members(kt_cone *cone, const kt_cone_problem *problem, double *p) {
    assert(problem->blocks != NULL && problem->n >= 0);
    kt_cone_result result = {.residual = (double)INFINITY};
    const double enough = fmax(problem->enough, closing);
    int count = 0, newton = 0;
    if (!begin_set(cone, problem, p, &count))
        return result;
    for (int change = 0; change < SET_CHANGES * cone->most; change++) {
        double speed;
        result =
            count > 0 ? kt_cone_cascade(cone, problem, cone->member, count, p) : (kt_cone_result){.converged = true};
        newton += result.newton;
        result.newton = newton;
        const int next = find_closing(cone, problem, p, &speed);
        const bool closes = next >= 0 && speed > enough;
        result.residual = fmax(result.residual, speed);
        result.converged = result.converged && !closes && isfinite(speed);
        if (!closes || !isfinite(result.residual) || (count == cone->most && !free_place(cone, problem, p, &count)))
            return result;
        join_set(cone, next, &count);
    }
    return result;
}
