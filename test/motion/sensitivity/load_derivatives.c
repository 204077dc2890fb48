/* Derivatives of friction that grows with a reaction (derivative/load_derivatives.c). The oracles are differences of
 * accelerations and of steps. The mechanisms are a chain in space with all laws of joints, a drum with a rope, a worm,
 * a planetary train with losses in its meshes, and a thread that a state drives. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"

#include "kinetree/joint.h"
#include "kinetree/model.h"
#include "kinetree/simulation.h"
#include "motion/simulation/parsed.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 8 };

typedef struct rubbing_scene {
    const char *name, *text;
} rubbing_scene;

static const rubbing_scene scenes[] = {
    {"chain", "kinetree: 1\ngravity: [1, -2, -9.81]\nbodies:\n"
              "  - {name: base, joint: {type: revolute, axis: z, velocity: 1.5}, mass: 4, com: [0.1, 0, 0.2], inertia: "
              "[0.3, 0.2, "
              "0.4]}\n"
              "  - {name: arm, parent: base, joint: {type: revolute, axis: [1, 1, 0], at: [0.3, 0, 0.4], position: "
              "0.4, velocity: "
              "-0.7}, mass: 2, com: [0.4, 0.1, 0], inertia: [0.05, 0.1, 0.1]}\n"
              "  - {name: slide, parent: arm, joint: {type: prismatic, axis: [1, 0, 0.3], at: [0.5, 0, 0], velocity: "
              "0.4}, mass: "
              "1.5, com: [0, 0.1, 0.1], inertia: [0.02, 0.03, 0.02]}\n"
              "  - {name: nut, parent: slide, joint: {type: screw, axis: y, at: [0.1, 0.1, 0], pitch: -0.01, velocity: "
              "9}, mass: "
              "1, com: [0.05, 0, 0], inertia: [0.004, 0.005, 0.006]}\n"
              "effects:\n"
              "  - {type: joint_friction, joint: base, coefficient: 0.2, radius: 0.05, smoothing: 0.5, coulomb: 0.3}\n"
              "  - {type: joint_friction, joint: arm, coefficient: 0.3, radius: 0.03, smoothing: 0.5, viscous: 0.1}\n"
              "  - {type: joint_friction, joint: slide, coefficient: 0.25, smoothing: 0.5}\n"
              "  - {type: joint_friction, joint: nut, coefficient: 0.15, radius: 0.04, smoothing: 0.5}\n"
              "  - {type: spring, between: [world, nut], stiffness: 30, damping: 2, length: 0.4}\n"},
    {"drum", "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
             "  - {name: drum, joint: {type: revolute, axis: y, velocity: 0.3}, mass: 20, inertia: [1, 0.5, 1]}\n"
             "  - {name: load, joint: {type: prismatic, axis: z, at: [0.2, 0, -3]}, mass: 50}\n"
             "loops:\n  - {name: rope, type: span, between: [drum, load], axis: y, radius: -0.2}\n"
             "effects:\n"
             "  - {type: motor, joint: drum, torque: -100}\n"
             "  - {type: joint_friction, joint: drum, coefficient: 0.3, radius: 0.04, smoothing: 0.5}\n"
             "initial: {hold: [drum]}\n"},
    {"worm",
     "kinetree: 1\nbodies:\n"
     "  - {name: worm, joint: {type: revolute, axis: x, velocity: 5}, mass: 1, inertia: [0.01, 1, 1]}\n"
     "  - {name: wheel, joint: {type: revolute, axis: y, at: [0, 0, 0.1]}, mass: 3, inertia: [1, 0.1, 1]}\n"
     "loops:\n"
     "  - {name: mesh, type: worm, between: [worm, wheel], axis: x, axis2: y, radius: 0.02, teeth: 2, teeth2: 40}\n"
     "effects:\n"
     "  - {type: motor, joint: wheel, torque: 20}\n"
     "  - {type: motor, joint: worm, torque: 2}\n"
     "  - {type: joint_friction, joint: worm, coefficient: 0.1, load: mesh, smoothing: 4}\n"
     "initial: {hold: [worm]}\n"},
    {"planetary", "kinetree: 1\nbodies:\n"
                  "  - {name: sun, joint: {type: revolute, axis: z, velocity: 10}, mass: 1, inertia: [1, 1, 0.001]}\n"
                  "  - {name: carrier, joint: {type: revolute, axis: z, velocity: 3}, mass: 1, inertia: [1, 1, 0.01]}\n"
                  "  - {name: planet, parent: carrier, joint: {type: revolute, axis: z, at: [0.05, 0, 0]}, mass: 0.2, "
                  "inertia: [1, 1, "
                  "0.0001]}\n"
                  "loops:\n"
                  "  - {name: inner, type: gear, between: [sun, planet], teeth: 30, teeth2: 20}\n"
                  "  - {name: outer, type: gear, between: [world, planet], teeth: -70, teeth2: 20}\n"
                  "effects:\n"
                  "  - {type: motor, joint: sun, torque: 1}\n"
                  "  - {type: motor, joint: carrier, torque: -2.5}\n"
                  "  - {type: joint_friction, joint: planet, efficiency: 0.97, load: inner, smoothing: 5}\n"
                  "  - {type: joint_friction, joint: planet, efficiency: 0.95, load: outer, smoothing: 5}\n"
                  "initial: {hold: [sun]}\n"},
    {"bearing in tiny smoothing",
     "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
     "  - {name: a, joint: {type: revolute, axis: y, velocity: 2}, mass: 20, com: [0.3, 0, 0], inertia: [1, 0.5, 1]}\n"
     "  - {name: b, parent: a, joint: {type: revolute, axis: y, at: [0.6, 0, 0]}, mass: 5, com: [0.3, 0, 0], inertia: "
     "[0.5, 0.5, 0.5]}\n"
     "effects:\n"
     "  - {type: joint_friction, joint: a, coefficient: 0.3, radius: 0.04, smoothing: 0.5}\n"
     "  - {type: joint_friction, joint: b, coefficient: 0.3, radius: 0.04, smoothing: 1e-6}\n"},
};
enum { SCENES = sizeof scenes / sizeof *scenes };

static void start_closed(const kt_parsed *m, double *q, double *v) {
    kt_error error = {0};
    kt_model_initial(m->model, q, v);
    kt_need_fine("state", kt_state_assemble(m->model, m->data, 0.0, q, v, &error), &error);
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

/* Accelerations with a change h of component j of (xi, v, tau). */
static void accelerate_from(const kt_parsed *m, const double *q0, const double *v0, int j, double h, double *a) {
    const int nv = kt_model_nv(m->model);
    double q[MOST], v[MOST], tau[MOST] = {0.0}, step[MOST] = {0.0};
    kt_error error = {0};
    memcpy(v, v0, sizeof v);
    step[j % nv] = h;
    kt_position_add(m->model, q0, j < nv ? step : tau, q);
    v[j % nv] += j / nv == 1 ? h : 0.0;
    tau[j % nv] = j / nv == 2 ? h : 0.0;
    kt_need_fine("acceleration", kt_acceleration_evaluate(m->model, m->data, 0.1, q, v, tau, NULL, a, &error), &error);
}

