/* Joints that move no mass (quasi-statics, [MSD 8.1]): against closed forms, against small masses by an implicit
 * method, and who rejects them. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parsed.h"

#include "kinetree/analysis.h"
#include "kinetree/batch.h"
#include "kinetree/control.h"
#include "kinetree/mechanism.h"
#include "kinetree/sensitivity.h"
#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static kt_run run_by(const char *method, double step) {
    kt_run run = kt_run_fixed(method, step, 3.0);
    run.interval = 0.037;
    run.relative = run.absolute = 1e-9;
    run.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY;
    return run;
}

/* All families of methods, and the bound of the error in the motions below, whose values are about 1. The bound is the
 * tolerance times the growth, or the error of the fixed steps. */
static const struct {
    const char *name;
    double step, bound;
} methods[] = {{"dopri5", 0.0, 1e-8},    {"dop853", 0.0, 1e-8},         {"tsit5", 0.0, 1e-8},
               {"bs32", 0.0, 1e-7},      {"rkc4", 0.0, 1e-8},           {"radau5", 0.0, 1e-8},
               {"rodas5p", 0.0, 1e-8},   {"auto", 0.0, 1e-8},           {"rk4", 5e-3, 2e-9},
               {"ab4", 2e-3, 2e-10},     {"bdf2", 2e-3, 4e-5},          {"two-step", 2e-3, 1e-5},
               {"midpoint", 2e-3, 2e-5}, {"crank-nicolson", 2e-3, 1e-5}};
enum { METHODS = sizeof methods / sizeof *methods };

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

/* Positions and velocities of a motion at a time. */
typedef void motion_call(double t, double q[3], double v[3]);

typedef struct compared {
    motion_call *motion;
    int count;
    kt_worst position, velocity;
    double bound;
} compared;

static int compare(const kt_record *record, void *user) {
    compared *c = user;
    double q[3], v[3];
    c->motion(record->t, q, v);
    for (int k = 0; k < c->count; k++) {
        kt_worst_near(&c->position, record->q[k], q[k], c->bound, "%d at %g s", k, record->t);
        kt_worst_near(&c->velocity, record->v[k], v[k], 4.0 * c->bound, "%d at %g s", k, record->t);
    }
    return 0;
}

static void follows(const char *text, motion_call *motion) {
    kt_parsed m;
    kt_parsed_make(&m, text);
    for (int k = 0; k < METHODS; k++) {
        const kt_run run = run_by(methods[k].name, methods[k].step);
        compared c = {.motion = motion, .count = kt_model_nv(m.model), .bound = methods[k].bound};
        c.position = kt_worst_make(methods[k].name);
        c.velocity = kt_worst_make("velocities");
        kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
        kt_test_run(s, compare, &c);
        kt_check_worst(&c.position);
        kt_check_worst(&c.velocity);
    }
}

/* [MSD example 8.1] with m1 = 0. The springs k1 = 100 N/m and k2 = 300 N/m in a row act as one spring of 75 N/m. The
 * first spring takes 3/4 of the stretch. The mass m2 = 8 kg starts with a stretch of 0.1 m. */
#define SPRINGS                                                                                                        \
    "kinetree: 1\nbodies:\n"                                                                                           \
    "  - {name: two, joint: {type: prismatic, axis: x, position: 1.0}, mass: 8}\n"                                     \
    "  - {name: one, joint: {type: prismatic, axis: x}}\n"                                                             \
    "effects:\n"                                                                                                       \
    "  - {type: joint_spring, joint: one, stiffness: 100}\n"                                                           \
    "  - {type: spring, between: [one, two], stiffness: 300, length: 0.9}\n"
static const double frequency = 3.0618621784789726; /* sqrt(75 / 8) */

static void two_springs(double t, double q[3], double v[3]) {
    const double c = 0.1 * cos(frequency * t), s = -0.1 * frequency * sin(frequency * t);
    q[0] = 0.9 + c;
    v[0] = s;
    q[1] = 0.75 * c;
    v[1] = 0.75 * s;
}

KT_TEST(node_between_two_springs_is_where_forces_balance) { follows(SPRINGS, two_springs); }

/* The same as a tree in which the mass moves on the node: the mass matrix has rank 1. */
static void two_springs_in_a_row(double t, double q[3], double v[3]) {
    two_springs(t, q, v);
    const double node = q[1], speed = v[1];
    q[1] = q[0] - node;
    v[1] = v[0] - speed;
    q[0] = node;
    v[0] = speed;
}

