/* One mechanism described in two ways moves in one way. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "rewrite.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 60 };

/* ---- a second description of a tree -------------------------------------------------------------------------- */

typedef struct motion {
    kt_joint_type type;
    kt_vec3 axis;
} motion;

/* The elementary joints that a joint is made of, in their order; 0 where it is one itself. */
static int chain_of(const kt_joint *joint, motion *out) {
    const kt_vec3 n = joint->axis, x = {1.0, 0.0, 0.0}, y = {0.0, 1.0, 0.0}, z = {0.0, 0.0, 1.0};
    const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(n), 2);
    const bool given = joint->axis2.x != 0.0 || joint->axis2.y != 0.0 || joint->axis2.z != 0.0;
    switch (joint->type) {
    case KT_JOINT_UNIVERSAL:
        memcpy(out, (motion[]){{KT_JOINT_REVOLUTE, n}, {KT_JOINT_REVOLUTE, given ? joint->axis2 : triad.x}},
               2 * sizeof *out);
        return 2;
    case KT_JOINT_CYLINDRICAL:
        memcpy(out, (motion[]){{KT_JOINT_REVOLUTE, n}, {KT_JOINT_PRISMATIC, n}}, 2 * sizeof *out);
        return 2;
    case KT_JOINT_PLANAR:
        memcpy(out, (motion[]){{KT_JOINT_PRISMATIC, triad.x}, {KT_JOINT_PRISMATIC, triad.y}, {KT_JOINT_REVOLUTE, n}},
               3 * sizeof *out);
        return 3;
    case KT_JOINT_FREE:
        memcpy(out,
               (motion[]){
                   {KT_JOINT_PRISMATIC, x}, {KT_JOINT_PRISMATIC, y}, {KT_JOINT_PRISMATIC, z}, {KT_JOINT_SPHERICAL, z}},
               4 * sizeof *out);
        return 4;
    default:
        return 0;
    }
}

/* Each composite joint as a chain of massless bodies. Coordinates keep their order. */
static void describe_chains(kt_tree *out, const kt_tree *tree) {
    kt_rewrite_begin(out, tree);
    for (int i = 0; i < tree->description.body_count; i++) {
        const kt_body *body = &tree->body[i];
        motion chain[4];
        const int count = chain_of(&body->joint, chain);
        const char *parent = body->parent;
        for (int k = 0; k + 1 < count; k++) {
            kt_body *h = kt_rewrite_helper(out, parent, chain[k].type, chain[k].axis);
            if (k == 0) {
                h->joint.at = body->joint.at;
                h->joint.rotation = body->joint.rotation;
            }
            parent = h->name;
        }
        kt_body *last = kt_rewrite_copy(out, body);
        if (count == 0)
            continue;
        last->parent = parent;
        last->joint = kt_joint_default();
        last->joint.type = chain[count - 1].type;
        last->joint.axis = chain[count - 1].axis;
    }
}

