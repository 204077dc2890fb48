/* The joints' algebra on positions: rates, steps along the exponential map, differences, norms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/dynamics/tree.h"

#include "joint/joint.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 60 };

/* First coordinate of a joint's quaternion, and of its angular velocity; -1 where it has none. */
static int quaternion_at(kt_coordinates c) { return c.nq > c.nv ? c.q + c.nq - 4 : -1; }
static int spin_at(kt_coordinates c) { return c.v + c.nv - 3; }

static kt_quat quaternion(const double *q) { return kt_quat_make(q[0], q[1], q[2], q[3]); }

static double distance(kt_mat3 a, kt_mat3 b) {
    const double *x = &a.x.x, *y = &b.x.x;
    double largest = 0.0;
    for (int i = 0; i < 9; i++)
        largest = fmax(largest, fabs(x[i] - y[i]));
    return largest;
}

KT_TEST(each_joint_type_has_the_coordinates_of_the_list) {
#define CASE(id, name, nq, nv) {id, #name, nq, nv},
    static const struct {
        kt_joint_type type;
        const char *name;
        int nq, nv;
    } list[] = {KT_JOINT_LIST(CASE)};
#undef CASE
    static const struct { /* as the scene's page counts them */
        const char *name;
        int nq, nv;
    } known[] = {{"fixed", 0, 0},  {"revolute", 1, 1},  {"prismatic", 1, 1}, {"screw", 1, 1}, {"cylindrical", 2, 2},
                 {"planar", 3, 3}, {"universal", 2, 2}, {"spherical", 4, 3}, {"free", 7, 6}};
    kt_check_equal_int("types", KT_JOINT_TYPE_COUNT, 9);
    for (int i = 0; i < KT_JOINT_TYPE_COUNT; i++) {
        kt_random random = kt_random_of_test();
        kt_tree tree;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.types = 1U << i;
        plan.bodies = 2;
        kt_tree_grow(&tree, &plan, &random);
        kt_check_text("name", list[i].name, known[i].name);
        for (int b = 1; b < 3; b++) {
            const kt_coordinates c = kt_body_coordinates(tree.model, b);
            kt_check_equal_int("type", c.type, list[i].type);
            kt_check_equal_int("positions", c.nq, known[i].nq);
            kt_check_equal_int("velocities", c.nv, known[i].nv);
            kt_check_equal_int("first position", c.q, (b - 1) * known[i].nq);
            kt_check_equal_int("first velocity", c.v, (b - 1) * known[i].nv);
        }
        kt_tree_free(&tree);
    }
}

/* A velocity of a motion with these facts is the rate of a length, of an angle, or a component of a rotation. */
static bool measures(kt_motion_facts motion, int k, kt_coordinate_kind kind) {
    if (k < motion.lengths)
        return kind == KT_COORDINATE_LENGTH || kind == KT_COORDINATE_TRANSLATION;
    return k < motion.plain ? kind == KT_COORDINATE_ANGLE || kind == KT_COORDINATE_TURNS
                            : kind == KT_COORDINATE_ROTATION;
}

KT_TEST(coordinates_of_a_joint_type_are_those_of_its_motions) {
    for (int type = 0; type < KT_JOINT_TYPE_COUNT; type++) {
        kt_joint joint = kt_joint_default();
        kt_element element[KT_ELEMENT_MAX];
        int nq = 0, nv = 0, alike = 0;
        joint.type = (kt_joint_type)type;
        const int count = kt_joint_elements(&joint, element);
        for (int i = 0; i < count; i++) {
            const kt_motion_facts motion = kt_motion_facts_of(element[i].motion);
            for (int k = 0; k < motion.velocities; k++)
                alike += measures(motion, k, kt_joint_coordinate_kind(joint.type, nv + k));
            nq += motion.positions;
            nv += motion.velocities;
        }
        kt_note("%s", kt_joint_type_name(joint.type));
        kt_check_equal_int("positions", nq, kt_joint_sizes[type].nq);
        kt_check_equal_int("velocities", nv, kt_joint_sizes[type].nv);
        kt_check_equal_int("velocities that measure what the descriptor says", alike, nv);
    }
}

/* A trial on random trees of all joint types. */
typedef void trial(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n);

static void try_all(const char *what, trial *one) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make(what);
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.is_shuffled = n % 2;
        kt_tree_grow(&tree, &plan, &random);
        kt_tree_state_draw(&tree, &random, &s);
        one(&tree, &random, &s, &error, n);
        kt_tree_free(&tree);
    }
}

