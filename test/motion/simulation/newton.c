/* Newton's equations of a simulation, against differences of its right-hand side. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"
#include "parsed.h"

#include "kinetree/scene.h"
#include "simulation/simulation.h"
#include "step/newton_matrices.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 80 };

/* Column j of J by central differences of order four: h^4 / 30 f''''' and eps / h of f. */
static void difference(kt_simulation *s, const kt_integrator_callbacks *callbacks, const double *y, size_t n, double h,
                       double *jacobian) {
    static const double step[] = {-2.0, -1.0, 1.0, 2.0}, weight[] = {1.0 / 12.0, -2.0 / 3.0, 2.0 / 3.0, -1.0 / 12.0};
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
    KT_WORST worst = kt_worst_make("defect");
    const kt_run run = kt_run_fixed("radau5", 0.01, 1.0);
    for (int k = 0; k < 12; k++) {
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 1 + k % 6;
        kt_error error;
        kt_tree_grow(&tree, &plan, &random);
        kt_tree_state_draw(&tree, &random, &state);
        kt_simulation *s = kt_test_simulation(tree.model, &run, NULL);
        const size_t n = (size_t)(tree.nq + tree.nv);
        double y[MOST], slope[MOST];
        (void)kt_fine("state", kt_simulation_set_state(s, 0.0, state.q, state.v, &error), &error);
        (void)kt_fine("torque", kt_simulation_set_torque(s, state.tau, &error), &error);
        (void)kt_fine("torque", kt_simulation_inputs_commit(s, &error), &error);
        memcpy(y, state.q, (size_t)tree.nq * sizeof *y);
        memcpy(y + tree.nq, state.v, (size_t)tree.nv * sizeof *y);
        const kt_integrator_callbacks callbacks = kt_simulation_callbacks(s);
        difference(s, &callbacks, y, n, 1e-3, jacobian);
        kt_check_equal_int("slope", callbacks.rhs(0.0, y, slope, s), 0);
        kt_need(kt_check_equal_int("Jacobian", kt_simulation_newton.jacobian(0.0, y, slope, s), 0));
        check_solutions(s, jacobian, n, &random, &worst, k);
    }
}

/* ---- auxiliary states -------------------------------------------------------------------------------------------- */

/* A body on a ball joint with an arm, and states that read joints, a marker, time and each other. Effects with formulas
 * in all possible places read these states. With `loop` a second rod that is closed to the ground. */
#define STATES_TREE                                                                                                    \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                   \
    "  - {name: ball, joint: {type: spherical}, mass: 2, com: [0.3, 0.1, 0], inertia: [0.2, 0.3, 0.4]}\n"              \
    "  - {name: arm, parent: ball, joint: {type: revolute, axis: y, at: [0.5, 0, 0.1]}, mass: 1, com: [0.2, 0, "       \
    "0.1],\n"                                                                                                          \
    "     inertia: [0.02, 0.03, 0.04], markers: {tip: [0.4, 0.1, 0]}}\n"                                               \
    "states:\n"                                                                                                        \
    "  lag: {initial: 0.5, rate: \"30*(position.arm - lag) + sin(2*t)\"}\n"                                            \
    "  charge: {initial: 1, rate: \"marker.arm.tip.vx - lag*charge + velocity.ball[1]*marker.arm.tip.y\"}\n"           \
    "effects:\n"                                                                                                       \
    "  - {type: expression, joint: arm, force: \"-3*lag - 40*charge*velocity.arm\"}\n"                                 \
    "  - {type: expression, between: [arm.tip, {body: world, at: [1, 1, 0]}], force: \"5*charge*lag - length\"}\n"     \
    "  - {type: expression, at: ball, force: [charge^2, 0, lag*t], torque: [0, lag, 0]}\n"
#define STATES_LOOP                                                                                                    \
    "loops:\n"                                                                                                         \
    "  - {name: rod, type: distance, between: [arm.tip, {body: world, at: [1.2, 0.4, 0.3]}]}\n"

typedef struct states_scene {
    kt_scene scene;
    kt_model *model;
    kt_simulation *s;
} states_scene;

static void open_states(states_scene *at, const char *text, const char *method) {
    const kt_run run = kt_run_fixed(method, 0.01, 1.0);
    memset(at, 0, sizeof *at);
    kt_parsed_scene(text, &at->scene);
    at->model = kt_scene_compile(&at->scene.description);
    at->s = kt_test_simulation(at->model, &run, NULL);
}

/* The equations (sigma - J) x = r as the matrices solve them: of the velocities Z'(..) = 0 alone where loops reduce
 * them (newton.c). */
