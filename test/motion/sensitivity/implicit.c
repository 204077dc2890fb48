/* Steps of implicit methods and their derivatives on trees, quaternions, loops and contacts. They are compared with
 * closed forms, with a simulation's steps, and with differences of the steps themselves. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"
#include "grown.h"

#include "kinetree/simulation.h"
#include "kinetree/stability.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- an oscillator ----------------------------------------------------------------------------------------------- */

typedef struct matrix {
    double a[4]; /* column-major */
} matrix;

static matrix combined(double one, double z, matrix x, double square, double cube) {
    const double *a = x.a;
    const matrix x2 = {
        {a[0] * a[0] + a[2] * a[1], a[1] * a[0] + a[3] * a[1], a[0] * a[2] + a[2] * a[3], a[1] * a[2] + a[3] * a[3]}};
    const double *b = x2.a;
    const matrix x3 = {
        {a[0] * b[0] + a[2] * b[1], a[1] * b[0] + a[3] * b[1], a[0] * b[2] + a[2] * b[3], a[1] * b[2] + a[3] * b[3]}};
    matrix out;
    for (int i = 0; i < 4; i++)
        out.a[i] = one * (i % 3 == 0) + z * a[i] + square * b[i] + cube * x3.a[i];
    return out;
}

/* q^-1 p */
static matrix quotient(matrix q, matrix p) {
    const double det = q.a[0] * q.a[3] - q.a[2] * q.a[1];
    matrix out;
    for (int j = 0; j < 2; j++) {
        const double x = p.a[2 * j], y = p.a[2 * j + 1];
        out.a[2 * j] = (q.a[3] * x - q.a[2] * y) / det;
        out.a[2 * j + 1] = (q.a[0] * y - q.a[1] * x) / det;
    }
    return out;
}

/* R(Z) of a matrix with two real eigenvalues, from the values there (Sylvester). */
static matrix by_eigenvalues(const kt_method *method, matrix z) {
    const double mean = 0.5 * (z.a[0] + z.a[3]), det = z.a[0] * z.a[3] - z.a[2] * z.a[1];
    const double apart = sqrt(mean * mean - det), one = mean + apart, other = mean - apart;
    kt_stability s;
    kt_error e;
    matrix out = {{NAN}};
    kt_need_fine("stability", kt_stability_make(method, 0, &s, &e), &e);
    const double at_one = kt_stability_value(&s, (kt_complex){one, 0.0}).re,
                 at_other = kt_stability_value(&s, (kt_complex){other, 0.0}).re;
    for (int i = 0; i < 4; i++) {
        const double unit = i % 3 == 0;
        out.a[i] = (at_one * (z.a[i] - other * unit) - at_other * (z.a[i] - one * unit)) / (one - other);
    }
    return out;
}

/* R(h L) = P / Q of the method, a rational function (Hairer, Wanner II, IV.3). */
static matrix growth(const kt_method *of, matrix z) {
    const char *method = of->name;
    if (of->steps == 2) { /* the starter, diagonally implicit: (1 + (1 - 2 g) z) / (1 - g z)^2 */
        const double g = 1.0 - sqrt(0.5);
        return quotient(combined(1.0, -2.0 * g, z, g * g, 0.0), combined(1.0, 1.0 - 2.0 * g, z, 0.0, 0.0));
    }
    if (strcmp(method, "implicit-euler") == 0)
        return quotient(combined(1.0, -1.0, z, 0.0, 0.0), combined(1.0, 0.0, z, 0.0, 0.0));
    if (strcmp(method, "crank-nicolson") == 0)
        return quotient(combined(1.0, -0.5, z, 0.0, 0.0), combined(1.0, 0.5, z, 0.0, 0.0));
    if (strcmp(method, "rodas5p") == 0)
        return by_eigenvalues(of, z);
    return quotient(combined(1.0, -0.6, z, 0.15, -1.0 / 60.0), combined(1.0, 0.4, z, 0.05, 0.0));
}

/* A stiff oscillator has a closed form:
 *     m q'' = tau - k q - c q',  A = R(h L),  B = (R - 1) L^-1 (0, 1 / m)
 * Times are in 1 / w with w^2 = k / m, so that all numbers of A are of one size. Rounding is that of the solution of
 * equations whose condition is some hundred. */
