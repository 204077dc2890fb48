/* Projection onto the manifold: closed to rounding, by the least step, and nothing else touched. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include "model/model.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <string.h>

static void project(const tangle *g, double *q, double *v, bool *changed) {
    kt_error e = {0};
    kt_need_fine("projects", kt_state_project(g->tree.model, g->tree.data, g->t, q, v, changed, &e), &e);
}

/* The residuals against sizes of one: lengths are some metres, and |A v| less than ten times the largest velocity. */
static void check_closed(const tangle *g, const double *q, const double *v, kt_worst *position, kt_worst *velocity) {
    kt_residual r = {(double)NAN, (double)NAN};
    kt_error e = {0};
    kt_need_fine("residuals", kt_loop_residual(g->tree.model, g->tree.data, g->t, q, v, &r, &e), &e);
    kt_worst_below(position, r.position, 4e-14, "nv %d", g->tree.nv);
    kt_worst_below(velocity, r.velocity, 4e-14 * fmax(1.0, kt_tree_largest(v, g->tree.nv)), "nv %d", g->tree.nv);
}

/* Some roundings leave loops open. Closing these loops moves positions by `reach` times as much. Velocities also change
 * because A changes with the positions. */
static void run(const tangle_plan *plan, kt_random *random, int mechanisms) {
    static tangle g;
    KT_WORST position = kt_worst_make("positions are closed"), velocity = kt_worst_make("velocities are closed");
    KT_WORST again = kt_worst_make("a second time moves nothing");
    for (int i = 0; i < mechanisms; i++) {
        double q[KT_TREE_NQ], v[KT_TREE_NV], r[KT_TREE_NQ], w[KT_TREE_NV];
        bool changed = false;
        tangle_grow(&g, plan, random);
        tangle_disturb(&g, random, 1e-3, q, v);
        project(&g, q, v, &changed);
        kt_worst_below(&again, changed ? 0.0 : 1.0, 0.5, "off the manifold, and not changed");
        check_closed(&g, q, v, &position, &velocity);
        memcpy(r, q, sizeof r);
        memcpy(w, v, sizeof w);
        memcpy(g.q, q, sizeof q);
        memcpy(g.v, v, sizeof v);
        const bool mass = plan->options.metric == KT_METRIC_MASS;
        const double open = 16.0 * DBL_EPSILON, reach = tangle_reach(&g, mass);
        const double swift = tangle_reach(&g, true) * (1.0 + reach); /* always in kinetic energy */
        const double most = fmax(1.0, kt_tree_largest(v, g.tree.nv));
        project(&g, r, w, &changed);
        for (int k = 0; k < g.tree.nq; k++)
            kt_worst_near(&again, r[k], q[k], open * reach, "nv %d, q %d", g.tree.nv, k);
        for (int k = 0; k < g.tree.nv; k++)
            kt_worst_near(&again, w[k], v[k], open * swift * most, "nv %d, v %d", g.tree.nv, k);
    }
}

KT_TEST(projection_closes_to_rounding) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    run(&plan, &random, 60);
    plan.options.metric = KT_METRIC_MASS;
    run(&plan, &random, 40);
    plan.options.metric = KT_METRIC_IDENTITY;
    plan.options.reduction = kt_reduction_method_of(KT_REDUCTION_PARTITION);
    run(&plan, &random, 40);
    plan.options.reduction = kt_reduction_method_of(KT_REDUCTION_SVD);
    run(&plan, &random, 40);
}

/* Loops that lock frames, and joints that still turn. If all else rests, an equation may have a single term: the
 * rounding of an entry of A, times the speed of these joints. It is no contradiction. */
KT_TEST(frames_at_rest_stay_so_beside_joints_that_turn) {
    static tangle g;
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_planar();
    int rejected = 0, rested = 0;
    plan.tree.planar = 2;
    plan.tree.from_world = 0.4;
    plan.nearby = 1.0;
    plan.options.plan = KT_PLAN_SPATIAL; /* where redundant equations are full of such entries */
    for (int i = 0; i < 600; i++) {
        tangle_grow(&g, &plan, &random);
        double q[KT_TREE_NQ], v[KT_TREE_NV], slowest = HUGE_VAL;
        kt_error e = {0};
        memcpy(q, g.q, sizeof q);
        memcpy(v, g.v, sizeof v);
        rejected += kt_state_project(g.tree.model, g.tree.data, g.t, q, v, NULL, &e) != KT_OK;
        tangle_disturb(&g, &random, i % 2 ? 1e-4 : 1e-6, q, v);
        rejected += kt_state_project(g.tree.model, g.tree.data, g.t, q, v, NULL, &e) != KT_OK;
        for (size_t k = 0; k < g.tree.model->n.group_v; k++)
            slowest = fmin(slowest, fabs(v[g.tree.model->group_v[k]]));
        rested += slowest < 1e-14;
    }
    kt_check_equal_int("rejected", rejected, 0);
    kt_check_above("with frames at rest", rested, 200.0);
}

