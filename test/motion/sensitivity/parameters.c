/* Derivatives of steps by parameters. They are compared with central differences of order eight of the step itself,
 * with the parameter set in a copy of the model. They are also compared with the closed form of an oscillator. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"

#include "kinetree/scene.h"
#include "kinetree/stability.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 32, TEXT = 4096 };

/* A slider-crank with a payload and armature in a plane; an arm in space with quaternions; effects of many laws. */
static const char tree_text[] =
    "kinetree: 1\n"
    "gravity: [0.3, -9.81, 0.2]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, axis: z, position: 60 deg, velocity: 2, armature: 0.1}, mass: 1,\n"
    "     shape: {type: rod, to: [0.3, 0, 0]}, markers: {pin: [0.3, 0, 0]}}\n"
    "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [0.3, 0, 0], position: -75 deg}, mass: 2,\n"
    "     com: [0.5, 0, 0], inertia: [0, 0.2, 0.2], markers: {end: [1, 0, 0]}}\n"
    "  - {name: load, parent: rod, joint: {type: fixed, at: [0.4, 0.1, 0]}, mass: 0.7, com: [0.1, 0.2, 0],\n"
    "     inertia: [0.02, 0.03, 0.04, 0.001, 0, 0]}\n"
    "  - {name: ram, joint: {type: prismatic, axis: x, position: 1.1}, mass: 5}\n"
    "  - {name: arm, joint: {type: universal, axis: x, at: [0, 0, 2], position: [0.3, 0.4], velocity: [0.5, -1]},\n"
    "     mass: 1.5, com: [0.1, 0.2, 0.3], inertia: [1, 1.2, 1.4], markers: {tip: [0, 0, 1]}}\n"
    "  - {name: hand, parent: arm, joint: {type: spherical, at: [0, 0, 1], velocity: [1, 2, -0.5], armature: [0.02, 0, "
    "0.03]},\n"
    "     mass: 0.5, com: [0, 0.1, 0.2], inertia: [0.1, 0.12, 0.15], markers: {grip: [0.1, 0.2, 0.3]}}\n"
    "  - {name: slide, parent: hand, joint: {type: prismatic, axis: y, position: 0.2, velocity: 0.3}, mass: 0.3,\n"
    "     inertia: [0.01, 0.012, 0.015]}\n"
    "%s"
    "effects:\n"
    "  - {name: coil, type: spring, between: [arm.tip, world], stiffness: 100, length: 0.5, damping: 0.7}\n"
    "  - {name: brake, type: joint_friction, joint: slide, coulomb: 0.3, viscous: 0.1, smoothing: 0.2}\n"
    "  - {name: guide, type: servo, joint: slide, target: 0.1, stiffness: 30, damping: 2, limit: 20}\n"
    "  - {name: turn, type: motor, joint: crank, torque: {sine: {amplitude: 2, frequency: 1}}}\n"
    "  - {name: mount, type: bushing, between: [hand, world], stiffness: [1, 2, 3, 4, 5, 6], damping: [0, 0, 0, 0, 0, "
    "0]}\n"
    "  - {name: push, type: force, at: hand, value: [1, 2, 3]}\n";

static const char loops_text[] = "loops:\n"
                                 "  - {name: eye, type: revolute, between: [rod.end, ram], axis: z}\n"
                                 "  - {name: tether, type: distance, between: [hand.grip, world]%s}\n"
                                 "  - {name: drive, type: motion, joint: slide, position: 0.2}\n";

static const char *const names[] = {"gravity",
                                    "crank.armature",
                                    "load.mass",
                                    "load.com",
                                    "load.inertia",
                                    "hand.mass",
                                    "hand.com",
                                    "hand.inertia",
                                    "hand.armature",
                                    "arm.armature",
                                    "ram.mass",
                                    "effect coil.stiffness",
                                    "effect coil.length",
                                    "effect coil.damping",
                                    "effect brake.coulomb",
                                    "effect brake.smoothing",
                                    "effect guide.target",
                                    "effect guide.limit",
                                    "effect mount.stiffness",
                                    "effect mount.damping",
                                    "effect push.value",
                                    "loop drive.position",
                                    "loop tether.length"};