/* The scale of a change: that of the smallest smoothing. */
static void compare_accelerations(const kt_parsed *m, const char *name, double scale, kt_worst *worst) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    const int nv = kt_model_nv(m->model);
    const size_t size = kt_acceleration_work_size(m->model);
    void *work = aligned_alloc(64, (size + 63) / 64 * 64);
    double by[3][MOST * MOST], q[MOST], v[MOST];
    kt_error error = {0};
    start_closed(m, q, v);
    kt_need_fine(
        "derivatives",
        kt_acceleration_derivatives(m->model, m->data, work, size, 0.1, q, v, NULL, NULL, by[0], by[1], by[2], &error),
        &error);
    for (int j = 0; j < 3 * nv; j++) {
        const double h = j / nv == 1 ? 0.05 * scale : j / nv == 2 ? 0.1 : 0.002;
        const double *column = by[j / nv] + (j % nv) * nv;
        double sum[MOST] = {0.0}, up[MOST], down[MOST], most = 0.0, largest = 1e-3;
        for (int k = 0; k < 4; k++) {
            accelerate_from(m, q, v, j, (k + 1) * h, up);
            accelerate_from(m, q, v, j, -(k + 1) * h, down);
            for (int i = 0; i < nv; i++) {
                sum[i] += weight[k] / h * (up[i] - down[i]);
                most = fmax(most, fabs(up[i]));
                largest = fmax(largest, fabs(column[i]));
            }
        }
        for (int i = 0; i < nv; i++) /* truncation of order eight in h, and rounding of the law (1e-14) over h */
            kt_worst_near(worst, column[i], sum[i], 1e-8 * largest + 1e-13 * most / h, "%s row %d column %d", name, i,
                          j);
    }
    free(work);
}

