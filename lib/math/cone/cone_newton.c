/* Alart and Curnier's function of the cone solver, its residual, and semismooth Newton steps for its zero (cone.h).
 *
 * L. Grippo, F. Lampariello, S. Lucidi, A nonmonotone line search technique for Newton's method, 1986.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include "kinetree/algebra.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const double exact = 1e-14;
/* A residual is compared with the rates, or with an impulse of up to `gain` times the rates. A larger impulse would
 * hide rates that it does not reach: a sphere between two walls may have any internal force, and no impulse stops a rod
 * that a drive lowers within its friction cone. What a larger impulse excuses is the rounding of each row: a bar that
 * is normal to a face clamps it with impulses far above the rates, and they cancel in W x + b. */
static const double gain = 100.0;
/* A step is halved until the square of f falls below the largest of the last MERITS squares. Between sticking and slip,
 * f has edges at which it grows for a step. A method that rejects such steps takes short steps along the edge. */
enum { HALVINGS = 5, WORSE_MOST = 5, SLOW_MOST = 2, MERITS = 10 };

/* The damping is this part of the residual, within bounds. The least one is small against pivots that are not lost. */
static const double damping = 0.3, damping_least = 1e-8, damping_most = 1e-2;

/* ---- the function ------------------------------------------------------------------------------------------------ */

/* The mode of an item decides which of its rows are unknown: given normal impulse, closed without friction, sticking or
 * slipping. The last two modes have the least normal impulse. */
typedef enum cone_mode { HELD, SMOOTH, STICKS, SLIPS, LEAST_STICKS, LEAST_SLIPS } cone_mode;

/* Whether Newton's step gives a row its value at once, without an equation for the rate. */
static bool is_known(cone_mode mode, int row) {
    return mode == HELD || (mode == SMOOTH && row > 0) || (mode >= LEAST_STICKS && row == 0);
}

/* u = W x + b. Only the blocks of W that are not zero take part. */
static void find_rates(const kt_cone *cone, const double *b, const double *x, double *u) {
    const int m = 3 * cone->n;
    for (int r = 0; r < m; r++) {
        double sum = b[r];
        for (int k = cone->first[r / 3]; k < cone->first[r / 3 + 1]; k++) {
            const double *W = cone->W + r * m + 3 * cone->block[k], *y = x + 3 * cone->block[k];
            sum += W[0] * y[0] + W[1] * y[1] + W[2] * y[2];
        }
        u[r] = sum;
    }
}

/* Computes f and the mode of an item without a cone: dry friction, or a contact without friction. Dry friction of a
 * joint that a drive moves changes no rate, and is at its limit. */
static void find_plain(kt_cone *cone, int i, const double *x, const double *u, double *f) {
    const bool is_driven = cone->limit[i] >= 0.0 && cone->W[9 * i * cone->n + 3 * i] == 0.0 && u[3 * i] != 0.0;
    const double z = is_driven ? copysign(HUGE_VAL, -u[3 * i]) : x[3 * i] - u[3 * i];
    const double limit = cone->limit[i], least = cone->least[i];
    const double low = limit >= 0.0 ? -limit : least, high = limit >= 0.0 ? limit : (double)INFINITY;
    cone->mode[i] = z > low && z < high ? SMOOTH : HELD;
    cone->target[i] = z > low ? high : low;
    f[3 * i] = cone->mode[i] == SMOOTH ? u[3 * i] : x[3 * i] - cone->target[i];
    f[3 * i + 1] = x[3 * i + 1];
    f[3 * i + 2] = x[3 * i + 2];
}