enum { NAMES = sizeof names / sizeof *names };

static void *take(size_t size) {
    return aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
}

/* A copy of a mechanism in which parameters are set, at a state that its loops allow. */
typedef struct mechanism {
    kt_model *model, *copy;
    kt_data *data;
    double q[MOST], v[MOST], tau[MOST];
} mechanism;

static void mechanism_free(mechanism *m) {
    free(m->copy);
    kt_data_free(m->data);
    kt_model_free(m->model);
}

static bool mechanism_read(mechanism *m, const char *text, kt_metric metric, kt_structure structure) {
    kt_scene scene;
    kt_error error;
    kt_model_options options = kt_model_options_default();
    options.metric = metric;
    options.structure = structure;
    *m = (mechanism){.model = NULL};
    kt_need_fine("parse", kt_scene_parse("trial", text, strlen(text), &scene, NULL, NULL, &error), &error);
    bool fine = kt_fine("compile", kt_model_compile(&scene.description, &options, &m->model, &error), &error);
    kt_scene_free(&scene);
    const size_t size = fine ? kt_model_size(m->model) : 0;
    fine = fine && kt_fine("copy", kt_model_copy(m->model, take(size), size, &m->copy, &error), &error) &&
           kt_fine("data", kt_data_create(m->model, &m->data, &error), &error);
    if (!fine)
        return false;
    kt_model_initial(m->model, m->q, m->v);
    for (int i = 0; i < kt_model_nv(m->model); i++)
        m->tau[i] = 0.3 * (i % 3) - 0.2;
    return kt_fine("assembled", kt_state_assemble(m->model, m->data, 0.0, m->q, m->v, &error), &error);
}

static bool mechanism_make(mechanism *m, const char *loops, kt_metric metric, kt_structure structure) {
    char text[TEXT];
    (void)snprintf(text, sizeof text, tree_text, loops);
    return mechanism_read(m, text, metric, structure);
}

/* The change of the state after the step from `from`, where number k of the parameter is changed by s. */
static bool step_shifted(mechanism *m, const kt_step *step, const kt_parameter *parameter, const double *now, int k,
                         double s, const double *from, double *change) {
    const int nq = kt_model_nq(m->model), n = kt_model_nv(m->model);
    const size_t size = kt_step_work_size(m->model, step->method);
    double values[KT_PARAMETER_MAX], q[MOST], v[MOST];
    void *work = take(size);
    kt_error error;
    memcpy(values, now, sizeof values);
    values[k] += s;
    const bool fine =
        kt_fine("set", kt_parameter_set(m->copy, parameter, values, &error), &error) &&
        kt_fine("step", kt_step_evaluate(m->copy, m->data, work, size, step, m->q, m->v, q, v, &error), &error);
    if (fine)
        kt_position_subtract(m->model, q, from, change);
    for (int i = 0; i < n && fine; i++)
        change[n + i] = v[i] - from[nq + i];
    free(work);
    return fine;
}

/* Column k by differences of order eight. A number that may not be negative and is 0 is differenced on one side, by
 * order six. The coefficients of both are those of the polynomial through the points. */