KT_TEST(step_of_an_oscillator_has_the_stability_function_of_its_method) {
    const double mass = 2.0, stiffness = 5e4, damping = 700.0, h = 0.05, tau = 3.0;
    kt_body body = kt_body_default();
    kt_effect spring = kt_effect_default();
    kt_description d = kt_description_default();
    kt_error e;
    body.name = spring.joint = "mass";
    body.joint.type = KT_JOINT_PRISMATIC;
    body.joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    body.mass = mass;
    spring.type = KT_EFFECT_JOINT_SPRING;
    spring.stiffness = stiffness;
    spring.damping = damping;
    d.bodies = &body, d.body_count = 1, d.effects = &spring, d.effect_count = 1;
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    const double q = 0.1, v = 0.2, w = sqrt(stiffness / mass), rounding = 128.0 * DBL_EPSILON;
    const matrix z = {{0.0, -h * stiffness / mass, h, -h * damping / mass}};
    for (int n = 0; n < IMPLICIT_METHODS; n++) {
        const kt_step step = {.method = implicit_method(n), .h = h, .tau = &tau};
        const size_t size = kt_step_work_size(model, step.method);
        void *work = aligned_alloc(64, (size + 63) / 64 * 64);
        double A[4], B[2], next_q = 0.0, next_v = 0.0;
        kt_fine("step", kt_step_derivatives(model, data, work, size, &step, &q, &v, &next_q, &next_v, A, B, &e), &e);
        const matrix r = growth(step.method, z);
        const double rest = tau / stiffness, off = q - rest;
        const double unit[] = {1.0, w, 1.0 / w, 1.0};
        kt_worst worst[] = {kt_worst_make(step.method->name), kt_worst_make("B"), kt_worst_make("next state")};
        for (int i = 0; i < 4; i++)
            kt_worst_near(&worst[0], A[i], r.a[i], rounding * unit[i], "A %d", i);
        kt_worst_near(&worst[1], B[0], (1.0 - r.a[0]) / stiffness, rounding / stiffness, "q");
        kt_worst_near(&worst[1], B[1], -r.a[1] / stiffness, rounding * w / stiffness, "v");
        kt_worst_near(&worst[2], next_q, rest + r.a[0] * off + r.a[2] * v, rounding * q, "q");
        kt_worst_near(&worst[2], next_v, r.a[1] * off + r.a[3] * v, rounding * q * w, "v");
        for (int i = 0; i < 3; i++)
            kt_check_worst(&worst[i]);
        free(work);
    }
}

/* ---- trees ------------------------------------------------------------------------------------------------------- */

enum { TREES = 24 };

KT_TEST(derivatives_of_implicit_steps_of_trees_are_those_of_the_steps) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A and B");
    int taken = 0, turning = 0;
    for (int n = 0; n < TREES; n++) {
        static grown s;
        const kt_method *method = implicit_method(n);
        grown_make(&s, n, &random);
        const step_case c = {s.tree.model,
                             s.tree.data,
                             s.state.q,
                             s.state.v,
                             {.method = method, .t = 0.1, .h = 0.01, .tau = s.state.tau, .external = s.state.external},
                             0.01};
        turning += s.tree.nq > s.tree.nv;
        taken += compare_step(&c, &worst, method->name);
    }
    kt_check_equal_int("trees", taken, TREES);
    kt_check_above("with quaternions", turning, 12.0);
}

enum { CHAINED = 3 };

