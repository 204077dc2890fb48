/* Poses, twists, accelerations, points and Jacobians: against compositions of Taylor series in long double, and against
 * differences along motions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 150 };

static const double *components(const kt_vec3 *a) { return &a->x; }

/* How many of n numbers are finite. */
static int finite(const double *x, size_t n) {
    int count = 0;
    for (size_t i = 0; i < n; i++)
        count += isfinite(x[i]) ? 1 : 0;
    return count;
}

/* Only the zero columns of a Jacobian are numbers. */
KT_TEST(queries_before_the_first_update_are_not_numbers) {
    kt_random random = kt_random_of_test();
    int known = 0, zeros_only = 0;
    for (int n = 0; n < 20; n++) {
        kt_tree tree;
        kt_tree_plan plan = kt_tree_plan_default();
        double jacobian[6 * KT_TREE_NV];
        plan.types = KT_TREE_ALL_TYPES & ~(1U << KT_JOINT_FIXED);
        kt_tree_grow(&tree, &plan, &random);
        for (int b = 1; b < tree.count; b++) {
            const kt_vec3 at = kt_tree_vector(&random, -1.0, 1.0);
            const kt_pose pose = kt_body_pose(tree.model, tree.data, b);
            const kt_twist twist = kt_body_twist(tree.model, tree.data, b);
            const kt_twist change = kt_body_acceleration(tree.model, tree.data, b);
            const kt_vec3 point = kt_point_position(tree.model, tree.data, b, at);
            const kt_vec3 velocity = kt_point_velocity(tree.model, tree.data, b, at);
            const kt_vec3 acceleration = kt_point_acceleration(tree.model, tree.data, b, at);
            known += finite(&pose.rotation.x.x, 9) + finite(&pose.position.x, 3) + finite(&twist.angular.x, 3) +
                     finite(&twist.linear.x, 3) + finite(&change.angular.x, 3) + finite(&change.linear.x, 3) +
                     finite(&point.x, 3) + finite(&velocity.x, 3) + finite(&acceleration.x, 3);
            kt_point_jacobian(tree.model, tree.data, b, at, jacobian);
            zeros_only += finite(jacobian, 6 * (size_t)tree.nv) == 6 * tree.nv;
        }
        kt_vec3 center = {0.0, 0.0, 0.0};
        const kt_wrench momentum = kt_momentum(tree.model, tree.data);
        const double energies[2] = {kt_kinetic_energy(tree.model, tree.data),
                                    kt_potential_energy(tree.model, tree.data)};
        (void)kt_mass_center(tree.model, tree.data, &center);
        known +=
            finite(&momentum.moment.x, 3) + finite(&momentum.force.x, 3) + finite(&center.x, 3) + finite(energies, 2);
    }
    kt_check_equal_int("finite numbers", known, 0);
    kt_check_equal_int("Jacobians without a NaN", zeros_only, 0);
}

/* Lengths of the longest path and sums of rates along it are of the order of the number of bodies. The factor c is
 * measured over 20 seeds, whose worst is half of the bound. */
KT_TEST(bodies_move_as_their_joints_compose) {
    kt_random random = kt_random_of_test();
    KT_WORST place = kt_worst_make("poses"), speed = kt_worst_make("twists"), change = kt_worst_make("accelerations");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.bodies = kt_random_int(&random, 1, 20);
        plan.is_shuffled = n % 2;
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_oracle_body slow[KT_TREE_SLOTS];
        kt_oracle_motion(&tree, s.q, s.v, s.a, slow);
        kt_tree_kinematics(&tree, &s);
        for (int b = 0; b < tree.count; b++) {
            const kt_pose p = kt_body_pose(tree.model, tree.data, b);
            const kt_twist t = kt_body_twist(tree.model, tree.data, b),
                           a = kt_body_acceleration(tree.model, tree.data, b);
            const kt_mat3 r = kt_mat3_transpose(p.rotation); /* rows */
            const kt_vec3 *rows[3] = {&r.x, &r.y, &r.z};
            const kt_oracle_body *o = &slow[b];
            double fast = 1.0, faster = 1.0; /* |v|, |a| */
            for (int i = 0; i < 3; i++) {
                fast = fmax(fast, (double)fmaxl(fabsl(o->w[i]), fabsl(o->u[i])));
                faster = fmax(faster, (double)fmaxl(fabsl(o->alpha[i]), fabsl(o->a[i])));
            }
            for (int i = 0; i < 3; i++) {
                kt_worst_near(&place, components(&p.position)[i], (double)o->p[i], 40.0 * EPS, "tree %d body %d", n, b);
                for (int j = 0; j < 3; j++)
                    kt_worst_near(&place, components(rows[i])[j], (double)o->r[i][j], 20.0 * EPS, "tree %d body %d", n,
                                  b);
                kt_worst_near(&speed, components(&t.angular)[i], (double)o->w[i], 40.0 * EPS * fast, "%d %d", n, b);
                kt_worst_near(&speed, components(&t.linear)[i], (double)o->u[i], 40.0 * EPS * fast, "%d %d", n, b);
                kt_worst_near(&change, components(&a.angular)[i], (double)o->alpha[i], 40.0 * EPS * faster, "%d %d", n,
                              b);
                kt_worst_near(&change, components(&a.linear)[i], (double)o->a[i], 40.0 * EPS * faster, "%d %d", n, b);
            }
        }
    }
}

