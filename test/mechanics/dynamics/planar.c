/* Trees that move in planes: the planar kernels against the slow equations of oracle.c and against the spatial kernels.
 * Masses and forces may lie out of the plane. The tests also check which trees count as planar. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 150 };

/* Bounds as those of the spatial kernels (aba.c, rnea.c, crba.c, kinematics.c, reaction.c). */

/* Planar trees alone, or every second one. */
static kt_tree_plan draw_plan(kt_random *random, bool is_mixed) {
    kt_tree_plan plan = kt_tree_plan_planar();
    plan.bodies = kt_random_int(random, is_mixed ? 10 : 1, 16);
    if (is_mixed) {
        plan.planar = 2;
        plan.from_world = 0.4;
    }
    return plan;
}

/* ---- against the slow equations ------------------------------------------------------------------------------ */

static void compare_dynamics(const kt_tree *tree, kt_tree_state *s, int n, kt_worst worst[3]) {
    static double mass[KT_TREE_NV * KT_TREE_NV];
    static long double entry[KT_TREE_NV * KT_TREE_NV];
    double a[KT_TREE_NV], tau[KT_TREE_NV], sensitivity[KT_TREE_NV];
    long double slow[KT_TREE_NV], size[KT_TREE_NV];
    const int nv = tree->nv;
    kt_tree_forward(tree, s, a);
    if (kt_oracle_forward(tree, s, slow, sensitivity))
        for (int i = 0; i < nv; i++)
            kt_worst_near(&worst[0], a[i], (double)slow[i], 20.0 * EPS * sensitivity[i], "tree %d coordinate %d", n, i);
    kt_oracle_inverse(tree, s, s->a, slow, size);
    kt_tree_inverse(tree, s, tau);
    for (int i = 0; i < nv; i++)
        kt_worst_near(&worst[1], tau[i], (double)slow[i], 20.0 * EPS * (double)size[i], "tree %d coordinate %d", n, i);
    kt_oracle_mass(tree, s->q, entry);
    kt_tree_mass(tree, s, mass);
    for (int i = 0; i < nv * nv; i++) {
        const double scale = (double)sqrtl(entry[i / nv * (nv + 1)] * entry[i % nv * (nv + 1)]);
        kt_worst_near(&worst[2], mass[i], (double)entry[i], 100.0 * EPS * scale, "tree %d entry %d", n, i);
    }
}

/* Planar trees are all found, but for those of fixed joints alone; a world with one tree is not mixed. */
static void check_dynamics(bool is_mixed) {
    kt_random random = kt_random_of_test();
    kt_worst worst[3] = {kt_worst_make("accelerations"), kt_worst_make("forces"), kt_worst_make("mass matrices")};
    int planar = 0, mixed = 0, moving = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = draw_plan(&random, is_mixed);
        kt_tree_sample(&tree, &plan, &random, &s);
        compare_dynamics(&tree, &s, n, worst);
        moving += tree.nv > 0;
        planar += strcmp(kt_model_plan(tree.model), "planar") == 0;
        mixed += strcmp(kt_model_plan(tree.model), "mixed") == 0;
    }
    kt_check_above("worlds that move", moving, 0.9 * TREES);
    if (is_mixed)
        kt_check_above("mixed worlds", mixed, 0.5 * TREES);
    else
        kt_check_equal_int("planar worlds", planar, moving);
    for (int k = 0; k < 3; k++)
        kt_check_worst(&worst[k]);
}

KT_TEST(planar_recursions_solve_the_slow_equations_on_random_trees) { check_dynamics(false); }

KT_TEST(mixed_recursions_solve_the_slow_equations_on_random_trees) { check_dynamics(true); }

/* ---- against the spatial kernels ----------------------------------------------------------------------------- */

/* All queries after the kinematics, as numbers. */
enum { NUMBERS = KT_TREE_SLOTS * (12 + 6 + 6 + 6) + 6 * KT_TREE_NV + 12 };

static void put(double *x, int *n, const void *from, size_t bytes) {
    memcpy(x + *n, from, bytes);
    *n += (int)(bytes / sizeof *x);
}

static int ask_all(const kt_tree *tree, const kt_tree_state *s, double *x) {
    static double jacobian[6 * KT_TREE_NV];
    kt_wrench wrench[KT_TREE_SLOTS];
    int n = 0;
    kt_tree_kinematics(tree, s);
    kt_joint_reactions(tree->model, tree->data, s->external, wrench);
    for (int b = 0; b < tree->count; b++) {
        const kt_pose pose = kt_body_pose(tree->model, tree->data, b);
        const kt_twist twist = kt_body_twist(tree->model, tree->data, b);
        const kt_twist change = kt_body_acceleration(tree->model, tree->data, b);
        put(x, &n, &pose, sizeof pose);
        put(x, &n, &twist, sizeof twist);
        put(x, &n, &change, sizeof change);
        put(x, &n, &wrench[b], sizeof wrench[b]);
    }
    kt_point_jacobian(tree->model, tree->data, tree->count - 1, kt_vec3_make(0.1, 0.2, 0.3), jacobian);
    put(x, &n, jacobian, (size_t)(6 * tree->nv) * sizeof *jacobian);
    const double energy[2] = {kt_kinetic_energy(tree->model, tree->data), kt_potential_energy(tree->model, tree->data)};
    const kt_wrench momentum = kt_momentum(tree->model, tree->data);
    kt_vec3 center;
    kt_mass_center(tree->model, tree->data, &center);
    put(x, &n, energy, sizeof energy);
    put(x, &n, &momentum, sizeof momentum);
    put(x, &n, &center, sizeof center);
    return n;
}

