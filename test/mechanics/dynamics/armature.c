/* Armature, on random trees of every joint type, spatial, planar and mixed. One reference is the same tree without
 * armature, whose equations change by a diagonal. The other is the closed form of a pendulum with a rotor. (MuJoCo's
 * armature: mujoco.c; loops and whole motions: reference/oracle.) */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tree.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON

enum { TREES = 60 };

static kt_tree_plan draw_plan(int n, kt_random *random) {
    kt_tree_plan plan = n % 3 ? kt_tree_plan_default() : kt_tree_plan_planar();
    plan.planar = n % 6 == 0 ? 2 : plan.planar; /* some trees planar, some not */
    plan.bodies = kt_random_int(random, 1, 12);
    plan.with_armature = 0.6;
    return plan;
}

/* The same tree without armature, and the armatures by velocity coordinates. */
static void strip(const kt_tree *tree, kt_tree *bare, double *armature) {
    *bare = *tree;
    bare->model = NULL;
    bare->data = NULL;
    bare->description.bodies = bare->body;
    for (int b = 1; b < tree->count; b++) {
        kt_body *body = &bare->body[kt_body_source(tree->model, b)];
        const kt_coordinates at = kt_body_coordinates(tree->model, b);
        memcpy(armature + at.v, body->joint.armature, (size_t)at.nv * sizeof *armature);
        memset(body->joint.armature, 0, sizeof body->joint.armature);
    }
    kt_tree_compile(bare, NULL);
}

KT_TEST(armature_adds_to_the_diagonal_of_the_mass_matrix_alone) {
    kt_random random = kt_random_of_test();
    static double mass[KT_TREE_NV * KT_TREE_NV], bare_mass[KT_TREE_NV * KT_TREE_NV];
    KT_WORST mass_error = kt_worst_make("M - diag(a) against M without"), force_error = kt_worst_make("tau - a v'");
    KT_WORST energy_error = kt_worst_make("T - sum a v^2 / 2"), momentum_error = kt_worst_make("momentum");
    for (int n = 0; n < TREES; n++) {
        const kt_tree_plan plan = draw_plan(n, &random);
        kt_tree tree, bare;
        kt_tree_state s;
        double armature[KT_TREE_NV] = {0.0}, tau[KT_TREE_NV], bare_tau[KT_TREE_NV];
        kt_tree_grow(&tree, &plan, &random);
        strip(&tree, &bare, armature);
        kt_tree_state_draw(&tree, &random, &s);
        kt_tree_mass(&tree, &s, mass);
        kt_tree_mass(&bare, &s, bare_mass);
        kt_tree_inverse(&tree, &s, tau);
        kt_tree_inverse(&bare, &s, bare_tau);
        kt_tree_kinematics(&tree, &s);
        kt_tree_kinematics(&bare, &s);
        double rotors = 0.0;
        for (int i = 0; i < tree.nv; i++) {
            const double a = armature[i], sum = bare_tau[i] + a * s.a[i];
            rotors += 0.5 * a * s.v[i] * s.v[i];
            kt_worst_near(&force_error, tau[i], sum, EPS * (fabs(sum) + fabs(bare_tau[i])), "tree %d, %d", n, i);
            for (int j = 0; j < tree.nv; j++) {
                const double entry = bare_mass[i * tree.nv + j] + (i == j ? a : 0.0);
                kt_worst_near(&mass_error, mass[i * tree.nv + j], entry, 0.0, "tree %d, %d %d", n, i, j);
            }
        }
        const double energy = kt_kinetic_energy(bare.model, bare.data) + rotors;
        kt_worst_near(&energy_error, kt_kinetic_energy(tree.model, tree.data), energy, 400.0 * EPS * energy, "tree %d",
                      n);
        const kt_wrench one = kt_momentum(tree.model, tree.data), two = kt_momentum(bare.model, bare.data);
        kt_worst_near(&momentum_error, kt_vec3_norm(kt_vec3_sub(one.moment, two.moment)), 0.0, 0.0, "tree %d", n);
        kt_worst_near(&momentum_error, kt_vec3_norm(kt_vec3_sub(one.force, two.force)), 0.0, 0.0, "tree %d", n);
    }
}

