/* An interior point method for contacts with Coulomb's friction. All cones become Lorentz cones with the scaling
 *
 *     D = diag(1 / mu, 1, 1)
 *
 * and the problem becomes
 *
 *     s = Q r + c + g(s) e_n,   r o s = sigma tau e,   Q = D W D,  c = D b,  r = p / D,  g(s) = |s_t|
 *
 * (o is the product of Jordan algebra, e its unit, tau the mean of r . s). The term g is De Saxce's correction, and is
 * smoothed with tau. The scaling follows Nesterov and Todd, the centring Mehrotra. Newton's method on the
 * modes is tried once the iterates are near.
 *
 * V. Acary, P. Armand, H. M. Nguyen, M. Shpakovych, Second-order cone programming for frictional contact mechanics
 * using interior point algorithm, 2023.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/cone_parts.h"

#include "kinetree/algebra.h"

#include <math.h>
#include <string.h>

enum { STEPS = 60, POLISH = 6, POLISH_LAST = 25 };

/* ---- a cone ------------------------------------------------------------------------------------------------------ */

static double determinant_of(const double *x) {
    const double t = kt_hypot(x[1], x[2]);
    return (x[0] - t) * (x[0] + t);
}

/* z = x o y */
static void jordan_product(const double *x, const double *y, double *z) {
    z[0] = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    z[1] = x[0] * y[1] + y[0] * x[1];
    z[2] = x[0] * y[2] + y[0] * x[2];
}

/* z with x o z = y. */
static void jordan_divide(const double *x, const double *y, double *z) {
    z[0] = (x[0] * y[0] - (x[1] * y[1] + x[2] * y[2])) / determinant_of(x);
    for (int k = 1; k < 3; k++)
        z[k] = (y[k] - x[k] * z[0]) / x[0];
}

/* The longest step a for which x + a d stays in the cone. */
static double longest_step(const double *x, const double *d) {
    const double A = d[0] * d[0] - d[1] * d[1] - d[2] * d[2], B = x[0] * d[0] - x[1] * d[1] - x[2] * d[2];
    const double C = determinant_of(x), root = B * B - A * C;
    double a = 1e300;
    if (root >= 0.0) {
        const double t = -(B + (B >= 0.0 ? sqrt(root) : -sqrt(root)));
        const double a1 = A != 0.0 ? t / A : -1.0, a2 = t != 0.0 ? C / t : -1.0;
        a = a1 > 0.0 ? fmin(a, a1) : a;
        a = a2 > 0.0 ? fmin(a, a2) : a;
    }
    return a;
}

/* Nesterov and Todd's symmetric F with F r = F^-1 s = lambda. */
static void find_frame(const double *r, const double *s, double *F, double *lambda) {
    const double nr = sqrt(fmax(determinant_of(r), 1e-300)), ns = sqrt(fmax(determinant_of(s), 1e-300));
    double dot = 0.0, w[3];
    for (int k = 0; k < 3; k++)
        dot += r[k] / nr * (s[k] / ns);
    const double gamma = sqrt(0.5 * (1.0 + dot)), eta = sqrt(ns / nr);
    w[0] = (s[0] / ns + r[0] / nr) / (2.0 * gamma);
    for (int k = 1; k < 3; k++)
        w[k] = (s[k] / ns - r[k] / nr) / (2.0 * gamma);
    F[0] = eta * w[0];
    for (int i = 1; i < 3; i++) {
        F[i] = F[3 * i] = eta * w[i];
        for (int j = 1; j < 3; j++)
            F[3 * i + j] = eta * ((i == j ? 1.0 : 0.0) + w[i] * w[j] / (1.0 + w[0]));
    }
    for (int i = 0; i < 3; i++)
        lambda[i] = F[3 * i] * r[0] + F[3 * i + 1] * r[1] + F[3 * i + 2] * r[2];
}

/* Mehrotra's second term, (F dr) o (F^-1 ds). */
static void correct_centre(const double *F, const double *dr, const double *ds, double *by) {
    const double eta2 = F[0] * F[0] - F[1] * F[1] - F[2] * F[2]; /* F^-1 = J F J / eta^2 */
    double a[3] = {0.0, 0.0, 0.0}, b[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            a[i] += F[3 * i + j] * dr[j];
            b[i] += F[3 * i + j] * ((i == 0) != (j == 0) ? -1.0 : 1.0) / eta2 * ds[j];
        }
    jordan_product(a, b, by);
}