/* The two differ by rounding of rotations and sums along paths of up to 16 bodies. The largest number of a tree, a
 * moment or a momentum, is a sum over its bodies. The factor c is measured over 20 seeds, whose worst is half of the
 * bound. */
static void check_queries(bool is_mixed) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("all queries");
    static double flat[NUMBERS], space[NUMBERS];
    int different = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, spatial;
        kt_tree_state s;
        const kt_tree_plan plan = draw_plan(&random, is_mixed);
        kt_tree_grow(&tree, &plan, &random);
        memset(&spatial, 0, sizeof spatial);
        spatial.description = tree.description;
        kt_tree_compile(&spatial, &(kt_model_options){.plan = KT_PLAN_SPATIAL});
        kt_tree_state_draw(&tree, &random, &s);
        const int count = ask_all(&tree, &s, flat);
        const bool fine = count > 0 && count == ask_all(&spatial, &s, space);
        different += !fine || strcmp(kt_model_plan(spatial.model), "spatial") != 0;
        const double scale = fmax(1.0, kt_tree_largest(space, count));
        for (int i = 0; i < count; i++)
            kt_worst_near(&error, flat[i], space[i], 10.0 * EPS * scale, "tree %d number %d", n, i);
    }
    kt_check_equal_int("trees that could not be compared", different, 0);
}

KT_TEST(queries_after_planar_kinematics_are_those_of_space) { check_queries(false); }

KT_TEST(queries_after_mixed_kinematics_are_those_of_space) { check_queries(true); }

/* ---- a long chain -------------------------------------------------------------------------------------------- */

enum { LONG = 1000 };

typedef char text[16];

/* Rods of 1 m about one axis, almost straight and swinging. If `turned`, every link has a frame turned about the axis.
 * The argument `frame` has the world axes of a mechanism that turns about z and lies along x, with gravity along -y. */
static void accelerate_chain(kt_mat3 frame, bool turned, kt_plan plan, const char *expected, double *a) {
    static kt_body body[LONG];
    static text name[LONG];
    static double q[LONG], v[LONG];
    kt_description d = kt_description_default();
    kt_error e = {0};
    for (int i = 0; i < LONG; i++) {
        snprintf(name[i], sizeof name[i], "link%d", i);
        body[i] = kt_body_of(name[i], i ? name[i - 1] : NULL, KT_JOINT_REVOLUTE, 1.0);
        body[i].joint.axis = frame.z;
        body[i].joint.at = kt_vec3_scale(i ? 1.0 : 0.0, frame.x);
        body[i].com = kt_vec3_scale(0.5, frame.x);
        body[i].inertia = kt_sym3_rotate(frame, kt_sym3_make(1e-3, 0.08, 0.08, 0.0, 0.0, 0.0));
        if (turned)
            body[i].joint.rotation = kt_rotation_axis_angle(frame.z, i % 2 ? 0.25 : -0.25);
        q[i] = 1e-4 * sin(0.05 * i) - (turned ? (i % 2 ? 0.25 : -0.25) : 0.0);
        v[i] = 1e-3 * cos(0.11 * i);
    }
    kt_describe(&d, body, LONG, NULL, 0, NULL, 0);
    d.gravity = kt_vec3_scale(-9.81, frame.y);
    kt_model *model = kt_test_model(&d, &(kt_model_options){.plan = plan});
    kt_check_text("plan", kt_model_plan(model), expected);
    kt_data *data = kt_test_data(model);
    kt_need_fine("accelerates", kt_dynamics_forward(model, data, q, v, NULL, NULL, a, &e), &e);
}

static double difference(const double *a, const double *b) {
    double worst = 0.0;
    for (int i = 0; i < LONG; i++)
        worst = fmax(worst, fabs(a[i] - b[i]));
    return worst / kt_tree_largest(b, LONG);
}

/* Out of the plane, the chain has 1e9 times its inertia in the plane. An axis that is off by eps brings 1e9 eps of it
 * into the plane. The spatial kernels lose this accuracy. Measured: 3e-14 in the plane. */
KT_TEST(a_long_oblique_chain_in_its_plane_loses_no_digits) {
    static double upright[LONG], flat[LONG], oblique[LONG], space[LONG], turned[LONG];
    const kt_mat3 aligned = kt_mat3_identity();
    const kt_mat3 askew = kt_mat3_from_quat(kt_quat_normalize(kt_quat_make(0.5, 0.3, -0.4, 0.6)));
    accelerate_chain(aligned, false, KT_PLAN_SPATIAL, "spatial", upright);
    accelerate_chain(aligned, false, KT_PLAN_AUTO, "planar", flat);
    accelerate_chain(askew, false, KT_PLAN_AUTO, "planar", oblique);
    accelerate_chain(askew, true, KT_PLAN_AUTO, "planar", turned);
    accelerate_chain(askew, false, KT_PLAN_SPATIAL, "spatial", space);
    kt_note("the spatial kernels on the oblique chain are off by %.1e", difference(space, upright));
    kt_check_below("planar against spatial, axes along z", difference(flat, upright), 2e-13);
    kt_check_below("oblique", difference(oblique, upright), 2e-13);
    kt_check_below("oblique, frames turned", difference(turned, upright), 2e-13);
}
