/* Reactions. Each body is in balance under its joints, its loops and the external forces. Loops push only along
 * forbidden directions. The torque of a prescribed motion and a closed form are checked as well. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "mechanics/constraint/tangle.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct reactions {
    kt_wrench joint[KT_TREE_SLOTS], loop[TANGLE_LOOPS];
    double a[KT_TREE_NV], size; /* of the largest number in any wrench */
} reactions;

static double wrench_size(const kt_wrench *w) { return fmax(kt_vec3_norm(w->moment), kt_vec3_norm(w->force)); }

static void react(const tangle *g, reactions *r) {
    const kt_model *model = g->tree.model;
    kt_error e = {0};
    kt_need_fine("acceleration",
                 kt_acceleration_evaluate(model, g->tree.data, g->t, g->q, g->v, g->tau, g->external, r->a, &e), &e);
    kt_need_fine(
        "reactions",
        kt_reaction_evaluate(model, g->tree.data, g->t, g->q, g->v, g->tau, g->external, r->joint, r->loop, &e), &e);
    r->size = 1.0;
    for (int b = 1; b < g->tree.count; b++)
        r->size = fmax(r->size, wrench_size(&r->joint[b]));
    for (int i = 0; i < g->loops; i++)
        r->size = fmax(r->size, wrench_size(&r->loop[i]));
}

static bool is_relation(const tangle *g, int i) {
    return g->loop[i].type == KT_LOOP_COUPLING || g->loop[i].type == KT_LOOP_MOTION || g->loop[i].type == KT_LOOP_RATES;
}

/* The world point of a loop's first end, and the bodies at its ends. Needs the kinematics. */
static kt_vec3 loop_point(const tangle *g, int i, int body[2]) {
    for (int k = 0; k < 2; k++)
        body[k] = g->loop[i].between[k].body ? kt_body_find(g->tree.model, g->loop[i].between[k].body) : 0;
    return kt_point_position(g->tree.model, g->tree.data, body[0], g->loop[i].between[0].at);
}

/* Adds a wrench at a point to a body's total about the origin of its frame. */
static void push(const tangle *g, int body, kt_wrench w, kt_vec3 point, double sign, kt_wrench *on) {
    const kt_vec3 arm = kt_vec3_sub(point, kt_body_pose(g->tree.model, g->tree.data, body).position);
    const kt_vec3 moment = kt_vec3_add(w.moment, kt_vec3_cross(arm, w.force));
    on->moment = kt_vec3_add(on->moment, kt_vec3_scale(sign, moment));
    on->force = kt_vec3_add(on->force, kt_vec3_scale(sign, w.force));
}

/* d/dt of momentum, less gravity, about the body frame's origin. */
static kt_wrench inertial(const tangle *g, int b) {
    const kt_model *model = g->tree.model;
    const kt_body *body = &g->tree.description.bodies[kt_body_source(model, b)];
    const kt_mat3 r = kt_body_pose(model, g->tree.data, b).rotation;
    const kt_sym3 j = kt_sym3_rotate(r, body->inertia);
    const kt_vec3 w = kt_body_twist(model, g->tree.data, b).angular;
    const kt_vec3 alpha = kt_body_acceleration(model, g->tree.data, b).angular;
    kt_wrench out;
    out.force = kt_vec3_scale(
        body->mass, kt_vec3_sub(kt_point_acceleration(model, g->tree.data, b, body->com), g->tree.description.gravity));
    out.moment = kt_vec3_add(kt_sym3_apply(j, alpha), kt_vec3_cross(w, kt_sym3_apply(j, w)));
    out.moment = kt_vec3_add(out.moment, kt_vec3_cross(kt_mat3_apply(r, body->com), out.force));
    return out;
}

