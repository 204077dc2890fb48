/* One mechanism in two sets of coordinates moves in one way: screws as slides that follow turns, balls as three turns.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "rewrite.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 60 };

static const double *components(const kt_vec3 *a) { return &a->x; }

/* Bounds of this file: c measured over 20 seeds, whose worst is about half of the bound. */

/* ---- screws --------------------------------------------------------------------------------------------------------
 *
 * A screw is a cylindrical joint with s = pitch angle: with v_c = T v, M = T' M_c T and tau = T' tau_c. */

typedef struct screws {
    kt_tree tree, loose;                /* with screws; with cylindrical joints in their place */
    kt_tree_state s, t;                 /* the same motion */
    double map[KT_TREE_NV][KT_TREE_NV]; /* T */
} screws;

static void screws_make(screws *x, kt_random *random) {
    kt_tree_plan plan = kt_tree_plan_default();
    plan.types = 1U << KT_JOINT_SCREW | 1U << KT_JOINT_SPHERICAL | 1U << KT_JOINT_REVOLUTE;
    plan.bodies = 8;
    plan.massless = false;
    memset(x, 0, sizeof *x);
    kt_tree_sample(&x->tree, &plan, random, &x->s);
    kt_rewrite_begin(&x->loose, &x->tree);
    for (int i = 0; i < plan.bodies; i++) {
        kt_body *body = kt_rewrite_copy(&x->loose, &x->tree.body[i]);
        if (body->joint.type == KT_JOINT_SCREW)
            body->joint.type = KT_JOINT_CYLINDRICAL;
    }
    kt_tree_compile(&x->loose, NULL);
}

static void screws_map(screws *x) {
    for (int b = 1; b < x->tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(x->tree.model, b), d = kt_body_coordinates(x->loose.model, b);
        const double pitch = x->tree.body[kt_body_source(x->tree.model, b)].joint.pitch;
        x->t.external[b] = x->s.external[b];
        for (int k = 0; k < c.nq; k++)
            x->t.q[d.q + k] = x->s.q[c.q + k];
        for (int k = 0; k < c.nv; k++)
            x->map[d.v + k][c.v + k] = 1.0;
        if (c.type == KT_JOINT_SCREW) {
            x->t.q[d.q + 1] = pitch * x->s.q[c.q];
            x->map[d.v + 1][c.v] = pitch;
        }
    }
    for (int i = 0; i < x->loose.nv; i++)
        for (int j = 0; j < x->tree.nv; j++) {
            x->t.v[i] += x->map[i][j] * x->s.v[j];
            x->t.a[i] += x->map[i][j] * x->s.a[j];
        }
}

KT_TEST(forces_of_a_screw_are_those_of_a_slide_that_follows_a_turn) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("tau against T' tau_c"), place = kt_worst_make("places");
    static screws x;
    for (int n = 0; n < TREES; n++) {
        screws_make(&x, &random);
        double tau[KT_TREE_NV], loose[KT_TREE_NV];
        long double slow[KT_TREE_NV], size[KT_TREE_NV];
        screws_map(&x);
        kt_oracle_inverse(&x.tree, &x.s, x.s.a, slow, size);
        kt_tree_inverse(&x.tree, &x.s, tau);
        kt_tree_inverse(&x.loose, &x.t, loose);
        kt_tree_kinematics(&x.tree, &x.s);
        kt_tree_kinematics(&x.loose, &x.t);
        for (int i = 0; i < x.tree.nv; i++) {
            double force = 0.0;
            for (int k = 0; k < x.loose.nv; k++)
                force += x.map[k][i] * loose[k];
            kt_worst_near(&error, force, tau[i], 5.0 * EPS * (double)size[i], "tree %d %d", n, i);
        }
        for (int b = 1; b < x.tree.count; b++) {
            const kt_vec3 p = kt_body_pose(x.tree.model, x.tree.data, b).position;
            const kt_vec3 q = kt_body_pose(x.loose.model, x.loose.data, b).position;
            kt_worst_below(&place, kt_vec3_norm(kt_vec3_sub(p, q)), 20.0 * EPS, "tree %d body %d", n, b);
        }
    }
}

