/* Mechanisms whose dynamics others have published (published.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "published.h"
#include "tree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static kt_body *add(kt_tree *tree, const char *name, const char *parent, kt_vec3 axis, kt_vec3 at) {
    kt_body *body = &tree->body[tree->description.body_count++];
    *body = kt_body_of(name, parent, KT_JOINT_REVOLUTE, 0.0);
    body->joint.axis = axis;
    body->joint.at = at;
    return body;
}

static void begin(kt_tree *tree, kt_vec3 gravity) {
    memset(tree, 0, sizeof *tree);
    tree->description = kt_description_default();
    tree->description.bodies = tree->body;
    tree->description.gravity = gravity;
}

static const kt_vec3 ex = {1.0, 0.0, 0.0}, ey = {0.0, 1.0, 0.0}, ez = {0.0, 0.0, 1.0}, zero = {0.0, 0.0, 0.0};

/* ---- autoTree ------------------------------------------------------------------------------------------------ */

/* Body i (from 0) hangs at the end of body `i - 1`, turned by 1 rad about x. Lengths are `0.95^i` and masses
 * `0.95^(3i)`. */
static void grow_auto_tree(kt_tree *tree) {
    begin(tree, kt_vec3_make(0.0, 0.0, -9.81));
    double length = 1.0, mass = 1.0;
    for (int i = 0; i < 10; i++) {
        snprintf(tree->name[i], sizeof tree->name[i], "b%d", i);
        kt_body *body = add(tree, tree->name[i], i ? tree->name[i - 1] : NULL, ez, zero);
        if (i > 0) {
            body->joint.at = kt_vec3_make(length, 0.0, 0.0);
            body->joint.rotation = kt_rotation_axis_angle(ex, 1.0);
            length *= 0.95;
            mass *= 0.95 * 0.95 * 0.95;
        }
        const double across = mass * length * length * 1.015 / 12.0;
        body->mass = mass;
        body->com = kt_vec3_make(0.5 * length, 0.0, 0.0);
        body->inertia = kt_sym3_make(mass * length * length * 0.0025, across, across, 0.0, 0.0, 0.0);
    }
    kt_tree_compile(tree, NULL);
}

static void auto_tree_state(kt_tree_state *s) {
    memset(s, 0, sizeof *s);
    for (int i = 1; i <= 10; i++) {
        s->q[i - 1] = sin(i);
        s->v[i - 1] = cos(2.0 * i);
        s->a[i - 1] = sin(3.0 * i);
        s->tau[i - 1] = cos(3.0 * i);
    }
}

/* The numbers are printed to 16 or 17 digits. Forces of up to 30 N m are sums of about a hundred terms. */
KT_TEST(auto_tree_has_its_published_forces_and_accelerations) {
    kt_tree tree;
    kt_tree_state s;
    kt_error e;
    double x[10];
    KT_WORST force = kt_worst_make("tau"), bias = kt_worst_make("h"), gravity = kt_worst_make("gravity");
    KT_WORST acceleration = kt_worst_make("a");
    grow_auto_tree(&tree);
    auto_tree_state(&s);
    const kt_model *m = tree.model;
    kt_check_equal_int("tau", kt_dynamics_inverse(m, tree.data, s.q, s.v, s.a, NULL, x, &e), KT_OK);
    for (int i = 0; i < 10; i++)
        kt_worst_near(&force, x[i], auto_tree_force[i], 5e-14, "joint %d", i);
    kt_check_equal_int("h", kt_dynamics_inverse(m, tree.data, s.q, s.v, NULL, NULL, x, &e), KT_OK);
    for (int i = 0; i < 10; i++)
        kt_worst_near(&bias, x[i], auto_tree_bias[i], 5e-14, "joint %d", i);
    kt_check_equal_int("g", kt_dynamics_inverse(m, tree.data, s.q, NULL, NULL, NULL, x, &e), KT_OK);
    for (int i = 0; i < 10; i++)
        kt_worst_near(&gravity, x[i], auto_tree_gravity[i], 5e-14, "joint %d", i);
    kt_check_equal_int("a", kt_dynamics_forward(m, tree.data, s.q, s.v, s.tau, NULL, x, &e), KT_OK);
    for (int i = 0; i < 10; i++) /* up to 200 rad/s^2 */
        kt_worst_near(&acceleration, x[i], auto_tree_acceleration[i], 2e-12, "joint %d", i);
}

KT_TEST(auto_tree_has_its_published_mass_matrix_and_energy) {
    kt_tree tree;
    kt_tree_state s;
    double mass[100];
    KT_WORST error = kt_worst_make("M");
    grow_auto_tree(&tree);
    auto_tree_state(&s);
    kt_tree_mass(&tree, &s, mass);
    kt_tree_kinematics(&tree, &s);
    for (int i = 0; i < 100; i++)
        kt_worst_near(&error, mass[i], auto_tree_mass[i], 5e-14, "entry %d %d", i / 10, i % 10);
    kt_check_near("T + V", kt_kinetic_energy(tree.model, tree.data) + kt_potential_energy(tree.model, tree.data),
                  auto_tree_energy, 1e-13);
}