static double states_defect(const kt_simulation *s, const double *jacobian, double sigma, const double *x,
                            const double *r) {
    const size_t nq = s->size.nq, nv = s->size.nv, n = s->size.n;
    double missing[MOST], size = 0.0, worst = 0.0;
    for (size_t i = 0; i < n; i++) {
        double sum = fabs(sigma * x[i]);
        missing[i] = sigma * x[i] - r[i];
        for (size_t j = 0; j < n; j++) {
            missing[i] -= jacobian[j * n + i] * x[j];
            sum += fabs(jacobian[j * n + i] * x[j]);
        }
        size = fmax(size, sum);
        if (!(s->size.reduced && i >= nq && i < nq + nv))
            worst = fmax(worst, fabs(missing[i]));
    }
    for (size_t c = 0; c < s->size.free && s->size.reduced; c++) {
        double sum = 0.0;
        for (size_t i = 0; i < nv; i++)
            sum += s->newton->basis[c * nv + i] * missing[nq + i];
        worst = fmax(worst, fabs(sum));
    }
    return worst / size;
}

static void check_states(const char *text, const char *method, kt_random *random, kt_worst *worst) {
    static double jacobian[MOST * MOST];
    states_scene at;
    double y[MOST], slope[MOST], r[MOST], x[MOST];
    open_states(&at, text, method);
    kt_simulation *s = at.s;
    const size_t n = s->size.n;
    const kt_integrator_callbacks callbacks = kt_simulation_callbacks(s);
    memcpy(y, kt_integrator_state(s->integrator), n * sizeof *y);
    difference(s, &callbacks, y, n, 2e-4, jacobian); /* the loop's equations are curved */
    kt_check_equal_int("slope", callbacks.rhs(0.0, y, slope, s), 0);
    kt_check_equal_int("Jacobian", kt_simulation_newton.jacobian(0.0, y, slope, s), 0);
    for (int k = 0; k < 6; k++) {
        const kt_complex sigma = {k < 3 ? 0.7 : 40.0, 0.0};
        for (size_t i = 0; i < n; i++)
            r[i] = x[i] = kt_random_normal(random);
        kt_check_equal_int("regular", kt_simulation_newton.factor(sigma, s), 0);
        kt_check_equal_int("solved", kt_simulation_newton.solve(x, NULL, s), 0);
        kt_worst_below(worst, states_defect(s, jacobian, sigma.re, x, r), 1e-9, "%s, sigma %g", method, sigma.re);
    }
    if (!s->size.reduced)
        check_solutions(s, jacobian, n, random, worst, 0);
}

/* Measured: 2e-11, the error of the differences. */
KT_TEST(solutions_with_auxiliary_states_are_those_of_the_matrix_of_differences) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("defect");
    check_states(STATES_TREE, "radau5", &random, &worst);
    check_states(STATES_TREE, "rodas5p", &random, &worst);
    check_states(STATES_TREE STATES_LOOP, "radau5", &random, &worst);
    check_states(STATES_TREE STATES_LOOP, "rodas5p", &random, &worst);
}

/* The oracle is a difference of order four. Measured: 1e-11. */
KT_TEST(the_slope_in_time_is_that_of_rates_of_auxiliary_states) {
    static const double step[] = {-2.0, -1.0, 1.0, 2.0}, weight[] = {1.0 / 12.0, -2.0 / 3.0, 2.0 / 3.0, -1.0 / 12.0};
    states_scene at;
    double y[MOST], dydt[MOST], one[MOST], slope[MOST] = {0.0}, expected[MOST] = {0.0};
    KT_WORST worst = kt_worst_make("slope in time");
    open_states(&at, STATES_TREE, "rodas5p");
    const size_t n = at.s->size.n;
    const double t = 0.4, h = 1e-3;
    const kt_integrator_callbacks callbacks = kt_simulation_callbacks(at.s);
    memcpy(y, kt_integrator_state(at.s->integrator), n * sizeof *y);
    kt_check_equal_int("evaluated", callbacks.rhs(t, y, dydt, at.s), 0);
    kt_check_equal_int("known", kt_simulation_newton.time_derivative(t, y, dydt, slope, at.s), 0);
    for (int l = 0; l < 4; l++) {
        kt_check_equal_int("evaluated", callbacks.rhs(t + step[l] * h, y, one, at.s), 0);
        for (size_t i = 0; i < n; i++)
            expected[i] += weight[l] * one[i] / h;
    }
    for (size_t i = 0; i < n; i++)
        kt_worst_near(&worst, slope[i], expected[i], 3e-11, "%d", (int)i);
    kt_check_equal_int("not autonomous", kt_simulation_newton.autonomous(at.s), 0);
}

/* ---- the slope in time ------------------------------------------------------------------------------------------- */

enum { DRIVES = 6 };