KT_TEST(mass_of_a_screw_is_that_of_a_slide_that_follows_a_turn) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("M against T' M_c T");
    static double mass[KT_TREE_NV * KT_TREE_NV], loose[KT_TREE_NV * KT_TREE_NV];
    static screws x;
    for (int n = 0; n < TREES; n++) {
        screws_make(&x, &random);
        screws_map(&x);
        kt_tree_mass(&x.tree, &x.s, mass);
        kt_tree_mass(&x.loose, &x.t, loose);
        const int nv = x.tree.nv, nc = x.loose.nv;
        for (int i = 0; i < nv; i++)
            for (int j = 0; j < nv; j++) {
                double sum = 0.0;
                for (int k = 0; k < nc; k++)
                    for (int l = 0; l < nc; l++)
                        sum += x.map[k][i] * loose[k * nc + l] * x.map[l][j];
                const double scale = sqrt(mass[i * nv + i] * mass[j * nv + j]);
                kt_worst_near(&error, sum, mass[i * nv + j], 40.0 * EPS * scale, "tree %d %d %d", n, i, j);
            }
    }
}

/* ---- balls ---------------------------------------------------------------------------------------------------------
 *
 * As turns about z, y, x, with helpers between them. With G the relative angular velocity, body axes, of unit rates:
 * w = G rates, tau_turns = G' tau; and w' follows from  alpha = alpha_p + w_p x (w - w_p) + R w'. */

typedef struct ball {
    int body, parent, v; /* in the tree of turns: the body, the ball's parent, the first rate */
    double g[3][3];
} ball;

static void describe_turns(kt_tree *out, const kt_tree *tree) {
    kt_rewrite_begin(out, tree);
    for (int i = 0; i < tree->description.body_count; i++) {
        const kt_body *body = &tree->body[i];
        if (body->joint.type != KT_JOINT_SPHERICAL) {
            (void)kt_rewrite_copy(out, body);
            continue;
        }
        kt_body *first = kt_rewrite_helper(out, body->parent, KT_JOINT_REVOLUTE, kt_vec3_make(0.0, 0.0, 1.0));
        first->joint.at = body->joint.at;
        first->joint.rotation = body->joint.rotation;
        kt_body *second = kt_rewrite_helper(out, first->name, KT_JOINT_REVOLUTE, kt_vec3_make(0.0, 1.0, 0.0));
        kt_body *last = kt_rewrite_copy(out, body);
        last->parent = second->name;
        last->joint = kt_joint_default();
        last->joint.type = KT_JOINT_REVOLUTE;
        last->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    }
}

static ball ball_of(const kt_tree *turns, int body) {
    double own[6 * KT_TREE_NV], up[6 * KT_TREE_NV];
    const kt_vec3 at = {0.0, 0.0, 0.0};
    int parent = body;
    for (int k = 0; k < 3; k++)
        parent = kt_body_parent(turns->model, parent);
    ball out = {.body = body, .parent = parent, .v = kt_body_coordinates(turns->model, body).v - 2};
    const kt_mat3 r = kt_body_pose(turns->model, turns->data, body).rotation;
    kt_point_jacobian(turns->model, turns->data, body, at, own);
    kt_point_jacobian(turns->model, turns->data, parent, at, up);
    for (int k = 0; k < 3; k++) {
        const int j = 6 * (out.v + k);
        const kt_vec3 w = kt_vec3_make(own[j] - up[j], own[j + 1] - up[j + 1], own[j + 2] - up[j + 2]);
        const kt_vec3 local = kt_mat3_apply_transposed(r, w);
        for (int i = 0; i < 3; i++)
            out.g[i][k] = components(&local)[i];
    }
    return out;
}

static kt_vec3 ball_acceleration(const kt_tree *turns, const ball *b) {
    const kt_twist t = kt_body_twist(turns->model, turns->data, b->body);
    const kt_twist up = kt_body_twist(turns->model, turns->data, b->parent);
    const kt_vec3 alpha = kt_body_acceleration(turns->model, turns->data, b->body).angular;
    const kt_vec3 alpha_up = kt_body_acceleration(turns->model, turns->data, b->parent).angular;
    const kt_vec3 carried = kt_vec3_add(alpha_up, kt_vec3_cross(up.angular, kt_vec3_sub(t.angular, up.angular)));
    return kt_mat3_apply_transposed(kt_body_pose(turns->model, turns->data, b->body).rotation,
                                    kt_vec3_sub(alpha, carried));
}

