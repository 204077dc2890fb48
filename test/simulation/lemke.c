/* Linear complementarity problems by Lemke's method, and those of Coulomb's friction, against their own definition. */
#include "linear/lemke.h"
#include "linear/coulomb.h"

#include <math.h>

#include "check.h"

/* Random W = J J' of any rank, q in its range: w and z are not negative, and of each pair one is zero. */
KT_TEST(lemke_solves_what_is_positive_semidefinite) {
    kt_random random = kt_random_named("lemke");
    double worst = 0.0;
    uint64_t pivots = 0;
    int unsolved = 0;
    for (int trial = 0; trial < 20000; trial++) {
        const int n = 1 + trial % 10, rank = 1 + (trial / 10) % 10;
        double J[10][10], M[100], q[10], z[10];
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
        if (!kt_lemke_solve(n, M, q, z, &pivots)) {
            unsolved++;
            continue;
        }
        for (int i = 0; i < n; i++) {
            double w = q[i], size = fabs(q[i]);
            for (int j = 0; j < n; j++) {
                w += M[i * n + j] * z[j];
                size += fabs(M[i * n + j] * z[j]);
            }
            worst = fmax(worst, fmax(-w, fmin(z[i], w)) / fmax(size, 1.0));
        }
    }
    kt_note("%.3g pivots each", (double)pivots / 20000.0);
    kt_check_equal_int("unsolved", unsolved, 0);
    kt_check_below("negative, or both above zero", worst, 1e-9);
}

/* Random problems of one to three contacts, half of which have least normal impulses: what is found satisfies the laws, by their definition. */
KT_TEST(coulombs_laws_hold_in_random_problems) {
    kt_random random = kt_random_named("coulomb");
    double worst = 0.0;
    int none = 0, parted = 0;
    for (int n = 0; n < 300; n++) {
        const int contacts = kt_random_int(&random, 1, 3), rows = 3 * contacts,
                  dofs = rows + kt_random_int(&random, 0, 2);
        double J[9][11], W[9 * 9] = {0.0};
        uint64_t trials = 0;
        kt_coulomb c = {.n = contacts, .rows = rows, .stride = rows, .W = W, .size = 1.0};
        kt_coulomb_solution s;
        for (int i = 0; i < rows; i++) {
            c.line[i] = i;
            c.b[i] = kt_random_uniform(&random, -1.0, 1.0);
            for (int k = 0; k < dofs; k++)
                J[i][k] = kt_random_uniform(&random, -1.0, 1.0);
            for (int j = 0; j <= i; j++) {
                for (int k = 0; k < dofs; k++)
                    W[i * rows + j] += J[i][k] * J[j][k];
                W[j * rows + i] = W[i * rows + j];
            }
        }
        for (int i = 0; i < contacts; i++)
            c.item[i] = (kt_coulomb_item){.type = KT_COULOMB_CONE,
                                          .row = 3 * i,
                                          .across = 3 * i + 1,
                                          .friction = 0.3,
                                          .least = n % 2 ? kt_random_uniform(&random, 0.0, 0.5) : 0.0};
        if (!kt_coulomb_solve(&c, &s, &trials)) {
            none++;
            continue;
        }
        for (int i = 0; i < contacts; i++) {
            const double p = s.p[3 * i], u = s.u[3 * i], *pt = s.p + 3 * i + 1, *ut = s.u + 3 * i + 1;
            const double slip = hypot(ut[0], ut[1]), force = hypot(pt[0], pt[1]);
            const double more = p - c.item[i].least;
            worst = fmax(worst, fmax(-more, -u));
            worst = fmax(worst, fabs(more * u));
            parted += n % 2 && u > 1e-9;
            worst = fmax(worst, force - 0.3 * p);
            worst = fmax(worst, fmax(fabs(slip * pt[0] + 0.3 * p * ut[0]), fabs(slip * pt[1] + 0.3 * p * ut[1])));
        }
    }
    kt_check_below("laws", worst, 1e-11);
    kt_check_equal_int("without a solution", none, 0);
    kt_check_above("with the least impulse", parted, 50.0);
}