static bool difference(mechanism *m, const kt_step *step, const kt_parameter *parameter, const double *now, int k,
                       const double *from, double *column) {
    static const double both[] = {1.0 / 280, -4.0 / 105, 1.0 / 5,   -4.0 / 5,  0.0,
                                  4.0 / 5,   -1.0 / 5,   4.0 / 105, -1.0 / 280};
    static const double after[] = {-49.0 / 20, 6.0, -15.0 / 2, 20.0 / 3, -15.0 / 4, 6.0 / 5, -1.0 / 6};
    const int n = 2 * kt_model_nv(m->model);
    const bool one_sided =
        now[k] == 0.0 && (parameter->kind == KT_PARAMETER_ARMATURE || parameter->kind == KT_PARAMETER_EFFECT);
    const double most = parameter->kind == KT_PARAMETER_LOOP_CURVE ? 1e-3 : 0.01; /* loops can still be closed */
    const double reach = one_sided ? 5e-4 : most * fmax(fabs(now[k]), 0.2);
    double change[2 * MOST];
    memset(column, 0, (size_t)n * sizeof *column);
    for (int s = one_sided ? 0 : -4; s <= (one_sided ? 6 : 4); s++) {
        const double weight = one_sided ? after[s] : both[s + 4];
        if (!step_shifted(m, step, parameter, now, k, s * reach, from, change))
            return false;
        for (int i = 0; i < n; i++)
            column[i] += weight / reach * change[i];
    }
    return true;
}

/* All numbers of a parameter: to 1e-8 of the largest number of their columns, or 1e-10 if all are small. */
static void compare(mechanism *m, const kt_step *step, const char *name, kt_worst *worst, int *columns) {
    const int nq = kt_model_nq(m->model), n = kt_model_nv(m->model);
    const size_t size = kt_step_parameter_work_size(m->model, step->method);
    double C[2 * MOST * KT_PARAMETER_MAX], now[KT_PARAMETER_MAX] = {0.0}, from[2 * MOST], expected[2 * MOST];
    kt_parameter parameter;
    void *work = take(size);
    kt_error error;
    kt_need_fine(name, kt_parameter_find(m->copy, name, &parameter, &error), &error);
    kt_need_fine(name, kt_parameter_get(m->copy, &parameter, now, &error), &error);
    if (parameter.kind >= KT_PARAMETER_EFFECT_CURVE && parameter.count == 4)
        memcpy(now, (double[]){now[0], 0.05, -0.4, 0.03}, 4 * sizeof *now); /* moves */
    kt_need_fine("set", kt_parameter_set(m->copy, &parameter, now, &error), &error);
    kt_need_fine("step", kt_step_evaluate(m->copy, m->data, work, size, step, m->q, m->v, from, from + nq, &error),
                 &error);
    kt_need_fine(name,
                 kt_step_parameter_derivatives(m->copy, m->data, work, size, step, &parameter, m->q, m->v, C, &error),
                 &error);
    for (int k = 0; k < parameter.count; k++) {
        if (!difference(m, step, &parameter, now, k, from, expected))
            break;
        const double floor = fmax(1e-2, kt_tree_largest(expected, 2 * n));
        for (int i = 0; i < 2 * n; i++)
            kt_worst_near(worst, C[2 * n * k + i], expected[i], 1e-8 * floor, "%s %s number %d row %d",
                          step->method->name, name, k, i);
        *columns += kt_tree_largest(expected, 2 * n) > 1e-6;
    }
    free(work);
}

static void compare_all(const char *loops, kt_metric metric, double h, const char *what) {
    const bool closed = loops[0] != '\0';
    KT_WORST worst = kt_worst_make(what);
    int columns = 0;
    for (int i = 0; i < (closed ? NAMES : NAMES - 2); i++) {
        mechanism m;
        kt_need(mechanism_make(&m, loops, metric, i % 2 ? KT_STRUCTURE_AUTO : KT_STRUCTURE_FRONTS));
        const kt_method *method = i % 3 == 2 ? implicit_method(i / 3) : explicit_method(i % 11);
        const kt_step step = {.method = method, .t = 0.05, .h = h, .tau = m.tau};
        compare(&m, &step, names[i], &worst, &columns);
        mechanism_free(&m);
    }
    kt_check_above("columns that are not small", columns, 40.0);
}

KT_TEST(derivatives_by_parameters_are_those_of_the_step_of_a_tree) {
    compare_all("", KT_METRIC_IDENTITY, 0.02, "C of a tree");
}

