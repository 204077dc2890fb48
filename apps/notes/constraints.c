/* Chapter 6: compares each constraint's equations with the results of the exercises. Differences of phi check A and b'
 * (derivative, linearisation, virtual perturbation). Differences of A v - b' check b'' (linearisation of the
 * derivative). Reactions A' lambda do no work on motions that A allows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "notes.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { ROWS = 6, NV = 12 };

typedef struct equations {
    double jacobian[ROWS * NV], phi[ROWS], rate[ROWS], drift[ROWS];
} equations;

static bool evaluate_equations(const mechanism *m, double t, const double *q, const double *v, equations *e) {
    kt_error error = {0};
    return works(kt_loop_equations(m->model, m->data, t, q, v, e->jacobian, e->phi, e->rate, e->drift, &error), &error);
}

/* A v - b' */
static double slip(const equations *e, int k, int r, const double *v) {
    double sum = -e->rate[r];
    for (int i = 0; i < NV; i++)
        sum += e->jacobian[i * k + r] * v[i];
    return sum;
}

/* The largest of |d phi / dt - (A v - b')| and of |d (A v - b') / dt + b''| at constant v, along which time passes. */
static bool derivatives(const mechanism *m, double *first, double *second) {
    equations here, side[2];
    const int k = kt_model_mobility(m->model).equations;
    const double h = 1e-5;
    double q[32];
    *first = *second = 0.0;
    if (!evaluate_equations(m, 0.0, m->q, m->v, &here))
        return false;
    for (int s = 0; s < 2; s++) {
        double step[NV];
        for (int i = 0; i < NV; i++)
            step[i] = (s ? h : -h) * m->v[i];
        kt_position_add(m->model, m->q, step, q);
        if (!evaluate_equations(m, s ? h : -h, q, m->v, &side[s]))
            return false;
    }
    for (int r = 0; r < k; r++) {
        *first = fmax(*first, fabs((side[1].phi[r] - side[0].phi[r]) / (2.0 * h) - slip(&here, k, r, m->v)));
        *second =
            fmax(*second, fabs((slip(&side[1], k, r, m->v) - slip(&side[0], k, r, m->v)) / (2.0 * h) + here.drift[r]));
    }
    return true;
}

/* Prints the rank of a loop's equations in space: the number of independent motions that the loop forbids. Prints the
 * errors of the first and second derivatives, too. */
static bool loop(const char *exercise, const char *type) {
    char text[1024], name[64];
    mechanism m;
    double first, second;
    snprintf(
        text, sizeof text,
        "kinetree: 1\nbodies:\n"
        "  - {name: a, joint: {type: free, position: {position: [0.1, -0.2, 0.3], orientation: {vector: [0.2, 0.1, "
        "-0.3]}}}, "
        "mass: 1, inertia: [1, 1, 1]}\n"
        "  - {name: b, joint: {type: free, position: {position: [0.7, 0.4, 0.2], orientation: {vector: [0.1, -0.2, "
        "0.1]}}}, "
        "mass: 1, inertia: [1, 1, 1]}\n"
        "loops:\n  - {name: loop, %s, between: [{body: a, at: [0.5, 0.3, 0.1]}, {body: b, at: [-0.2, 0.1, 0.2]}]}\n",
        type);
    if (!open_mechanism(&m, text))
        return false;
    for (int i = 0; i < NV; i++)
        m.v[i] = any();
    if (!derivatives(&m, &first, &second))
        return false;
    tell(exercise, kt_model_mobility(m.model).rank);
    snprintf(name, sizeof name, "%s.A", exercise);
    tell(name, first);
    snprintf(name, sizeof name, "%s.b", exercise);
    tell(name, second);
    close_mechanism(&m);
    return true;
}

/* Prints reactions A' lambda of a loop that makes a bar a pendulum. They do no work on motions that the loop allows. */
static bool reactions(void) {
    mechanism m;
    kt_error e = {0};
    kt_wrench loops[2];
    if (!open_mechanism(
            &m, "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                "  - {name: bar, joint: {type: free, velocity: {angular: [0, 0, 2]}}, mass: 2, shape: {type: rod, to: "
                "[1, 0, 0], radius: 0.001}}\n"
                "loops:\n  - {name: hinge, type: revolute, between: [world, bar]}\n") ||
        !works(kt_reaction_evaluate(m.model, m.data, 0.0, m.q, m.v, NULL, NULL, NULL, loops, &e), &e))
        return false;
    tell("6.9E", loops[0].force.y); /* m g / 4 on a bar that is let go level: 4.905 N */
    tell("6.28", loops[0].force.x); /* -m w^2 l / 2 */
    close_mechanism(&m);
    return true;
}

static void vectors(void) {
    const kt_vec3 a = any_vector(), b = any_vector(), c = any_vector();
    const kt_mat3 R = any_rotation();
    /* a x (b x c) + b x (c x a) + c x (a x b) = 0 */
    tell("6.11",
         size_of(kt_vec3_add(kt_vec3_add(kt_vec3_cross(a, kt_vec3_cross(b, c)), kt_vec3_cross(b, kt_vec3_cross(c, a))),
                             kt_vec3_cross(c, kt_vec3_cross(a, b)))));
    /* (R - R') / 2 = sin(theta) n x */
    const kt_vec3 theta = kt_euler_vector_from_mat3(R);
    const double angle = size_of(theta);
    const kt_mat3 skew = kt_mat3_scale(0.5, kt_mat3_add(R, kt_mat3_scale(-1.0, kt_mat3_transpose(R))));
    tell("6.16", difference(skew, kt_mat3_skew(kt_vec3_scale(sin(angle) / angle, theta))));
}

bool constraints(void) {
    vectors();
    return loop("6.1", "type: spherical") && loop("6.4", "type: inline") &&
           loop("6.5", "type: curve, curve: {helix: {radius: 0.8, pitch: 0.2}}") && loop("6.6", "type: inplane") &&
           loop("6.7", "type: surface, surface: {torus: {radius: 1, tube: 0.4}}") &&
           loop("6.8", "type: curve, curve: {line: {}}, distance: {polynomial: [0.1, 0.3, 0.4]}") &&
           loop("6.10", "type: distance, length: 1") && loop("6.20", "type: parallel") &&
           loop("6.24", "type: coaxial") && loop("6.29", "type: universal") && loop("6.34", "type: revolute") &&
           loop("6.35", "type: prismatic") && loop("6.36", "type: screw, pitch: 0.2") &&
           loop("6.37", "type: cylindrical") && loop("6.38", "type: planar") && loop("6.39", "type: orthogonal") &&
           reactions();
}