KT_TEST(massless_carrier_of_a_mass_is_where_forces_balance) {
    follows("kinetree: 1\nbodies:\n"
            "  - {name: one, joint: {type: prismatic, axis: x, position: 0.075}}\n"
            "  - {name: two, parent: one, joint: {type: prismatic, axis: x, position: 0.925}, mass: 8}\n"
            "effects:\n"
            "  - {type: joint_spring, joint: one, stiffness: 100}\n"
            "  - {type: joint_spring, joint: two, stiffness: 300, rest: 0.9}\n",
            two_springs_in_a_row);
}

/* Maxwell's element, a damper c and a spring k in a row, on a mass m, stretched by x0. With the force F = k (x - z):
 *     m x'' = -F,  c z' = F,   F'' + k/c F' + k/m F = 0,  F(0) = k x0,  F'(0) = -k/c F(0)
 * and z = -m x'/c as both are -integral of F / c. */
enum { K = 30, C = 9 };
static const double mass = 2.0, stretch = 0.5;

static void maxwell(double t, double *x, double *z, double *vx, double *vz) {
    const double a = 0.5 * K / C, w = sqrt(K / mass - a * a), f0 = K * stretch, b = -a * f0 / w, e = exp(-a * t);
    const double f = e * (f0 * cos(w * t) + b * sin(w * t));
    const double rate = -a * f + e * w * (b * cos(w * t) - f0 * sin(w * t));
    *vz = f / C;
    *vx = rate / K + *vz;
    *z = -mass * *vx / C;
    *x = f / K + *z;
}

static void damper_and_spring(double t, double q[3], double v[3]) { maxwell(t, &q[1], &q[0], &v[1], &v[0]); }

#define MAXWELL                                                                                                        \
    "kinetree: 1\nbodies:\n"                                                                                           \
    "  - {name: node, joint: {type: prismatic, axis: x}}\n"                                                            \
    "  - {name: mass, joint: {type: prismatic, axis: x, position: 0.5}, mass: 2}\n"                                    \
    "effects:\n"                                                                                                       \
    "  - {type: joint_damper, joint: node, damping: 9}\n"                                                              \
    "  - {type: bushing, between: [node, mass], stiffness: [30, 0, 0, 0, 0, 0], damping: [0, 0, 0, 0, 0, 0]}\n"

KT_TEST(maxwell_element_is_a_state_of_first_order) { follows(MAXWELL, damper_and_spring); }

/* Spring, damper and spring in a row, which two nodes join: along the sum of their motions nothing resists but springs.
 * Springs of 90 and 45 N/m in a row act as one spring of 30 N/m. The first node is at F / 90, the second one at x - F /
 * 45. */
static void spring_damper_spring(double t, double q[3], double v[3]) {
    double z, vz;
    maxwell(t, &q[2], &z, &v[2], &vz);
    q[0] = K * (q[2] - z) / 90.0;
    q[1] = q[2] - K * (q[2] - z) / 45.0;
    v[0] = K * (v[2] - vz) / 90.0;
    v[1] = v[2] - K * (v[2] - vz) / 45.0;
}

KT_TEST(damper_between_two_nodes_leaves_one_balance_of_springs) {
    follows("kinetree: 1\nbodies:\n"
            "  - {name: near, joint: {type: prismatic, axis: x, position: 0.16666666666666667}}\n"
            "  - {name: far, joint: {type: prismatic, axis: x, position: 0.16666666666666667}}\n"
            "  - {name: mass, joint: {type: prismatic, axis: x, position: 0.5}, mass: 2}\n"
            "effects:\n"
            "  - {type: joint_spring, joint: near, stiffness: 90}\n"
            "  - {type: bushing, between: [near, far], stiffness: [0, 0, 0, 0, 0, 0], damping: [9, 0, 0, 0, 0, 0]}\n"
            "  - {type: bushing, between: [far, mass], stiffness: [45, 0, 0, 0, 0, 0], damping: [0, 0, 0, 0, 0, 0]}\n",
            spring_damper_spring);
}

/* ---- small masses ------------------------------------------------------------------------------------------------ */

/* A pendulum in space carries a flap without inertia. The hinge of the flap has a hardening spring and a damper, or a
 * linear spring alone. Another spring acts at the tip of the flap. The pendulum also carries a sensor's cage without
 * mass on a bushing, whose six coordinates are all without mass. */
