/* Forces by formulas: against the effects that are written in C, differences, and the balance of energy. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "files/scene/collect.h"

#include "evaluate/evaluate.h"
#include "kinetree/kinetree.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Two arms on one another, far from the world's origin, and a free ball. Forces act on other bodies than those of the
 * variables. */
#define BODIES(x, axis)                                                                                                \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nparameters: {k: 50, c: 0.3}\nbodies:\n"                                      \
    "  - {name: arm, joint: {type: revolute, axis: " axis ", at: [" x                                                  \
    ", 0, 0], position: 20 deg, velocity: 1}, mass: 1,\n"                                                              \
    "     shape: {type: rod, to: [0, 0, -1]}, markers: {tip: [0, 0, -1]}}\n"                                           \
    "  - {name: leg, parent: arm, joint: {type: revolute, axis: " axis                                                 \
    ", at: [0, 0, -1], position: 40 deg, velocity: -2},\n"                                                             \
    "     mass: 1, shape: {type: rod, to: [0, 0, -1]}, markers: {toe: [0.1, 0, -1]}}\n"
#define BALL(x)                                                                                                        \
    "  - {name: ball, joint: {type: free, position: {position: [" x                                                    \
    ", 0.2, 0]}, velocity: {linear: [1, 2, 3], angular: [1, -1, 2]}},\n"                                               \
    "     mass: 1, shape: {type: sphere, radius: 0.3}, markers: {eye: [0.1, 0, 0.05]}}\n"

typedef struct mechanism {
    kt_scene *scene;
    kt_model *model;
    kt_data *data;
    int nq, nv;
    double q[40], v[40], a[40];
} mechanism;

static void make_with(mechanism *s, const char *text, kt_plan plan) {
    kt_model_options options = kt_model_options_default();
    options.plan = plan;
    const kt_opened at = kt_test_open(kt_test_scene(text), &options);
    *s = (mechanism){.scene = at.scene, .model = at.model, .data = at.data};
    s->nq = kt_model_nq(s->model);
    s->nv = kt_model_nv(s->model);
    kt_model_initial(s->model, s->q, s->v);
}

static void make(mechanism *s, const char *text) { make_with(s, text, KT_PLAN_AUTO); }

static void accelerate(mechanism *s, double t, const double *q, const double *v, double *a) {
    kt_error error = {0};
    if (kt_acceleration_evaluate(s->model, s->data, t, q, v, NULL, NULL, a, &error) != KT_OK)
        kt_check_text(error.where, error.message, "");
}

/* A hook is fixed to the arm. Its points act and are read as the same points of the arm. */
#define HOOKED(arm_markers, hook_markers, eye, tip)                                                                    \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"                                                                   \
    "  - {name: arm, joint: {type: universal, axis: x, position: [20 deg, 10 deg], velocity: [1, -2]}, mass: 1, com: " \
    "[0, 0, -0.5], inertia: [1, 1.1, 1.2], markers: {" arm_markers "}}\n"                                              \
    "  - {name: hook, parent: arm, joint: {type: fixed, at: [0.1, 0.2, -0.6]}, mass: 0.5, com: [0, 0.1, 0], inertia: " \
    "[0.1, 0.1, 0.1], markers: {" hook_markers "}}\n"                                                                  \
    "effects:\n"                                                                                                       \
    "  - {type: expression, path: [{body: world, at: [1, 0.5, 0]}, " eye ", " tip                                      \
    ", {body: world, at: [0, 2, -1]}], force: \"-30*(length - 1) - 2*speed\"}\n"                                       \
    "  - {type: expression, joint: \"arm[0]\", force: \"3*marker." eye ".x*marker." tip ".vz + marker." tip            \
    ".y^2 - marker." eye ".vy\"}\n"

KT_TEST(points_of_fixed_bodies_act_and_are_read_as_points_of_what_carries_them) {
    static const char *const texts[] = {
        HOOKED("a: [0, 0, 0]", "eye: [0.05, 0, 0.1], tip: [0.3, -0.2, -0.4]", "hook.eye", "hook.tip"),
        HOOKED("eye: [0.15, 0.2, -0.5], tip: [0.4, 0, -1]", "a: [0, 0, 0]", "arm.eye", "arm.tip")};
    mechanism s[2];
    for (int i = 0; i < 2; i++) {
        make(&s[i], texts[i]);
        accelerate(&s[i], 0.0, s[i].q, s[i].v, s[i].a);
    }
    for (int k = 0; k < 2; k++)
        kt_check_near("acceleration", s[0].a[k], s[1].a[k], 1e-13 * (fabs(s[1].a[0]) + fabs(s[1].a[1])));
}

