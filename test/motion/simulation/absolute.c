/* The absolute formulation in a simulation: its inputs and outputs are those of the tree, although the simulation
 * integrates absolute coordinates. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "interpose.h"
#include "mechanics/dynamics/tree.h"
#include "scenes.h"

#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A random tree and a state of it. */
typedef struct stage {
    kt_tree tree;
    kt_absolute *absolute;
    kt_tree_state state;
} stage;

static void set_stage(stage *s, int bodies) {
    kt_random random = kt_random_of_test();
    kt_tree_plan plan = kt_tree_plan_default();
    plan.bodies = bodies;
    plan.is_shuffled = true;
    kt_tree_describe(&s->tree, &plan, &random);
    kt_tree_compile(&s->tree, NULL);
    s->absolute = kt_formulate(&s->tree.description, NULL, s->tree.model, KT_FORMULATION_ABSOLUTE);
    kt_tree_state_draw(&s->tree, &random, &s->state);
}

static kt_simulation *simulate(const kt_model *model, const kt_absolute *absolute, const kt_run *run) {
    const kt_simulation_options options = kt_formulated(absolute);
    return kt_test_simulation(model, run, &options);
}

static kt_simulation *begin(const stage *s, kt_run run, kt_formulation formulation) {
    kt_error error;
    kt_simulation *simulation =
        simulate(s->tree.model, formulation == KT_FORMULATION_ABSOLUTE ? s->absolute : NULL, &run);
    if (simulation)
        (void)kt_fine("state", kt_simulation_set_state(simulation, 0.0, s->state.q, s->state.v, &error), &error);
    return simulation;
}

static kt_status push(kt_simulation *simulation, const stage *s, double factor, kt_error *error) {
    double tau[KT_TREE_NV];
    kt_wrench external[KT_TREE_SLOTS];
    for (int i = 0; i < s->tree.nv; i++)
        tau[i] = factor * s->state.tau[i];
    for (int b = 0; b < s->tree.count; b++) {
        external[b].moment = kt_vec3_scale(factor, s->state.external[b].moment);
        external[b].force = kt_vec3_scale(factor, s->state.external[b].force);
    }
    const kt_status status = kt_simulation_set_torque(simulation, tau, error);
    return status == KT_OK ? kt_simulation_set_wrenches(simulation, external, error) : status;
}

/* Torques in joints of every type and wrenches on all bodies, which change from one call to the next, and the
 * accelerations that they cause. Bounds: five times the largest of twenty seeds. */
KT_TEST(pushes_of_the_caller_act_alike) {
    static stage s;
    KT_WORST position = kt_worst_make("position"), velocity = kt_worst_make("velocity");
    KT_WORST acceleration = kt_worst_make("acceleration, relative");
    kt_error error;
    set_stage(&s, 10);
    const kt_run run = kt_run_fixed("dop853", 0.001, 1.0);
    kt_simulation *tree = begin(&s, run, KT_FORMULATION_TREE), *absolute = begin(&s, run, KT_FORMULATION_ABSOLUTE);
    for (int k = 0; k < 10 && tree && absolute; k++) {
        kt_simulation *both[2] = {tree, absolute};
        double a[2][KT_TREE_NV];
        for (int i = 0; i < 2; i++) {
            (void)kt_fine("push", push(both[i], &s, 5.0 * sin(k + 1.0), &error), &error);
            (void)kt_fine("acceleration", kt_simulation_acceleration(both[i], a[i], &error), &error);
            kt_test_advance(both[i], 0.01 * (k + 1));
        }
        const double *q = kt_simulation_positions(tree), *v = kt_simulation_velocities(tree);
        const double scale = kt_tree_largest(a[0], s.tree.nv);
        for (int i = 0; i < s.tree.nq; i++)
            kt_worst_near(&position, kt_simulation_positions(absolute)[i], q[i], 6e-14, "%d, %d", k, i);
        for (int i = 0; i < s.tree.nv; i++) {
            kt_worst_near(&velocity, kt_simulation_velocities(absolute)[i], v[i], 2e-12, "%d, %d", k, i);
            kt_worst_near(&acceleration, a[1][i] / scale, a[0][i] / scale, 1e-13, "%d, %d", k, i);
        }
    }
}