/* Second-order differences of q (+) h v: `h^2 / 6 |v|^3 / 8` of the exponential, EPS / h of rounding. */
static void rates(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n) {
    double rate[KT_TREE_NQ], there[KT_TREE_NQ], back[KT_TREE_NQ], step[KT_TREE_NV];
    const double h = 1e-5;
    (void)random;
    kt_position_rate(tree->model, s->q, s->v, rate);
    for (int i = 0; i < tree->nv; i++)
        step[i] = h * s->v[i];
    kt_position_add(tree->model, s->q, step, there);
    for (int i = 0; i < tree->nv; i++)
        step[i] = -step[i];
    kt_position_add(tree->model, s->q, step, back);
    for (int i = 0; i < tree->nq; i++)
        kt_worst_near(error, (there[i] - back[i]) / (2.0 * h), rate[i], 1e-10, "tree %d coordinate %d", n, i);
}

KT_TEST(rates_are_derivatives_of_steps) { try_all("dq/dt", rates); }

/* R(q (+) d) = R(q) exp(d x), and plain numbers add. */
static void steps(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n) {
    double dv[KT_TREE_NV], out[KT_TREE_NQ];
    const double scale = pow(10.0, kt_random_uniform(random, -9.0, 1.5));
    kt_tree_state from = *s;
    for (int i = 0; i < tree->nv; i++)
        dv[i] = scale * s->v[i];
    for (int b = 1; b < tree->count; b++) { /* a quaternion that has lost its norm gets it back */
        const int k = quaternion_at(kt_body_coordinates(tree->model, b));
        for (int i = 0; k >= 0 && i < 4; i++)
            from.q[k + i] *= n % 3 ? 1.0 : 0.7;
    }
    kt_position_add(tree->model, from.q, dv, out);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        const int k = quaternion_at(c);
        for (int i = c.q; i < (k < 0 ? c.q + c.nq : k); i++)
            kt_worst_near(error, out[i], s->q[i] + dv[c.v + i - c.q], 0.0, "tree %d coordinate %d", n, i);
        if (k < 0)
            continue;
        const double *d = dv + spin_at(c);
        const kt_mat3 turned = kt_mat3_from_euler_vector(kt_vec3_make(d[0], d[1], d[2]));
        const kt_mat3 expected = kt_mat3_multiply(kt_mat3_from_quat(quaternion(s->q + k)), turned);
        const kt_quat p = quaternion(out + k);
        kt_worst_below(error, distance(kt_mat3_from_quat(p), expected), 20.0 * EPS, "tree %d rotation %d", n, b);
        kt_worst_near(error, kt_quat_norm_squared(p), 1.0, 4.0 * EPS, "tree %d norm %d", n, b);
    }
}

KT_TEST(steps_go_along_the_exponential_map_of_the_body_frame) { try_all("q (+) d", steps); }

static void differences(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n) {
    double dv[KT_TREE_NV], out[KT_TREE_NQ], back[KT_TREE_NV];
    const double scale = pow(10.0, kt_random_uniform(random, -9.0, 0.2)); /* less than half a turn */
    for (int i = 0; i < tree->nv; i++)
        dv[i] = scale * s->v[i];
    kt_position_add(tree->model, s->q, dv, out);
    for (int b = 1; b < tree->count; b++) { /* the opposite quaternion is the same rotation */
        const int k = quaternion_at(kt_body_coordinates(tree->model, b));
        for (int i = 0; k >= 0 && n % 2 && i < 4; i++)
            out[k + i] = -out[k + i];
    }
    kt_position_subtract(tree->model, out, s->q, back);
    for (int i = 0; i < tree->nv; i++)
        kt_worst_near(error, back[i], dv[i], 10.0 * EPS, "tree %d coordinate %d", n, i);
}

KT_TEST(differences_undo_steps) { try_all("(q (+) d) (-) q", differences); }

/* Beyond half a turn the difference is the way round the other side: |d| <= pi, and it leads to the same place. */
static void shorter(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n) {
    kt_tree_state other;
    double dv[KT_TREE_NV], out[KT_TREE_NQ];
    kt_tree_state_draw(tree, random, &other);
    kt_position_subtract(tree->model, other.q, s->q, dv);
    kt_position_add(tree->model, s->q, dv, out);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        const int k = quaternion_at(c);
        if (k < 0)
            continue;
        const double *d = dv + spin_at(c);
        const double turn = kt_vec3_norm(kt_vec3_make(d[0], d[1], d[2]));
        kt_worst_below(error, fmax(0.0, turn - 3.14159265358979312), 4.0 * EPS, "tree %d way of joint %d", n, b);
        const kt_mat3 r = kt_mat3_from_quat(quaternion(out + k));
        kt_worst_below(error, distance(r, kt_mat3_from_quat(quaternion(other.q + k))), 20.0 * EPS, "tree %d place %d",
                       n, b);
    }
}