#define FLAP                                                                                                           \
    "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"                                                                   \
    "  - {name: arm, joint: {type: spherical, position: {axis: [0, 1, 0], angle: 50 deg}, velocity: [0.2, 0.1, "       \
    "0.5]},\n"                                                                                                         \
    "     mass: 3, shape: {type: box, size: [0.2, 0.3, 1], at: [0, 0, -0.5]}, markers: {tip: [0, 0, -1]}}\n"           \
    "  - {name: flap, parent: arm, joint: {type: revolute, axis: [0.6, 0.8, 0], at: [0, 0, -1], position: 0.1}%s,\n"   \
    "     markers: {tip: [0, 0, -0.4]}}\n"                                                                             \
    "  - {name: cage, parent: arm, joint: {type: free}%s, markers: {eye: [0.2, 0, 0.1]}}\n"                            \
    "effects:\n"                                                                                                       \
    "  - {type: %s}\n"                                                                                                 \
    "  - {type: spring, between: [{body: world, at: [0.5, 0.4, -1.8]}, flap.tip], stiffness: 3, length: 0.3}\n"        \
    "  - {type: bushing, between: [arm, cage], stiffness: [40, 50, 60, 7, 8, 9], damping: [0, 0, 0, 0, 0, 0]}\n"       \
    "  - {type: spring, between: [{body: world, at: [0, 1, 0.5]}, cage.eye], stiffness: 5, length: 0.6}\n"

static const char damped[] =
    "expression, joint: flap, force: \"-4*position.flap - 9*position.flap^3 - 0.3*velocity.flap\"";
static const char springs[] = "joint_spring, joint: flap, stiffness: 4";

enum { NUMBERS = 12, STATES = 100 };

typedef struct path {
    int count, stop;
    double q[STATES][NUMBERS], v[STATES][NUMBERS - 2];
} path;

static int keep(const kt_record *record, void *user) {
    path *p = user;
    if (p->count == STATES)
        return -1;
    memcpy(p->q[p->count], record->q, sizeof p->q[0]);
    memcpy(p->v[p->count], record->v, sizeof p->v[0]);
    return ++p->count == p->stop ? -1 : 0;
}

static void trace(const char *method, double tolerance, const char *small_flap, const char *small_cage,
                  const char *hinge, path *p) {
    char text[3000];
    kt_parsed m;
    kt_error error;
    (void)snprintf(text, sizeof text, FLAP, small_flap, small_cage, hinge);
    *p = (path){.count = 0};
    kt_parsed_make(&m, text);
    kt_run run = run_by(method, 0.0);
    run.relative = run.absolute = tolerance;
    run.duration = 2.0;
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    kt_need_fine(method, kt_simulation_run(s, keep, p, &error), &error);
}

static double distance(const path *a, const path *b) {
    double most = a->count == b->count && a->count > 50 ? 0.0 : (double)NAN;
    for (int i = 5; i < a->count && i < b->count; i++) /* behind the boundary layer of a small mass */
        for (int k = 0; k < NUMBERS; k++)
            most = fmax(most, fabs(a->q[i][k] - b->q[i][k]));
    return most;
}

/* A small mass moves the motion in proportion to itself. */
KT_TEST(small_masses_come_to_the_balance_as_they_vanish) {
    static path none, first, second, implicit;
    static const char *const flap[2] = {", mass: 1e-3, com: [0, 0, -0.2], inertia: [2e-5, 2e-5, 2e-5]",
                                        ", mass: 1e-4, com: [0, 0, -0.2], inertia: [2e-6, 2e-6, 2e-6]"};
    trace("dopri5", 1e-9, "", ", mass: 0.1, inertia: [1e-3, 2e-3, 2e-3]", damped, &none);
    trace("radau5", 1e-9, flap[0], ", mass: 0.1, inertia: [1e-3, 2e-3, 2e-3]", damped, &first);
    trace("radau5", 1e-9, flap[1], ", mass: 0.1, inertia: [1e-3, 2e-3, 2e-3]", damped, &second);
    trace("radau5", 1e-9, "", ", mass: 0.1, inertia: [1e-3, 2e-3, 2e-3]", damped, &implicit);
    kt_check_below("by another method", distance(&none, &implicit), 1e-7);
    kt_check_below("1e-4 kg", distance(&none, &second), 1e-3);
    kt_check_near("ratio of 1e-3 to 1e-4 kg", distance(&none, &first) / distance(&none, &second), 10.0, 0.5);
}

