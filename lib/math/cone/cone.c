/* The cascade of the cone solver for a stored matrix: sweeps of block Gauss-Seidel, proximal points, and the order of
 * its parts (cone.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include "kinetree/algebra.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A row of f below the part `lost` of the sum of its terms is rounding. */
static const double converged = 1e-9, polished = 1e-12, lost = 1e-13;
/* Determinants of blocks below this number count as zero. The largest number on a diagonal is 1. */
static const double vanishing = 1e-12;
/* Corners of a face share an impact in many ways, and Newton's method may end at a residual that is enough, but above
 * `converged`. Proximal points then find a solution. Larger problems take what is enough, since these points cost more
 * there. */
enum { SMALL = 8 };
enum { LOCAL = 4, FIRST_SWEEPS = 2, MORE_SWEEPS = 100, NEWTON_MOST = 40 };

/* ---- sweeps ------------------------------------------------------------------------------------------------------ */

/* Writes the forces with which a contact sticks. Returns false if these are outside of its cone, p_n >= low. */
static bool stick_item(const double *w, const double *q, double mu, double low, double *x) {
    const double c0 = w[4] * w[8] - w[5] * w[7], c1 = w[2] * w[7] - w[1] * w[8], c2 = w[1] * w[5] - w[2] * w[4];
    const double det = w[0] * c0 + w[3] * c1 + w[6] * c2, normal = -(c0 * q[0] + c1 * q[1] + c2 * q[2]) / det;
    const double a = q[1] + w[3] * normal, b = q[2] + w[6] * normal;
    const double y1 = (w[5] * b - w[8] * a) / c0, y2 = (w[7] * a - w[4] * b) / c0;
    if (!(det > vanishing && c0 > vanishing && normal > low) || !(kt_hypot(y1, y2) <= mu * normal))
        return false;
    x[0] = normal;
    x[1] = y1;
    x[2] = y2;
    return true;
}

/* Moves x of item i towards the solution of its own problem u = w x + q, with steps of projection. A step goes along
 * the rates, divided by the diagonal of w, and then back to the set of forces. Where Alart and Curnier's function
 * vanishes, the step is zero. */
static void solve_item(const kt_cone *cone, int i, const double *w, const double *q, double *x) {
    const double limit = cone->limit[i], across = w[4] + w[8], mu = limit >= 0.0 ? 0.0 : cone->mu[i];
    const double low = limit >= 0.0 ? -limit : cone->least[i], high = limit >= 0.0 ? limit : (double)INFINITY;
    if (mu > 0.0 && stick_item(w, q, mu, low, x))
        return;
    for (int k = 0; k < LOCAL; k++) {
        const double u = q[0] + w[0] * x[0] + w[1] * x[1] + w[2] * x[2];
        x[0] = fmax(low, fmin(high, w[0] > 0.0 ? x[0] - u / w[0] : 0.0));
        const double u1 = q[1] + w[3] * x[0] + w[4] * x[1] + w[5] * x[2];
        const double u2 = q[2] + w[6] * x[0] + w[7] * x[1] + w[8] * x[2];
        const double y1 = across > 0.0 ? x[1] - u1 / across : 0.0, y2 = across > 0.0 ? x[2] - u2 / across : 0.0;
        const double size = kt_hypot(y1, y2), part = size > mu * x[0] ? mu * x[0] / size : 1.0;
        x[1] = part * y1;
        x[2] = part * y2;
    }
}

/* One sweep of the block Gauss-Seidel method. Each x_i in turn solves the problem of its item alone: with the block
 * w = W_ii and q = b_i + sum of W_ij x_j over the other items. An item is a cone, a force of at least `least`, or a
 * force of at most `limit`. */
static void sweep_cones(kt_cone *cone, const double *b, double *x) {
    const int m = 3 * cone->n;
    for (int i = 0; i < cone->n; i++) {
        double q[3], w[9];
        for (int c = 0; c < 3; c++) {
            const double *W = cone->W + (3 * i + c) * m;
            q[c] = b[3 * i + c];
            for (int k = cone->first[i]; k < cone->first[i + 1]; k++) {
                const int j = 3 * cone->block[k];
                q[c] += j == 3 * i ? 0.0 : W[j] * x[j] + W[j + 1] * x[j + 1] + W[j + 2] * x[j + 2];
            }
            memcpy(w + 3 * c, W + 3 * i, 3 * sizeof *w);
        }
        solve_item(cone, i, w, q, x + 3 * i);
    }
}

