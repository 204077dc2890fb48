/* Queries of a model. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A cart with a pendulum; the pendulum is described first. */
static void make(kt_tree *tree) {
    static const kt_marker markers[2] = {{.name = "tip", .at = {0.0, -1.0, 0.0}},
                                         {.name = "heel", .at = {0.0, 0.25, 0.0}}};
    memset(tree, 0, sizeof *tree);
    kt_body *pendulum = &tree->body[0], *cart = &tree->body[1];
    *pendulum = *cart = kt_body_default();
    pendulum->name = "pendulum";
    pendulum->parent = "cart";
    pendulum->joint.type = KT_JOINT_SPHERICAL;
    pendulum->joint.velocity[1] = 0.5;
    pendulum->mass = 2.0;
    pendulum->com = kt_vec3_make(0.0, -0.5, 0.0);
    pendulum->inertia = kt_sym3_make(0.1, 0.01, 0.1, 0.0, 0.0, 0.0);
    pendulum->markers = markers;
    pendulum->marker_count = 2;
    cart->name = "cart";
    cart->parent = "world";
    cart->joint.type = KT_JOINT_PRISMATIC;
    cart->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    cart->joint.position[0] = 0.75;
    cart->joint.velocity[0] = -2.0;
    cart->mass = 5.0;
    tree->description = kt_description_default();
    tree->description.name = "cart and pendulum";
    tree->description.gravity = kt_vec3_make(0.0, -9.81, 0.5);
    kt_describe(&tree->description, tree->body, 2, NULL, 0, NULL, 0);
    kt_tree_compile(tree, NULL);
}

KT_TEST(bodies_are_found_by_name_and_named_by_index) {
    kt_tree tree;
    make(&tree);
    const kt_model *m = tree.model;
    kt_check_equal_int("bodies", kt_model_body_count(m), 3);
    kt_check_text("0", kt_body_name(m, 0), "world");
    kt_check_text("1", kt_body_name(m, 1), "cart");
    kt_check_text("2", kt_body_name(m, 2), "pendulum");
    kt_check_equal_int("world", kt_body_find(m, "world"), 0);
    kt_check_equal_int("cart", kt_body_find(m, "cart"), 1);
    kt_check_equal_int("pendulum", kt_body_find(m, "pendulum"), 2);
    kt_check_equal_int("an unknown name", kt_body_find(m, "Cart"), -1);
    kt_check_equal_int("a marker's name", kt_body_find(m, "tip"), -1);
    kt_check_equal_int("no name", kt_body_find(m, ""), -1);
    kt_check_equal_int("parent of the cart", kt_body_parent(m, 1), 0);
    kt_check_equal_int("parent of the pendulum", kt_body_parent(m, 2), 1);
    kt_check_equal_int("the world is not described", kt_body_source(m, 0), -1);
    kt_check_equal_int("the cart is second", kt_body_source(m, 1), 1);
    kt_check_equal_int("the pendulum is first", kt_body_source(m, 2), 0);
    kt_check_equal_bits("masses", (double[]){kt_body_mass(m, 1), kt_body_mass(m, 2)}, (double[]){5.0, 2.0}, 2);
}

/* Fixed bodies, which have no coordinates, are between them, before them and behind. */
static kt_status find(const kt_model *m, const char *name, int *body, kt_error *error) {
    *error = (kt_error){0};
    *body = -7;
    return kt_joint_find(m, name, body, error);
}

