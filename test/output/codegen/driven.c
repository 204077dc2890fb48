/* Driven loops, against the second derivatives of their functions of time. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "generated.h"

#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
#define TURN 6.28318530717958647692

/* Two hinges about z and y, and a loop. Points into itself: not to be copied. */
typedef struct driven_arm {
    kt_description description;
    kt_body body[2];
    kt_loop loop;
    kt_term term[2];
    kt_model *model;
    kt_data *data;
    kt_generated file;
} driven_arm;

static void driven_arm_describe(driven_arm *arm, kt_loop_type type, kt_function function) {
    memset(arm, 0, sizeof *arm);
    arm->description = kt_description_default();
    arm->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    kt_describe(&arm->description, arm->body, 2, &arm->loop, 1, NULL, 0);
    for (int i = 0; i < 2; i++) {
        kt_body *b = &arm->body[i];
        *b = kt_body_of(i == 0 ? "first" : "second", i == 0 ? NULL : "first", KT_JOINT_REVOLUTE, 2.0);
        b->joint.axis = i == 0 ? kt_vec3_make(0.0, 0.0, 1.0) : kt_vec3_make(0.0, 1.0, 0.0);
        b->joint.at = i == 0 ? kt_vec3_make(0.0, 0.0, 0.0) : kt_vec3_make(0.3, 0.0, 0.1);
        b->com = kt_vec3_make(0.2, 0.05, 0.1);
        b->inertia = kt_sym3_make(0.02, 0.03, 0.025, 0.001, 0.002, 0.003);
    }
    arm->loop = kt_loop_of("drive", type);
    arm->loop.function = function;
}

static void driven_arm_compile(driven_arm *arm) {
    arm->model = kt_test_model(&arm->description, NULL);
    arm->data = kt_test_data(arm->model);
}

/* Compiles the model, and the file of its accelerations. */
static void driven_arm_make(driven_arm *arm) {
    driven_arm_compile(arm);
    kt_generated_make_some(&arm->file, arm->model, KT_CODEGEN_ACCELERATION, "cc -O1", false);
}

/* ---- functions of time ------------------------------------------------------------------------------------------- */

static double second_of_sine(double t) { return -0.4 * 0.9 * 0.9 * sin(0.9 * t + 0.2); }
static double second_of_ramp(double t) {
    return t > 0.5 && t < 2.0 ? 6.0 * 0.8 / (1.5 * 1.5) * (1.0 - 2.0 * (t - 0.5) / 1.5) : 0.0;
}
static double second_of_polynomial(double t) { return 2.0 * 0.3 - 6.0 * 0.05 * t; }
static double second_of_formula(double t) { return -4.0 * 0.3 * sin(2.0 * t) + 6.0 * 0.01 * t; }
static double second_of_bump(double t) { /* u = 4 s (1 - s), (u^3)'' = 6 u u'^2 + 3 u^2 u'' */
    const double s = (t - 0.25) / 2.0, u = 4.0 * s * (1.0 - s), du = 4.0 * (1.0 - 2.0 * s) / 2.0, d2u = -8.0 / 4.0;
    return s > 0.0 && s < 1.0 ? 0.5 * (6.0 * u * du * du + 3.0 * u * u * d2u) : 0.0;
}

/* A driven hinge has the second derivative of its function, and rates have the first one of theirs. */
static void check_drive(const char *what, kt_loop_type type, kt_function function, double (*second)(double)) {
    static driven_arm arm;
    static const double time[] = {0.1, 0.4, 0.9, 1.3, 1.9, 2.4};
    driven_arm_describe(&arm, type, function);
    arm.loop.joint = type == KT_LOOP_MOTION ? "first" : NULL;
    if (type == KT_LOOP_RATES) {
        arm.term[0] = (kt_term){.joint = "first", .coefficient = 1.0};
        arm.term[1] = (kt_term){.joint = "second", .coefficient = 2.0};
        arm.loop.terms = arm.term;
        arm.loop.term_count = 2;
    }
    kt_note("%s", what);
    driven_arm_make(&arm);
    for (size_t i = 0; i < sizeof time / sizeof *time; i++) {
        const double q[2] = {0.3, 0.6}, v[2] = {0.7, -0.4}, tau[2] = {1.0, -2.0};
        double a[2];
        kt_check_equal_int("acceleration", arm.file.acceleration(arm.file.model, time[i], q, v, NULL, tau, a), 0);
        kt_check_near("second derivative", type == KT_LOOP_RATES ? a[0] + 2.0 * a[1] : a[0], second(time[i]),
                      10.0 * EPS * (40.0 + fabs(a[0]) + fabs(a[1]))); /* forces over inertias: below 40 */
    }
}

KT_TEST(driven_hinges_have_the_second_derivative_of_each_function) {
    static const double coefficients[] = {0.1, 0.2, 0.3, -0.05};
    kt_generated_need_compiler();
    check_drive("sine", KT_LOOP_MOTION, kt_function_sine(0.4, 0.9 / TURN, 0.2, 0.1), second_of_sine);
    check_drive("ramp", KT_LOOP_MOTION, kt_function_ramp(0.1, 0.9, 0.5, 2.0), second_of_ramp);
    check_drive("polynomial", KT_LOOP_MOTION, kt_function_polynomial(coefficients, 4), second_of_polynomial);
    check_drive("bump", KT_LOOP_MOTION, kt_function_bump(0.5, 0.25, 2.25), second_of_bump);
    check_drive("formula", KT_LOOP_MOTION, kt_function_expression("0.3*sin(2*t) + 0.01*t^3"), second_of_formula);
}

