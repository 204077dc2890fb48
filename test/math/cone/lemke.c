/* Linear complementarity problems by Lemke's method against their own definition. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "cone/lemke.h"

#include <math.h>

#include "check.h"

/* Random W = J J' of any rank, q in its range: w and z are not negative, and of each pair one is zero. Nearly singular
 * W leave the largest residuals: at most delta / k of |z| after k proximal points (lemke.h). */
KT_TEST(lemke_solves_what_is_positive_semidefinite) {
    enum { TRIALS = 100000 };
    kt_random random = kt_random_named("lemke");
    double worst = 0.0;
    uint64_t pivots = 0;
    int unsolved = 0;
    for (int trial = 0; trial < TRIALS; trial++) {
        const int n = 1 + trial % 10, rank = 1 + (trial / 10) % 10;
        double J[10][10], M[100], q[10], z[10], work[250];
        for (int i = 0; i < n; i++)
            for (int k = 0; k < rank; k++)
                J[i][k] = kt_random_uniform(&random, -1.0, 1.0);
        for (int i = 0; i < n; i++) {
            q[i] = 0.0;
            for (int k = 0; k < rank; k++)
                q[i] += J[i][k] * cos(k + trial);
            for (int j = 0; j < n; j++) {
                M[i * n + j] = 0.0;
                for (int k = 0; k < rank; k++)
                    M[i * n + j] += J[i][k] * J[j][k];
            }
        }
        if (!kt_lemke_solve(n, M, q, work, z, &pivots)) {
            unsolved++;
            continue;
        }
        double square = 0.0; /* of z, each relative to sqrt(M_ii) */
        for (int i = 0; i < n; i++)
            square += M[i * n + i] * z[i] * z[i];
        for (int i = 0; i < n; i++) {
            const double size = fabs(q[i]) + sqrt(M[i * n + i] * square), z_size = size / M[i * n + i];
            double w = q[i];
            for (int j = 0; j < n; j++)
                w += M[i * n + j] * z[j];
            worst = fmax(worst, fmax(-w / size, fmin(z[i] / z_size, w / size)));
        }
    }
    kt_note("%.3g pivots each", (double)pivots / TRIALS);
    kt_check_equal_int("unsolved", unsolved, 0);
    kt_check_below("negative, or both above zero", worst, 1e-9);
}