/* The condition for the least step: W step is a combination of rows of A. It then has no part along motions that A
 * allows. W is the mass matrix or the identity. */
typedef struct part {
    double along;    /* step' W allowed */
    double size;     /* sum of the sizes of its terms */
    double rounding; /* the same for a step of eps in every coordinate */
} part;

static part part_along(const tangle *g, const tangle_system *s, bool mass, kt_random *random, const double *step) {
    static tangle_system other;
    double allowed[KT_TREE_NV], moved[KT_TREE_NV];
    const int nv = g->tree.nv;
    part p = {0.0, 0.0, 0.0};
    /* the acceleration of [1 A'; A 0] under a random force, b'' = 0, is allowed */
    other = *s;
    memset(other.drift, 0, sizeof other.drift);
    memset(other.mass, 0, (size_t)(nv * nv) * sizeof(double));
    for (int i = 0; i < nv; i++) {
        other.mass[i * nv + i] = 1.0;
        other.force[i] = kt_random_uniform(random, -1.0, 1.0);
    }
    (void)tangle_solve(g, &other, (tangle_way){0}, allowed, moved);
    for (int i = 0; i < nv; i++)
        for (int k = 0; k < nv; k++) {
            const double w = allowed[i] * (mass ? s->mass[k * nv + i] : i == k ? 1.0 : 0.0);
            p.along += w * step[k];
            p.size += fabs(w * step[k]);
            p.rounding += DBL_EPSILON * fabs(w);
        }
    return p;
}

/* For an error of 1e-6, second-order terms are some 1e-6 of the step, times the curvature of the manifold. */
static void check_least(const tangle_plan *plan, kt_random *random, bool mass, kt_worst *position, kt_worst *velocity) {
    static tangle g;
    static tangle_system s;
    const double off = 1e-6;
    for (int i = 0; i < 40; i++) {
        double q[KT_TREE_NQ], v[KT_TREE_NV], r[KT_TREE_NQ], w[KT_TREE_NV], step[KT_TREE_NV];
        tangle_grow(&g, plan, random);
        tangle_disturb(&g, random, off, q, v);
        memcpy(r, q, sizeof r);
        memcpy(w, v, sizeof w);
        kt_position_subtract(g.tree.model, r, q, step);
        project(&g, r, w, NULL);
        kt_position_subtract(g.tree.model, r, q, step);
        memcpy(g.q, r, sizeof r);
        tangle_system_of(&g, &s);
        part p = part_along(&g, &s, mass, random, step);
        kt_worst_below(position, fabs(p.along), 200.0 * off * p.size + p.rounding, "nv %d", g.tree.nv);
        for (int k = 0; k < g.tree.nv; k++)
            step[k] = w[k] - v[k];
        p = part_along(&g, &s, true, random, step); /* always in kinetic energy */
        kt_worst_below(velocity, fabs(p.along), 0.1 * p.rounding * fmax(1.0, kt_tree_largest(w, g.tree.nv)), "nv %d",
                       g.tree.nv);
    }
}

KT_TEST(projection_moves_least_in_its_metric) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    static const char *const names[4] = {"qr", "partition", "svd", "mass"};
    for (int way = 0; way < 4; way++) {
        KT_WORST position = kt_worst_make("step in positions, along what loops allow");
        KT_WORST velocity = kt_worst_make("step in velocities, along what loops allow");
        plan.options.reduction = kt_reduction_method_of((kt_reduction)(way % 3));
        plan.options.metric = way == 3 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        kt_note("%s", names[way]);
        check_least(&plan, &random, way == 3, &position, &velocity);
    }
}

