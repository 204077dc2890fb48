/* The absolute formulation as a model: the conversion of bodies, joints, loops and effects. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "interpose.h"
#include "mechanics/compile/mechanism.h"
#include "mechanics/dynamics/tree.h"

#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <string.h>

static kt_model *compile_both(const kt_description *description, kt_absolute **formulation) {
    kt_model *model = kt_test_model(description, NULL);
    *formulation = kt_formulate(description, NULL, model, KT_FORMULATION_ABSOLUTE);
    kt_need(*formulation != NULL);
    return model;
}

static bool is_oblique(const kt_joint *joint) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    const kt_vec3 a = kt_vec3_normalize(joint->axis), b = joint->axis2;
    if (joint->type != KT_JOINT_UNIVERSAL || memcmp(&b, &none, sizeof b) == 0)
        return false;
    return fabs(kt_vec3_dot(a, kt_vec3_normalize(b))) > 1e-9;
}

/* The loop type that closes each joint. */
static kt_loop_type loop_of(const kt_joint *joint) {
    static const kt_loop_type types[KT_JOINT_TYPE_COUNT] = {[KT_JOINT_FIXED] = KT_LOOP_WELD,
                                                            [KT_JOINT_REVOLUTE] = KT_LOOP_REVOLUTE,
                                                            [KT_JOINT_PRISMATIC] = KT_LOOP_PRISMATIC,
                                                            [KT_JOINT_SCREW] = KT_LOOP_SCREW,
                                                            [KT_JOINT_CYLINDRICAL] = KT_LOOP_CYLINDRICAL,
                                                            [KT_JOINT_PLANAR] = KT_LOOP_PLANAR,
                                                            [KT_JOINT_UNIVERSAL] = KT_LOOP_UNIVERSAL,
                                                            [KT_JOINT_SPHERICAL] = KT_LOOP_SPHERICAL,
                                                            [KT_JOINT_FREE] = KT_LOOP_TYPE_COUNT};
    return is_oblique(joint) ? KT_LOOP_REVOLUTE : types[joint->type];
}

/* The loop of this name, from a place on; -1: none. */
static int find_loop(const kt_model *model, const char *name, int from) {
    for (int i = from; i < kt_loop_count(model); i++)
        if (strcmp(kt_loop_name(model, i), name) == 0)
            return i;
    return -1;
}

/* Each body free on the world, with its mass and markers; each joint a loop of the body's name and of its own kind. */
KT_TEST(every_body_is_free_and_every_joint_a_loop) {
    static kt_tree tree;
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 10; n++) {
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 12;
        plan.is_shuffled = n % 2 == 1;
        kt_tree_describe(&tree, &plan, &random);
        kt_absolute *formulation = NULL;
        (void)compile_both(&tree.description, &formulation);
        const kt_model *absolute = kt_absolute_model(formulation);
        int crosses = 0, wrong = 0;
        for (int i = 0; i < plan.bodies && absolute; i++) {
            const kt_body *body = &tree.description.bodies[i];
            const int b = i + 1, loop = find_loop(absolute, body->name, 0);
            const kt_loop_type type = loop_of(&body->joint);
            wrong += strcmp(kt_body_name(absolute, b), body->name) != 0 || kt_body_parent(absolute, b) != 0;
            wrong += kt_body_coordinates(absolute, b).type != KT_JOINT_FREE;
            wrong += kt_body_mass(absolute, b) != body->mass || kt_marker_count(absolute, b) != body->marker_count;
            wrong += type == KT_LOOP_TYPE_COUNT ? loop >= 0 : loop < 0 || kt_loop_type_of(absolute, loop) != type;
            crosses += is_oblique(&body->joint);
        }
        kt_check_equal_int("wrong", wrong, 0);
        kt_check_equal_int("bodies", absolute ? kt_model_body_count(absolute) : -1, 1 + plan.bodies + crosses);
    }
}