/* Newton and Euler, body by body. */
static void check_balance(const tangle *g, const reactions *r, kt_worst *worst) {
    const kt_model *model = g->tree.model;
    kt_wrench on[KT_TREE_SLOTS];
    kt_error e = {0};
    kt_need_fine("kinematics", kt_kinematics_update(model, g->tree.data, g->q, g->v, r->a, &e), &e);
    memset(on, 0, sizeof on);
    for (int b = 1; b < g->tree.count; b++) {
        const kt_vec3 at = g->tree.description.bodies[kt_body_source(model, b)].joint.at;
        const int parent = kt_body_parent(model, b);
        const kt_vec3 joint = kt_point_position(model, g->tree.data, parent, at);
        push(g, b, r->joint[b], joint, 1.0, &on[b]);
        push(g, parent, r->joint[b], joint, -1.0, &on[parent]);
        push(g, b, g->external[b], kt_body_pose(model, g->tree.data, b).position, 1.0, &on[b]);
    }
    for (int i = 0; i < g->loops; i++) {
        int body[2];
        if (is_relation(g, i))
            continue;
        const kt_vec3 point = loop_point(g, i, body);
        push(g, body[1], r->loop[i], point, 1.0, &on[body[1]]);
        push(g, body[0], r->loop[i], point, -1.0, &on[body[0]]);
    }
    for (int b = 1; b < g->tree.count; b++) {
        const kt_wrench m = inertial(g, b);
        const double off =
            fmax(kt_vec3_norm(kt_vec3_sub(on[b].moment, m.moment)), kt_vec3_norm(kt_vec3_sub(on[b].force, m.force)));
        kt_worst_below(worst, off, 10.0 * DBL_EPSILON * r->size, "nv %d, body %d", g->tree.nv, b);
    }
}

/* The largest sum of the sizes of forces that make up M a. */
static double force_size(const tangle *g, const reactions *r) {
    static tangle_system s;
    double most = r->size;
    tangle_system_of(g, &s);
    for (int i = 0; i < g->tree.nv; i++) {
        double sum = 0.0;
        for (int k = 0; k < g->tree.nv; k++)
            sum += fabs(s.mass[k * g->tree.nv + i] * r->a[k]);
        most = fmax(most, sum);
    }
    return most;
}

/* The joint forces, with the loops' wrenches as external ones, are equal to the drives: tau, and relations between
 * joints.
 */
static void check_joints(const tangle *g, const reactions *r, kt_worst *worst) {
    const double size = force_size(g, r);
    kt_error e = {0};
    kt_need_fine("kinematics", kt_kinematics_update(g->tree.model, g->tree.data, g->q, g->v, r->a, &e), &e);
    const kt_model *model = g->tree.model;
    kt_wrench external[KT_TREE_SLOTS];
    double need[KT_TREE_NV];
    bool driven[KT_TREE_NV] = {false};
    memcpy(external, g->external, sizeof external);
    for (int i = 0; i < g->loops; i++) {
        int body[2];
        if (!is_relation(g, i)) {
            const kt_vec3 point = loop_point(g, i, body);
            push(g, body[1], r->loop[i], point, 1.0, &external[body[1]]);
            push(g, body[0], r->loop[i], point, -1.0, &external[body[0]]);
        }
        for (int k = 0; k < g->loop[i].term_count; k++)
            driven[kt_body_coordinates(model, kt_body_find(model, g->loop[i].terms[k].joint)).v] = true;
        if (g->loop[i].type == KT_LOOP_MOTION)
            driven[kt_body_coordinates(model, kt_body_find(model, g->loop[i].joint)).v] = true;
    }
    kt_need_fine("inverse dynamics", kt_dynamics_inverse(model, g->tree.data, g->q, g->v, r->a, external, need, &e),
                 &e);
    for (int k = 0; k < g->tree.nv; k++)
        if (!driven[k])
            kt_worst_near(worst, need[k], g->tau[k], 12.0 * DBL_EPSILON * size, "nv %d, %d", g->tree.nv, k);
}

/* Velocities that loop i allows, from random ones, by Gram-Schmidt on its rows. */
static void draw_allowed(const tangle *g, int i, kt_random *random, double *w) {
    static double a[TANGLE_ROWS * KT_TREE_NV];
    double row[6][KT_TREE_NV];
    const int first = kt_loop_rows_of(g->tree.model, i).first, count = kt_loop_rows_of(g->tree.model, i).count;
    const int nv = g->tree.nv;
    kt_error e = {0};
    kt_need_fine("equations", kt_loop_equations(g->tree.model, g->tree.data, g->t, g->q, NULL, a, NULL, NULL, NULL, &e),
                 &e);
    for (int k = 0; k < nv; k++)
        w[k] = kt_random_uniform(random, -1.0, 1.0);
    for (int pass = 0; pass < 2; pass++)
        for (int c = 0; c < count; c++) {
            double norm = 0.0, along = 0.0;
            for (int k = 0; k < nv && !pass; k++)
                row[c][k] = a[k * g->rows + first + c];
            for (int d = 0; d < c && !pass; d++) {
                double dot = 0.0;
                for (int k = 0; k < nv; k++)
                    dot += row[c][k] * row[d][k];
                for (int k = 0; k < nv; k++)
                    row[c][k] -= dot * row[d][k];
            }
            for (int k = 0; k < nv; k++) {
                norm += row[c][k] * row[c][k];
                along += row[c][k] * w[k];
            }
            for (int k = 0; k < nv; k++) { /* a row that depends on those before it requires nothing more */
                w[k] -= norm > 1e-20 ? along / norm * row[c][k] : 0.0;
                row[c][k] /= norm > 1e-20 ? sqrt(norm) : (double)INFINITY;
            }
        }
}