/* ---- the iteration ----------------------------------------------------------------------------------------------- */

typedef struct interior {
    double size;   /* the largest |b|, the unit of forces */
    double tau;    /* the mean of r . s over the contacts */
    double smooth; /* g(s) = sqrt(|s_t|^2 + smooth^2) */
    double sigma;  /* centring: the next tau over the present one */
} interior;

/* An entry of Q = D W D. */
static double entry_of_Q(const kt_cone *cone, int i, int j) {
    return cone->weight[i] * cone->W[i * 3 * cone->n + j] * cone->weight[j];
}

/* Starts on the axis of each cone: r = s = e_0. The weights 1 / mu of the normal rates turn every friction cone into
 * the cone |(x_1, x_2)| <= x_0. near_b is b in these weights, divided by the largest entry of b. */
static void begin_interior(kt_cone *cone, interior *it) {
    const int m = 3 * cone->n;
    it->size = 1e-300;
    for (int i = 0; i < m; i++)
        it->size = fmax(it->size, fabs(cone->b[i]));
    for (int i = 0; i < m; i++) {
        cone->weight[i] = i % 3 ? 1.0 : 1.0 / fmax(cone->mu[i / 3], 1e-4);
        cone->near_b[i] = cone->weight[i] * cone->b[i] / it->size;
        cone->r[i] = cone->s[i] = i % 3 ? 0.0 : 1.0;
    }
}

/* The residual of the equations; returns its largest entry. */
static double find_gap(kt_cone *cone, interior *it) {
    const int m = 3 * cone->n;
    double most = 0.0;
    it->tau = 0.0;
    for (int i = 0; i < m; i++)
        it->tau += cone->r[i] * cone->s[i] / cone->n;
    it->smooth = fmin(1e-3, it->tau);
    for (int i = 0; i < m; i++) {
        double sum = cone->near_b[i] - cone->s[i];
        for (int k = 3 * cone->first[i / 3]; k < 3 * cone->first[i / 3 + 1]; k++) {
            const int j = 3 * cone->block[k / 3] + k % 3;
            sum += entry_of_Q(cone, i, j) * cone->r[j];
        }
        const double *s = cone->s + i;
        if (i % 3 == 0)
            sum += sqrt(s[1] * s[1] + s[2] * s[2] + it->smooth * it->smooth);
        cone->gap[i] = sum;
        most = fmax(most, fabs(sum));
    }
    return most;
}

/* Adds the block of contact i to A of Newton's equations, and writes their right-hand side dr:
 *     A += (1 - e_n g') F F,   dr = (1 - e_n g') F d - gap
 * F is the scaling (find_frame), d the centring step, and g the gradient of the smoothed g(s). */
static void add_block(kt_cone *cone, const interior *it, int i) {
    double *A = kt_cone_block(cone, i, i);
    const double *F = cone->frame + 9 * i, *s = cone->s + 3 * i;
    const double slip = sqrt(s[1] * s[1] + s[2] * s[2] + it->smooth * it->smooth);
    const double g[3] = {0.0, s[1] / slip, s[2] / slip};
    double square[9] = {0.0}, Fd[3] = {0.0}; /* F F, F d */
    for (int u = 0; u < 3; u++)
        for (int v = 0; v < 3; v++) {
            for (int k = 0; k < 3; k++)
                square[3 * u + v] += F[3 * u + k] * F[3 * k + v];
            Fd[u] += F[3 * u + v] * cone->centre[3 * i + v];
        }
    for (int u = 0; u < 3; u++) {
        double right = Fd[u];
        for (int v = 0; v < 3; v++)
            A[3 * u + v] += square[3 * u + v];
        for (int k = 1; k < 3 && u == 0; k++) {
            right -= g[k] * Fd[k];
            for (int v = 0; v < 3; v++)
                A[v] -= g[k] * square[3 * k + v];
        }
        cone->dr[3 * i + u] = right - cone->gap[3 * i + u];
    }
}