/* A free body with an arm on a slide, which all effects push that are functions of time. */
static kt_model *driven_model(kt_effect drives[DRIVES], kt_loop *loop) {
    static const double rows[] = {0.0, 0.0, 0.4, 0.8, 1.0, 0.3, 2.0, 0.5}, polynomial[] = {0.2, -1.0, 0.5, 0.3};
    static kt_body bodies[3];
    static const kt_joint_type joints[] = {KT_JOINT_FREE, KT_JOINT_REVOLUTE, KT_JOINT_PRISMATIC};
    static const char *const names[] = {"base", "arm", "slide"};
    for (int i = 0; i < 3; i++) {
        bodies[i] = kt_body_of(names[i], i > 0 ? names[i - 1] : NULL, joints[i], 1.0 + i);
        bodies[i].com = kt_vec3_make(0.1, 0.2 * i, -0.1);
        bodies[i].inertia = (kt_sym3){.xx = 0.3, .yy = 0.35, .zz = 0.4};
    }
    for (int i = 0; i < DRIVES; i++)
        drives[i] = kt_effect_default();
    drives[0].type = KT_EFFECT_JOINT_SPRING;
    drives[0].rest = kt_function_sine(0.4, 1.5, 0.3, 0.1);
    drives[1].type = drives[2].type = KT_EFFECT_SERVO;
    drives[1].target = drives[2].target = kt_function_table(rows, 8, KT_INTERPOLATION_CUBIC);
    drives[1].limit = 30.0; /* on the parabola before the limit */
    drives[3].type = KT_EFFECT_MOTOR;
    drives[3].torque = kt_function_polynomial(polynomial, 4);
    drives[4].type = KT_EFFECT_FORCE;
    drives[4].between[0] = (kt_end){.body = "slide", .at = kt_vec3_make(0.3, -0.2, 0.1)};
    drives[4].value[0] = kt_function_ramp(0.0, 7.0, 0.1, 1.3);
    drives[4].value[1] = kt_function_constant(2.0);
    drives[4].value[2] = kt_function_sine(3.0, 0.7, 0.0, 1.0);
    drives[4].frame = KT_FRAME_BODY;
    drives[5] = drives[4];
    drives[5].type = KT_EFFECT_TORQUE;
    drives[5].frame = KT_FRAME_WORLD;
    for (int i = 0; i < 4; i++) {
        drives[i].joint = i % 2 ? "slide" : "arm";
        drives[i].stiffness = 40.0;
        drives[i].damping = 3.0;
    }
    kt_description d = kt_description_of(bodies, 3, NULL, 0, drives, DRIVES);
    *loop = kt_loop_of("hold", KT_LOOP_SPHERICAL);
    loop->between[1] = (kt_end){.body = "slide"};
    d.loops = loop;
    d.loop_count = 1;
    return kt_scene_compile(&d);
}

/* The oracle is a difference of order four. Its errors are h^4 / 30 f_ttttt and eps / h of f. Measured: 3e-9. */
KT_TEST(the_slope_in_time_is_that_of_all_functions_of_time) {
    kt_random random = kt_random_of_test();
    kt_effect drives[DRIVES];
    kt_loop loop;
    KT_WORST worst = kt_worst_make("slope in time");
    kt_model *model = driven_model(drives, &loop);
    const kt_run run = kt_run_fixed("rodas5p", 0.01, 1.0);
    kt_simulation *s = kt_test_simulation(model, &run, NULL);
    for (int k = 0; k < 40; k++) {
        static const double step[] = {-2.0, -1.0, 1.0, 2.0};
        static const double weight[] = {1.0 / 12.0, -2.0 / 3.0, 2.0 / 3.0, -1.0 / 12.0};
        const size_t n = s->size.n;
        const double t = kt_random_uniform(&random, 0.15, 1.2), h = 1e-3;
        const kt_integrator_callbacks callbacks = kt_simulation_callbacks(s);
        double y[MOST] = {0.0}, dydt[MOST], slope[MOST] = {0.0}, expected[MOST] = {0.0}, one[MOST], size = 1.0;
        kt_model_initial(model, y, y + s->size.nq);
        for (size_t i = s->size.nq - 2; i < n; i++)
            y[i] = 0.3 * kt_random_normal(&random);
        kt_check_equal_int("evaluated", callbacks.rhs(t, y, dydt, s), 0);
        kt_check_equal_int("known", kt_simulation_newton.time_derivative(t, y, dydt, slope, s), 0);
        for (int l = 0; l < 4; l++) {
            kt_check_equal_int("evaluated", callbacks.rhs(t + step[l] * h, y, one, s), 0);
            for (size_t i = 0; i < n; i++)
                expected[i] += weight[l] * one[i] / h;
        }
        for (size_t i = 0; i < n; i++)
            size = fmax(size, fabs(expected[i]));
        for (size_t i = 0; i < n; i++)
            kt_worst_near(&worst, slope[i] / size, expected[i] / size, 1e-8, "t = %g, %d", t, (int)i);
    }
}