/* Compares a, tau, M and the frames of bodies of equal name; coordinates are in the same order. */
static void compare(kt_worst *error, const kt_tree *tree, const kt_tree *other, const kt_tree_state *s, int n) {
    static double mass[KT_TREE_NV * KT_TREE_NV], mass2[KT_TREE_NV * KT_TREE_NV];
    double a[KT_TREE_NV], b[KT_TREE_NV], sensitivity[KT_TREE_NV];
    long double slow[KT_TREE_NV], size[KT_TREE_NV];
    kt_tree_state t;
    const int nv = tree->nv;
    kt_rewrite_state(tree, s, other, &t);
    if (!kt_oracle_forward(tree, s, slow, sensitivity))
        return;
    kt_tree_forward(tree, s, a);
    kt_tree_forward(other, &t, b);
    for (int i = 0; i < nv; i++)
        kt_worst_near(error, b[i], a[i], 20.0 * EPS * sensitivity[i], "tree %d acceleration %d", n, i);
    kt_oracle_inverse(tree, s, s->a, slow, size);
    kt_tree_inverse(tree, s, a);
    kt_tree_inverse(other, &t, b);
    for (int i = 0; i < nv; i++)
        kt_worst_near(error, b[i], a[i], 20.0 * EPS * (double)size[i], "tree %d force %d", n, i);
    kt_tree_mass(tree, s, mass);
    kt_tree_mass(other, &t, mass2);
    for (int i = 0; i < nv; i++)
        for (int j = 0; j < nv; j++)
            kt_worst_near(error, mass2[i * nv + j], mass[i * nv + j],
                          100.0 * EPS * sqrt(mass[i * nv + i] * mass[j * nv + j]), "tree %d mass %d %d", n, i, j);
    kt_tree_kinematics(tree, s);
    kt_tree_kinematics(other, &t);
    for (int i = 1; i < tree->count; i++) {
        const int j = kt_body_find(other->model, kt_body_name(tree->model, i));
        for (int k = 0; k < 4; k++) { /* the frame's origin and three points on its axes */
            const kt_vec3 at = kt_vec3_make(k == 1, k == 2, k == 3);
            const kt_vec3 p = kt_point_position(tree->model, tree->data, i, at);
            const kt_vec3 q = kt_point_position(other->model, other->data, j, at);
            kt_worst_below(error, kt_vec3_norm(kt_vec3_sub(p, q)), 40.0 * EPS, "tree %d place of body %d", n, i);
        }
    }
}

/* Bounds: c measured over 20 seeds, whose worst is half of the bound. */
KT_TEST(composite_joints_are_chains_of_turns_and_slides) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("universal, cylindrical, planar, free");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, chains;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 6;
        plan.types = 1U << KT_JOINT_REVOLUTE | 1U << KT_JOINT_UNIVERSAL | 1U << KT_JOINT_CYLINDRICAL |
                     1U << KT_JOINT_PLANAR | 1U << KT_JOINT_FREE;
        kt_tree_sample(&tree, &plan, &random, &s);
        describe_chains(&chains, &tree);
        kt_tree_compile(&chains, NULL);
        if ((chains.nv == tree.nv && chains.nq == tree.nq) || kt_check_true("same freedoms", false))
            compare(&error, &tree, &chains, &s, n);
    }
}

/* An axis n in the joint frame is the axis z of a frame turned by a triad T with T z = n. The body is fixed to this
 * frame and turned back by T'. */
static void describe_turned(kt_tree *out, const kt_tree *tree) {
    kt_rewrite_begin(out, tree);
    for (int i = 0; i < tree->description.body_count; i++) {
        const kt_body *body = &tree->body[i];
        kt_mat3 rest;
        kt_error e;
        if (kt_rotation_evaluate(&body->joint.rotation, &rest, &e) != KT_OK)
            abort();
        const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(body->joint.axis), 2);
        kt_body *h = kt_rewrite_helper(out, body->parent, body->joint.type, kt_vec3_make(0.0, 0.0, 2.0));
        h->joint.pitch = body->joint.pitch;
        h->joint.at = body->joint.at;
        h->joint.rotation = kt_rotation_matrix(kt_mat3_multiply(rest, triad));
        kt_body *last = kt_rewrite_copy(out, body);
        last->parent = h->name;
        last->joint = kt_joint_default();
        last->joint.rotation = kt_rotation_matrix(kt_mat3_transpose(triad));
    }
}

KT_TEST(an_oblique_axis_is_an_upright_one_in_a_turned_frame) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("revolute, prismatic, screw, cylindrical, planar");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, turned;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 9;
        plan.types = 1U << KT_JOINT_REVOLUTE | 1U << KT_JOINT_PRISMATIC | 1U << KT_JOINT_SCREW |
                     1U << KT_JOINT_CYLINDRICAL | 1U << KT_JOINT_PLANAR;
        kt_tree_sample(&tree, &plan, &random, &s);
        describe_turned(&turned, &tree);
        kt_tree_compile(&turned, NULL);
        compare(&error, &tree, &turned, &s, n);
    }
}