/* Fills the matrix A of a step of the interior-point method: Q, and on its diagonal the block of each cone. */
static void fill_direction(kt_cone *cone, const interior *it) {
    kt_cone_clear_equations(cone);
    for (int i = 0; i < cone->n; i++) {
        for (int k = cone->first[i]; k < cone->first[i + 1]; k++)
            for (int c = 0; c < 9; c++)
                kt_cone_block(cone, i, cone->block[k])[c] = entry_of_Q(cone, 3 * i + c / 3, 3 * cone->block[k] + c % 3);
        add_block(cone, it, i);
    }
}

/* The step (dr, ds) towards the centre sigma tau; corrects: with Mehrotra's term. Returns the longest step. */
static double find_direction(kt_cone *cone, const interior *it, bool corrects) {
    double alpha = 1e300;
    for (int i = 0; i < cone->n; i++) {
        double right[3], by[3];
        jordan_product(cone->lambda + 3 * i, cone->lambda + 3 * i, right);
        for (int k = 0; k < 3; k++)
            right[k] = (k ? 0.0 : it->sigma * it->tau) - right[k];
        if (corrects) {
            correct_centre(cone->frame + 9 * i, cone->dr + 3 * i, cone->ds + 3 * i, by);
            for (int k = 0; k < 3; k++)
                right[k] -= by[k];
        }
        jordan_divide(cone->lambda + 3 * i, right, cone->centre + 3 * i);
    }
    fill_direction(cone, it);
    kt_cone_eliminate(cone, cone->dr);
    for (int i = 0; i < cone->n; i++) {
        const double *F = cone->frame + 9 * i, *dr = cone->dr + 3 * i;
        double t[3];
        for (int u = 0; u < 3; u++)
            t[u] = cone->centre[3 * i + u] - (F[3 * u] * dr[0] + F[3 * u + 1] * dr[1] + F[3 * u + 2] * dr[2]);
        for (int u = 0; u < 3; u++)
            cone->ds[3 * i + u] = F[3 * u] * t[0] + F[3 * u + 1] * t[1] + F[3 * u + 2] * t[2];
        alpha = fmin(alpha, fmin(longest_step(cone->r + 3 * i, dr), longest_step(cone->s + 3 * i, cone->ds + 3 * i)));
    }
    return alpha;
}

/* Takes one step: predictor, then corrector. */
static void step_interior(kt_cone *cone, interior *it) {
    const int m = 3 * cone->n;
    for (int i = 0; i < cone->n; i++)
        find_frame(cone->r + 3 * i, cone->s + 3 * i, cone->frame + 9 * i, cone->lambda + 3 * i);
    it->sigma = 0.0;
    const double a = fmin(1.0, find_direction(cone, it, false));
    double after = 0.0;
    for (int i = 0; i < m; i++)
        after += (cone->r[i] + a * cone->dr[i]) * (cone->s[i] + a * cone->ds[i]);
    it->sigma = fmin(1.0, fmax(pow(fmax(0.0, after / cone->n / it->tau), 3.0), 1e-8));
    const double alpha = fmin(1.0, 0.99 * find_direction(cone, it, true));
    for (int i = 0; i < m; i++) {
        cone->r[i] += alpha * cone->dr[i];
        cone->s[i] += alpha * cone->ds[i];
    }
}

void kt_cone_interior(kt_cone *cone, double *y) {
    const int m = 3 * cone->n;
    interior it;
    double least = kt_cone_residual(cone, cone->b, y);
    begin_interior(cone, &it);
    for (int k = 0; k < STEPS; k++) {
        const double residual = find_gap(cone, &it);
        for (int i = 0; i < m; i++)
            cone->z[i] = it.size * cone->r[i] * cone->weight[i]; /* p = D r */
        const double left = kt_cone_residual(cone, cone->b, cone->z);
        if (left < least)
            memcpy(y, cone->z, (size_t)m * sizeof *y);
        least = fmin(least, left);
        if (left < 1e-4 && k % 3 == 0 && kt_cone_newton(cone, cone->b, cone->z, POLISH)) {
            memcpy(y, cone->z, (size_t)m * sizeof *y);
            return;
        }
        if (!(it.tau > 1e-15) || !isfinite(residual))
            break;
        step_interior(cone, &it);
    }
    memcpy(cone->z, y, (size_t)m * sizeof *y);
    (void)kt_cone_newton(cone, cone->b, cone->z, POLISH_LAST);
    if (kt_cone_residual(cone, cone->b, cone->z) < least)
        memcpy(y, cone->z, (size_t)m * sizeof *y);
}