/* Coordinates that are in no loop: their positions keep their bits. */
KT_TEST(positions_outside_loops_are_left_alone) {
    static tangle g;
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    long outside = 0, touched = 0;
    plan.loops = 2;
    plan.nearby = 1.0;
    for (int i = 0; i < 40; i++) {
        double q[KT_TREE_NQ], v[KT_TREE_NV], r[KT_TREE_NQ];
        tangle_grow(&g, &plan, &random);
        bool inside[KT_TREE_NV] = {false};
        for (size_t k = 0; k < g.tree.model->n.group_v; k++)
            inside[g.tree.model->group_v[k]] = true;
        tangle_disturb(&g, &random, 1e-3, q, v);
        memcpy(r, q, sizeof r);
        project(&g, r, v, NULL);
        for (int b = 1; b < g.tree.count; b++) {
            const kt_coordinates c = kt_body_coordinates(g.tree.model, b);
            for (int k = 0; k < c.nv && c.nq == c.nv; k++) {
                outside += !inside[c.v + k];
                touched += !inside[c.v + k] && memcmp(&r[c.q + k], &q[c.q + k], sizeof(double)) != 0;
            }
        }
    }
    kt_check_above("coordinates outside", (double)outside, 100.0);
    kt_check_equal_int("touched", touched, 0);
}

/* Without loops only quaternions are put right, and those of norm one keep their bits. */
KT_TEST(state_without_loops_keeps_its_bits) {
    static kt_tree tree;
    static kt_tree_state s;
    kt_random random = kt_random_of_test();
    kt_tree_plan plan = kt_tree_plan_default();
    double q[KT_TREE_NQ], v[KT_TREE_NV];
    bool changed = true;
    kt_error e = {0};
    kt_tree_sample(&tree, &plan, &random, &s);
    kt_check_true("quaternions of norm one", kt_position_normalize(tree.model, s.q));
    memcpy(q, s.q, sizeof q);
    memcpy(v, s.v, sizeof v);
    for (int i = 0; i < 3; i++) {
        changed = true;
        (void)kt_fine("projects", kt_state_project(tree.model, tree.data, 0.0, q, v, &changed, &e), &e);
        kt_check_true("changed", !changed);
        kt_check_equal_bits("positions", q, s.q, (size_t)tree.nq);
        kt_check_equal_bits("velocities", v, s.v, (size_t)tree.nv);
    }
    for (int b = 1; b < tree.count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree.model, b);
        for (int k = c.q + c.nq - 4; k < c.q + c.nq && c.nq != c.nv; k++)
            q[k] *= 1.0 + 1e-9;
    }
    (void)kt_fine("projects", kt_state_project(tree.model, tree.data, 0.0, q, v, &changed, &e), &e);
    kt_check_true("changed", changed);
    for (int k = 0; k < tree.nq; k++)
        if (fabs(q[k] - s.q[k]) > 4.0 * DBL_EPSILON)
            kt_check_near("scaled back", q[k], s.q[k], 4.0 * DBL_EPSILON);
}

/* A crank of 1 m must reach 1.5 m. No projection closes this gap. The message names the open loop and its gap. */
KT_TEST(failed_projection_names_the_loop_and_leaves_the_state) {
    static linkage l;
    kt_error e = {0};
    bool changed = true;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.3, 1.0);
    kt_loop *rope = linkage_close(&l, "rope", KT_LOOP_DISTANCE, NULL, kt_vec3_make(2.0, 0.0, 0.0), "bar",
                                  kt_vec3_make(1.0, 0.0, 0.0));
    rope->function = kt_function_ramp(1.2, 3.5, 0.0, 1.0);
    linkage_build(&l, 0.0);
    double q = l.q[0], v = l.v[0];
    kt_check_equal_int("status", kt_state_project(l.model, l.data, 1.0, &q, &v, &changed, &e), KT_ERROR_CONSTRAINT);
    kt_check_text("where", e.where, "t = 1 s");
    kt_check_contains("message", e.message, "the loops can no longer be closed; what stays open is: 'rope' by 0.5 m");
    kt_check_equal_bits("position", &q, l.q, 1);
    kt_check_equal_bits("velocity", &v, l.v, 1);
    q = (double)NAN;
    kt_check_equal_int("status", kt_state_project(l.model, l.data, 0.0, &q, &v, &changed, &e), KT_ERROR_NOT_FINITE);
    kt_check_text("where", e.where, "joint 'bar'");
    kt_check_text("message", e.message, "its position is nan; give a finite number");
    kt_check_true("untouched", isnan(q) && v == l.v[0] && changed);
}

/* ---- dead points ------------------------------------------------------------------------------------------------- */

/* A cart on a wheel that rolls, with a lift on it that is driven to y = t - 1/4. A rod of driven length L leads from
 * the lift to the origin, so that L L' = x x' + (1 + y) y'. The cart starts at 1 m. At t = 1/4 the cart is at x.
 * Towards x = 0 the rod loses the cart's direction, of which it has x / L, and requires rate - 1 along it. */