/* The forces of a loop have no power in the motions that it allows. */
static void check_power(const tangle *g, const reactions *r, kt_random *random, kt_worst *worst) {
    double w[KT_TREE_NV];
    kt_error e = {0};
    for (int i = 0; i < g->loops; i++) {
        int body[2];
        if (is_relation(g, i))
            continue;
        draw_allowed(g, i, random, w);
        kt_need_fine("kinematics", kt_kinematics_update(g->tree.model, g->tree.data, g->q, w, NULL, &e), &e);
        const kt_vec3 point = loop_point(g, i, body);
        double power = 0.0, speed = 1.0;
        for (int k = 0; k < 2; k++) {
            const kt_twist twist = kt_body_twist(g->tree.model, g->tree.data, body[k]);
            const kt_vec3 arm = kt_vec3_sub(point, kt_body_pose(g->tree.model, g->tree.data, body[k]).position);
            const kt_vec3 velocity = kt_vec3_add(twist.linear, kt_vec3_cross(twist.angular, arm));
            power += (k ? 1.0 : -1.0) *
                     (kt_vec3_dot(r->loop[i].moment, twist.angular) + kt_vec3_dot(r->loop[i].force, velocity));
            speed = fmax(speed, fmax(kt_vec3_norm(twist.angular), kt_vec3_norm(velocity)));
        }
        kt_worst_below(worst, fabs(power), 12.0 * DBL_EPSILON * speed * fmax(1.0, wrench_size(&r->loop[i])),
                       "%s, nv %d", kt_loop_type_name(g->loop[i].type), g->tree.nv);
    }
}

KT_TEST(bodies_are_in_balance_under_joints_and_loops) {
    static tangle g;
    static reactions r;
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    KT_WORST balance = kt_worst_make("Newton and Euler"), joints = kt_worst_make("joints that nothing else drives");
    KT_WORST power = kt_worst_make("power in what a loop allows");
    for (int i = 0; i < 100; i++) {
        tangle_grow(&g, &plan, &random);
        react(&g, &r);
        check_balance(&g, &r, &balance);
        check_joints(&g, &r, &joints);
        check_power(&g, &r, &random, &power);
    }
}

/* All coordinates of a tree prescribed: each motion's torque is that of inverse dynamics. */
KT_TEST(prescribed_motion_needs_the_torque_of_inverse_dynamics) {
    static tangle g;
    static reactions r;
    kt_random random = kt_random_of_test();
    KT_WORST torque = kt_worst_make("torque of a motion"), motion = kt_worst_make("acceleration");
    for (int i = 0; i < 30; i++) {
        tangle_plan plan = tangle_plan_default();
        kt_error e = {0};
        plan.tree.bodies = 6;
        plan.tree.types = 1U << KT_JOINT_REVOLUTE | 1U << KT_JOINT_PRISMATIC | 1U << KT_JOINT_SCREW;
        memset(&g, 0, sizeof g);
        kt_tree_describe(&g.tree, &plan.tree, &random);
        for (int k = 0; k < 6; k++) {
            snprintf(g.name[k], sizeof g.name[k], "loop%d", k);
            g.loop[k] = kt_loop_of(g.name[k], KT_LOOP_MOTION);
            g.loop[k].joint = g.tree.name[k];
            g.loop[k].function = kt_function_sine(0.5, 0.3, kt_random_uniform(&random, -1.0, 1.0), 0.1);
        }
        g.loops = g.tree.description.loop_count = 6;
        g.tree.description.loops = g.loop;
        g.t = kt_random_uniform(&random, 0.0, 2.0);
        double need[KT_TREE_NV];
        kt_tree_compile(&g.tree, NULL);
        kt_model_initial(g.tree.model, g.q, g.v);
        kt_need_fine("assembles", kt_state_assemble(g.tree.model, g.tree.data, g.t, g.q, g.v, &e), &e);
        react(&g, &r);
        kt_need_fine("inverse", kt_dynamics_inverse(g.tree.model, g.tree.data, g.q, g.v, r.a, NULL, need, &e), &e);
        for (int k = 0; k < 6; k++) {
            const int body = kt_body_find(g.tree.model, g.tree.name[k]);
            const kt_coordinates c = kt_body_coordinates(g.tree.model, body);
            const kt_wrench *w = &r.loop[k];
            const double omega = 2.0 * 3.14159265358979 * 0.3, x = g.q[c.q] - 0.1;
            const double size = c.type == KT_JOINT_PRISMATIC ? kt_vec3_norm(w->force) : kt_vec3_norm(w->moment);
            kt_worst_near(&torque, size, fabs(need[c.v]), 8.0 * DBL_EPSILON * r.size, "tree %d, joint %d", i, k);
            kt_worst_near(&motion, r.a[c.v], -omega * omega * x, 2e-14, "tree %d, joint %d", i, k);
        }
    }
}

