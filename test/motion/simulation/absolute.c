/* A motion in the absolute formulation: its states and records are those of the tree, although its simulation
 * integrates absolute coordinates. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "formulation.h"
#include "mechanics/dynamics/tree.h"
#include "scenes.h"

#include "kinetree/scene.h"

#include <float.h>
#include <math.h>
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

static kt_either begin(const stage *s, kt_run run, kt_formulation formulation) {
    kt_error error;
    const kt_either e =
        kt_either_begin(s->tree.model, formulation == KT_FORMULATION_ABSOLUTE ? s->absolute : NULL, &run, NULL);
    kt_need_fine("state", kt_either_set_state(e, 0.0, s->state.q, s->state.v, &error), &error);
    return e;
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
    kt_either_test_run(kt_either_begin(model, absolute, &run, NULL), watch_spin, &s);
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
    kt_either_test_run(kt_either_begin(model, absolute, &run, NULL), watch_balls, &worst);
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
    const kt_either tree = begin(&s, kt_run_default(), KT_FORMULATION_TREE);
    const kt_either absolute = begin(&s, kt_run_default(), KT_FORMULATION_ABSOLUTE);
    for (int b = 1; b < s.tree.count; b++) {
        const kt_coordinates at = kt_body_coordinates(s.tree.model, b);
        if (at.type == KT_JOINT_REVOLUTE)
            s.state.q[at.q] += 62.83185307179586;
    }
    (void)kt_fine("tree", kt_either_set_state(tree, 2.5, s.state.q, s.state.v, &error), &error);
    (void)kt_fine("absolute", kt_either_set_state(absolute, 2.5, s.state.q, s.state.v, &error), &error);
    for (int i = 0; i < s.tree.nq; i++)
        kt_worst_near(&position, kt_either_positions(absolute)[i], kt_either_positions(tree)[i], DBL_EPSILON, "%d", i);
    memcpy(before, kt_either_positions(absolute), sizeof(double) * (size_t)s.tree.nq);
    kt_check_equal_bits("velocities", kt_either_velocities(absolute), s.state.v, (size_t)s.tree.nv);
    kt_check_near("time", kt_simulation_time(absolute.simulation), 2.5, 0.0);
    s.state.q[0] = (double)NAN;
    kt_check_equal_int("not finite", kt_either_set_state(absolute, 0.0, s.state.q, s.state.v, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_near("time, still", kt_simulation_time(absolute.simulation), 2.5, 0.0);
    kt_check_equal_bits("positions, still", kt_either_positions(absolute), before, (size_t)s.tree.nq);
}

/* Assembly turns the bars of Andrews' mechanism by a radian. From the same start, free bodies do not find a closed
 * position. */
KT_TEST(motion_starts_where_the_tree_is_assembled) {
    static const double given[7] = {-1.19, -0.83, 0.838, 1.566, 0.719, -0.533, 2.66};
    kt_body bodies[7];
    kt_description description = kt_test_bundled("andrews")->description;
    kt_need(kt_check_equal_int("bodies", description.body_count, 7));
    for (int i = 0; i < 7; i++) {
        bodies[i] = description.bodies[i];
        bodies[i].joint.position[0] = given[i];
    }
    description.bodies = bodies;
    kt_model *model = kt_scene_compile(&description);
    kt_absolute *absolute = kt_formulate(&description, NULL, model, KT_FORMULATION_ABSOLUTE);
    const kt_either tree = kt_either_begin(model, NULL, NULL, NULL),
                    freed = kt_either_begin(model, absolute, NULL, NULL);
    kt_check_equal_bits("positions", kt_either_positions(freed), kt_either_positions(tree), 7);
    kt_check_above("assembly has moved a bar, rad", fabs(kt_either_positions(tree)[1] - given[1]), 0.5);
}

static int count_calls(const kt_simulation *simulation, void *user) {
    (void)simulation;
    ++*(int *)user;
    return 0;
}

KT_TEST(caller_follows_the_progress_of_a_motion) {
    static stage s;
    kt_error error;
    int calls = 0;
    set_stage(&s, 3);
    const kt_run run = kt_run_fixed("rk4", 0.01, 0.1);
    kt_simulation_options options = kt_simulation_options_default();
    options.progress = count_calls;
    options.progress_user = &calls;
    options.progress_steps = 3;
    kt_check_equal_int(
        "run",
        kt_simulation_advance(kt_either_begin(s.tree.model, s.absolute, &run, &options).simulation, 0.05, &error),
        KT_OK);
    kt_check_equal_int("calls without a run", calls, 0);
    const kt_either e = kt_either_begin(s.tree.model, s.absolute, &run, &options);
    kt_either_test_run(e, kt_keep, kt_kept_empty(s.tree.model));
    kt_check_equal_int("calls in ten steps", calls, 3);
    options.progress_steps = 0;
    kt_absolute_motion *none = NULL;
    kt_check_equal_int("no steps", kt_absolute_motion_create(s.absolute, &run, &options, &none, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "progress_steps");
}

KT_TEST(motion_rejects_what_needs_the_tree) {
    static stage s;
    kt_error error = {KT_OK, "", ""};
    kt_absolute_motion *none = NULL;
    kt_simulation_options options = kt_simulation_options_default();
    set_stage(&s, 3);
    options.events = 1;
    kt_check_equal_int("events", kt_absolute_motion_create(s.absolute, NULL, &options, &none, &error),
                       KT_ERROR_UNSUPPORTED);
    kt_check_text("where", error.where, "formulation");
    kt_check_contains("message", error.message, "events need the formulation 'tree'");
    kt_check_true("none", none == NULL);
}