/* ---- whole turns ------------------------------------------------------------------------------------------------- */

enum { SPINNERS = 4 };

/* Bodies that spin about their joint's axis, at the rates +-40 rad/s; the last from rest under a constant torque. */
static kt_model *make_spinners(kt_body *bodies, kt_effect *motor, kt_absolute **absolute) {
    static const kt_joint_type types[SPINNERS] = {KT_JOINT_CYLINDRICAL, KT_JOINT_PLANAR, KT_JOINT_UNIVERSAL,
                                                  KT_JOINT_REVOLUTE};
    static const char *const names[SPINNERS] = {"sleeve", "puck", "cardan", "wheel"};
    static const int turning[SPINNERS] = {0, 2, 1, 0};
    kt_model *model = NULL;
    for (int i = 0; i < SPINNERS; i++) {
        bodies[i] = kt_body_of(names[i], NULL, types[i], 1.0);
        bodies[i].inertia = kt_sym3_make(0.2, 0.2, 0.2, 0.0, 0.0, 0.0);
        bodies[i].joint.position[turning[i]] = 3.0;
        bodies[i].joint.velocity[turning[i]] = i == 3 ? 0.0 : i % 2 ? -40.0 : 40.0;
    }
    *motor = kt_effect_of(KT_EFFECT_MOTOR, "wheel");
    motor->torque = kt_function_constant(20.0);
    kt_description description = kt_description_of(bodies, SPINNERS, NULL, 0, motor, 1);
    model = kt_scene_compile(&description);
    *absolute = kt_formulate(&description, NULL, model, KT_FORMULATION_ABSOLUTE);
    return model;
}

typedef struct spin {
    kt_worst angle;
    int at[SPINNERS];
} spin;

static double angle_of(int spinner, double t) {
    return 3.0 + (spinner == 3 ? 0.5 * (20.0 / 0.2) * t * t : (spinner % 2 ? -40.0 : 40.0) * t);
}

static int watch_spin(const kt_record *record, void *user) {
    spin *s = user;
    for (int i = 0; i < SPINNERS; i++) /* the bound is five times the error measured with these coarse steps */
        kt_worst_near(&s->angle, record->q[s->at[i]], angle_of(i, record->t), 9e-4, "t = %g, %d", record->t, i);
    return 0;
}

/* A step turns the bodies by 2 rad. At the end it turns the wheel by almost 4 rad, which is more than half a turn. Only
 * the rates at both ends determine the number of turns. */
KT_TEST(angles_count_whole_turns) {
    kt_body bodies[SPINNERS];
    kt_effect motor;
    kt_absolute *absolute = NULL;
    kt_model *model = make_spinners(bodies, &motor, &absolute);
    kt_run run = kt_run_fixed("dop853", 0.05, 0.8);
    spin s = {.angle = kt_worst_make("angle, rad")};
    run.interval = 0.02;
    s.at[0] = kt_body_coordinates(model, kt_body_find(model, "sleeve")).q;
    s.at[1] = kt_body_coordinates(model, kt_body_find(model, "puck")).q + 2;
    s.at[2] = kt_body_coordinates(model, kt_body_find(model, "cardan")).q + 1;
    s.at[3] = kt_body_coordinates(model, kt_body_find(model, "wheel")).q;
    kt_simulation *simulation = simulate(model, absolute, &run);
    if (simulation)
        kt_test_run(simulation, watch_spin, &s);
    kt_check_worst(&s.angle);
    kt_check_above("turns of the wheel", angle_of(3, 0.8) / 6.283185307179586, 5.0);
}

enum { BALLS = 4 };

/* The last is free. */
static const double ball_axis[BALLS][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, {0.6, 0.0, -0.8}};