/* Steps from s one after the other, with other torques at each; and those of a simulation. */
static void chain_steps(grown *s, const kt_step *first, kt_simulation *simulation, kt_worst *worst) {
    const int nq = s->tree.nq, nv = s->tree.nv;
    const size_t size = kt_step_work_size(s->tree.model, first->method);
    void *work = aligned_alloc(64, (size + 63) / 64 * 64);
    double q[KT_TREE_NQ], v[KT_TREE_NV], tau[KT_TREE_NV];
    kt_error error;
    kt_step step = *first;
    memcpy(q, kt_simulation_positions(simulation), (size_t)nq * sizeof *q);
    memcpy(v, kt_simulation_velocities(simulation), (size_t)nv * sizeof *v);
    for (int k = 0; k < CHAINED; k++) {
        for (int i = 0; i < nv; i++)
            tau[i] = (1.0 - 0.5 * k) * s->state.tau[i];
        step.t = k * step.h;
        step.tau = tau;
        kt_fine("torque", kt_simulation_set_torque(simulation, tau, &error), &error);
        kt_fine("step", kt_step_evaluate(s->tree.model, s->tree.data, work, size, &step, q, v, q, v, &error), &error);
        kt_fine("simulated", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
        const double *at = kt_simulation_positions(simulation), *rate = kt_simulation_velocities(simulation);
        const double most = fmax(1.0, kt_tree_largest(v, nv));
        for (int i = 0; i < nq; i++)
            kt_worst_near(worst, q[i], at[i], 1e-13 * most, "%s, step %d position %d", step.method->name, k, i);
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, v[i], rate[i], 1e-11 * most, "%s, step %d velocity %d", step.method->name, k, i);
    }
    free(work);
}

/* A simulation solves the same equations with other matrices, to rounding. Two-step methods begin anew where its
 * torques change, as each step from a state alone does. */
KT_TEST(implicit_steps_are_those_of_a_simulation_whose_torques_change_at_each) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("state after the steps");
    for (int n = 0; n < 24; n++) {
        static grown s;
        kt_run run = kt_run_default();
        kt_error error;
        const kt_step step = {.method = implicit_method(n), .h = 0.01};
        run.integrator = step.method->name;
        run.step = 0.01;
        grown_make(&s, n, &random);
        kt_simulation *simulation = kt_test_simulation(s.tree.model, &run, NULL);
        kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, s.state.q, s.state.v, &error), &error);
        chain_steps(&s, &step, simulation, &worst);
    }
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

static const kt_method *any_implicit_method(int n) { return n < IMPLICIT_METHODS ? implicit_method(n) : NULL; }

KT_TEST(derivatives_of_implicit_steps_follow_the_projection) { compare_linkages(any_implicit_method, 6); }

KT_TEST(derivatives_of_implicit_steps_of_random_closed_mechanisms_hold) { compare_closed(implicit_method, 4, 16.0); }

/* ---- contact ----------------------------------------------------------------------------------------------------- */

/* A ball of 1 kg and 0.1 m that rolls and slides on the ground, stiff, at some depth; or, closing, just above it. */
static void compare_contact(double height, double speed, double h, double reach, kt_worst *worst, int *taken) {
    kt_description d = kt_description_default();
    const double q[7] = {0.0, 0.0, 0.1 + height, 1.0, 0.0, 0.0, 0.0};
    const double v[6] = {0.3, -0.2, 0.1, 0.4, 0.2, speed};
    kt_body body = kt_body_of("ball", NULL, KT_JOINT_FREE, 1.0);
    body.inertia = (kt_sym3){4e-3, 4e-3, 4e-3, 0.0, 0.0, 0.0};
    kt_effect contact = kt_effect_of(KT_EFFECT_CONTACT, NULL);
    contact.between[0].body = "ball";
    contact.stiffness = 1e6;
    contact.exponent = 1.5;
    contact.dissipation = 0.5;
    contact.radius = 0.1;
    contact.friction = 0.4;
    contact.slip = 0.05;
    d.bodies = &body, d.body_count = 1, d.effects = &contact, d.effect_count = 1;
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    for (int m = 0; m < IMPLICIT_METHODS; m++) {
        const step_case c = {model, data, q, v, {.method = implicit_method(m), .h = h}, reach};
        *taken += compare_step(&c, worst, c.step.method->name);
    }
}

KT_TEST(derivatives_of_implicit_steps_know_contacts) {
    KT_WORST worst = kt_worst_make("A and B");
    int taken = 0;
    compare_contact(-2e-3, -0.5, 1e-3, 8e-5, &worst, &taken);
    kt_check_equal_int("steps", taken, IMPLICIT_METHODS);
}

/* All stages but the first are in contact. The Jacobian of the start contains no contact. */
KT_TEST(implicit_steps_that_close_a_contact_are_solved) {
    KT_WORST worst = kt_worst_make("A and B");
    int taken = 0;
    compare_contact(1e-4, -3.0, 1e-3, 1e-6, &worst, &taken);
    kt_check_equal_int("steps", taken, IMPLICIT_METHODS);
}
