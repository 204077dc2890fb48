/* The interior point method without the other solvers of the cascade. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "impacts.h"

/* The interior point method alone, from zero: the cascade asks it only where sweeps and Newton's method fail. Newton's
 * method ends it, and needs few steps from a point of the interior method. The unit of rates is any. */
KT_TEST(interior_points_solve_random_impacts_alone) {
    enum { COUNT = 1000 };
    kt_random random = kt_random_of_test();
    void *memory = NULL;
    kt_cone *cone = make_cone(CONTACTS, CONTACTS, &memory);
    problem *p = malloc(sizeof *p);
    int unsolved = 0, steps = 0;
    for (int k = 0; k < COUNT && p != NULL; k++) {
        const int n = kt_random_int(&random, 1, 20);
        double x[ROWS] = {0.0}, y[ROWS] = {0.0};
        draw_problem(&random, (enum kind)(k % KINDS), n, p);
        const double unit = pow(10.0, kt_random_uniform(&random, -6.0, 6.0));
        for (int r = 0; r < 3 * n; r++)
            p->b[r] *= unit;
        const kt_cone_problem posed = {.n = n, .W = p->W, .b = p->b, .mu = p->mu, .symmetric = true};
        (void)kt_cone_cascade(cone, &posed, NULL, n, x); /* scales the problem */
        cone->newton = 0;
        kt_cone_interior(cone, y);
        steps += cone->newton;
        unsolved += !(kt_cone_residual(cone, cone->b, y) <= 1e-9);
    }
    kt_check_below("unsolved", unsolved, 0.02 * COUNT);
    kt_check_below("steps of Newton's method", (double)steps / COUNT, 2.7);
    free(p);
    free(memory);
}