KT_TEST(derivatives_by_parameters_go_through_loops_and_the_projection) {
    char loops[TEXT];
    (void)snprintf(loops, sizeof loops, loops_text, "");
    compare_all(loops, KT_METRIC_IDENTITY, 0.02, "C with loops");
    compare_all(loops, KT_METRIC_MASS, 0.02, "C with loops, projected by masses");
}

/* x' = L x + g with tau = 3 N: of the spring's stiffness k the step's derivative is that of
 *     x+ = sum_i r_i (h L)^i x + sum_i r_(i+1) h (h L)^i g,   dL/dk = (0, -1/m) (1, 0)
 * by the product rule, with the coefficients r of the method's stability polynomial. */
KT_TEST(derivative_by_the_stiffness_of_an_oscillator_has_its_closed_form) {
    static const char text[] = "kinetree: 1\n"
                               "gravity: [0, 0, 0]\n"
                               "bodies:\n"
                               "  - {name: mass, joint: {type: prismatic, axis: x}, mass: 2}\n"
                               "effects:\n"
                               "  - {name: coil, type: joint_spring, joint: mass, stiffness: 50, damping: 1.5}\n";
    const double mass = 2.0, h = 0.05, q = 0.7, v = -1.3, tau = 3.0;
    kt_scene scene;
    kt_model *model = NULL;
    kt_data *data = NULL;
    kt_parameter stiffness;
    kt_error error;
    KT_WORST worst = kt_worst_make("d/dk");
    kt_need_fine("parse", kt_scene_parse("mass", text, strlen(text), &scene, NULL, NULL, &error), &error);
    const bool fine = kt_fine("compile", kt_model_compile(&scene.description, NULL, &model, &error), &error) &&
                      kt_fine("data", kt_data_create(model, &data, &error), &error) &&
                      kt_fine("find", kt_parameter_find(model, "effect coil.stiffness", &stiffness, &error), &error);
    kt_scene_free(&scene);
    const kt_method *method;
    for (int n = 0; fine && (method = explicit_method(n)) != NULL; n++) {
        const kt_step step = {.method = method, .h = h, .tau = &tau};
        const size_t size = kt_step_parameter_work_size(model, method);
        const double L[2][2] = {{0.0, 1.0}, {-25.0, -0.75}};
        double x[2] = {q, v}, dx[2] = {0.0, 0.0}, g[2] = {0.0, tau / mass}, dg[2] = {0.0, 0.0},
               expected[2] = {0.0, 0.0};
        double C[2] = {(double)NAN, (double)NAN};
        void *work = take(size);
        kt_stability s;
        kt_check_equal_int("stability", kt_stability_make(method, 0, &s, &error), KT_OK);
        kt_fine("C", kt_step_parameter_derivatives(model, data, work, size, &step, &stiffness, &q, &v, C, &error),
                &error);
        for (int i = 0; i <= s.degree; i++) { /* x and g: (h L)^i times the start; dx and dg: their derivatives by k */
            double *of[2] = {x, g}, *by[2] = {dx, dg};
            for (int r = 0; r < 2; r++)
                expected[r] += s.coefficient[i] * dx[r] + (i < s.degree ? s.coefficient[i + 1] * h * dg[r] : 0.0);
            for (int k = 0; k < 2; k++) {
                const double *y = of[k], *dy = by[k];
                const double next[2] = {h * y[1], h * (L[1][0] * y[0] + L[1][1] * y[1])};
                const double change[2] = {h * dy[1], h * (L[1][0] * dy[0] + L[1][1] * dy[1] - y[0] / mass)};
                memcpy(of[k], next, sizeof next);
                memcpy(by[k], change, sizeof change);
            }
        }
        for (int r = 0; r < 2;
             r++) /* differences over k / 1024 of forces of 35 N lose 1e-13 of q at each of 12 stages */
            kt_worst_near(&worst, C[r], expected[r], 2e-12 * h * q / mass, "%s number %d", method->name, r);
        free(work);
    }
    kt_data_free(data);
    kt_model_free(model);
}