/* The initial state is the tree's: each body where its kinematics put it, as fast. */
KT_TEST(initial_state_is_that_of_the_tree) {
    static kt_tree tree;
    static double q[KT_TREE_NQ], v[KT_TREE_NV], free_q[2 * KT_TREE_NQ], free_v[2 * KT_TREE_NV];
    kt_random random = kt_random_of_test();
    KT_WORST position = kt_worst_make("position"), turn = kt_worst_make("orientation");
    KT_WORST velocity = kt_worst_make("velocity");
    for (int n = 0; n < 10; n++) {
        kt_tree_plan plan = kt_tree_plan_default();
        kt_error error = {0};
        kt_tree_describe(&tree, &plan, &random);
        kt_absolute *formulation = NULL;
        kt_model *model = compile_both(&tree.description, &formulation);
        kt_data *data = kt_test_data(model);
        const kt_model *absolute = kt_absolute_model(formulation);
        kt_model_initial(model, q, v);
        kt_model_initial(absolute, free_q, free_v);
        (void)kt_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &error), &error);
        for (int b = 1; b < kt_model_body_count(model); b++) {
            const int f = kt_body_find(absolute, kt_body_name(model, b));
            const double *x = free_q + kt_body_coordinates(absolute, f).q;
            const double *u = free_v + kt_body_coordinates(absolute, f).v;
            const kt_pose pose = kt_body_pose(model, data, b);
            const kt_twist twist = kt_body_twist(model, data, b);
            const kt_mat3 r = kt_mat3_from_quat(kt_quat_make(x[3], x[4], x[5], x[6]));
            const kt_vec3 w = kt_mat3_apply(r, kt_vec3_make(u[3], u[4], u[5]));
            kt_worst_below(&position, kt_vec3_norm(kt_vec3_sub(kt_vec3_make(x[0], x[1], x[2]), pose.position)), 6e-15,
                           "tree %d, body %d", n, b);
            kt_worst_below(
                &turn,
                fmax(kt_vec3_norm(kt_vec3_sub(r.x, pose.rotation.x)), kt_vec3_norm(kt_vec3_sub(r.y, pose.rotation.y))),
                1e-14, "tree %d, body %d", n, b);
            kt_worst_below(&velocity,
                           fmax(kt_vec3_norm(kt_vec3_sub(kt_vec3_make(u[0], u[1], u[2]), twist.linear)),
                                kt_vec3_norm(kt_vec3_sub(w, twist.angular))),
                           2.5e-14, "tree %d, body %d", n, b);
        }
    }
}

typedef struct totals {
    double kinetic, potential, mass;
    kt_vec3 center;
} totals;

/* At the initial state. */
static totals totals_of(const kt_model *model) {
    static double q[2 * KT_TREE_NQ], v[2 * KT_TREE_NV];
    totals t;
    kt_data *data = kt_test_data(model);
    kt_error error = {0};
    kt_model_initial(model, q, v);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &error), &error);
    t.kinetic = kt_kinetic_energy(model, data);
    t.potential = kt_potential_energy(model, data);
    t.mass = kt_mass_center(model, data, &t.center);
    return t;
}

/* Neither counts bodies that are fixed to the world. Bounds: five times the largest of forty seeds. */
KT_TEST(totals_are_those_of_the_bodies_that_the_tree_moves) {
    static kt_tree tree;
    kt_random random = kt_random_of_test();
    KT_WORST kinetic = kt_worst_make("kinetic energy"), potential = kt_worst_make("potential energy");
    KT_WORST mass = kt_worst_make("mass"), center = kt_worst_make("centre of mass");
    double fixed = 0.0;
    for (int n = 0; n < 20; n++) {
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 12;
        plan.from_world = 0.5;
        plan.is_shuffled = true;
        kt_tree_describe(&tree, &plan, &random);
        kt_absolute *formulation = NULL;
        kt_model *model = compile_both(&tree.description, &formulation);
        if (!model)
            return;
        const totals t = totals_of(model), a = totals_of(kt_absolute_model(formulation));
        const double weight = t.mass * kt_vec3_norm(tree.description.gravity);
        kt_worst_near(&kinetic, a.kinetic, t.kinetic, 4e-15 * t.kinetic, "tree %d", n);
        kt_worst_near(&potential, a.potential, t.potential, 2.5e-15 * weight, "tree %d", n);
        kt_worst_near(&mass, a.mass, t.mass, 9.0 * DBL_EPSILON * t.mass, "tree %d", n);
        kt_worst_below(&center, kt_vec3_norm(kt_vec3_sub(a.center, t.center)), 4e-15, "tree %d", n);
        for (int b = 1; b < kt_model_body_count(model); b++)
            fixed += kt_body_mass(model, b);
        fixed -= t.mass;
    }
    kt_check_above("mass that is fixed to the world", fixed, 1.0);
}

