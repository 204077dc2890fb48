/* The cascade of the cone solver for a stored matrix: sweeps of block Gauss-Seidel, proximal points, and the order of
 * its parts (cone.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include "kinetree/algebra.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

static const double converged = 1e-9, polished = 1e-12;
/* Corners of a face share an impact in many ways, and Newton's method may end at a residual that is enough, but not
 * rounding. The interior point method then finds a solution in the middle. It costs too much for large problems. */
enum { SMALL = 8 };
enum { NEWTON_MOST = 25, MANY = 600, TURNS = 10, TURN_SWEEPS = 10, TURN_NEWTON = 10 };

/* ---- sweeps ------------------------------------------------------------------------------------------------------ */

/* Computes x of one contact that slips in the direction e = (cos, sin), from u_n = 0 and p_t = -mu p_n e. Returns e x
 * u_t, which is zero if the slip has that direction, and not the opposite one: *along = e . u_t. */
static double turn_of(const double *w, const double *q, double mu, double angle, double *x, double *along) {
    const double e0 = cos(angle), e1 = sin(angle), d = w[0] - mu * (w[1] * e0 + w[2] * e1);
    x[0] = d > 0.0 ? -q[0] / d : 0.0;
    x[1] = -mu * x[0] * e0;
    x[2] = -mu * x[0] * e1;
    const double u1 = q[1] + w[3] * x[0] + w[4] * x[1] + w[5] * x[2];
    const double u2 = q[2] + w[6] * x[0] + w[7] * x[1] + w[8] * x[2];
    *along = d > 0.0 ? e0 * u1 + e1 * u2 : -1.0;
    return e0 * u2 - e1 * u1;
}

/* The direction between two angles at which e x u_t, `turn` there, changes its sign: by secants. If b moves to the
 * same side again, fa is lowered, so that the next secant ends on the other side (Anderson and Bjorck 1973). The search
 * ends when a secant moves b by roundings. */
static void bracket_turn(const double *w, const double *q, double mu, double a, double b, const double turn[2],
                         double *x, double *along) {
    double fa = turn[0], fb = turn[1];
    for (int k = 0; k < 60; k++) {
        const double c = b - fb * (b - a) / (fb - fa), fc = turn_of(w, q, mu, c, x, along), left = 1.0 - fc / fb;
        const bool ends = fc == 0.0 || fabs(c - b) <= DBL_EPSILON * fabs(b);
        if ((fc <= 0.0) == (fb <= 0.0)) {
            fa *= left > 0.0 ? left : 0.5;
        } else {
            a = b;
            fa = fb;
        }
        b = c;
        fb = fc;
        if (ends)
            break;
    }
}

/* Computes x of one contact that slips: the root next to the angle `from`, or 0 without a root. Parts of the circle are
 * searched from this angle outwards. */
static void slip_one(const double *w, const double *q, double mu, double from, double *x) {
    enum { PARTS = 12, MIDDLE = PARTS / 2 };
    static const double pi = 3.14159265358979323846;
    double y[3], along[PARTS + 1], turn[PARTS + 1], far = (double)INFINITY;
    memset(x, 0, 3 * sizeof *x);
    turn[MIDDLE] = turn_of(w, q, mu, from - pi + 2.0 * pi * MIDDLE / PARTS, y, &along[MIDDLE]);
    for (int ring = 0; ring < MIDDLE && !isfinite(far); ring++)
        for (int side = 0; side < 2; side++) {
            const int k = side == 0 ? MIDDLE - 1 - ring : MIDDLE + ring, end = k + side;
            const double a = from - pi + 2.0 * pi * k / PARTS, b = from - pi + 2.0 * pi * (k + 1) / PARTS,
                         mid = 0.5 * (a + b);
            turn[end] = turn_of(w, q, mu, side == 0 ? a : b, y, &along[end]);
            if ((turn[k] <= 0.0) != (turn[k + 1] <= 0.0) && (along[k] > 0.0 || along[k + 1] > 0.0) &&
                fabs(mid - from) < far) {
                double now;
                bracket_turn(w, q, mu, a, b, turn + k, y, &now);
                if (now > 0.0 && y[0] > 0.0) {
                    far = fabs(mid - from);
                    memcpy(x, y, sizeof y);
                }
            }
        }
}