/* Copies x to y if its residual is the least so far. */
static void keep_better(kt_cone *cone, const double *x, double *least) {
    const double residual = kt_cone_residual(cone, cone->b, x);
    if (residual < *least)
        memcpy(cone->y, x, 3 * (size_t)cone->n * sizeof *x);
    *least = fmin(*least, residual);
}

/* ---- proximal points --------------------------------------------------------------------------------------------- */

/* Writes the diagonal of W + delta 1. */
static void raise_diagonal(kt_cone *cone, double delta) {
    const int m = 3 * cone->n;
    for (int i = 0; i < m; i++)
        cone->W[i * m + i] = cone->diagonal[i] + delta;
}

/* Solves W + delta 1 and b - delta z, from z to z. Returns whether a solution is found. */
static bool find_proximal(kt_cone *cone, double delta) {
    for (int i = 0; i < 3 * cone->n; i++)
        cone->near_b[i] = cone->b[i] - delta * cone->z[i];
    raise_diagonal(cone, delta);
    bool done = kt_cone_newton(cone, cone->near_b, cone->z, NEWTON_MOST);
    for (int k = 0; !done && k < 3; k++) {
        for (int j = 0; j < 30 * (k + 1); j++)
            sweep_cones(cone, cone->near_b, cone->z);
        done = kt_cone_newton(cone, cone->near_b, cone->z, NEWTON_MOST);
    }
    raise_diagonal(cone, 0.0);
    return done;
}

/* Proximal points z: each solves (W + delta 1) z' + b - delta z, and delta falls after some of them. Then, if
 * the last point is near a solution, Newton is tried on the problem itself. The points begin with z and this delta.
 * y becomes the best point; *least: its residual. */
static void follow_points(kt_cone *cone, double delta, double *least) {
    enum { OUTER = 12 };
    static const double last = 1e-7, falls = 0.5;
    const int m = 3 * cone->n;
    for (int i = 0; i < m; i++)
        cone->diagonal[i] = cone->W[i * m + i];
    while (delta > last && !(*least <= cone->enough)) {
        bool done = true;
        for (int outer = 0; done && outer < OUTER; outer++)
            done = find_proximal(cone, delta);
        memcpy(cone->x, cone->z, (size_t)m * sizeof *cone->x);
        if (kt_cone_residual(cone, cone->b, cone->x) < 1e-3)
            (void)kt_cone_newton(cone, cone->b, cone->x, NEWTON_MOST);
        keep_better(cone, cone->x, least);
        delta *= falls;
    }
}

/* Proximal points from the best point so far, since a heap's problems that come to them are nearly solved. Then from
 * zero with a large delta, so that no earlier start matters. */
static void approach(kt_cone *cone) {
    const size_t bytes = 3 * (size_t)cone->n * sizeof *cone->z;
    double least = (double)INFINITY;
    memcpy(cone->z, cone->found, bytes);
    follow_points(cone, 0.01, &least);
    memset(cone->z, 0, bytes);
    follow_points(cone, 1.0, &least);
}

/* ---- the cascade ------------------------------------------------------------------------------------------------- */

/* Copies the block of two items of a problem with blocks to W. */
static void copy_block(const kt_cone *cone, const kt_cone_blocks *blocks, int i, int j, double *W) {
    double w[9];
    blocks->block(blocks->user, i, j, w);
    for (int r = 0; r < 3; r++)
        memcpy(W + 3 * r * cone->n, w + 3 * r, 3 * sizeof *w);
}

/* Copies n items of the problem (kt_cone_cascade) and the start p in scaled numbers: W_ij s_i s_j, b_i s_i and
 * x_i = p_i / s_i. The scale s_i makes the largest diagonal entry of the block W_ii equal to 1, so that masses and
 * units do not matter. An item without a response has the scale of the item with the largest. */