/* Each body as two that are fixed to each other, the second turned and shifted. */
static void describe_split(kt_tree *out, kt_tree *tree, kt_random *random) {
    kt_rewrite_begin(out, tree);
    for (int i = 0; i < tree->description.body_count; i++) {
        kt_body *body = &tree->body[i];
        kt_mat3 r;
        kt_error e;
        kt_rewrite_copy(out, body);
        kt_body *part = kt_rewrite_helper(out, body->name, KT_JOINT_FIXED, kt_vec3_make(0.0, 0.0, 1.0));
        part->joint.at = kt_tree_vector(random, -1.0, 1.0);
        part->joint.rotation = kt_tree_rotation(random);
        part->mass = kt_random_uniform(random, 0.1, 1.0);
        part->com = kt_tree_vector(random, -0.5, 0.5);
        part->inertia = kt_tree_inertia(random, part->mass, 1.0);
        if (kt_rotation_evaluate(&part->joint.rotation, &r, &e) != KT_OK)
            abort();
        /* the whole: m c = sum m_i c_i, I = sum I_i + m_i (d_i'd_i 1 - d_i d_i') with d_i = c_i - c */
        const kt_vec3 at = kt_vec3_add(part->joint.at, kt_mat3_apply(r, part->com));
        const double mass = body->mass + part->mass;
        const kt_vec3 first = kt_vec3_scale(body->mass, body->com), second = kt_vec3_scale(part->mass, at);
        const kt_vec3 c = kt_vec3_scale(1.0 / mass, kt_vec3_add(first, second));
        const kt_sym3 own = kt_sym3_shift(body->inertia, body->mass, kt_vec3_sub(body->com, c));
        const kt_sym3 other = kt_sym3_shift(kt_sym3_rotate(r, part->inertia), part->mass, kt_vec3_sub(at, c));
        body->inertia = kt_sym3_add(own, other);
        body->mass = mass;
        body->com = c;
    }
}

KT_TEST(bodies_fixed_to_each_other_are_one_body) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("bodies in two parts");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, split;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = 9;
        plan.massless = false;
        kt_tree_describe(&tree, &plan, &random);
        describe_split(&split, &tree, &random);
        kt_tree_compile(&tree, NULL);
        kt_tree_state_draw(&tree, &random, &s);
        kt_tree_compile(&split, NULL);
        compare(&error, &tree, &split, &s, n);
    }
}

/* ---- order --------------------------------------------------------------------------------------------------- */

KT_TEST(order_of_description_changes_nothing_but_rounding) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("accelerations by name");
    int moved = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, other;
        kt_tree_state s, t;
        kt_tree_plan plan = kt_tree_plan_default();
        double a[KT_TREE_NV], b[KT_TREE_NV], sensitivity[KT_TREE_NV];
        long double slow[KT_TREE_NV];
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_rewrite_begin(&other, &tree);
        for (int i = plan.bodies - 1; i >= 0; i--)
            kt_rewrite_copy(&other, &tree.body[i]);
        kt_tree_compile(&other, NULL);
        kt_rewrite_state(&tree, &s, &other, &t);
        for (int i = 1; i < tree.count; i++) {
            const int j = kt_body_find(other.model, kt_body_name(tree.model, i));
            const kt_coordinates c = kt_body_coordinates(tree.model, i), d = kt_body_coordinates(other.model, j);
            moved += c.v != d.v;
            memcpy(t.q + d.q, s.q + c.q, (size_t)c.nq * sizeof(double));
            memcpy(t.v + d.v, s.v + c.v, (size_t)c.nv * sizeof(double));
            memcpy(t.tau + d.v, s.tau + c.v, (size_t)c.nv * sizeof(double));
        }
        kt_tree_forward(&tree, &s, a);
        kt_tree_forward(&other, &t, b);
        if (kt_oracle_forward(&tree, &s, slow, sensitivity))
            for (int i = 1; i < tree.count; i++) {
                const int j = kt_body_find(other.model, kt_body_name(tree.model, i));
                const kt_coordinates c = kt_body_coordinates(tree.model, i), d = kt_body_coordinates(other.model, j);
                for (int k = 0; k < c.nv; k++)
                    kt_worst_near(&error, b[d.v + k], a[c.v + k], EPS * sensitivity[c.v + k], "tree %d body %d", n, i);
            }
    }
    kt_check_above("bodies whose coordinates moved", moved, TREES);
}