/* Springs, dampers, motors and constant forces, as formulas. */
KT_TEST(formulas_give_the_forces_of_effects_in_c) {
    static const char *const in_c = BODIES("100", "y")
        BALL("101") "effects:\n"
                    "  - {type: spring, between: [arm.tip, ball.eye], stiffness: 50, length: 0.7, damping: 0.3}\n"
                    "  - {type: joint_damper, joint: leg, damping: 0.3}\n"
                    "  - {type: joint_spring, joint: arm, stiffness: 50, rest: 0.1}\n"
                    "  - {type: motor, joint: leg, torque: {sine: {amplitude: 2, frequency: 0.5, phase: 1}}}\n"
                    "  - {type: force, at: ball.eye, value: [1, 2, -3], frame: body}\n"
                    "  - {type: torque, on: ball, value: [0.5, 0, 0.25]}\n"
                    "  - {type: drag, on: ball.eye, linear: 0.3}\n";
    static const char *const by_formulas = BODIES("100", "y") BALL(
        "101") "effects:\n"
               "  - {type: expression, between: [arm.tip, ball.eye], force: \"-k*(length - 0.7) - c*speed\"}\n"
               "  - {type: expression, joint: leg, force: \"-c*velocity.leg\"}\n"
               "  - {type: expression, joint: arm, force: \"-k*(position.arm - 0.1)\"}\n"
               "  - {type: expression, joint: leg, force: \"2*sin(pi*t + 1)\"}\n"
               "  - {type: expression, at: ball.eye, force: [\"1\", \"2\", \"-3\"], frame: body}\n"
               "  - {type: expression, at: ball, torque: [\"0.5\", \"0*t\", \"1/4\"]}\n"
               "  - {type: expression, at: ball.eye, force: [\"-c*marker.ball.eye.vx\", \"-c*marker.ball.eye.vy\", "
               "\"-c*marker.ball.eye.vz\"]}\n";
    mechanism c, f;
    make(&c, in_c);
    make(&f, by_formulas);
    for (int k = 0; k < 5; k++) {
        accelerate(&c, 0.3 * k, c.q, c.v, c.a);
        accelerate(&f, 0.3 * k, c.q, c.v, f.a);
        KT_WORST worst = kt_worst_make("acceleration");
        for (int i = 0; i < c.nv; i++) /* positions 100 m from the origin, stiffness over the least inertia */
            kt_worst_near(&worst, f.a[i], c.a[i], 1e-15 * (100.0 + fabs(c.a[i])), "a[%d]", i);
        kt_position_add(c.model, c.q, (const double[]){0.3, -0.2, 0.1, 0.2, -0.1, 0.3, 0.2, 0.1}, c.q);
    }
}

#define COUPLED                                                                                                        \
    "effects:\n"                                                                                                       \
    "  - {type: expression, joint: arm, force: \"-3*position.leg^3 - c*velocity.ball[4]*velocity.arm + sin(2*t)\"}\n"  \
    "  - {type: expression, between: [leg.toe, ball.eye], force: \"-k*(length - 1)^3 - 2*speed*length + "              \
    "marker.arm.tip.z*marker.leg.toe.vx\"}\n"                                                                          \
    "  - {type: expression, at: ball.eye, force: [\"-marker.leg.toe.vx*marker.ball.eye.y\", \"0.1*t\", "               \
    "\"position.ball[1]\"], torque: [\"velocity.leg\", \"velocity.leg*marker.leg.toe.x\", \"t^2\"], frame: body}\n"    \
    "  - {type: expression, at: leg.toe, force: [\"marker.ball.eye.vz^2\", \"0*t\", \"-marker.arm.tip.x\"]}\n"