/* ABA against RNEA and CRBA: M a + h = tau. */
KT_TEST(articulated_bodies_with_armature_solve_the_equations_of_motion) {
    kt_random random = kt_random_of_test();
    static double mass[KT_TREE_NV * KT_TREE_NV];
    KT_WORST error = kt_worst_make("M a + h - tau");
    for (int n = 0; n < 2 * TREES; n++) {
        const kt_tree_plan plan = draw_plan(n, &random);
        kt_tree tree;
        kt_tree_state s, rest;
        double a[KT_TREE_NV], h[KT_TREE_NV];
        kt_tree_sample(&tree, &plan, &random, &s);
        rest = s;
        memset(rest.a, 0, sizeof rest.a);
        kt_tree_forward(&tree, &s, a);
        kt_tree_inverse(&tree, &rest, h);
        kt_tree_mass(&tree, &s, mass);
        double size = 1.0;
        for (int i = 0; i < tree.nv; i++)
            for (int j = 0; j < tree.nv; j++)
                size = fmax(size, fabs(mass[j * tree.nv + i] * a[j]));
        for (int i = 0; i < tree.nv; i++) {
            double sum = h[i];
            for (int j = 0; j < tree.nv; j++)
                sum += mass[j * tree.nv + i] * a[j];
            kt_worst_near(&error, sum, s.tau[i], 1e3 * EPS * size, "tree %d, %d", n, i);
        }
    }
}

static kt_body pendulum_body(void) {
    kt_body body = kt_body_of("rod", NULL, KT_JOINT_REVOLUTE, 2.0);
    body.joint.position[0] = 0.75;
    body.joint.armature[0] = 0.5;
    body.com = kt_vec3_make(0.0, -1.5, 0.0);
    return body;
}

static kt_description pendulum(kt_body *body) {
    kt_description d = kt_description_default();
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    kt_describe(&d, body, 1, NULL, 0, NULL, 0);
    return d;
}

/* (m l^2 + a) q'' = -m g l sin q; planar and spatial kernels. A massless rod with a rotor is a flywheel: q'' = tau /
 * a. */
KT_TEST(pendulum_with_a_rotor_has_inertia_m_l2_plus_a) {
    for (int k = 0; k < 4; k++) {
        kt_body body = pendulum_body();
        body.mass = k < 2 ? 2.0 : 0.0;
        const kt_description d = pendulum(&body);
        const double q = 0.75, v = 0.3, tau = 0.7, inertia = body.mass * 2.25 + 0.5;
        kt_model_options options = kt_model_options_default();
        options.plan = k % 2 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
        kt_error e;
        double a = (double)NAN;
        kt_model *model = kt_test_model(&d, &options);
        kt_data *data = kt_test_data(model);
        kt_fine("forward", kt_dynamics_forward(model, data, &q, &v, &tau, NULL, &a, &e), &e);
        kt_check_near("q''", a, (tau - body.mass * 9.81 * 1.5 * sin(q)) / inertia, 8.0 * EPS * 6.0);
        kt_fine("kinematics", kt_kinematics_update(model, data, &q, &v, NULL, &e), &e);
        kt_check_near("T", kt_kinetic_energy(model, data), 0.5 * inertia * v * v, 8.0 * EPS);
    }
}

KT_TEST(armature_that_cannot_be_is_rejected) {
    static const double wrong[] = {-1.0, (double)NAN, (double)INFINITY, 1e-60};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        kt_body body = pendulum_body();
        body.joint.armature[0] = wrong[k];
        const kt_description d = pendulum(&body);
        kt_model *model = NULL;
        kt_error e;
        kt_check_equal_int("status", kt_model_compile(&d, NULL, &model, &e), KT_ERROR_MODEL);
        kt_check_true(e.message, strstr(e.message, "armature") != NULL && model == NULL);
    }
    kt_body body = pendulum_body();
    const kt_description d = pendulum(&body);
    kt_absolute *absolute = NULL;
    kt_error e;
    kt_model *model = kt_test_model(&d, NULL);
    kt_check_equal_int("absolute", kt_absolute_create(&d, NULL, model, &absolute, &e), KT_ERROR_UNSUPPORTED);
    kt_check_true(e.message, strstr(e.where, "rod") != NULL);
    kt_check_true("no formulation", absolute == NULL);
}