/* The caller's loops come first, as they are. A joint whose position is referred to, however often, has one counter.
 * The counter starts from the position given, turns included. The description is not changed. */
KT_TEST(positions_that_are_referred_to_are_counted) {
    static mechanism m, before;
    mechanism_fill(&m);
    m.bodies[CRANK].joint.position[0] = 20.0;
    m.bodies[SLIDER].joint.position[0] = 0.3;
    m.bodies[SCREW].joint.velocity[0] = -2.0;
    before = m;
    kt_absolute *formulation = NULL;
    kt_model *model = compile_both(&m.description, &formulation);
    if (!model)
        return;
    kt_check_true("description", memcmp(&m, &before, sizeof m) == 0);
    const kt_model *absolute = kt_absolute_model(formulation);
    static const struct {
        const char *name, *parent;
        kt_joint_type type;
        double position, velocity;
    } counters[] = {{"crank.position", "world", KT_JOINT_REVOLUTE, 20.0, 0.0},
                    {"rocker.position", "world", KT_JOINT_REVOLUTE, 0.0, 0.0},
                    {"slider.position", "gimbal", KT_JOINT_PRISMATIC, 0.3, 0.0},
                    {"screw.position", "world", KT_JOINT_REVOLUTE, 0.0, -2.0}};
    double q[200], v[200];
    kt_model_initial(absolute, q, v);
    for (size_t i = 0; i < sizeof counters / sizeof counters[0]; i++) {
        const int b = kt_body_find(absolute, counters[i].name);
        kt_need(kt_check_above(counters[i].name, b, BODIES + 1));
        const kt_coordinates at = kt_body_coordinates(absolute, b);
        kt_check_equal_int("type", at.type, counters[i].type);
        kt_check_text("parent", kt_body_name(absolute, kt_body_parent(absolute, b)), counters[i].parent);
        kt_check_near("position", q[at.q], counters[i].position, 0.0);
        kt_check_near("velocity", v[at.v], counters[i].velocity, 0.0);
        kt_check_near("mass", kt_body_mass(absolute, b), 0.0, 0.0);
        const kt_loop_type tie = at.type == KT_JOINT_PRISMATIC ? KT_LOOP_INPLANE : KT_LOOP_ORTHOGONAL;
        kt_check_equal_int("tie", kt_loop_type_of(absolute, find_loop(absolute, counters[i].name, LOOPS)), tie);
    }
    kt_check_equal_int("bodies", kt_model_body_count(absolute), 1 + BODIES + 4);
    for (int i = 0; i < LOOPS; i++) {
        kt_check_text("loop", kt_loop_name(absolute, i), m.loops[i].name);
        kt_check_equal_int("its type", kt_loop_type_of(absolute, i), m.loops[i].type);
    }
    kt_check_equal_int("loops", kt_loop_count(absolute), LOOPS + (BODIES - 1) + 4); /* one body is free */
}

/* Every allocation of a compilation fails once: an error, nothing left behind, no model. */
KT_TEST(compilation_without_memory_leaks_nothing) {
    static mechanism m;
    kt_error error = {0};
    mechanism_fill(&m);
    kt_model *model = kt_test_model(&m.description, NULL);
    int tried = 0, leaks = 0, wrong = 0;
    for (long n = 1;; n++) {
        kt_absolute *formulation = NULL;
        kt_interpose_start_failing(n);
        const kt_status status = kt_absolute_create(&m.description, NULL, model, &formulation, &error);
        const long allocations = kt_interpose_stop();
        if (!kt_interpose_has_failed()) {
            kt_absolute_free(formulation);
            break;
        }
        tried++;
        leaks += kt_interpose_frees() != allocations - 1;
        wrong += status != KT_ERROR_MEMORY || formulation != NULL;
    }
    kt_check_above("allocations", tried, 10);
    kt_check_equal_int("leaks", leaks, 0);
    kt_check_equal_int("wrong answers", wrong, 0);
}