KT_TEST(accelerations_under_friction_from_loads_have_derivatives) {
    KT_WORST worst = kt_worst_make("derivatives of accelerations");
    for (int i = 0; i < SCENES; i++) {
        kt_parsed m;
        kt_parsed_make(&m, scenes[i].text);
        compare_accelerations(&m, scenes[i].name, i == SCENES - 1 ? 1e-6 : 0.5, &worst);
        kt_check_true("a model whose derivatives are differences", kt_model_is_differenced(m.model));
    }
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* A and B of steps by explicit and implicit methods. The last scene changes its friction within less than a step. */
KT_TEST(steps_under_friction_from_loads_have_derivatives) {
    KT_WORST worst = kt_worst_make("A and B");
    int taken = 0, asked = 0;
    for (int i = 0; i < SCENES - 1; i++) {
        kt_parsed m;
        double q[MOST], v[MOST];
        kt_parsed_make(&m, scenes[i].text);
        start_closed(&m, q, v);
        for (int k = 0; k < 6; k++) {
            const kt_method *method = k < 2 ? kt_method_find(k == 0 ? "rk4" : "dopri5") : implicit_method(k - 2);
            const step_case c = {m.model, m.data, q, v, {.method = method, .t = 0.1, .h = 0.01}, 0.004};
            asked++;
            taken += compare_step(&c, &worst, scenes[i].name);
        }
    }
    kt_check_equal_int("compared", taken, asked);
}

/* ---- through events ---------------------------------------------------------------------------------------------- */

/* A block slides up an incline with v, is at rest after v / up, with up = (sin + mu cos) g, and rests there or slides
 * back with down = (sin - mu cos) g. With the time s since then,
 *     dq/dv = v / up + down s / up,   dv/dv = down / up */
KT_TEST(derivatives_pass_through_rest_under_friction_from_loads) {
    static const double slopes[] = {0.29, 1.0};
    KT_WORST worst = kt_worst_make("A of the block");
    for (int k = 0; k < 2; k++) {
        char text[600];
        kt_parsed m;
        double A[4], B[2];
        kt_error error = {0};
        const double g = 9.81, c = 1.0 / sqrt(1.0 + slopes[k] * slopes[k]), v = 2.0;
        const double up = g * (slopes[k] * c + 0.3 * c), down = k == 1 ? g * (slopes[k] * c - 0.3 * c) : 0.0, s = 0.2;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
                       "  - {name: block, joint: {type: prismatic, axis: [1, 0, %.17g], velocity: %.17g}, mass: 7}\n"
                       "effects:\n"
                       "  - {type: joint_friction, joint: block, coefficient: 0.3, stick: true}\n",
                       slopes[k], v);
        kt_parsed_make(&m, text);
        kt_run run = kt_run_fixed("dopri5", 0.0, 10.0);
        run.relative = run.absolute = 1e-12;
        kt_simulation *simulation = kt_test_simulation(m.model, &run, NULL);
        const size_t size = kt_motion_work_size(simulation);
        void *work = aligned_alloc(64, (size + 63) / 64 * 64);
        kt_need_fine("derivatives", kt_motion_derivatives(simulation, work, size, v / up + s, A, B, &error), &error);
        kt_worst_near(&worst, A[2], v / up + down * s / up, 1e-9, "position, slope %g", slopes[k]);
        kt_worst_near(&worst, A[3], down / up, 1e-9, "velocity, slope %g", slopes[k]);
        free(work);
    }
}

/* ---- what has none ----------------------------------------------------------------------------------------------- */

KT_TEST(derivatives_by_parameters_under_friction_from_loads_name_the_remedy) {
    kt_parsed m;
    kt_error error = {0};
    kt_parameter parameter;
    double q[MOST], v[MOST], C[2 * MOST];
    kt_parsed_make(&m, scenes[1].text);
    start_closed(&m, q, v);
    kt_need_fine("parameter", kt_parameter_find(m.model, "load.mass", &parameter, &error), &error);
    const kt_step step = {.method = kt_method_find("rk4"), .h = 0.01};
    const size_t size = kt_step_parameter_work_size(m.model, step.method);
    void *work = aligned_alloc(64, (size + 63) / 64 * 64);
    kt_check_equal_int("status",
                       kt_step_parameter_derivatives(m.model, m.data, work, size, &step, &parameter, q, v, C, &error),
                       KT_ERROR_UNSUPPORTED);
    kt_check_contains("remedy", error.message, "take differences of two runs");
    free(work);
}