/* Three windows in a row, flat and nearly flat: their equations (almost) depend on each other. The ground gives the
 * cranks the force that all bars together need, m (c'' - g), and no joint about z resists. (If they lie flat, the
 * reactions inside are unbounded.) theta'' is from the closed form. The bound has two parts. The first is the error of
 * the interpolation, `4e-11 rad/s^2`. The second is the rounding at the neighbouring positions, times masses and
 * lengths, over the distance 1e-3.
 */
KT_TEST(ground_carries_a_row_of_windows_at_a_singular_position) {
    static linkage l;
    static kt_wrench joint[8], loop[3];
    const int n = 3;
    for (int k = 0; k < 3; k++) {
        const double theta = 1.5707963267948966 + (k == 2 ? 0.4 : 1e-3 * k), rate = 3.0;
        kt_error e = {0};
        linkage_windows(&l, n, theta, rate, KT_LOOP_REVOLUTE);
        linkage_build(&l, 0.0);
        kt_need_fine("reactions", kt_reaction_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, NULL, joint, loop, &e),
                     &e);
        const double a = windows_acceleration(n, theta), bound = k == 2 ? 1e-12 : 1e-9;
        /* the circle of a crank's centre is `1/2 m`, that of a coupler's `1 m` */
        const double length = 0.5 * (n + 1) + n, mass = 2 * n + 1;
        double x = 0.0, y = 0.0, resistance = 0.0;
        for (int b = 1; b < kt_model_body_count(l.model); b++) {
            resistance = fmax(resistance, fabs(joint[b].moment.z));
            x += kt_body_parent(l.model, b) == 0 ? joint[b].force.x : 0.0;
            y += kt_body_parent(l.model, b) == 0 ? joint[b].force.y : 0.0;
        }
        kt_check_near("x", x, length * (a * cos(theta) - rate * rate * sin(theta)), 1e-12);
        kt_check_near("y", y, length * (-a * sin(theta) - rate * rate * cos(theta)) + mass * 9.81, bound);
        if (k)
            kt_check_below("moment about a joint's axis", resistance, bound);
    }
}

/* Teeth press along a line that leans by 20 degrees from the common tangent: two pinions away from each other, a pinion
 * and its ring towards each other's centres. */
KT_TEST(teeth_press_along_their_line_of_action) {
    static const double teeth[4][2] = {{30.0, 20.0}, {30.0, 20.0}, {-70.0, 20.0}, {20.0, -70.0}}; /* of rings: < 0 */
    for (int n = 0; n < 4; n++) {
        const double q[2] = {0.0, 0.0}, tau[2] = {1.0, 0.0};
        kt_body wheel[2] = {kt_body_of("first", NULL, KT_JOINT_REVOLUTE, 1.0),
                            kt_body_of("second", NULL, KT_JOINT_REVOLUTE, 1.0)};
        kt_loop mesh = kt_loop_of("mesh", KT_LOOP_GEAR);
        for (int k = 0; k < 2; k++) {
            wheel[k].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
            mesh.between[k].body = wheel[k].name;
        }
        wheel[1].joint.at.x = 0.5;
        mesh.second_axis.z = n == 1 ? -1.0 : 1.0;
        mesh.teeth = teeth[n][0];
        mesh.teeth2 = teeth[n][1];
        const kt_description d = kt_description_of(wheel, 2, &mesh, 1, NULL, 0);
        kt_model *model = kt_test_model(&d, NULL);
        kt_wrench on_second;
        kt_error e = {0};
        kt_need_fine("reaction",
                     kt_reaction_evaluate(model, kt_test_data(model), 0.0, q, q, tau, NULL, NULL, &on_second, &e), &e);
        const double tangential = fabs(on_second.force.y), radial = tangential * tan(acos(-1.0) / 9.0);
        kt_check_above("tangential force, N", tangential, 0.1);
        kt_check_near("radial force, N", on_second.force.x, n < 2 ? radial : -radial, 1e-14 * tangential);
    }
}