/* The motion of the turns t as one of the balls; forces of the balls s->tau as those of the turns. */
static void translate(const kt_tree *tree, kt_tree_state *s, const kt_tree *turns, kt_tree_state *t) {
    memset(t->external, 0, sizeof t->external);
    for (int b = 1; b < tree->count; b++) {
        const int other = kt_body_find(turns->model, kt_body_name(tree->model, b));
        const kt_coordinates c = kt_body_coordinates(tree->model, b), d = kt_body_coordinates(turns->model, other);
        t->external[other] = s->external[b];
        if (c.type != KT_JOINT_SPHERICAL) {
            for (int k = 0; k < c.nv; k++) {
                s->q[c.q + k] = t->q[d.q + k];
                s->v[c.v + k] = t->v[d.v + k];
                s->tau[c.v + k] = t->tau[d.v + k];
            }
            continue;
        }
        const ball turn = ball_of(turns, other);
        const double *angle = t->q + d.q - 2;
        const kt_quat q = kt_quat_from_mat3(kt_mat3_from_rpy(kt_vec3_make(angle[2], angle[1], angle[0])));
        memcpy(s->q + c.q, (double[]){q.w, q.x, q.y, q.z}, 4 * sizeof(double));
        for (int i = 0; i < 3; i++) {
            s->v[c.v + i] = t->tau[turn.v + i] = 0.0;
            for (int k = 0; k < 3; k++) {
                s->v[c.v + i] += turn.g[i][k] * t->v[turn.v + k];
                t->tau[turn.v + i] += turn.g[k][i] * s->tau[c.v + k];
            }
        }
    }
}

KT_TEST(a_ball_is_three_turns) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("accelerations");
    int balls = 0;
    for (int n = 0; n < TREES; n++) {
        kt_tree tree, turns;
        kt_tree_state s, t;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.types = 1U << KT_JOINT_SPHERICAL | 1U << KT_JOINT_REVOLUTE | 1U << KT_JOINT_PRISMATIC;
        plan.bodies = 7;
        double a[KT_TREE_NV], sensitivity[KT_TREE_NV];
        long double slow[KT_TREE_NV];
        kt_tree_grow(&tree, &plan, &random);
        describe_turns(&turns, &tree);
        kt_tree_compile(&turns, NULL);
        kt_tree_state_draw(&tree, &random, &s);
        kt_tree_state_draw(&turns, &random, &t);
        for (int i = 0; i < turns.nq; i++) /* angles about y away from a quarter turn, where three turns are two */
            t.q[i] = fmax(-1.0, fmin(1.0, t.q[i]));
        kt_tree_kinematics(&turns, &t);
        translate(&tree, &s, &turns, &t);
        kt_tree_forward(&tree, &s, a);
        kt_tree_forward(&turns, &t, t.a);
        kt_tree_kinematics(&turns, &t);
        if (!kt_oracle_forward(&tree, &s, slow, sensitivity))
            return;
        for (int b = 1; b < tree.count; b++) {
            const int other = kt_body_find(turns.model, kt_body_name(tree.model, b));
            const kt_coordinates c = kt_body_coordinates(tree.model, b), d = kt_body_coordinates(turns.model, other);
            const double *observed = t.a + d.v;
            kt_vec3 w;
            if (c.type == KT_JOINT_SPHERICAL) {
                const ball turn = ball_of(&turns, other);
                w = ball_acceleration(&turns, &turn);
                observed = components(&w);
                balls++;
            }
            for (int i = 0; i < c.nv; i++)
                kt_worst_near(&error, observed[i], a[c.v + i], 10.0 * EPS * sensitivity[c.v + i], "tree %d body %d", n,
                              b);
        }
    }
    kt_check_above("balls", balls, TREES);
}