KT_TEST(what_has_no_derivative_is_rejected_and_leaves_the_output) {
    mechanism m;
    kt_need(mechanism_make(&m, "", KT_METRIC_IDENTITY, KT_STRUCTURE_AUTO));
    static const char *const given[] = {"crank.hold", "effect turn.torque", "load.mass", "load.mass"};
    static const char *const told[] = {"hold", "set it in a copy", "rkc2", "kt_step_parameter_work_size"};
    for (int i = 0; i < 4; i++) {
        const kt_step step = {.method = kt_method_find(i == 2 ? "rkc2" : "rk4"), .h = 0.01};
        const size_t size = kt_step_parameter_work_size(m.model, step.method);
        double C[2 * MOST * KT_PARAMETER_MAX] = {7.0};
        kt_parameter parameter;
        kt_error error = {0};
        void *work = take(size + 1);
        kt_check_equal_int("size", size > 0, i != 2);
        kt_fine(given[i], kt_parameter_find(m.model, given[i], &parameter, &error), &error);
        kt_check_equal_int("rejected",
                           kt_step_parameter_derivatives(m.model, m.data, work, i == 3 ? size - 1 : size, &step,
                                                         &parameter, m.q, m.v, C, &error),
                           i == 3 ? KT_ERROR_MEMORY : KT_ERROR_ARGUMENT);
        kt_check_contains("why", error.message, told[i]);
        kt_check_near("untouched", C[0], 7.0, 0.0);
        free(work);
    }
    mechanism_free(&m);
}

/* A slider-crank whose crank and rod are equal, 0.0006 rad before the pins of crank and slider meet: half of
 * that is left after 0.3 ms. */
static const char folded_text[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, axis: z, position: 1.5701963267948966, velocity: 1}, mass: 1,\n"
    "     shape: {type: rod, to: [1, 0, 0]}}\n"
    "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [1, 0, 0], position: -3.1403926535897932},\n"
    "     mass: 1, shape: {type: rod, to: [1, 0, 0]}, markers: {end: [1, 0, 0]}}\n"
    "  - {name: ram, joint: {type: prismatic, axis: x, position: 0.0011999999280000013}, mass: 2}\n"
    "loops:\n"
    "  - {name: eye, type: revolute, between: [rod.end, ram], axis: z}\n";

/* After a step to a singular position, a result can be too inaccurate. The parameter's columns reject it, since they
 * are the only ones. A mass does not move positions by one of Euler's steps, and velocities in proportion to h. */
KT_TEST(what_work_holds_does_not_decide_whether_derivatives_are_rejected) {
    mechanism m;
    kt_need(mechanism_read(&m, folded_text, KT_METRIC_IDENTITY, KT_STRUCTURE_AUTO));
    static const double held[] = {0.0, 1e300};
    const kt_step step = {.method = kt_method_find("euler"), .h = 3e-4};
    const size_t size = kt_step_parameter_work_size(m.model, step.method);
    double C[2][2 * MOST * KT_PARAMETER_MAX] = {{0.0}}, *work = take(size);
    for (int i = 0; i < 2; i++) {
        kt_parameter parameter;
        kt_error error = {0};
        for (size_t k = 0; k < size / sizeof *work; k++)
            work[k] = held[i];
        kt_fine("found", kt_parameter_find(m.model, "ram.mass", &parameter, &error), &error);
        kt_fine("known",
                kt_step_parameter_derivatives(m.model, m.data, work, size, &step, &parameter, m.q, m.v, C[i], &error),
                &error);
    }
    kt_check_equal_bits("derivatives", C[0], C[1], 2 * (size_t)kt_model_nv(m.model));
    free(work);
    mechanism_free(&m);
}