/* ---- RBDL ---------------------------------------------------------------------------------------------------- */

/* All bodies have mass 1 and inertia 1 about their centre. The first joint has the angle q, all others zero, at
 * rest. */
static void check_rbdl(kt_tree *tree, double q, const double *expected, int count, double bound) {
    double angles[5] = {q}, a[5];
    kt_error e = {0};
    kt_tree_compile(tree, NULL);
    const kt_status status = kt_dynamics_forward(tree->model, tree->data, angles, NULL, NULL, NULL, a, &e);
    kt_need_fine("forward", status, &e);
    for (int i = 0; i < count; i++)
        kt_check_near("acceleration", a[i], expected[i], bound);
}

static void load(kt_body *body, kt_vec3 com) {
    body->mass = 1.0;
    body->com = com;
    body->inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
}

KT_TEST(chains_fall_as_rbdl_published) {
    kt_tree tree;
    begin(&tree, kt_vec3_make(0.0, -9.81, 0.0));
    load(add(&tree, "a", NULL, ez, zero), ex);
    load(add(&tree, "b", "a", ez, ex), ex);
    check_rbdl(&tree, 0.0, rbdl_double_chain_z, 2, 1e-14);
    load(add(&tree, "c", "b", ez, ex), ex);
    check_rbdl(&tree, 0.0, rbdl_triple_chain_z, 3, 1e-14); /* printed to 14 decimals */
    begin(&tree, kt_vec3_make(0.0, -9.81, 0.0));
    load(add(&tree, "a", NULL, ez, zero), ex);
    load(add(&tree, "b", "a", ey, ex), ey);
    check_rbdl(&tree, 0.0, rbdl_double_3d, 2, 1e-14);
}

KT_TEST(a_branched_tree_falls_as_rbdl_published) {
    kt_tree tree;
    begin(&tree, kt_vec3_make(0.0, -9.81, 0.0));
    load(add(&tree, "b1", NULL, ez, zero), ex);
    load(add(&tree, "b2", "b1", ey, ex), ey);
    load(add(&tree, "b3", "b2", ex, ey), ez);
    load(add(&tree, "b4", "b1", ey, kt_vec3_make(-0.5, 0.0, 0.0)), ey);
    load(add(&tree, "b5", "b4", ex, kt_vec3_make(0.0, -0.5, 0.0)), ez);
    check_rbdl(&tree, 0.0, rbdl_tree_3d, 5, 2e-14);
}

KT_TEST(a_body_on_massless_turns_falls_as_rbdl_published) {
    kt_tree tree;
    begin(&tree, kt_vec3_make(0.0, -9.81, 0.0));
    (void)add(&tree, "z", NULL, ez, zero);
    (void)add(&tree, "y", "z", ey, zero);
    load(add(&tree, "x", "y", ex, zero), kt_vec3_make(0.0, 0.5, 0.0));
    check_rbdl(&tree, 1.0, rbdl_three_dof_zyx, 3, 1e-14);
}

/* ---- Pinocchio ----------------------------------------------------------------------------------------------- */

KT_TEST(a_body_on_turns_about_z_y_x_has_pinocchios_forces_and_mass) {
    kt_tree tree;
    begin(&tree, kt_vec3_make(0.0, 0.0, -9.81));
    (void)add(&tree, "z", NULL, ez, zero);
    (void)add(&tree, "y", "z", ey, zero);
    load(add(&tree, "x", "y", ex, zero), kt_vec3_make(0.5, 0.0, 0.0));
    kt_tree_compile(&tree, NULL);
    KT_WORST force = kt_worst_make("tau"), matrix = kt_worst_make("M");
    for (int n = 0; n < 3; n++) {
        const pinocchio_case *c = &pinocchio[n];
        kt_tree_state s;
        double tau[3], mass[9];
        memset(&s, 0, sizeof s);
        for (int i = 0; i < 3; i++) {
            s.q[i] = c->angle[i];
            s.v[i] = s.a[i] = c->rate;
        }
        kt_tree_inverse(&tree, &s, tau);
        kt_tree_mass(&tree, &s, mass);
        for (int i = 0; i < 3; i++) /* printed to 13 or 14 decimals */
            kt_worst_near(&force, tau[i], c->force[i], 6e-14, "case %d joint %d", n, i);
        for (int i = 0; i < 9; i++)
            kt_worst_near(&matrix, mass[i], c->mass[i], 6e-14, "case %d entry %d", n, i);
    }
}
