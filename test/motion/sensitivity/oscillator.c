/* A mass on a spring with a damper: x' = L x + g. A Runge-Kutta method with the stability polynomial R computes
 *     x + (R(h L) - 1) L^-1 (L x + g)
 * The derivatives of this step are therefore
 *     A = R(h L),  B = (R(h L) - 1) L^-1 (0, 1/m) */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"
#include "kinetree/stability.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double mass = 2.0, stiffness = 50.0, damping = 1.5, h = 0.05;

static void product(const double *a, const double *b, double *out) {
    double c[4];
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++)
            c[2 * j + i] = a[i] * b[2 * j] + a[2 + i] * b[2 * j + 1];
    memcpy(out, c, sizeof c);
}

/* A = R(h L) and B, column-major. */
static void expected_of(const kt_method *method, double *A, double *B) {
    const double L[4] = {0.0, -stiffness / mass, 1.0, -damping / mass};
    double power[4] = {1.0, 0.0, 0.0, 1.0}, sum[4] = {0.0}; /* sum: (R - 1) (h L)^-1 */
    kt_stability s;
    kt_error error;
    kt_check_equal_int("stability", kt_stability_make(method, 0, &s, &error), KT_OK);
    memcpy(A, power, sizeof power);
    for (int k = 1; k <= s.degree; k++) {
        for (int i = 0; i < 4; i++)
            sum[i] += s.coefficient[k] * power[i];
        product(L, power, power);
        for (int i = 0; i < 4; i++) {
            power[i] *= h;
            A[i] += s.coefficient[k] * power[i];
        }
    }
    for (int i = 0; i < 2; i++)
        B[i] = h * sum[2 + i] / mass;
}

KT_TEST(step_of_an_oscillator_has_the_methods_stability_polynomial) {
    kt_effect effect[2] = {kt_effect_default(), kt_effect_default()};
    kt_description d = kt_description_default();
    kt_error error;
    kt_body body = kt_body_of("mass", NULL, KT_JOINT_PRISMATIC, mass);
    effect[0].type = KT_EFFECT_JOINT_SPRING;
    effect[0].joint = effect[1].joint = "mass";
    effect[0].stiffness = stiffness;
    effect[1].type = KT_EFFECT_JOINT_DAMPER;
    effect[1].damping = damping;
    d.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    d.bodies = &body, d.body_count = 1;
    d.effects = effect, d.effect_count = 2;
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    KT_WORST worst = kt_worst_make("A = R(h L), B = (R(h L) - 1) L^-1 / m");
    const kt_method *method;
    for (int n = 0; (method = explicit_method(n)) != NULL; n++) {
        double observed[6], expected[6], q = 0.7, v = -1.3, next_q, next_v;
        const double tau = 3.0;
        const kt_step step = {.method = method, .t = 0.3, .h = h, .tau = &tau};
        const size_t size = kt_step_work_size(model, method);
        void *work = aligned_alloc(64, (size + 63) / 64 * 64);
        kt_need_fine("derivatives",
                     kt_step_derivatives(model, data, work, size, &step, &q, &v, &next_q, &next_v, observed,
                                         observed + 4, &error),
                     &error);
        expected_of(method, expected, expected + 4);
        /* rounding: stages times some products of numbers below 26 */
        for (int i = 0; i < 6; i++)
            kt_worst_near(&worst, observed[i], expected[i], 8.0 * DBL_EPSILON * fmax(1.0, fabs(expected[i])),
                          "%s number %d", method->name, i);
        kt_worst_near(&worst, next_q, q + (expected[0] - 1.0) * q + expected[2] * v + expected[4] * tau,
                      8.0 * DBL_EPSILON, "%s position", method->name);
        free(work);
    }
    kt_check_above("methods", explicit_method(10) != NULL, 1.0);
}

KT_TEST(methods_whose_steps_depend_on_earlier_ones_are_rejected_by_name) {
    kt_description d = kt_description_default();
    kt_error error;
    char work[64];
    double q = 0.1, v = 0.2, next_q = 5.0, next_v = 6.0;
    kt_body body = kt_body_of("mass", NULL, KT_JOINT_PRISMATIC, mass);
    d.bodies = &body, d.body_count = 1;
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    for (int i = 0; i < 4; i++) {
        const char *name[] = {"rkc2", "ab4", "auto", NULL};
        const kt_step step = {.method = name[i] ? kt_method_find(name[i]) : NULL, .h = h};
        kt_check_equal_int("size", (long long)kt_step_work_size(model, step.method), 0);
        kt_check_equal_int("status",
                           kt_step_evaluate(model, data, work, sizeof work, &step, &q, &v, &next_q, &next_v, &error),
                           KT_ERROR_ARGUMENT);
        kt_check_contains("message", error.message, name[i] ? name[i] : "there is no method");
    }
    const kt_step step = {.method = kt_method_find("rk4"), .h = h};
    kt_check_equal_int("memory",
                       kt_step_evaluate(model, data, work, sizeof work, &step, &q, &v, &next_q, &next_v, &error),
                       KT_ERROR_MEMORY);
    kt_check_near("the output is untouched", next_q, 5.0, 0.0);
}

/* A motor makes the accelerations depend on time. A simulation ends its steps at multiples of h. */
KT_TEST(steps_that_end_with_a_simulation_have_its_bits) {
    kt_body body = kt_body_default();
    kt_effect motor = kt_effect_default();
    kt_description d = kt_description_default();
    kt_run run = kt_run_default();
    kt_error error;
    body.name = motor.joint = "arm";
    body.joint.type = KT_JOINT_REVOLUTE;
    body.joint.position[0] = 1.0;
    body.mass = 1.0;
    body.com = kt_vec3_make(0.0, -1.0, 0.0);
    motor.type = KT_EFFECT_MOTOR;
    motor.torque = kt_function_sine(2.0, 1.5, 0.3, 0.5);
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    d.bodies = &body, d.body_count = 1;
    d.effects = &motor, d.effect_count = 1;
    run.integrator = "rk4";
    run.step = 1e-3;
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    kt_step step = {.method = kt_method_find("rk4"), .h = run.step};
    const size_t size = kt_step_work_size(model, step.method);
    void *work = aligned_alloc(64, (size + 63) / 64 * 64);
    int equal = 0, other_times = 0;
    for (int k = 0; k < 2000; k++) {
        const double from[2] = {q[0], v[0]};
        double next[2];
        step.t = kt_simulation_time(simulation);
        kt_fine("a step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
        step.end = kt_simulation_time(simulation);
        other_times += step.end != step.t + step.h;
        kt_fine("it", kt_step_evaluate(model, data, work, size, &step, from, from + 1, next, next + 1, &error), &error);
        equal += next[0] == q[0] && next[1] == v[0];
    }
    kt_check_equal_int("steps with equal bits", equal, 2000);
    kt_check_above("times other than t + h", other_times, 100.0);
    double next[2], zero[2] = {0.0};
    step.end = 1.001 * (step.t + step.h);
    kt_check_equal_int("another end",
                       kt_step_evaluate(model, data, work, size, &step, zero, zero + 1, next, next + 1, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("is", error.where, "step.end");
    free(work);
}