typedef struct cart {
    double lift[2], rod[3];
    linkage l;
} cart;

static void make_cart(cart *c, double x, double rate) {
    const kt_vec3 origin = kt_vec3_make(0.0, 0.0, 0.0);
    const double length = sqrt(1.0 + x * x), bend = 16.0 * (1.25 - length + 0.25 * rate); /* L(0) = 1.25 */
    linkage *l = &c->l;
    linkage_begin(l);
    kt_body *body = linkage_bar(l, "cart", NULL, origin, kt_vec3_make(1.0, 0.0, 0.0), 1.0, 0.0);
    body->joint.type = KT_JOINT_PRISMATIC;
    body->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    (void)linkage_bar(l, "wheel", "cart", kt_vec3_make(0.0, 0.5, 0.0), kt_vec3_make(0.3, 0.0, 0.0), 0.0, 0.0);
    body = linkage_bar(l, "lift", "cart", kt_vec3_make(0.0, 1.0, 0.0), kt_vec3_make(0.0, 1.0, 0.0), -0.25, 0.0);
    body->joint.type = KT_JOINT_PRISMATIC;
    body->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    kt_loop *loop = linkage_close(l, "roll", KT_LOOP_ROLLING, "wheel", origin, NULL, origin);
    loop->radius = 0.5;
    loop->axis = kt_vec3_make(0.0, 0.0, 1.0);
    loop->axis2 = kt_vec3_make(0.0, 1.0, 0.0);
    loop = linkage_close(l, "lift", KT_LOOP_MOTION, NULL, origin, NULL, origin);
    loop->joint = "lift";
    loop->between[0] = loop->between[1] = kt_end_default();
    c->lift[0] = -0.25;
    c->lift[1] = 1.0;
    loop->function = kt_function_polynomial(c->lift, 2);
    loop = linkage_close(l, "rod", KT_LOOP_DISTANCE, "lift", origin, NULL, origin);
    c->rod[0] = 1.25;
    c->rod[1] = rate - 0.5 * bend;
    c->rod[2] = bend;
    loop->function = kt_function_polynomial(c->rod, 3);
    linkage_compile(l);
}

/* Returns whether the projection reports a dead point, or -1 for another failure. The output *size is the size of
 * the direction that is about to be lost, over the usual size. */
static int project_cart(double x, double rate, double *size) {
    static cart c;
    int dead = -1;
    make_cart(&c, x, rate);
    kt_error e = {0};
    const kt_model *m = c.l.model;
    double q[3], v[3] = {0.0, 0.0, 0.0};
    q[kt_body_coordinates(m, kt_body_find(m, "cart")).q] = x;
    q[kt_body_coordinates(m, kt_body_find(m, "wheel")).q] = 0.0;
    q[kt_body_coordinates(m, kt_body_find(m, "lift")).q] = 0.0;
    const kt_status status = kt_state_project(m, c.l.data, 0.25, q, v, NULL, &e);
    kt_note("x = %g, rate %g: %s: %s", x, rate, e.where, e.message);
    if (status == KT_OK)
        dead = 0;
    else if (status == KT_ERROR_CONSTRAINT && strstr(e.message, "a dead point"))
        dead = 1;
    *size = c.l.data->last[0] / m->group[0].usual[KT_ROWS_ALL];
    return dead;
}

KT_TEST(a_dead_point_is_one_where_a_ten_thousandth_of_a_direction_is_left) {
    double size = 0.0, per_x;
    kt_check_equal_int("1 mm off it", project_cart(1e-3, 1.5, &size), 0);
    per_x = size / 1e-3;
    kt_check_equal_int("a little less", project_cart(0.99e-4 / per_x, 1.5, &size), 1);
    kt_check_near("size", size, 0.99e-4, 1e-10); /* 1e-6, the square of 1 mm, of it */
    kt_check_equal_int("a little more", project_cart(1.01e-4 / per_x, 1.5, &size), 0);
    kt_check_near("size", size, 1.01e-4, 1e-10);
}

KT_TEST(a_dead_point_is_one_where_a_tenth_of_a_drive_is_missed) {
    double size;
    kt_check_equal_int("missed by 0.099", project_cart(1e-6, 0.901, &size), 0);
    kt_check_equal_int("missed by 0.101", project_cart(1e-6, 0.899, &size), 1);
    kt_check_equal_int("followed", project_cart(1e-6, 1.0, &size), 0);
}
