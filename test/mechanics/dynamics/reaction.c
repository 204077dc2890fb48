/* Wrenches across joints. The references are sums over the bodies that each joint carries, the joint forces, and a cut
 * tree. Some trees are far from the world's origin. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 100 };

static const double *components(const kt_vec3 *a) { return &a->x; }

/* Bounds of this file: c measured over 20 seeds, whose worst is about half of the bound. */

static double wrench_scale(const kt_wrench *w, int count) {
    double largest = 0.0;
    for (int b = 0; b < count; b++)
        largest = fmax(largest, fmax(kt_vec3_norm(w[b].moment), kt_vec3_norm(w[b].force)));
    return largest;
}

KT_TEST(reactions_carry_inertia_weight_and_external_wrenches_of_the_subtree) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("wrenches across joints");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 20);
        plan.is_shuffled = n % 2;
        kt_wrench w[KT_TREE_SLOTS];
        kt_oracle_wrench slow[KT_TREE_SLOTS];
        kt_tree_sample(&tree, &plan, &random, &s);
        memset(w, 0xFF, sizeof w);
        kt_oracle_reactions(&tree, &s, slow);
        kt_tree_kinematics(&tree, &s);
        kt_joint_reactions(tree.model, tree.data, s.external, w);
        const double scale = wrench_scale(w, tree.count);
        for (int b = 0; b < tree.count; b++)
            for (int i = 0; i < 3; i++) {
                kt_worst_near(&error, components(&w[b].moment)[i], (double)slow[b].moment[i], 20.0 * EPS * scale,
                              "tree %d joint %d moment", n, b);
                kt_worst_near(&error, components(&w[b].force)[i], (double)slow[b].force[i], 20.0 * EPS * scale,
                              "tree %d joint %d force", n, b);
            }
    }
}

/* Compares the work of a joint's wrench on a unit velocity of each coordinate with the joint forces. The wrench is
 * about the origin of the joint's frame on the parent. The Jacobians are those of the body and of its parent at that
 * point. */
KT_TEST(reactions_along_the_freedoms_are_the_joint_forces) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("S' wrench against tau");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_wrench w[KT_TREE_SLOTS];
        double tau[KT_TREE_NV], own[6 * KT_TREE_NV], up[6 * KT_TREE_NV];
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_inverse(&tree, &s, tau);
        kt_tree_kinematics(&tree, &s);
        kt_joint_reactions(tree.model, tree.data, s.external, w);
        const double scale = wrench_scale(w, tree.count);
        for (int b = 1; b < tree.count; b++) {
            const kt_coordinates c = kt_body_coordinates(tree.model, b);
            const int parent = kt_body_parent(tree.model, b);
            const kt_vec3 at = tree.body[kt_body_source(tree.model, b)].joint.at;
            const kt_vec3 joint = kt_point_position(tree.model, tree.data, parent, at);
            const kt_vec3 local = kt_pose_apply(kt_pose_invert(kt_body_pose(tree.model, tree.data, b)), joint);
            kt_point_jacobian(tree.model, tree.data, b, local, own);
            kt_point_jacobian(tree.model, tree.data, parent, at, up);
            for (int k = 0; k < c.nv; k++) {
                double work = 0.0;
                for (int i = 0; i < 3; i++) {
                    const int j = 6 * (c.v + k) + i;
                    work += (own[j] - up[j]) * components(&w[b].moment)[i];
                    work += (own[j + 3] - up[j + 3]) * components(&w[b].force)[i];
                }
                kt_worst_near(&error, work, tau[c.v + k], 20.0 * EPS * scale, "tree %d joint %d freedom %d", n, b, k);
            }
        }
    }
}

/* The test cuts a fixed joint. The free part moves as before on a free joint if the reaction acts on it. The remaining
 * part moves as before if the opposite reaction acts there. */