/* Six coordinates, an orientation among them, and a hinge, held by springs alone. Parts without mass keep their energy
 * in springs. */
KT_TEST(massless_cage_on_springs_is_where_its_six_forces_balance) {
    static path all, implicit;
    char text[3000];
    kt_parsed m;
    kt_error error;
    (void)snprintf(text, sizeof text, FLAP, "", "", springs);
    kt_parsed_make(&m, text);
    trace("dop853", 1e-11, "", "", springs, &all);
    trace("radau5", 1e-10, "", "", springs, &implicit);
    kt_check_equal_int("coordinates", kt_massless_count(m.model), 7);
    kt_check_below("by another method", distance(&all, &implicit), 1e-7);
    double start = 0.0;
    KT_WORST energy = kt_worst_make("energy"), force = kt_worst_make("forces on the cage, and in the hinge");
    for (int i = 0; i < all.count; i++) {
        double a[NUMBERS];
        (void)kt_fine("kinematics", kt_kinematics_update(m.model, m.data, all.q[i], all.v[i], NULL, &error), &error);
        const double e = kt_kinetic_energy(m.model, m.data) + kt_potential_energy(m.model, m.data) +
                         kt_effect_energy(m.model, m.data, 0.0, all.q[i], all.v[i]);
        start = i == 0 ? e : start;
        kt_worst_near(&energy, e, start, 1e-8, "record %d", i);
        (void)kt_fine("forces", kt_effect_forces(m.model, m.data, 0.0, all.q[i], all.v[i], a, &error), &error);
        for (int k = 0; k < 7; k++)
            kt_worst_near(&force, a[kt_massless_coordinate(m.model, k)], 0.0, 1e-12, "%d at record %d", k, i);
    }
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

KT_TEST(run_goes_on_from_a_checkpoint_with_the_same_bits) {
    char text[3000];
    kt_parsed m;
    (void)snprintf(text, sizeof text, FLAP, "", "", damped);
    kt_parsed_make(&m, text);
    for (int k = 0; k < METHODS; k += 3) {
        kt_run run = run_by(methods[k].name, methods[k].step);
        run.duration = 0.15;
        run.interval = 0.0137;
        kt_note("%s", methods[k].name);
        kt_check_equal_int("records", kt_resumption_check(&(kt_resumption){.model = m.model, .run = &run}, 4), 12);
    }
}

KT_TEST(energy_of_a_damper_in_a_row_is_accounted) {
    kt_parsed m;
    kt_error error;
    kt_record start, last;
    kt_parsed_make(&m, MAXWELL);
    kt_run run = run_by("dopri5", 0.0);
    run.record |= KT_RECORD_BALANCE | KT_RECORD_ENERGY;
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    (void)kt_fine("start", kt_simulation_sense(s, &start, &error), &error);
    kt_test_advance(s, 2.0);
    (void)kt_fine("end", kt_simulation_sense(s, &last, &error), &error);
    kt_check_near("energy at the start", start.kinetic + start.potential, 0.5 * K * stretch * stretch, 1e-14);
    kt_check_near("balance", last.kinetic + last.potential + last.work.dissipated, start.kinetic + start.potential,
                  1e-8);
    kt_check_above("dissipated", last.work.dissipated, 3.0);
}

/* A caller's torque on a node is balanced at once, and auxiliary states are integrated with it. */
KT_TEST(inputs_and_auxiliary_states_act_on_what_has_no_mass) {
    kt_parsed m;
    kt_error error;
    const double push[2] = {0.0, 20.0};
    kt_parsed_make(&m, SPRINGS "states: {path: {rate: \"velocity.one\"}}\n");
    double q[2] = {1.0, 0.3}, v[2] = {0.5, -3.0};
    (void)kt_fine("balance", kt_massless_balance(m.model, m.data, 0.0, q, v, push, NULL, &error), &error);
    kt_check_near("node", q[1], (20.0 + 300.0 * 0.1) / 400.0, 1e-15);
    kt_check_near("its speed", v[1], 300.0 * 0.5 / 400.0, 1e-9);
    kt_check_near("the mass stays", q[0] + v[0], 1.5, 0.0);
    const kt_run run = run_by("dopri5", 0.0);
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    const double from = kt_simulation_positions(s)[1];
    (void)kt_fine("push", kt_simulation_set_torque(s, push, &error), &error);
    kt_test_advance(s, 1.0);
    const double x = kt_simulation_positions(s)[0];
    kt_check_near("node", kt_simulation_positions(s)[1], (20.0 + 300.0 * (x - 0.9)) / 400.0, 1e-14);
    kt_check_near("path, without the jump", kt_simulation_auxiliary_states(s)[0],
                  kt_simulation_positions(s)[1] - 20.0 / 400.0 - from, 1e-10);
}

KT_TEST(mass_matrix_and_inverse_dynamics_know_no_armature) {
    kt_parsed m;
    kt_error error;
    double matrix[4], tau[2], a[2];
    const double q[2] = {1.0, 0.075}, v[2] = {0.3, 0.225}, given[2] = {2.0, 5.0};
    kt_parsed_make(&m, SPRINGS);
    const double expected[4] = {8.0, 0.0, 0.0, 0.0};
    (void)kt_fine("mass", kt_dynamics_mass(m.model, m.data, q, matrix, &error), &error);
    kt_check_equal_bits("mass matrix", matrix, expected, 4);
    (void)kt_fine("inverse", kt_dynamics_inverse(m.model, m.data, q, v, given, NULL, tau, &error), &error);
    kt_check_near("force on the mass", tau[0], 16.0, 0.0);
    kt_check_near("on the node", tau[1], 0.0, 0.0);
    (void)kt_fine("kinematics", kt_kinematics_update(m.model, m.data, q, v, NULL, &error), &error);
    kt_check_near("kinetic energy", kt_kinetic_energy(m.model, m.data), 4.0 * 0.09, 1e-16);
    (void)kt_fine("acceleration", kt_acceleration_evaluate(m.model, m.data, 0.0, q, v, NULL, NULL, a, &error), &error);
    kt_check_near("of the mass", a[0], -7.5 / 8.0, 1e-14);
    kt_check_near("balanced", a[1], 0.0, 1e-14);
    kt_check_true("moves", kt_massless_moves(m.model, 1) && !kt_massless_moves(m.model, 0));
    kt_check_equal_int("coordinate", kt_massless_coordinate(m.model, 0), 1);
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static void rejects(const char *what, kt_status status, const kt_error *error) {
    kt_check_equal_int(what, status, KT_ERROR_UNSUPPORTED);
    kt_check_contains("why", error->message, "joint 'one' moves no mass");
    kt_check_contains("the mend", error->message, "a small mass, and integrate with an implicit method (radau5)");
}

KT_TEST(what_does_not_balance_forces_says_so) {
    kt_parsed m;
    kt_error error = {0};
    kt_parsed_make(&m, SPRINGS);
    kt_mode_watch *watch = NULL;
    kt_floquet *floquet = NULL;
    kt_absolute *absolute = NULL;
    kt_constraint_formulation *formulation = NULL;
    kt_linearization *linearization = NULL;
    kt_mass_inverse *inverse = NULL;
    kt_batch *batch = NULL;
    kt_simulation *simulation = NULL;
    rejects("watch on modes", kt_mode_watch_create(m.model, &watch, &error), &error);
    const kt_floquet_options period = kt_floquet_options_default(1.0);
    rejects("multipliers", kt_floquet_create(m.model, &period, &floquet, &error), &error);
    rejects("absolute coordinates", kt_absolute_create(&m.scene.description, NULL, m.model, &absolute, &error), &error);
    const kt_constraint_formulation_options gauss =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 0.01);
    rejects("formulation", kt_constraint_formulation_create(m.model, &gauss, &formulation, &error), &error);
    rejects("linearisation", kt_linearization_create(m.model, NULL, &linearization, &error), &error);
    rejects("inverse of the mass matrix", kt_mass_inverse_create(m.model, 0, &inverse, &error), &error);
    kt_batch_options lanes = kt_batch_options_default();
    lanes.method = kt_method_find("rk4");
    rejects("batch", kt_batch_create(m.model, &lanes, &batch, &error), &error);
    kt_run run = run_by("dopri5", 0.0);
    run.record |= KT_RECORD_ACCELERATION;
    rejects("accelerations", kt_simulation_create(m.model, &run, NULL, &simulation, &error), &error);
    const kt_step step = {.method = kt_method_find("rk4"), .h = 0.1};
    const size_t size = kt_step_work_size(m.model, step.method);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    const double q[2] = {1.0, 0.0}, v[2] = {0.0, 0.0};
    double next_q[2], next_v[2];
    rejects("derivatives of a step",
            kt_step_derivatives(m.model, m.data, work, size, &step, q, v, next_q, next_v, NULL, NULL, &error), &error);
    free(work);
    kt_parameter parameter;
    const double one = 1.0;
    kt_model *copy = NULL;
    void *memory = aligned_alloc(KT_ALIGNMENT, kt_model_size(m.model));
    (void)kt_fine("copy", kt_model_copy(m.model, memory, kt_model_size(m.model), &copy, &error), &error);
    (void)kt_fine("parameter", kt_parameter_find(m.model, "one.mass", &parameter, &error), &error);
    kt_check_equal_int("a mass by a parameter", kt_parameter_set(copy, &parameter, &one, &error), KT_ERROR_MODEL);
    kt_check_contains("says why", error.message, "compile the description with the mass that it is to have");
    free(memory);
}

static void is_rejected(const char *text, const char *why) {
    kt_scene scene;
    kt_model *model = NULL;
    kt_error error = {0};
    kt_parsed_scene(text, &scene);
    kt_check_equal_int("compilation", kt_model_compile(&scene.description, NULL, &model, &error), KT_ERROR_MODEL);
    kt_check_contains("where", error.where, "body 'one'");
    kt_check_contains("why", error.message, why);
    kt_model_free(model);
}

#define NODE "kinetree: 1\nbodies:\n  - {name: one, joint: {type: prismatic, axis: x, position: 0.15}}\neffects:\n"

KT_TEST(what_forces_do_not_determine_is_rejected_when_it_is_compiled) {
    is_rejected(NODE "  - {type: force, at: one, value: [1, 0, 0]}\n", "no spring or damper holds it");
    is_rejected(
        "kinetree: 1\nbodies:\n  - {name: one, joint: {type: prismatic}}\n  - {name: two, joint: {type: prismatic}}\n"
        "effects:\n  - {type: expression, joint: one, force: \"velocity.two - position.one\"}\n"
        "  - {type: expression, joint: two, force: \"-velocity.one - position.two\"}\n",
        "forces depend on its velocity, but do not resist it");
    is_rejected(
        "kinetree: 1\nbodies:\n  - {name: one, joint: {type: revolute}}\n"
        "  - {name: two, parent: one, joint: {type: planar, position: [1, 2, 0]}, mass: 1, inertia: [1, 1, 1]}\n"
        "effects:\n  - {type: joint_spring, joint: one, stiffness: 2}\n",
        "the joints that must move with it, so that no mass moves, change with the positions");
    is_rejected(
        "kinetree: 1\nbodies:\n"
        "  - {name: one, joint: {type: spherical}, mass: 1, com: [0, 0, 1], inertia: [1, 1, 0]}\n"
        "effects:\n  - {type: bushing, between: [world, one], stiffness: [0, 0, 0, 1, 1, 1], damping: [0, 0, 0, "
        "0, 0, 0]}\n",
        "has inertia in part of its degrees of freedom");
}

/* An armature of 1 is less than the rounding of such a mass. */
KT_TEST(carrier_of_a_mass_that_rounds_all_away_is_rejected) {
    is_rejected(
        "kinetree: 1\nbodies:\n  - {name: one, joint: {type: prismatic, axis: x}}\n"
        "  - {name: two, parent: one, joint: {type: prismatic, axis: x}, mass: 1e25}\neffects:\n"
        "  - {type: joint_spring, joint: one, stiffness: 1}\n  - {type: joint_spring, joint: two, stiffness: 1}\n",
        "moves nothing that has inertia");
}

KT_TEST(balance_that_is_not_found_is_told_and_changes_nothing) {
    kt_parsed m;
    kt_error error;
    const double pull = 1.0, push = -1.0;
    double q = 0.15, v = 0.0;
    kt_parsed_make(&m, NODE "  - {type: expression, joint: one, force: \"-10*max(0, position.one - 0.1)\"}\n");
    (void)kt_fine("pull", kt_massless_balance(m.model, m.data, 0.0, &q, &v, &pull, NULL, &error), &error);
    kt_check_near("position", q, 0.2, 1e-16);
    kt_check_equal_int("push", kt_massless_balance(m.model, m.data, 0.25, &q, &v, &push, NULL, &error),
                       KT_ERROR_SINGULAR);
    kt_check_contains("where", error.where, "joint 'one', t = 0.25 s");
    kt_check_contains("why", error.message, "springs and dampers must hold it in every position");
    kt_check_near("untouched", q, 0.2, 1e-16);
}