static double first_of_sine(double t) { return 0.4 * 0.9 * cos(0.9 * t + 0.2); }

KT_TEST(rates_have_the_derivative_of_their_function) {
    kt_generated_need_compiler();
    check_drive("rates", KT_LOOP_RATES, kt_function_sine(0.4, 0.9 / TURN, 0.2, 0.1), first_of_sine);
}

/* ---- lengths ----------------------------------------------------------------------------------------------------- */

/* d = |p|, with p the second body's point: d'' of the acceleration and of the rates, by differences along the path. */
static double second_of_length(driven_arm *arm, const double q[2], const double v[2], const double a[2]) {
    const double h = 1e-3, weight[5] = {-1.0, 16.0, -30.0, 16.0, -1.0};
    double sum = 0.0;
    for (int k = -2; k <= 2; k++) {
        double moved[2];
        for (int i = 0; i < 2; i++)
            moved[i] = q[i] + k * h * v[i] + 0.5 * k * k * h * h * a[i];
        if (kt_kinematics_update(arm->model, arm->data, moved, NULL, NULL, NULL) != KT_OK)
            return (double)NAN;
        const kt_vec3 at = kt_point_position(arm->model, arm->data, 2, kt_vec3_make(0.4, 0.1, 0.2));
        sum += weight[k + 2] * kt_vec3_norm(kt_vec3_sub(at, kt_vec3_make(0.1, -0.2, 0.9)));
    }
    return sum / (12.0 * h * h);
}

KT_TEST(lengths_have_the_second_derivative_of_their_function) {
    static driven_arm arm;
    const double q[2] = {0.3, 0.6}, v[2] = {0.7, -0.4}, tau[2] = {1.0, -2.0};
    double a[2] = {0.0};
    kt_generated_need_compiler();
    driven_arm_describe(&arm, KT_LOOP_DISTANCE, kt_function_sine(0.2, 0.9 / TURN, 0.2, 0.8));
    arm.loop.between[0] = (kt_end){.body = "second", .at = {0.4, 0.1, 0.2}};
    arm.loop.between[1] = (kt_end){.body = NULL, .at = {0.1, -0.2, 0.9}};
    driven_arm_make(&arm);
    for (int i = 0; i < 4; i++) {
        const double t = 0.3 + 0.6 * i;
        kt_check_equal_int("acceleration", arm.file.acceleration(arm.file.model, t, q, v, NULL, tau, a), 0);
        kt_check_near("second derivative", second_of_length(&arm, q, v, a), -0.2 * 0.9 * 0.9 * sin(0.9 * t + 0.2),
                      1e-8 * (1.0 + fabs(a[0]) + fabs(a[1])));
    }
}

/* ---- projection -------------------------------------------------------------------------------------------------- */

/* The impulse M dv of the rates acts along their own row, c = (1, 2). Positions keep their bits. */
KT_TEST(a_projection_onto_rates_changes_velocities_alone) {
    static driven_arm arm;
    const double q[2] = {0.3, 0.6}, v[2] = {0.7, -0.4}, t = 0.7;
    double next[2] = {0.0}, u[2] = {0.0}, mass[4];
    kt_error error = {0};
    kt_generated_need_compiler();
    driven_arm_describe(&arm, KT_LOOP_RATES, kt_function_sine(0.4, 0.9 / TURN, 0.2, 0.1));
    arm.term[0] = (kt_term){.joint = "first", .coefficient = 1.0};
    arm.term[1] = (kt_term){.joint = "second", .coefficient = 2.0};
    arm.loop.terms = arm.term;
    arm.loop.term_count = 2;
    driven_arm_compile(&arm);
    kt_generated_make_some(&arm.file, arm.model, KT_CODEGEN_PROJECT, "cc -O1 -Wall -Wextra -Werror", false);
    kt_need_fine("mass", kt_dynamics_mass(arm.model, arm.data, q, mass, &error), &error);
    kt_check_equal_int("project", arm.file.project_at(arm.file.model, t, q, v, next, u), 0);
    kt_check_near("positions", fabs(next[0] - q[0]) + fabs(next[1] - q[1]), 0.0, 0.0);
    kt_check_near("rates", u[0] + 2.0 * u[1], 0.1 + 0.4 * sin(0.9 * t + 0.2), 10.0 * EPS);
    const double dv[2] = {u[0] - v[0], u[1] - v[1]};
    const double impulse[2] = {mass[0] * dv[0] + mass[2] * dv[1], mass[1] * dv[0] + mass[3] * dv[1]};
    kt_check_above("impulse", fabs(impulse[0]), 0.01);
    kt_check_near("along the row", impulse[1], 2.0 * impulse[0], 100.0 * EPS);
}