/* The state `q (+) (v h + a h^2 / 2), v + a h`: a motion whose velocity at h = 0 is v and whose acceleration is a. */
static void advance(const kt_tree *tree, const kt_tree_state *s, double h) {
    kt_tree_state moved = *s;
    double step[KT_TREE_NV];
    for (int i = 0; i < tree->nv; i++) {
        step[i] = h * (s->v[i] + 0.5 * h * s->a[i]);
        moved.v[i] = s->v[i] + h * s->a[i];
    }
    kt_position_add(tree->model, s->q, step, moved.q);
    kt_tree_kinematics(tree, &moved);
}

/* Marker positions and velocities of all bodies after h. */
static void markers_after(const kt_tree *tree, const kt_tree_state *s, double h, kt_vec3 *place, kt_vec3 *velocity) {
    advance(tree, s, h);
    for (int b = 0; b < tree->count; b++) {
        const kt_vec3 at = b ? kt_marker_at(tree->model, b, 0) : kt_vec3_make(0.0, 0.0, 0.0);
        place[b] = kt_point_position(tree->model, tree->data, b, at);
        velocity[b] = kt_point_velocity(tree->model, tree->data, b, at);
    }
}

static double difference(const kt_vec3 *x[4], int b, int i, double h) {
    const double near = components(&x[2][b])[i] - components(&x[1][b])[i];
    const double far = components(&x[3][b])[i] - components(&x[0][b])[i];
    return (8.0 * near - far) / (12.0 * h);
}

/* Fourth-order differences, h = 1e-3. The truncation is `h^4 / 30` times fifth derivatives (arm rate^5: several m, up
 * to 6 rad/s). The rounding is EPS / h. */
KT_TEST(velocities_and_accelerations_of_points_are_derivatives_along_motions) {
    kt_random random = kt_random_of_test();
    KT_WORST speed = kt_worst_make("velocities of markers"), change = kt_worst_make("accelerations of markers");
    const double h = 1e-3, times[4] = {-2.0 * h, -h, h, 2.0 * h};
    for (int n = 0; n < 40; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_vec3 place[4][KT_TREE_SLOTS], velocity[4][KT_TREE_SLOTS];
        kt_tree_sample(&tree, &plan, &random, &s);

        for (int k = 0; k < 4; k++)
            markers_after(&tree, &s, times[k], place[k], velocity[k]);
        kt_tree_kinematics(&tree, &s);
        const kt_vec3 *places[4] = {place[0], place[1], place[2], place[3]};
        const kt_vec3 *velocities[4] = {velocity[0], velocity[1], velocity[2], velocity[3]};
        for (int b = 1; b < tree.count; b++) {
            const kt_vec3 at = kt_marker_at(tree.model, b, 0);
            const kt_vec3 v = kt_point_velocity(tree.model, tree.data, b, at);
            const kt_vec3 a = kt_point_acceleration(tree.model, tree.data, b, at);
            for (int i = 0; i < 3; i++) {
                kt_worst_near(&speed, difference(places, b, i, h), components(&v)[i], 5e-10, "tree %d body %d", n, b);
                kt_worst_near(&change, difference(velocities, b, i, h), components(&a)[i], 3e-9, "tree %d body %d", n,
                              b);
            }
        }
    }
}