KT_TEST(joints_are_found_by_their_own_names_and_have_limits) {
    kt_tree tree;
    make(&tree);
    kt_tree own = tree;
    own.body[1].joint.name = "rail";
    own.body[0].joint.type = KT_JOINT_REVOLUTE;
    own.body[0].joint.limits = (kt_joint_limits){-0.5, 0.5, 6.0, 7.0};
    own.body[1].joint.limits = (kt_joint_limits){-1.0, 2.0, 3.0, 4.0};
    own.description.bodies = own.body;
    own.model = NULL;
    kt_tree_compile(&own, NULL);
    kt_error error;
    int body;
    kt_check_equal_int("of its body", find(tree.model, "cart", &body, &error), KT_OK);
    kt_check_equal_int("body", body, 1);
    kt_check_equal_int("its own", find(own.model, "rail", &body, &error), KT_OK);
    kt_check_equal_int("body", body, 1);
    kt_check_equal_int("the other has that of its body", find(own.model, "pendulum", &body, &error), KT_OK);
    kt_check_text("name", kt_joint_name(own.model, 1), "rail");
    kt_check_text("name", kt_joint_name(own.model, 2), "pendulum");
    kt_check_true("none", kt_joint_name(own.model, 3) == NULL);
    kt_check_equal_int("no longer that of its body", find(own.model, "cart", &body, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("message", error.message, "that of body 'cart' is named 'rail'");
    kt_check_equal_int("untouched", body, -7);
    kt_check_equal_int("misspelt", find(own.model, "rial", &body, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("message", error.message, "did you mean 'rail'?");
    kt_check_equal_int("the world has none", find(own.model, "world", &body, &error), KT_ERROR_ARGUMENT);
    const kt_joint_limits cart = kt_joint_limits_of(own.model, 1), pendulum = kt_joint_limits_of(own.model, 2),
                          none = kt_joint_limits_of(tree.model, 2);
    kt_check_equal_bits("limits", &cart.lower, (const double[]){-1.0, 2.0, 3.0, 4.0}, 4);
    kt_check_equal_bits("limits", &pendulum.lower, (const double[]){-0.5, 0.5, 6.0, 7.0}, 4);
    kt_check_true("none", none.lower == -(double)INFINITY && none.effort == (double)INFINITY);
}

KT_TEST(velocities_know_their_bodies) {
    kt_random random = kt_random_of_test();
    long coordinates = 0, fixed = 0, wrong = 0;
    for (int n = 0; n < 40; n++) {
        kt_tree tree;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, KT_TREE_BODIES);
        kt_tree_describe(&tree, &plan, &random);
        kt_tree_compile(&tree, NULL);
        for (int b = 0; b < kt_model_body_count(tree.model); b++) {
            const kt_coordinates at = kt_body_coordinates(tree.model, b);
            for (int i = 0; i < at.nv; i++)
                wrong += kt_velocity_body(tree.model, at.v + i) != b;
            coordinates += at.nv;
            fixed += at.nv == 0 && b > 0;
        }
        const int nv = kt_model_nv(tree.model);
        wrong += kt_velocity_body(tree.model, -1) != -1;
        wrong += kt_velocity_body(tree.model, nv) != -1;
    }
    kt_check_equal_int("wrong answers", wrong, 0);
    kt_check_above("coordinates", (double)coordinates, 100.0);
    kt_check_above("fixed bodies", (double)fixed, 20.0);
}

KT_TEST(markers_are_found_on_their_own_body) {
    kt_tree tree;
    make(&tree);
    const kt_model *m = tree.model;
    kt_check_equal_int("on the world", kt_marker_count(m, 0), 0);
    kt_check_equal_int("on the cart", kt_marker_count(m, 1), 0);
    kt_check_equal_int("on the pendulum", kt_marker_count(m, 2), 2);
    kt_check_text("first", kt_marker_name(m, 2, 0), "tip");
    kt_check_text("second", kt_marker_name(m, 2, 1), "heel");
    kt_check_equal_int("tip", kt_marker_find(m, 2, "tip"), 0);
    kt_check_equal_int("heel", kt_marker_find(m, 2, "heel"), 1);
    kt_check_equal_int("the cart has no tip", kt_marker_find(m, 1, "tip"), -1);
    kt_check_equal_int("nor has the pendulum a toe", kt_marker_find(m, 2, "toe"), -1);
    const kt_vec3 at = kt_marker_at(m, 2, 1);
    kt_check_equal_bits("place", &at.x, (double[]){0.0, 0.25, 0.0}, 3);
}

KT_TEST(the_initial_state_is_that_of_the_description) {
    kt_tree tree;
    make(&tree);
    double q[5], v[4];
    kt_check_equal_int("positions", kt_model_nq(tree.model), 5);
    kt_check_equal_int("velocities", kt_model_nv(tree.model), 4);
    kt_model_initial(tree.model, q, v);
    kt_check_equal_bits("q", q, (double[]){0.75, 1.0, 0.0, 0.0, 0.0}, 5); /* zeros mean no rotation */
    kt_check_equal_bits("v", v, (double[]){-2.0, 0.0, 0.5, 0.0}, 4);
    double unit[4];
    kt_random random = kt_random_of_test();
    kt_quat again;
    do { /* one that another scaling would change in its last bits */
        kt_random_direction(&random, 4, unit);
        again = kt_quat_normalize(kt_quat_make(unit[0], unit[1], unit[2], unit[3]));
    } while (again.w == unit[0] && again.x == unit[1]);
    memcpy(tree.body[0].joint.position, unit, sizeof unit);
    kt_tree_compile(&tree, NULL);
    kt_model_initial(tree.model, q, v);
    kt_check_equal_bits("a unit quaternion keeps its bits", q + 1, unit, 4);
    for (int i = 0; i < 4; i++)
        tree.body[0].joint.position[i] = 1.0005 * unit[i];
    kt_tree_compile(&tree, NULL);
    kt_model_initial(tree.model, q, v);
    for (int i = 0; i < 4; i++)
        kt_check_near("one that is almost one is scaled", q[1 + i], unit[i], 1e-15);
}

KT_TEST(name_gravity_and_level_are_kept) {
    kt_tree tree;
    make(&tree);
    const kt_vec3 g = kt_model_gravity(tree.model);
    kt_check_text("name", kt_model_name(tree.model), "cart and pendulum");
    kt_check_equal_bits("gravity", &g.x, (double[]){0.0, -9.81, 0.5}, 3);
    kt_check_true("a level that is one", kt_model_isa(tree.model) != KT_ISA_AUTO);
    tree.description.name = NULL;
    kt_tree_compile(&tree, NULL);
    kt_check_text("no name", kt_model_name(tree.model), "");
}

/* Names of bodies, 1000 of them, with markers of the same names on each: the table keeps them apart. */
KT_TEST(a_thousand_names_are_kept_apart) {
    static kt_body bodies[1000];
    static char names[1000][16];
    static kt_marker markers[2] = {{.name = "b7", .at = {0.0, 0.0, 0.0}}, {.name = "b8", .at = {1.0, 0.0, 0.0}}};
    kt_description d = kt_description_default();
    kt_model *m;
    int wrong = 0;
    for (int i = 0; i < 1000; i++) {
        snprintf(names[i], sizeof names[i], "b%d", i);
        bodies[i] = kt_body_default();
        bodies[i].name = names[i];
        bodies[i].markers = markers;
        bodies[i].marker_count = 2;
    }
    kt_describe(&d, bodies, 1000, NULL, 0, NULL, 0);
    m = kt_test_model(&d, NULL);
    for (int i = 0; i < 1000; i++)
        wrong += kt_body_find(m, names[i]) != i + 1 || kt_marker_find(m, i + 1, "b8") != 1 ||
                 kt_marker_find(m, i + 1, "b9") != -1 || strcmp(kt_body_name(m, i + 1), names[i]) != 0;
    kt_check_equal_int("bodies with wrong names", wrong, 0);
}