static void scale_problem(kt_cone *cone, const kt_cone_problem *problem, const int *member, int n, const double *p) {
    const int m = 3 * n;
    double rate = 0.0, largest = 0.0;
    bool has_least = false;
    cone->n = n;
    cone->newton = 0;
    cone->rounding = lost / fmax(problem->enough, converged);
    if (m > 0 && member == NULL && problem->W != cone->W) /* both are NULL without contacts */
        memcpy(cone->W, problem->W, (size_t)(m * m) * sizeof *cone->W);
    for (int i = 0; i < n; i++) {
        const int of = member != NULL ? member[i] : i;
        double most = 0.0;
        for (int j = 0; member != NULL && j < n; j++)
            copy_block(cone, problem->blocks, of, member[j], cone->W + 3 * i * m + 3 * j);
        for (int k = 0; k < 3; k++)
            most = fmax(most, cone->W[(3 * i + k) * m + 3 * i + k]);
        cone->scale[i] = most;
        largest = fmax(largest, most);
    }
    for (int i = 0; i < n; i++) {
        const int of = member != NULL ? member[i] : i;
        const double most = cone->scale[i] > 0.0 ? cone->scale[i] : largest,
                     scale = most > 0.0 ? 1.0 / sqrt(most) : 1.0;
        cone->scale[i] = scale;
        cone->mu[i] = problem->mu[of];
        cone->least[i] = problem->least != NULL ? problem->least[of] / scale : 0.0;
        cone->limit[i] = problem->limit != NULL ? problem->limit[of] / scale : -1.0;
        has_least = has_least || cone->least[i] > 0.0;
        for (int k = 0; k < 3; k++) {
            cone->b[3 * i + k] = problem->b[3 * of + k] * scale;
            cone->x[3 * i + k] = p[3 * of + k] / scale;
            rate = fmax(rate, fabs(cone->b[3 * i + k]));
        }
    }
    kt_cone_list_blocks(cone);
    for (int r = 0; r < m; r++)
        for (int k = 3 * cone->first[r / 3]; k < 3 * cone->first[r / 3 + 1]; k++) {
            const int j = cone->block[k / 3];
            cone->W[r * m + 3 * j + k % 3] *= cone->scale[r / 3];
            cone->W[r * m + 3 * j + k % 3] *= cone->scale[j];
        }
    if (rate == 0.0 && !has_least) /* p = 0 solves it */
        memset(cone->x, 0, (size_t)m * sizeof *cone->x);
}

/* Runs one solver from the best solution so far, and writes its solution to y. More sweeps lead away from modes between
 * which Newton's method cycles. */
static void run_round(kt_cone *cone, kt_cone_round round) {
    if (round == KT_CONE_PROXIMAL) {
        approach(cone);
        return;
    }
    memcpy(cone->y, cone->found, 3 * (size_t)cone->n * sizeof *cone->y);
    for (int k = 0; k < (round == KT_CONE_NEWTON ? FIRST_SWEEPS : MORE_SWEEPS); k++)
        sweep_cones(cone, cone->b, cone->y);
    (void)kt_cone_newton(cone, cone->b, cone->y, NEWTON_MOST);
}

/* Runs one solver, and keeps its solution if it is the best so far. */
static void take_round(kt_cone *cone, kt_cone_round round, kt_cone_result *result) {
    run_round(cone, round);
    const double left = kt_cone_residual(cone, cone->b, cone->y);
    if (left < result->residual) {
        result->residual = left;
        result->round = round;
        memcpy(cone->found, cone->y, 3 * (size_t)cone->n * sizeof *cone->y);
    }
}

kt_cone_result kt_cone_cascade(kt_cone *cone, const kt_cone_problem *problem, const int *member, int n, double *p) {
    assert(n >= 0 && n <= cone->most);
    kt_cone_result result = {.residual = (double)INFINITY};
    scale_problem(cone, problem, member, n, p);
    memcpy(cone->found, cone->x, 3 * (size_t)cone->n * sizeof *p);
    const double enough = fmax(n <= SMALL ? 0.0 : problem->enough, converged);
    cone->enough = fmax(problem->enough, polished);
    for (int round = KT_CONE_NEWTON; round <= KT_CONE_SWEEPS && !(result.residual <= cone->enough); round++)
        take_round(cone, (kt_cone_round)round, &result);
    cone->enough = n <= SMALL ? polished : cone->enough;
    if (!(result.residual <= enough))
        take_round(cone, KT_CONE_PROXIMAL, &result);
    result.newton = cone->newton;
    result.converged = result.residual <= converged;
    for (int r = 0; r < 3 * n; r++)
        p[member != NULL ? 3 * member[r / 3] + r % 3 : r] = cone->found[r] * cone->scale[r / 3];
    return result;
}