static kt_model *make_balls(kt_body *bodies, kt_absolute **absolute) {
    static const char *const names[BALLS] = {"about_x", "about_y", "about_z", "free"};
    kt_model *model = NULL;
    for (int i = 0; i < BALLS; i++) {
        bodies[i] = kt_body_of(names[i], NULL, i < 3 ? KT_JOINT_SPHERICAL : KT_JOINT_FREE, 1.0);
        bodies[i].inertia = kt_sym3_make(0.2, 0.2, 0.2, 0.0, 0.0, 0.0);
        for (int k = 0; k < 3; k++)
            bodies[i].joint.velocity[i < 3 ? k : 3 + k] = 10.0 * ball_axis[i][k];
    }
    kt_description description = kt_description_of(bodies, BALLS, NULL, 0, NULL, 0);
    model = kt_scene_compile(&description);
    *absolute = kt_formulate(&description, NULL, model, KT_FORMULATION_ABSOLUTE);
    return model;
}

static int watch_balls(const kt_record *record, void *user) {
    const double half = 5.0 * record->t;
    for (int i = 0; i < BALLS; i++) {
        const double *p = record->q + (i < 3 ? 4 * i : 15);
        kt_worst_near(user, p[0], cos(half), 2e-13, "t = %g, ball %d", record->t, i);
        for (int k = 0; k < 3; k++)
            kt_worst_near(user, p[1 + k], sin(half) * ball_axis[i][k], 2e-13, "t = %g, ball %d, %d", record->t, i, k);
    }
    return 0;
}

/* A rotation has two quaternions. The record has the one that is nearer to the last record, over more than two turns.
 * An angle of 4 pi is one turn of the quaternion. The measured error was 3e-14. */