KT_TEST(differences_go_the_shorter_way_and_arrive) { try_all("q (+) (p (-) q)", shorter); }

/* Compares numbers that must be equal in every bit. */
static void same(kt_worst *error, const double *x, const double *expected, int count, const char *what, int n) {
    for (int i = 0; i < count; i++)
        kt_worst_near(error, memcmp(&x[i], &expected[i], sizeof *x) == 0 ? 0.0 : 1.0, 0.0, 0.0, "%s: tree %d number %d",
                      what, n, i);
}

/* Every output over every input, against the result in an array of its own. */
static void aliases(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n) {
    kt_tree_state other;
    double expected[KT_TREE_NQ], x[KT_TREE_NQ], y[KT_TREE_NQ];
    kt_tree_state_draw(tree, random, &other);
    kt_position_rate(tree->model, s->q, s->v, expected);
    memcpy(x, s->q, sizeof x);
    kt_position_rate(tree->model, x, s->v, x);
    same(error, x, expected, tree->nq, "rate over q", n);
    memcpy(x, s->v, sizeof s->v);
    kt_position_rate(tree->model, s->q, x, x);
    same(error, x, expected, tree->nq, "rate over v", n);

    kt_position_add(tree->model, s->q, s->v, expected);
    memcpy(x, s->q, sizeof x);
    kt_position_add(tree->model, x, s->v, x);
    same(error, x, expected, tree->nq, "sum over q", n);
    memcpy(x, s->v, sizeof s->v);
    kt_position_add(tree->model, s->q, x, x);
    same(error, x, expected, tree->nq, "sum over dv", n);

    kt_position_subtract(tree->model, other.q, s->q, expected);
    memcpy(x, s->q, sizeof x);
    kt_position_subtract(tree->model, other.q, x, x);
    same(error, x, expected, tree->nv, "difference over q", n);
    memcpy(y, other.q, sizeof y);
    kt_position_subtract(tree->model, y, s->q, y);
    same(error, y, expected, tree->nv, "difference over end", n);
}

KT_TEST(outputs_may_be_written_over_inputs) { try_all("numbers of other bits", aliases); }

/* ---- norms --------------------------------------------------------------------------------------------------- */

/* Scaled by anything that a double can hold; all else keeps its bits. */
static void norms(const kt_tree *tree, kt_random *random, const kt_tree_state *s, kt_worst *error, int n) {
    double q[KT_TREE_NQ];
    memcpy(q, s->q, sizeof q);
    for (int b = 1; b < tree->count; b++) {
        const int k = quaternion_at(kt_body_coordinates(tree->model, b));
        const double scale = pow(10.0, kt_random_uniform(random, -300.0, 300.0));
        for (int i = 0; k >= 0 && i < 4; i++)
            q[k + i] *= scale;
    }
    kt_worst_near(error, kt_position_normalize(tree->model, q), 1.0, 0.0, "tree %d", n);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        for (int i = c.q; i < c.q + c.nq; i++) {
            const int k = quaternion_at(c);
            kt_worst_near(error, q[i], s->q[i], k >= 0 && i >= k ? 4.0 * EPS : 0.0, "tree %d coordinate %d", n, i);
        }
    }
}

KT_TEST(quaternions_of_any_length_come_back_as_unit_ones) { try_all("q", norms); }

KT_TEST(positions_that_have_no_direction_are_left_as_they_are) {
    kt_random random = kt_random_of_test();
    static const double bad[3] = {0.0, (double)NAN, (double)INFINITY};
    for (int n = 0; n < 3; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.types = 1U << KT_JOINT_SPHERICAL | 1U << KT_JOINT_FREE;
        plan.bodies = 4;
        double q[KT_TREE_NQ], before[KT_TREE_NQ];
        kt_tree_grow(&tree, &plan, &random);
        kt_tree_state_draw(&tree, &random, &s);
        for (int i = 0; i < tree.nq; i++)
            q[i] = 3.0 * s.q[i];
        for (int i = 1; i <= 4; i++) /* the last quaternion: the last four numbers */
            q[tree.nq - i] = bad[n];
        memcpy(before, q, sizeof q);
        kt_check_true("is rejected", !kt_position_normalize(tree.model, q));
        kt_check_equal_bits("q", q, before, (size_t)tree.nq);
        kt_tree_free(&tree);
    }
}