/* The solution of one contact: w its block, q its rates without its own impulses. */
static void solve_one(const double *block, const double *q, double mu, double *x) {
    double w[9], y[3];
    memcpy(w, block, sizeof w);
    for (int k = 0; k < 3; k++)
        w[4 * k] += 1e-12; /* of a diagonal of about 1 (scale_problem): a singular block has a solution, too */
    memset(x, 0, 3 * sizeof *x);
    if (q[0] >= 0.0) /* it leaves; where friction could pull it back there are other solutions (Painleve) */
        return;
    const double c0 = w[4] * w[8] - w[5] * w[7], c1 = w[2] * w[7] - w[1] * w[8], c2 = w[1] * w[5] - w[2] * w[4];
    const double det = w[0] * c0 + w[3] * c1 + w[6] * c2;
    y[0] = -(c0 * q[0] + c1 * q[1] + c2 * q[2]) / det;
    y[1] = -((w[5] * w[6] - w[3] * w[8]) * q[0] + (w[0] * w[8] - w[2] * w[6]) * q[1] +
             (w[2] * w[3] - w[0] * w[5]) * q[2]) /
           det;
    y[2] = -((w[3] * w[7] - w[4] * w[6]) * q[0] + (w[1] * w[6] - w[0] * w[7]) * q[1] +
             (w[0] * w[4] - w[1] * w[3]) * q[2]) /
           det;
    if (det > 0.0 && kt_hypot(y[1], y[2]) <= mu * y[0])
        memcpy(x, y, sizeof y);
    else
        slip_one(w, q, mu, kt_hypot(y[1], y[2]) > 0.0 ? atan2(-y[2], -y[1]) : 0.0, x);
}

/* The solution of one contact with the least normal impulse l. While the normal impulse equals l, tangential impulses
 * lie in a disc. */