#define PATHS                                                                                                          \
    "effects:\n"                                                                                                       \
    "  - {type: expression, force: \"-k*(length - 1)^3 - 2*speed*length + marker.arm.tip.z*velocity.leg\", path: "     \
    "[leg.toe, {body: arm, at: [0.2, 0, 0], radius: 0.2, axis: [0.1, 1, 0.2], side: [1, 0, 0]}, ball.eye]}\n"          \
    "  - {type: expression, force: \"-length^2 + sin(2*t)*speed\", path: [world, {body: arm, at: [0.1, 0.1, -0.5], "   \
    "radius: 0.2}, ball.eye, {body: leg, at: [0.4, 0.1, -0.5], radius: 0.1, inside: true}, leg.toe]}\n"                \
    "  - {type: expression, force: \"-length*speed - 0.3*velocity.ball[4]\", path: [arm.tip, {body: ball, at: "        \
    "[0.1, 0, 0], radius: 0.3, axis: x, inside: true}, leg.toe, {body: world, divisor: 2}, ball.eye]}\n"

/* Central differences of accelerations: their error is some h^2 times third derivatives, and rounding over h. */
static void check_derivatives(const char *text) {
    mechanism s;
    kt_error error = {0};
    make(&s, text);
    const int n = s.nv;
    const double t = 0.7, h = 1e-6;
    double *d = calloc(3 * (size_t)(n * n), sizeof *d), plus[40], minus[40], q[40], step[40] = {0.0};
    const size_t size = kt_acceleration_work_size(s.model);
    void *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    kt_check_equal_int("status",
                       kt_acceleration_derivatives(s.model, s.data, work, size, t, s.q, s.v, NULL, NULL, d, d + n * n,
                                                   d + 2 * n * n, &error),
                       KT_OK);
    KT_WORST by_q = kt_worst_make("by positions"), by_v = kt_worst_make("by velocities");
    double scale = 0.0;
    for (int i = 0; i < 2 * n * n; i++)
        scale = fmax(scale, fabs(d[i]));
    for (int j = 0; j < n; j++) {
        step[j] = h;
        kt_position_add(s.model, s.q, step, q);
        accelerate(&s, t, q, s.v, plus);
        step[j] = -h;
        kt_position_add(s.model, s.q, step, q);
        accelerate(&s, t, q, s.v, minus);
        step[j] = 0.0;
        for (int i = 0; i < n; i++)
            kt_worst_near(&by_q, d[j * n + i], (plus[i] - minus[i]) / (2.0 * h), 1e-9 * scale, "da[%d]/dq[%d]", i, j);
        double v[40];
        memcpy(v, s.v, sizeof v);
        v[j] = s.v[j] + h;
        accelerate(&s, t, s.q, v, plus);
        v[j] = s.v[j] - h;
        accelerate(&s, t, s.q, v, minus);
        for (int i = 0; i < n; i++)
            kt_worst_near(&by_v, d[n * n + j * n + i], (plus[i] - minus[i]) / (2.0 * h), 1e-9 * scale, "da[%d]/dv[%d]",
                          i, j);
    }
    double a_t[40];
    accelerate(&s, t, s.q, s.v, s.a);
    const kt_dynamic_state at = {.t = t, .q = s.q, .v = s.v};
    kt_check_equal_int("by time", kt_acceleration_time_derivative(s.model, s.data, &at, s.a, a_t, &error), KT_OK);
    accelerate(&s, t + h, s.q, s.v, plus);
    accelerate(&s, t - h, s.q, s.v, minus);
    KT_WORST by_t = kt_worst_make("by time");
    for (int i = 0; i < n; i++)
        kt_worst_near(&by_t, a_t[i], (plus[i] - minus[i]) / (2.0 * h), 1e-9 * scale, "da[%d]/dt", i);
    free(work);
    free(d);
}

KT_TEST(derivatives_are_exact) { check_derivatives(BODIES("3", "y") BALL("4") COUPLED); }

KT_TEST(derivatives_along_paths_are_exact) { check_derivatives(BODIES("3", "y") BALL("4") PATHS); }

/* The body is turned by a right angle about z, and its marker by one about y. The marker's z is the body's x and the
 * world's y. An end that turns the marker by a right angle about x has the marker's -y as its z: the world's x. The
 * torque's acceleration is in the axes of the body. */
