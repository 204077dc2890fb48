/* Principal moments, and whether a body can have them.
 *
 * Eigenvalues by cyclic Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.5): the rotation by t = tan(angle)
 * that annuls s_pq,
 *     t = sign(d) / (|d| + sqrt(d^2 + 1)),   d = (s_qq - s_pp) / (2 s_pq),
 *     s_pp <- s_pp - t s_pq,  s_qq <- s_qq + t s_pq.
 * Convergence is quadratic: a matrix of 3 x 3 takes four or five sweeps. The matrix is first scaled by a power of two,
 * which rounds nothing, so the scale of the entries does not matter.
 *
 * The moments of a body are integrals over its mass, in principal axes:
 *     Ixx = sum m (y^2 + z^2),  Iyy = sum m (z^2 + x^2),  Izz = sum m (x^2 + y^2).
 * No moment is negative, and none exceeds the sum of the other two.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/algebra.h"

#include <stddef.h>

static const double NEGLIGIBLE = 0x1p-70; /* relative to entries of one */
static const double ROUNDING = 1e-10;     /* of the largest moment */

/* One rotation of Jacobi's method, in the plane of the axes p and q. Afterwards s_pq is 0. (Golub & Van Loan,
 * section 8.5.) */
static void annul(double s[3][3], int p, int q) {
    if (fabs(s[p][q]) <= NEGLIGIBLE)
        return;
    const int r = 3 - p - q;
    const double d = (s[q][q] - s[p][p]) / (2.0 * s[p][q]);
    const double t = copysign(1.0, d) / (fabs(d) + sqrt(d * d + 1.0));
    const double cosine = 1.0 / sqrt(t * t + 1.0), sine = t * cosine;
    const double rp = s[r][p], rq = s[r][q];
    s[p][p] -= t * s[p][q];
    s[q][q] += t * s[p][q];
    s[p][q] = s[q][p] = 0.0;
    s[r][p] = s[p][r] = cosine * rp - sine * rq;
    s[r][q] = s[q][r] = sine * rp + cosine * rq;
}

static void order_moments(double *a, double *b) {
    if (*a > *b) {
        const double c = *a;
        *a = *b;
        *b = c;
    }
}

kt_vec3 kt_sym3_eigenvalues(kt_sym3 m) {
    enum { SWEEPS = 10 };
    double s[3][3] = {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}}, largest = 0.0;
    for (int i = 0; i < 9; i++) {
        if (!isfinite(s[i / 3][i % 3]))
            return kt_vec3_make((double)NAN, (double)NAN, (double)NAN);
        largest = fmax(largest, fabs(s[i / 3][i % 3]));
    }
    int exponent;
    (void)frexp(largest, &exponent);
    for (int i = 0; i < 9; i++)
        s[i / 3][i % 3] = ldexp(s[i / 3][i % 3], -exponent);
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        annul(s, 0, 1);
        annul(s, 0, 2);
        annul(s, 1, 2);
    }
    order_moments(&s[0][0], &s[1][1]);
    order_moments(&s[1][1], &s[2][2]);
    order_moments(&s[0][0], &s[1][1]);
    return kt_vec3_make(ldexp(s[0][0], exponent), ldexp(s[1][1], exponent), ldexp(s[2][2], exponent));
}

kt_inertia_fault kt_inertia_check(kt_sym3 inertia, kt_vec3 *moments) {
    const kt_vec3 m = kt_sym3_eigenvalues(inertia);
    if (!isfinite(m.x) || !isfinite(m.y) || !isfinite(m.z))
        return KT_INERTIA_NOT_FINITE;
    if (moments != NULL)
        *moments = m;
    if (m.x < -ROUNDING * fmax(fabs(m.x), fabs(m.z)))
        return KT_INERTIA_NEGATIVE;
    if (m.z - m.y - m.x > ROUNDING * m.z)
        return KT_INERTIA_TRIANGLE;
    return KT_INERTIA_VALID;
}

double kt_inertia_excess(kt_sym3 inertia) {
    kt_vec3 m;
    if (kt_inertia_check(inertia, &m) != KT_INERTIA_TRIANGLE)
        return 0.0;
    const double others = m.x + m.y;
    return others > 0.0 ? (m.z - others) / others : (double)INFINITY;
}