KT_TEST(reaction_of_a_fixed_joint_stands_in_for_what_is_cut_off) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("accelerations of the tree that is left");
    int cuts = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, rest;
        kt_tree_state s, t;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.massless = false;
        kt_wrench w[KT_TREE_SLOTS];
        double a[KT_TREE_NV];
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_forward(&tree, &s, s.a);
        kt_tree_kinematics(&tree, &s);
        kt_joint_reactions(tree.model, tree.data, s.external, w);
        /* a leaf that is fixed, so that the rest of the tree keeps its order */
        int leaf = tree.count - 1;
        while (leaf > 0 &&
               (kt_body_coordinates(tree.model, leaf).type != KT_JOINT_FIXED || !kt_oracle_moves(&tree, leaf)))
            leaf--;
        for (int b = leaf + 1; leaf && b < tree.count; b++)
            leaf = kt_body_parent(tree.model, b) == leaf ? 0 : leaf;
        if (leaf == 0)
            continue;
        cuts++;
        memset(&rest, 0, sizeof rest);
        int count = 0;
        for (int i = 0; i < plan.bodies; i++)
            if (i != kt_body_source(tree.model, leaf))
                rest.body[count++] = tree.body[i];
        rest.description = tree.description;
        rest.description.bodies = rest.body;
        rest.description.body_count = count;
        const int parent = kt_body_parent(tree.model, leaf);
        const kt_vec3 origin = kt_body_pose(tree.model, tree.data, parent).position;
        const kt_vec3 at = tree.body[kt_body_source(tree.model, leaf)].joint.at;
        const kt_vec3 arm = kt_vec3_sub(kt_point_position(tree.model, tree.data, parent, at), origin);
        t = s;
        for (int b = leaf; b + 1 < tree.count; b++)
            t.external[b] = s.external[b + 1];
        kt_wrench *on = &t.external[parent]; /* parents come first: the index has not moved */
        on->force = kt_vec3_sub(on->force, w[leaf].force);
        on->moment = kt_vec3_sub(on->moment, kt_vec3_add(w[leaf].moment, kt_vec3_cross(arm, w[leaf].force)));
        kt_tree_compile(&rest, NULL);
        kt_tree_forward(&rest, &t, a);
        long double slow[KT_TREE_NV];
        double sensitivity[KT_TREE_NV];
        (void)kt_oracle_forward(&rest, &t, slow, sensitivity);
        for (int i = 0; i < tree.nv; i++)
            kt_worst_near(&error, a[i], s.a[i], 20.0 * EPS * sensitivity[i], "tree %d coordinate %d", n, i);
    }
    kt_check_above("joints cut", cuts, 10.0);
}

/* A free body with its joint's wrench is in balance. Thus m (a_c - g) = f + f_ext - sum of the forces on its children.
 * The moments about its centre of mass follow the same rule. The test covers every body, with Euler's own equations of
 * finite rotations. */
KT_TEST(every_body_is_in_balance_with_the_joints_around_it) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("inertia - weight - wrenches");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_wrench w[KT_TREE_SLOTS], sum[KT_TREE_SLOTS];
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_kinematics(&tree, &s);
        const kt_model *m = tree.model;
        const kt_data *d = tree.data;
        kt_joint_reactions(m, tree.data, s.external, w);
        memset(sum, 0, sizeof sum);
        for (int b = tree.count - 1; b > 0; b--) { /* about each body's centre of mass */
            const kt_body *body = &tree.body[kt_body_source(m, b)];
            const int up = kt_body_parent(m, b);
            const kt_vec3 c = kt_point_position(m, d, b, body->com);
            const kt_vec3 joint = kt_point_position(m, d, up, body->joint.at);
            const kt_vec3 origin = kt_body_pose(m, d, b).position;
            const kt_vec3 on_self = kt_vec3_add(w[b].moment, kt_vec3_cross(kt_vec3_sub(joint, c), w[b].force));
            const kt_wrench e = s.external[b];
            sum[b].force = kt_vec3_add(sum[b].force, kt_vec3_add(w[b].force, e.force));
            sum[b].moment = kt_vec3_add(sum[b].moment, kt_vec3_add(on_self, e.moment));
            sum[b].moment = kt_vec3_add(sum[b].moment, kt_vec3_cross(kt_vec3_sub(origin, c), e.force));
            if (up == 0)
                continue;
            const kt_vec3 c_up = kt_point_position(m, d, up, tree.body[kt_body_source(m, up)].com);
            const kt_vec3 on_up = kt_vec3_add(w[b].moment, kt_vec3_cross(kt_vec3_sub(joint, c_up), w[b].force));
            sum[up].force = kt_vec3_sub(sum[up].force, w[b].force);
            sum[up].moment = kt_vec3_sub(sum[up].moment, on_up);
        }
        const double scale = wrench_scale(w, tree.count);
        for (int b = 1; b < tree.count; b++) {
            const kt_body *body = &tree.body[kt_body_source(m, b)];
            const kt_mat3 r = kt_body_pose(m, d, b).rotation;
            const kt_vec3 omega = kt_body_twist(m, d, b).angular, alpha = kt_body_acceleration(m, d, b).angular;
            const kt_sym3 inertia = kt_sym3_rotate(r, body->inertia);
            const kt_vec3 spin = kt_vec3_cross(omega, kt_sym3_apply(inertia, omega));
            const kt_vec3 moment = kt_vec3_add(kt_sym3_apply(inertia, alpha), spin);
            const kt_vec3 a = kt_point_acceleration(m, d, b, body->com);
            const kt_vec3 force = kt_vec3_scale(body->mass, kt_vec3_sub(a, tree.description.gravity));
            for (int i = 0; i < 3; i++) {
                kt_worst_near(&error, components(&sum[b].force)[i], components(&force)[i], 10.0 * EPS * scale,
                              "tree %d body %d", n, b);
                kt_worst_near(&error, components(&sum[b].moment)[i], components(&moment)[i], 10.0 * EPS * scale,
                              "tree %d body %d", n, b);
            }
        }
    }
}