/* Computes f and the modes at x, whose rates are u. Returns the square of f, the merit of Newton's steps. */
static double find_function(kt_cone *cone, const double *x, const double *u, double *f) {
    double sum = 0.0;
    for (int i = 0; i < cone->n; i++) {
        const double *xi = x + 3 * i, *ui = u + 3 * i, l = cone->least[i];
        if (cone->limit[i] >= 0.0 || !(cone->mu[i] > 0.0)) {
            find_plain(cone, i, x, u, f);
        } else {
            const double w = xi[0] - l - ui[0], R = cone->mu[i] * (l + fmax(0.0, w));
            const double z1 = xi[1] - ui[1], z2 = xi[2] - ui[2], z = kt_hypot(z1, z2), part = z > R ? R / z : 1.0;
            const bool slips = z > R;
            cone->mode[i] = w > 0.0 ? (slips ? SLIPS : STICKS) : R > 0.0 ? (slips ? LEAST_SLIPS : LEAST_STICKS) : HELD;
            cone->target[i] = l;
            f[3 * i] = xi[0] - l - fmax(0.0, w);
            f[3 * i + 1] = xi[1] - part * z1;
            f[3 * i + 2] = xi[2] - part * z2;
        }
        for (int k = 0; k < 3; k++)
            sum += f[3 * i + k] * f[3 * i + k];
    }
    return sum;
}

/* The sum of the magnitudes of b[r], x[r], and the terms of (W x)[r]. Rounding of f[r] is relative to it. */
static double size_of_terms(const kt_cone *cone, const double *b, const double *x, int r) {
    const int m = 3 * cone->n;
    double sum = fabs(b[r]) + fabs(x[r]);
    for (int k = cone->first[r / 3]; k < cone->first[r / 3 + 1]; k++) {
        const double *W = cone->W + r * m + 3 * cone->block[k], *y = x + 3 * cone->block[k];
        sum += fabs(W[0] * y[0]) + fabs(W[1] * y[1]) + fabs(W[2] * y[2]);
    }
    return sum;
}

/* The residual at x, whose rates and function are known. */
static double known_residual(const kt_cone *cone, const double *b, const double *x) {
    double impulse = 0.0, rate = 0.0, residual = 0.0;
    for (int r = 0; r < 3 * cone->n; r++) {
        if (!isfinite(x[r]) || !isfinite(cone->u[r]) || !isfinite(cone->f[r])) /* fmax leaves NaN out */
            return (double)INFINITY;
        impulse = fmax(impulse, fabs(x[r]));
        rate = fmax(rate, fabs(b[r]));
    }
    const double size = fmax(rate, fmin(impulse, gain * rate));
    for (int r = 0; r < 3 * cone->n; r++)
        if (fabs(cone->f[r]) > residual * size)
            residual = fmax(residual, fabs(cone->f[r]) / fmax(size, cone->rounding * size_of_terms(cone, b, x, r)));
    return residual;
}

double kt_cone_residual(kt_cone *cone, const double *b, const double *x) {
    assert(cone->n == 0 || (x != cone->u && x != cone->f)); /* arrays without numbers may coincide */
    find_rates(cone, b, x, cone->u);
    (void)find_function(cone, x, cone->u, cone->f);
    return known_residual(cone, b, x);
}

/* ---- Newton ------------------------------------------------------------------------------------------------------ */

/* Row (i, c) of the derivative: coefficients of this contact's du and dx; returns the right-hand side. */
static double linearise(const kt_cone *cone, int i, int c, const double *x, double du[3], double dx[3]) {
    const double *ui = cone->u + 3 * i, *xi = x + 3 * i, l = cone->least[i], mu = cone->mu[i];
    const cone_mode mode = (cone_mode)cone->mode[i];
    memset(du, 0, 3 * sizeof *du);
    memset(dx, 0, 3 * sizeof *dx);
    if (is_known(mode, c)) { /* takes its value at once */
        dx[c] = 1.0;
        return c == 0 ? cone->target[i] - xi[0] : -xi[c];
    }
    if (c == 0 || mode == STICKS || mode == LEAST_STICKS) {
        du[c] = 1.0;
        return -ui[c];
    }
    /* f_t = x_t - R e;  dR = mu (dx_n - du_n),  de = (1 - e e') (dx_t - du_t) / z */
    const double R = mu * (l + fmax(0.0, xi[0] - l - ui[0])), z1 = xi[1] - ui[1], z2 = xi[2] - ui[2];
    const double z = kt_hypot(z1, z2), e[2] = {z1 / z, z2 / z};
    if (mode == SLIPS) {
        dx[0] = -mu * e[c - 1];
        du[0] = mu * e[c - 1];
    }
    dx[c] = 1.0;
    for (int d = 0; d < 2; d++) {
        const double g = R / z * ((d == c - 1 ? 1.0 : 0.0) - e[c - 1] * e[d]);
        dx[1 + d] -= g;
        du[1 + d] += g;
    }
    return -cone->f[3 * i + c];
}

