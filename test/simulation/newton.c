/* Newton's equations of a simulation, against differences of its right-hand side. */
#include "../dynamics/tree.h"
#include "scenes.h"

#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 80 };

/* Column j of J by central differences of order four: h^4 / 30 f''''' and eps / h of f. */
static void difference(kt_simulation *s, const kt_integrator_callbacks *callbacks, const double *y, size_t n,
                       double *jacobian) {
    static const double step[] = {-2.0, -1.0, 1.0, 2.0}, weight[] = {1.0 / 12.0, -2.0 / 3.0, 2.0 / 3.0, -1.0 / 12.0};
    const double h = 1e-3;
    double moved[MOST], slope[MOST];
    for (size_t j = 0; j < n; j++) {
        memset(jacobian + j * n, 0, n * sizeof *jacobian);
        for (int k = 0; k < 4; k++) {
            memcpy(moved, y, n * sizeof *moved);
            moved[j] += step[k] * h;
            kt_check_equal_int("evaluated", callbacks->rhs(0.0, moved, slope, s), 0);
            for (size_t i = 0; i < n; i++)
                jacobian[j * n + i] += weight[k] * slope[i] / h;
        }
    }
}

/* The largest component of (sigma - J) x - r, over that of |sigma x| + |J| |x|. */
static double defect(const double *jacobian, size_t n, kt_complex sigma, const double *x_re, const double *x_im,
                     const double *r_re, const double *r_im) {
    double worst = 0.0, size = 0.0;
    for (size_t i = 0; i < n; i++) {
        double re = sigma.re * x_re[i] - sigma.im * x_im[i] - r_re[i];
        double im = sigma.re * x_im[i] + sigma.im * x_re[i] - r_im[i];
        double sum = hypot(sigma.re, sigma.im) * hypot(x_re[i], x_im[i]);
        for (size_t j = 0; j < n; j++) {
            re -= jacobian[j * n + i] * x_re[j];
            im -= jacobian[j * n + i] * x_im[j];
            sum += fabs(jacobian[j * n + i]) * hypot(x_re[j], x_im[j]);
        }
        worst = fmax(worst, hypot(re, im));
        size = fmax(size, sum);
    }
    return worst / size;
}

static void check_solutions(kt_simulation *s, const double *jacobian, size_t n, kt_random *random, kt_worst *worst,
                            int tree) {
    static const kt_complex sigmas[] = {{0.7, 0.0}, {40.0, 0.0}, {0.6, 0.9}, {30.0, 35.0}};
    for (int k = 0; k < 4; k++) {
        double r[2][MOST], x[2][MOST], zero[MOST] = {0.0};
        for (size_t i = 0; i < n; i++) {
            r[0][i] = kt_random_normal(random);
            r[1][i] = kt_random_normal(random);
        }
        memcpy(x, r, sizeof x);
        const bool complex = sigmas[k].im != 0.0;
        kt_check_equal_int("regular", kt_simulation_newton.factor(sigmas[k], s), 0);
        kt_check_equal_int("solved", kt_simulation_newton.solve(x[0], complex ? x[1] : NULL, s), 0);
        const double found = complex ? defect(jacobian, n, sigmas[k], x[0], x[1], r[0], r[1])
                                     : defect(jacobian, n, sigmas[k], x[0], zero, r[0], zero);
        kt_worst_below(worst, found, 1e-10, "tree %d, sigma %g + %gi", tree, sigmas[k].re, sigmas[k].im);
    }
}

/* Random trees of all types of joints, quaternions of any norm among them. Measured: 9e-12, the
 * error of the differences. */
KT_TEST(solutions_of_trees_are_those_of_the_matrix_of_differences) {
    static double jacobian[MOST * MOST];
    static kt_tree tree;
    static kt_tree_state state;
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("defect");
    const kt_run run = kt_run_fixed("radau5", 0.01, 1.0);
    for (int k = 0; k < 12; k++) {
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 1 + k % 6;
        kt_error error;
        if (!kt_tree_grow(&tree, &plan, &random))
            return;
        kt_tree_state_draw(&tree, &random, &state);
        kt_simulation *s = kt_scene_simulate(tree.model, &run, NULL);
        const size_t n = (size_t)(tree.nq + tree.nv);
        double y[MOST], slope[MOST];
        (void)kt_fine("state", kt_simulation_set_state(s, 0.0, state.q, state.v, &error), &error);
        (void)kt_fine("torque", kt_simulation_set_torque(s, state.tau, &error), &error);
        (void)kt_fine("torque", kt_simulation_inputs_commit(s, &error), &error);
        memcpy(y, state.q, (size_t)tree.nq * sizeof *y);
        memcpy(y + tree.nq, state.v, (size_t)tree.nv * sizeof *y);
        const kt_integrator_callbacks callbacks = kt_simulation_callbacks(s);
        difference(s, &callbacks, y, n, jacobian);
        kt_check_equal_int("slope", callbacks.rhs(0.0, y, slope, s), 0);
        if (kt_check_equal_int("Jacobian", kt_simulation_newton.jacobian(0.0, y, slope, s), 0))
            check_solutions(s, jacobian, n, &random, &worst, k);
        kt_simulation_free(s);
        kt_tree_free(&tree);
    }
    kt_check_worst(&worst);
}