/* Joints that slide from the world measure the distance from a place that is rounded. Parts fixed to the world carry
 * these joints. */
static bool is_rounded_far_away(const kt_tree *tree, int body) {
    if (!kt_oracle_moves(tree, body))
        return true;
    switch (kt_body_coordinates(tree->model, body).type) {
    case KT_JOINT_FIXED:
    case KT_JOINT_REVOLUTE:
    case KT_JOINT_UNIVERSAL:
    case KT_JOINT_SPHERICAL:
        return false;
    default:
        return !kt_oracle_moves(tree, kt_body_parent(tree->model, body));
    }
}

static int differ(const void *a, const void *b, size_t bytes) { return memcmp(a, b, bytes) != 0; }

/* How many of all results differ in a bit between a tree and the same tree elsewhere. */
static int compare_dynamics(const kt_tree *tree, const kt_tree *moved, kt_tree_state *s) {
    static double mass[KT_TREE_NV * KT_TREE_NV], mass_far[KT_TREE_NV * KT_TREE_NV];
    const size_t bytes = (size_t)tree->nv * sizeof(double);
    double a[KT_TREE_NV], b[KT_TREE_NV];
    kt_tree_forward(tree, s, a);
    kt_tree_forward(moved, s, b);
    int different = differ(a, b, bytes);
    memcpy(s->a, a, bytes);
    kt_tree_inverse(tree, s, a);
    kt_tree_inverse(moved, s, b);
    different += differ(a, b, bytes);
    kt_tree_mass(tree, s, mass);
    kt_tree_mass(moved, s, mass_far);
    return different + differ(mass, mass_far, (size_t)tree->nv * bytes);
}

/* Moved by 2e6 m as a whole. The recursions see offsets between links alone: all bits are equal. */
KT_TEST(a_mechanism_far_away_has_the_same_dynamics_to_the_bit) {
    kt_random random = kt_random_of_test();
    KT_WORST pose = kt_worst_make("places"), slid = kt_worst_make("reactions of slides from the world");
    const kt_vec3 far = kt_vec3_make(1e6, -2e6, 5e5);
    int different = 0, bits = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, moved;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_wrench w[KT_TREE_SLOTS], v[KT_TREE_SLOTS];
        kt_tree_sample(&tree, &plan, &random, &s);
        memset(&moved, 0, sizeof moved);
        moved.description = tree.description;
        memcpy(moved.body, tree.body, sizeof moved.body);
        moved.description.bodies = moved.body;
        for (int i = 0; i < plan.bodies; i++)
            if (!moved.body[i].parent || strcmp(moved.body[i].parent, "world") == 0)
                moved.body[i].joint.at = kt_vec3_add(moved.body[i].joint.at, far);
        kt_tree_compile(&moved, NULL);
        different += compare_dynamics(&tree, &moved, &s);
        kt_tree_kinematics(&tree, &s);
        kt_tree_kinematics(&moved, &s);
        kt_joint_reactions(tree.model, tree.data, s.external, w);
        kt_joint_reactions(moved.model, moved.data, s.external, v);
        const double scale = wrench_scale(w, tree.count);
        for (int b = 1; b < tree.count; b++) {
            const kt_vec3 p = kt_body_pose(tree.model, tree.data, b).position;
            const kt_vec3 q = kt_vec3_sub(kt_body_pose(moved.model, moved.data, b).position, far);
            for (int i = 0; i < 6 && is_rounded_far_away(&tree, b); i++)
                kt_worst_near(&slid, (&v[b].moment.x)[i], (&w[b].moment.x)[i], 2e6 * EPS * scale, "tree %d %d", n, b);
            for (int i = 0; i < 3; i++)
                kt_worst_near(&pose, components(&q)[i], components(&p)[i], 4.0 * EPS * 2e6, "tree %d body %d", n, b);
            bits += !is_rounded_far_away(&tree, b);
            different += !is_rounded_far_away(&tree, b) && differ(&w[b], &v[b], sizeof w[b]);
        }
    }
    kt_check_above("reactions compared by bits", bits, 5.0 * TREES);
    kt_check_equal_int("results that differ in a bit", different, 0);
}