/* J v, columns of six. */
static void product(const kt_tree *tree, const double *jacobian, const double *v, double out[6]) {
    for (int i = 0; i < 6; i++) {
        out[i] = 0.0;
        for (int k = 0; k < tree->nv; k++)
            out[i] += jacobian[6 * k + i] * v[k];
    }
}

KT_TEST(jacobian_times_velocity_is_twist_at_the_point) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("J v");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_tree_plan plan = kt_tree_plan_default();
        plan.is_shuffled = n % 2;
        double jacobian[6 * KT_TREE_NV], twist[6];
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_kinematics(&tree, &s);
        for (int b = 0; b < tree.count; b++) {
            const kt_vec3 at = kt_tree_vector(&random, -1.0, 1.0);
            const kt_vec3 w = kt_body_twist(tree.model, tree.data, b).angular;
            const kt_vec3 u = kt_point_velocity(tree.model, tree.data, b, at);
            memset(jacobian, 0xFF, sizeof jacobian);
            kt_point_jacobian(tree.model, tree.data, b, at, jacobian);
            product(&tree, jacobian, s.v, twist);
            for (int i = 0; i < 3; i++) {
                kt_worst_near(&error, twist[i], components(&w)[i], 100.0 * EPS, "tree %d body %d", n, b);
                kt_worst_near(&error, twist[3 + i], components(&u)[i], 100.0 * EPS, "tree %d body %d", n, b);
            }
        }
    }
}

/* Compares each column with fourth-order differences of the point along q (+) h e_k, with h = 2e-3. The truncation is
 * `h^4 / 30` times the arm (a few m). The rounding is EPS |p| / h. */
KT_TEST(columns_of_jacobian_are_displacements_of_the_point) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("dp / dq_k");
    const double h = 2e-3;
    for (int n = 0; n < 20; n++) {
        kt_tree tree;
        kt_tree_state s, unit;
        const kt_tree_plan plan = kt_tree_plan_default();
        double jacobian[6 * KT_TREE_NV];
        kt_vec3 place[4][KT_TREE_SLOTS], unused[KT_TREE_SLOTS];
        kt_tree_sample(&tree, &plan, &random, &s);
        memset(&unit, 0, sizeof unit);
        memcpy(unit.q, s.q, sizeof unit.q);
        for (int k = 0; k < tree.nv; k++) {
            unit.v[k] = 1.0;

            for (int j = 0; j < 4; j++)
                markers_after(&tree, &unit, (j < 2 ? j - 2 : j - 1) * h, place[j], unused);
            unit.v[k] = 0.0;
            kt_tree_kinematics(&tree, &s);
            const kt_vec3 *places[4] = {place[0], place[1], place[2], place[3]};
            for (int b = 1; b < tree.count; b++) {
                kt_point_jacobian(tree.model, tree.data, b, kt_marker_at(tree.model, b, 0), jacobian);
                for (int i = 0; i < 3; i++)
                    kt_worst_near(&error, difference(places, b, i, h), jacobian[6 * k + 3 + i], 2e-11,
                                  "tree %d body %d", n, b);
            }
        }
    }
}

KT_TEST(points_are_carried_by_the_pose_of_their_body) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("p + R at");
    for (int n = 0; n < 30; n++) {
        kt_tree tree;
        kt_tree_state s;
        const kt_tree_plan plan = kt_tree_plan_default();
        kt_tree_sample(&tree, &plan, &random, &s);
        kt_tree_kinematics(&tree, &s);
        for (int b = 0; b < tree.count; b++) {
            const kt_vec3 at = kt_tree_vector(&random, -1.0, 1.0);
            const kt_vec3 p = kt_point_position(tree.model, tree.data, b, at);
            const kt_vec3 q = kt_pose_apply(kt_body_pose(tree.model, tree.data, b), at);
            for (int i = 0; i < 3; i++)
                kt_worst_near(&error, components(&p)[i], components(&q)[i], 10.0 * EPS, "tree %d body %d", n, b);
        }
    }
}