KT_TEST(forces_of_an_end_are_along_the_axes_of_its_marker) {
    static const char *const acts[][2] = {
        {"type: force, at: ", "value: [0, 0, 2], frame: body"},
        {"type: expression, at: ", "force: [0, 0, 2], frame: body"},
        {"type: thrust, at: ", "mass: 10 - t, exhaust: [0, 0, -2]"},
        {"type: torque, on: ", "value: [0, 0, 2], frame: body"},
        {"type: expression, at: ", "torque: [0, 0, 2], frame: body"},
    };
    static const char *const ends[] = {"b.n", "{body: b, marker: n, rotation: {rpy: [90 deg, 0, 0]}}"};
    static const double force[2][3] = {{0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}};
    static const double torque[2][3] = {{1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}};
    for (int k = 0; k < 10; k++) {
        char text[600];
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\nbodies:\n  - name: b\n"
                       "    joint: {type: free, position: {orientation: {rpy: [0, 0, 90 deg]}}}\n"
                       "    mass: 2\n    com: [0, 0, 0]\n    inertia: [2, 2, 2]\n"
                       "    markers: {n: {at: [0, 0, 0], rotation: {rpy: [0, 90 deg, 0]}}}\neffects: [{%s%s, %s}]\n",
                       acts[k % 5][0], ends[k / 5], acts[k % 5][1]);
        mechanism s;
        make(&s, text);
        const bool turns = k % 5 > 2;
        accelerate(&s, 0.0, s.q, s.v, s.a);
        for (int i = 0; i < 3; i++) {
            kt_check_near(acts[k % 5][0], s.a[i], turns ? 0.0 : force[k / 5][i], 1e-15);
            kt_check_near("about the body's axes", s.a[3 + i], turns ? torque[k / 5][i] : 0.0, 1e-15);
        }
    }
}

static double energy_of(mechanism *s, const kt_simulation *simulation) {
    kt_error error = {0};
    const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
    if (kt_kinematics_update(s->model, s->data, q, v, NULL, &error) != KT_OK)
        return (double)NAN;
    return kt_kinetic_energy(s->model, s->data) + kt_potential_energy(s->model, s->data);
}

#define RUN                                                                                                            \
    "simulate: {duration: 0.5, tolerance: 1e-11, integrator: dop853}\noutput: {record: [position, energy, balance]}\n"

/* The formulas supply v . (M a + h). The kinetic and potential energy before and after a short time yield this
 * power. */
static void check_power(const char *text) {
    mechanism s;
    kt_error error = {0};
    make(&s, text);
    kt_simulation_options options = kt_simulation_options_default();
    options.record = KT_RECORD_ENERGY | KT_RECORD_BALANCE;
    kt_simulation *simulation = kt_test_simulation(s.model, &s.scene->run, &options);
    const double before = energy_of(&s, simulation);
    kt_check_equal_int("run", kt_simulation_advance(simulation, 0.5, &error), KT_OK);
    const double after = energy_of(&s, simulation);
    const kt_work work = kt_simulation_work(simulation);
    kt_check_above("supplied, J", fabs(work.supplied), 1.0);
    kt_check_near("energy gained, J", after - before, work.supplied - work.dissipated, 1e-9 * fabs(work.supplied));
}

KT_TEST(power_is_supplied) { check_power(BODIES("3", "y") BALL("4") COUPLED RUN); }

KT_TEST(power_along_paths_is_supplied) { check_power(BODIES("3", "y") BALL("4") PATHS RUN); }

KT_TEST(planar_plans_have_the_same_forces) {
    static const char *const text = BODIES(
        "3", "y") "effects:\n"
                  "  - {type: expression, joint: arm, force: \"-3*marker.leg.toe.x*velocity.leg\"}\n"
                  "  - {type: expression, between: [leg.toe, world], force: \"-k*(length - 1) - marker.arm.tip.vz\"}\n"
                  "  - {type: expression, at: leg.toe, force: [\"position.arm\", \"0*t\", \"-marker.arm.tip.x\"]}\n"
                  "  - {type: expression, path: [world, {body: arm, radius: 0.1, axis: y, side: [0, 0, 1]}, leg.toe], "
                  "force: \"-k*length - c*speed\"}\n";
    mechanism planar, spatial;
    make_with(&planar, text, KT_PLAN_AUTO);
    make_with(&spatial, text, KT_PLAN_SPATIAL);
    accelerate(&planar, 0.2, planar.q, planar.v, planar.a);
    accelerate(&spatial, 0.2, planar.q, planar.v, spatial.a);
    for (int i = 0; i < planar.nv; i++)
        kt_check_near("acceleration", planar.a[i], spatial.a[i], 1e-13 * fabs(spatial.a[i]) + 1e-13);
}