KT_TEST(quaternions_go_on_without_a_jump) {
    kt_body bodies[BALLS];
    kt_absolute *absolute = NULL;
    kt_model *model = make_balls(bodies, &absolute);
    kt_run run = kt_run_fixed("dop853", 0.025, 1.5);
    KT_WORST worst = kt_worst_make("quaternion");
    run.interval = 0.05;
    kt_simulation *simulation = simulate(model, absolute, &run);
    if (simulation)
        kt_test_run(simulation, watch_balls, &worst);
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* A state that is set is read back, turns included, as in the tree formulation, but for the last bit of a quaternion's
 * norm. A state with numbers that are not finite changes nothing. */
KT_TEST(state_that_is_set_comes_back) {
    static stage s;
    KT_WORST position = kt_worst_make("positions");
    double before[KT_TREE_NQ];
    kt_error error;
    set_stage(&s, 10);
    kt_simulation *tree = begin(&s, kt_run_default(), KT_FORMULATION_TREE);
    kt_simulation *simulation = begin(&s, kt_run_default(), KT_FORMULATION_ABSOLUTE);
    for (int b = 1; b < s.tree.count; b++) {
        const kt_coordinates at = kt_body_coordinates(s.tree.model, b);
        if (at.type == KT_JOINT_REVOLUTE)
            s.state.q[at.q] += 62.83185307179586;
    }
    (void)kt_fine("tree", kt_simulation_set_state(tree, 2.5, s.state.q, s.state.v, &error), &error);
    (void)kt_fine("absolute", kt_simulation_set_state(simulation, 2.5, s.state.q, s.state.v, &error), &error);
    for (int i = 0; i < s.tree.nq; i++)
        kt_worst_near(&position, kt_simulation_positions(simulation)[i], kt_simulation_positions(tree)[i], DBL_EPSILON,
                      "%d", i);
    memcpy(before, kt_simulation_positions(simulation), sizeof(double) * (size_t)s.tree.nq);
    kt_check_equal_bits("velocities", kt_simulation_velocities(simulation), s.state.v, (size_t)s.tree.nv);
    kt_check_near("time", kt_simulation_time(simulation), 2.5, 0.0);
    s.state.q[0] = (double)NAN;
    kt_check_equal_int("not finite", kt_simulation_set_state(simulation, 0.0, s.state.q, s.state.v, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_near("time, still", kt_simulation_time(simulation), 2.5, 0.0);
    kt_check_equal_bits("positions, still", kt_simulation_positions(simulation), before, (size_t)s.tree.nq);
}

/* From a checkpoint within a step, in another simulation, with pushes and many turns behind it. */
KT_TEST(restored_run_goes_on_bit_for_bit) {
    kt_body bodies[SPINNERS];
    kt_effect motor;
    kt_absolute *absolute = NULL;
    kt_model *model = make_spinners(bodies, &motor, &absolute);
    const kt_simulation_options options = kt_formulated(absolute);
    kt_run run = kt_run_default();
    run.duration = 0.8;
    run.interval = 0.01;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY;
    const double tau[8] = {1.0, 2.0, -1.0, 0.5, 3.0, -2.0, 1.0, 0.2};
    kt_check_equal_int(
        "records",
        kt_resumption_check(&(kt_resumption){.model = model, .run = &run, .options = &options, .torque = tau}, 53), 81);
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static int count_records(const kt_record *record, void *user) {
    (void)record;
    ++*(int *)user;
    return 0;
}

KT_TEST(placed_simulation_stays_within_its_memory_and_allocates_nothing) {
    static stage s;
    kt_error error;
    kt_simulation *simulation = NULL;
    int records = 0;
    set_stage(&s, 8);
    kt_run run = kt_run_fixed("rk4", 0.001, 0.05);
    run.interval = 0.01;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY | KT_RECORD_REACTION | KT_RECORD_CONSTRAINT;
    const kt_simulation_options options = kt_formulated(s.absolute);
    const size_t size = kt_simulation_size(s.tree.model, &run, &options), guard = 4096;
    unsigned char *memory = aligned_alloc(KT_ALIGNMENT, size + guard);
    memset(memory, 0x5A, size + guard);
    kt_interpose_start();
    kt_status status = kt_simulation_init(s.tree.model, &run, &options, memory, size, &simulation, &error);
    if (status == KT_OK)
        status = push(simulation, &s, 1.0, &error);
    if (status == KT_OK)
        status = kt_simulation_run(simulation, count_records, &records, &error);
    const long allocations = kt_interpose_stop();
    (void)kt_fine("place and run", status, &error);
    size_t touched = 0;
    for (size_t i = 0; i < guard; i++)
        touched += memory[size + i] != 0x5A;
    kt_check_equal_int("allocations", allocations, 0);
    kt_check_equal_int("bytes touched beyond", (long long)touched, 0);
    kt_check_equal_int("records", records, 6);
    free(memory);
}

static int keep_and_poison(const kt_record *record, void *user) {
    kt_simulation *simulation = *(kt_simulation **)user;
    const kt_simulation_sizes *size = &simulation->size;
    const int result = kt_keep(record, *((kt_kept **)user + 1));
    memset(simulation->y, 0xA5, size->n * sizeof(double));
    memset(simulation->a, 0xA5, size->nv * sizeof(double));
    memset(simulation->shown, 0xA5, size->shown * sizeof(double));
    memset(simulation->body_wrench, 0xA5, size->body_wrench * sizeof(kt_wrench));
    return result;
}

KT_TEST(garbage_in_scratch_changes_no_bit) {
    static stage s;
    static kt_kept clean;
    kt_error error;
    set_stage(&s, 5);
    kt_run run = kt_run_fixed("rk4", 0.013, 0.3);
    run.interval = 0.01;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY;
    for (int i = 0; i < 2; i++) {
        kt_simulation *simulation = begin(&s, run, KT_FORMULATION_ABSOLUTE);
        kt_kept *kept = kt_kept_empty(s.tree.model);
        void *both[2] = {simulation, kept};
        (void)kt_fine("push", push(simulation, &s, 1.0, &error), &error);
        kt_test_run(simulation, i ? keep_and_poison : kt_keep, i ? (void *)both : kept);
        if (i == 0)
            clean = *kept;
        else
            kt_check_equal_bits("states", kept->state[0], clean.state[0], (size_t)clean.count * KT_KEPT_NUMBERS);
    }
    kt_check_equal_int("records", clean.count, 31);
}