/* The linear system of a step dx: du of each contact, a combination of the rows of W + damp 1, and its own dx.
 * Requires rates, function and modes at x. */
static void fill_step(kt_cone *cone, const double *x, double damp, double *dx) {
    const int m = 3 * cone->n;
    kt_cone_clear_equations(cone);
    for (int r = 0; r < m; r++) {
        const int i = r / 3, c = 3 * (r % 3);
        double du[3], own[3];
        dx[r] = linearise(cone, i, r % 3, x, du, own);
        for (int d = 0; d < 3; d++) {
            const double *W = cone->W + (3 * i + d) * m;
            for (int k = cone->first[i]; k < cone->first[i + 1] && du[d] != 0.0; k++) {
                double *A = kt_cone_block(cone, i, cone->block[k]) + c;
                for (int e = 0; e < 3; e++)
                    A[e] += du[d] * W[3 * cone->block[k] + e];
            }
            kt_cone_block(cone, i, i)[c + d] += own[d] + damp * du[d];
        }
    }
}

/* The largest of the last merits; the k-th is stored. */
static double largest_merit(double *merits, int k, double merit) {
    double most = merits[k % MERITS] = merit;
    for (int i = 0; i < k && i < MERITS; i++)
        most = fmax(most, merits[i]);
    return most;
}

/* Computes the trial point from x along dx, its rates and its function. The merit is below `above` if HALVINGS suffice.
 * Returns the merit. */
static double search_line(kt_cone *cone, const double *b, const double *x, double above) {
    double part = 1.0, merit = 0.0;
    for (int h = 0; h < HALVINGS; h++) {
        for (int i = 0; i < 3 * cone->n; i++)
            cone->trial[i] = x[i] + part * cone->dx[i];
        find_rates(cone, b, cone->trial, cone->u);
        merit = find_function(cone, cone->trial, cone->u, cone->f);
        if (merit < (1.0 - 1e-4 * part) * above)
            break;
        part *= 0.5;
    }
    return merit;
}

bool kt_cone_newton(kt_cone *cone, const double *b, double *x, int most) {
    assert(cone->n <= cone->most && most >= 0);
    assert(cone->n == 0 || (x != cone->best && x != cone->trial && x != cone->u && x != cone->f && x != cone->dx));
    const size_t bytes = 3 * (size_t)cone->n * sizeof *x;
    find_rates(cone, b, x, cone->u);
    double merit = find_function(cone, x, cone->u, cone->f), merits[MERITS];
    double last = known_residual(cone, b, x), left = last;
    bool done = last <= exact;
    memcpy(cone->best, x, bytes);
    for (int k = 0, worse = 0, slow = 0; k < most && !done; k++) {
        const double above = largest_merit(merits, k, merit);
        fill_step(cone, x, fmax(damping_least, fmin(damping * left, damping_most)), cone->dx);
        kt_cone_eliminate(cone, cone->dx);
        cone->newton++;
        const double now = search_line(cone, b, x, above);
        worse += !(now < above);
        if (worse > WORSE_MOST || !(now < 1e300))
            break;
        memcpy(x, cone->trial, bytes);
        left = known_residual(cone, b, x);
        if (left < last)
            memcpy(cone->best, x, bytes);
        last = fmin(last, left);
        slow += last <= cone->enough && !(now < 0.5 * merit);
        done = left <= exact || slow == SLOW_MOST;
        merit = now;
    }
    memcpy(x, cone->best, bytes);
    return last <= cone->enough;
}