static void solve_one_least(const double *w, const double *q, double mu, double l, double *x) {
    double y[3];
    solve_one(w, q, mu, y);
    if (y[0] >= l) {
        memcpy(x, y, sizeof y);
        return;
    }
    const double t1 = q[1] + w[3] * l, t2 = q[2] + w[6] * l, det = w[4] * w[8] - w[5] * w[7] + 1e-24;
    x[0] = l;
    x[1] = -(w[8] * t1 - w[5] * t2) / det;
    x[2] = -(w[4] * t2 - w[7] * t1) / det;
    const double step = 1.0 / (w[4] + w[8] + 1e-12);
    for (int k = 0; k < 200 && kt_hypot(x[1], x[2]) > mu * l; k++) { /* slips: projected steps */
        const double norm = kt_hypot(x[1], x[2]), y1 = x[1] * mu * l / norm, y2 = x[2] * mu * l / norm;
        x[1] = y1 - step * (t1 + w[4] * y1 + w[5] * y2);
        x[2] = y2 - step * (t2 + w[7] * y1 + w[8] * y2);
        const double after = kt_hypot(x[1], x[2]), part = after > mu * l ? mu * l / after : 1.0;
        if (k == 199 || kt_hypot(x[1] * part - y1, x[2] * part - y2) < 1e-15 * mu * l) {
            x[1] *= part;
            x[2] *= part;
            return;
        }
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
        double *to = x + 3 * i;
        if (cone->limit[i] < 0.0 && cone->mu[i] > 0.0) {
            if (cone->least[i] > 0.0)
                solve_one_least(w, q, cone->mu[i], cone->least[i], to);
            else
                solve_one(w, q, cone->mu[i], to);
            continue;
        }
        const double free = w[0] > 0.0 ? -q[0] / w[0] : 0.0, limit = cone->limit[i];
        to[0] = limit >= 0.0 ? fmax(-limit, fmin(limit, free)) : fmax(cone->least[i], free);
        to[1] = to[2] = 0.0;
    }
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

/* Proximal points z: each solves (W + delta 1) z' + b - delta z, and delta falls tenfold after six of them. From each
 * point near a solution, Newton is tried on the problem itself. y becomes the best point. */
static void approach(kt_cone *cone, double *y) {
    const int m = 3 * cone->n;
    double residual = kt_cone_residual(cone, cone->b, y);
    memcpy(cone->z, y, (size_t)m * sizeof *y);
    for (int i = 0; i < m; i++)
        cone->diagonal[i] = cone->W[i * m + i];
    double delta = 1e-2;
    while (delta > 1e-7 && residual > cone->enough) {
        bool done = true;
        for (int outer = 0; outer < 6 && residual > cone->enough && done; outer++) {
            done = find_proximal(cone, delta);
            memcpy(cone->r, cone->z, (size_t)m * sizeof *y);
            if (kt_cone_residual(cone, cone->b, cone->r) < 1e-3)
                (void)kt_cone_newton(cone, cone->b, cone->r, NEWTON_MOST);
            const double left = kt_cone_residual(cone, cone->b, cone->r);
            if (left < residual)
                memcpy(y, cone->r, (size_t)m * sizeof *y);
            residual = fmin(residual, left);
        }
        delta *= 0.1;
    }
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
 * x_i = p_i / s_i. The scale s_i makes the largest diagonal entry of the block W_ii equal to 1, so that masses and units
 * do not matter. */
static void scale_problem(kt_cone *cone, const kt_cone_problem *problem, const int *member, int n, const double *p) {
    const int m = 3 * n;
    double rate = 0.0;
    cone->n = n;
    cone->symmetric = problem->symmetric;
    cone->has_least = cone->has_limit = false;
    cone->newton = 0;
    cone->gain = problem->gain;
    if (m > 0 && member == NULL && problem->W != cone->W) /* both are NULL without contacts */
        memcpy(cone->W, problem->W, (size_t)(m * m) * sizeof *cone->W);
    for (int i = 0; i < n; i++) {
        const int of = member != NULL ? member[i] : i;
        double most = 0.0;
        for (int j = 0; member != NULL && j < n; j++)
            copy_block(cone, problem->blocks, of, member[j], cone->W + 3 * i * m + 3 * j);
        for (int k = 0; k < 3; k++)
            most = fmax(most, cone->W[(3 * i + k) * m + 3 * i + k]);
        const double scale = most > 0.0 ? 1.0 / sqrt(most) : 1.0;
        cone->scale[i] = scale;
        cone->mu[i] = problem->mu[of];
        cone->least[i] = problem->least != NULL ? problem->least[of] / scale : 0.0;
        cone->limit[i] = problem->limit != NULL ? problem->limit[of] / scale : -1.0;
        cone->has_least = cone->has_least || cone->least[i] > 0.0;
        cone->has_limit = cone->has_limit || cone->limit[i] >= 0.0;
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
    if (rate == 0.0 && problem->gain > 0.0 && !cone->has_least) /* p = 0 solves it, and gain |b| is no size */
        memset(cone->x, 0, (size_t)m * sizeof *cone->x);
}

/* Sweeps and Newton in turn, each from the end of the other. From modes between which Newton's method cycles, sweeps
 * lead away. The best goes to y. */
static void alternate(kt_cone *cone, double *y) {
    const size_t bytes = 3 * (size_t)cone->n * sizeof *y;
    double least = (double)INFINITY;
    memcpy(cone->z, cone->found, bytes);
    for (int turn = 0; turn < TURNS && !(least <= cone->enough); turn++) {
        for (int k = 0; k < TURN_SWEEPS; k++)
            sweep_cones(cone, cone->b, cone->z);
        (void)kt_cone_newton(cone, cone->b, cone->z, TURN_NEWTON);
        const double left = kt_cone_residual(cone, cone->b, cone->z);
        if (left < least)
            memcpy(y, cone->z, bytes);
        least = fmin(least, left);
    }
}

/* Runs one solver from x, or from the best solution so far, and writes its solution to y. */
static void run_round(kt_cone *cone, kt_cone_round round) {
    static const int sweeps[KT_CONE_ROUNDS] = {[KT_CONE_NEWTON] = 2, [KT_CONE_MANY_SWEEPS] = MANY};
    const size_t bytes = 3 * (size_t)cone->n * sizeof(double);
    if (round == KT_CONE_SWEEPS) {
        alternate(cone, cone->y);
    } else if (round == KT_CONE_INTERIOR) {
        memcpy(cone->y, cone->x, bytes);
        if (cone->symmetric && !cone->has_least && !cone->has_limit)
            kt_cone_interior(cone, cone->y);
    } else if (round == KT_CONE_PROXIMAL) {
        memcpy(cone->y, cone->found, bytes);
        approach(cone, cone->y);
    } else {
        for (int k = 0; k < sweeps[round]; k++)
            sweep_cones(cone, cone->b, cone->x);
        memcpy(cone->y, cone->x, bytes);
        (void)kt_cone_newton(cone, cone->b, cone->y, NEWTON_MOST);
    }
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
    cone->enough = fmax(problem->enough, polished);
    for (int round = 0; round < KT_CONE_ROUNDS && !(result.residual <= cone->enough); round++)
        take_round(cone, (kt_cone_round)round, &result);
    cone->enough = polished;
    if (cone->n <= SMALL && result.residual > polished && problem->enough > polished)
        take_round(cone, KT_CONE_INTERIOR, &result);
    result.newton = cone->newton;
    result.converged = result.residual <= converged;
    for (int r = 0; r < 3 * n; r++)
        p[member != NULL ? 3 * member[r / 3] + r % 3 : r] = cone->found[r] * cone->scale[r / 3];
    return result;
}
