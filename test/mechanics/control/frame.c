/* Jacobians and bias accelerations of points, against poses composed apart from the library and their derivatives. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "along.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { TREES = 60, ROWS = 6 };
static const kt_twist_frame frames[] = {KT_TWIST_ALIGNED, KT_TWIST_BODY, KT_TWIST_WORLD};

static kt_vec3 vector(const long double *x) { return kt_vec3_make((double)x[0], (double)x[1], (double)x[2]); }

static kt_mat3 axes_of(const kt_oracle_body *b) {
    kt_mat3 r;
    r.x = kt_vec3_make((double)b->r[0][0], (double)b->r[1][0], (double)b->r[2][0]);
    r.y = kt_vec3_make((double)b->r[0][1], (double)b->r[1][1], (double)b->r[2][1]);
    r.z = kt_vec3_make((double)b->r[0][2], (double)b->r[1][2], (double)b->r[2][2]);
    return r;
}

/* The twist of a point, from the body's motion. */
static kt_twist twist_of(const kt_oracle_body *b, kt_vec3 at, kt_twist_frame frame) {
    const kt_vec3 w = vector(b->w), arm = kt_mat3_apply(axes_of(b), at);
    kt_twist twist = {.angular = w, .linear = kt_vec3_add(vector(b->u), kt_vec3_cross(w, arm))};
    if (frame == KT_TWIST_BODY) {
        twist.angular = kt_mat3_apply_transposed(axes_of(b), twist.angular);
        twist.linear = kt_mat3_apply_transposed(axes_of(b), twist.linear);
    } else if (frame == KT_TWIST_WORLD) {
        twist.linear = kt_vec3_add(vector(b->u), kt_vec3_cross(vector(b->p), w));
    }
    return twist;
}

static void multiply(const kt_tree *tree, const double *jacobian, const double *v, double out[ROWS]) {
    for (int r = 0; r < ROWS; r++) {
        out[r] = 0.0;
        for (int i = 0; i < tree->nv; i++)
            out[r] += jacobian[ROWS * i + r] * v[i];
    }
}

static void compare(kt_worst *error, const double *x, const double *y, double size, int n, int b, int frame) {
    for (int r = 0; r < ROWS; r++)
        kt_worst_near(error, x[r], y[r], size, "tree %d body %d frame %d row %d", n, b, frame, r);
}

/* Bounds of this file: measured over 20 seeds, the worst of which is about half of the bound. */
KT_TEST(jacobians_times_velocities_are_twists_in_each_frame) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("J v against the twist");
    for (int n = 0; n < TREES; n++) {
        static double jacobian[ROWS * KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        kt_oracle_body bodies[KT_TREE_SLOTS];
        along_grow(&tree, n, &random, &s);
        kt_tree_kinematics(&tree, &s);
        kt_oracle_motion(&tree, s.q, s.v, NULL, bodies);
        for (int b = 1; b < tree.count; b++)
            for (int f = 0; f < 3; f++) {
                const kt_vec3 at = kt_tree_vector(&random, -1.0, 1.0);
                double twist[ROWS];
                const kt_twist expected = twist_of(&bodies[b], at, frames[f]);
                kt_frame_jacobian(tree.model, tree.data, b, at, frames[f], jacobian);
                multiply(&tree, jacobian, s.v, twist);
                compare(&error, twist, (const double *)&expected, 4e-14, n, b, f);
            }
    }
}

/* The state's own accelerations are in the data, and must not enter. */
KT_TEST(bias_is_the_acceleration_that_velocities_alone_give) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("J' v against the acceleration at rest of all rates");
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_oracle_body bodies[KT_TREE_SLOTS];
        along_grow(&tree, n, &random, &s);
        kt_tree_kinematics(&tree, &s);
        memset(s.a, 0, sizeof s.a);
        kt_oracle_motion(&tree, s.q, s.v, s.a, bodies);
        for (int b = 1; b < tree.count; b++) {
            const kt_vec3 at = kt_tree_vector(&random, -1.0, 1.0), arm = kt_mat3_apply(axes_of(&bodies[b]), at);
            const kt_vec3 w = vector(bodies[b].w), alpha = vector(bodies[b].alpha);
            const kt_vec3 around = kt_vec3_cross(w, kt_vec3_cross(w, arm));
            const kt_vec3 a = kt_vec3_add(kt_vec3_add(vector(bodies[b].a), kt_vec3_cross(alpha, arm)), around);
            const kt_twist expected = {.angular = alpha, .linear = a};
            const kt_twist bias = kt_frame_bias(tree.model, tree.data, b, at, KT_TWIST_ALIGNED);
            compare(&error, (const double *)&bias, (const double *)&expected, 5e-14, n, b, 0);
        }
    }
}

/* J v of all bodies in all frames. */
static bool all_twists(const kt_tree *tree, const double *q, const double *v, double *out) {
    static double jacobian[ROWS * KT_TREE_NV];
    kt_error e;
    kt_need_fine("kinematics", kt_kinematics_update(tree->model, tree->data, q, v, NULL, &e), &e);
    for (int b = 1; b < tree->count; b++)
        for (int f = 0; f < 3; f++, out += ROWS) {
            kt_frame_jacobian(tree->model, tree->data, b, kt_vec3_make(0.3, -0.2, 0.1 * b), frames[f], jacobian);
            multiply(tree, jacobian, v, out);
        }
    return true;
}

KT_TEST(bias_is_the_derivative_of_the_jacobian_times_velocities_in_each_frame) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("J' v against differences");
    for (int n = 0; n < TREES; n++) {
        static double rate[ALONG_MOST];
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        kt_need(along_differentiate(&tree, &s, all_twists, 3 * ROWS * (tree.count - 1), rate));
        kt_tree_kinematics(&tree, &s);
        for (int b = 1; b < tree.count; b++)
            for (int f = 0; f < 3; f++) {
                const kt_twist bias =
                    kt_frame_bias(tree.model, tree.data, b, kt_vec3_make(0.3, -0.2, 0.1 * b), frames[f]);
                compare(&error, (const double *)&bias, rate + ROWS * (3 * (b - 1) + f), 4e-12, n, b, f);
            }
    }
}

/* ---- their derivatives ------------------------------------------------------------------------------------------- */

static const kt_vec3 there = {0.3, -0.2, 0.4};

/* J of the last body in all frames. */
static bool all_jacobians(const kt_tree *tree, const double *q, const double *v, double *out) {
    kt_error e;
    kt_need_fine("kinematics", kt_kinematics_update(tree->model, tree->data, q, v, NULL, &e), &e);
    for (int f = 0; f < 3; f++)
        kt_frame_jacobian(tree->model, tree->data, tree->count - 1, there, frames[f], out + ROWS * tree->nv * f);
    return true;
}

KT_TEST(jacobian_derivative_is_that_of_differences_in_time) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("dJ/dt against differences");
    for (int n = 0; n < TREES; n++) {
        static double rate[ALONG_MOST], derivative[ROWS * KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        kt_need(along_differentiate(&tree, &s, all_jacobians, 3 * ROWS * tree.nv, rate));
        kt_tree_kinematics(&tree, &s);
        for (int f = 0; f < 3; f++) {
            kt_frame_jacobian_derivative(tree.model, tree.data, tree.count - 1, there, frames[f], derivative);
            for (int i = 0; i < ROWS * tree.nv; i++)
                kt_worst_near(&error, derivative[i], rate[ROWS * tree.nv * f + i], 4e-12, "tree %d frame %d number %d",
                              n, f, i);
        }
    }
}

/* Central differences of order eight of J v along q (+) e_j. */
static void difference_twist(const kt_tree *tree, const kt_tree_state *s, int j, kt_twist_frame frame,
                             double out[ROWS]) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    static double jacobian[ROWS * KT_TREE_NV];
    const double step = 5e-3;
    kt_error e;
    memset(out, 0, ROWS * sizeof *out);
    for (int k = -4; k <= 4; k++) {
        double q[KT_TREE_NQ], move[KT_TREE_NV] = {0.0}, twist[ROWS];
        move[j] = k * step;
        kt_position_add(tree->model, s->q, move, q);
        if (k == 0)
            continue;
        kt_need_fine("kinematics", kt_kinematics_update(tree->model, tree->data, q, s->v, NULL, &e), &e);
        kt_frame_jacobian(tree->model, tree->data, tree->count - 1, there, frame, jacobian);
        multiply(tree, jacobian, s->v, twist);
        for (int r = 0; r < ROWS; r++)
            out[r] += (k < 0 ? -weight[-k - 1] : weight[k - 1]) / step * twist[r];
    }
}

/* Both matrices times v are the bias acceleration, which is computed otherwise. */
KT_TEST(twist_derivative_is_that_of_differences_and_both_give_the_bias) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("d(J v)/dq against differences"), bias = kt_worst_make("times v");
    for (int n = 0; n < TREES; n++) {
        static double matrix[2][ROWS * KT_TREE_NV];
        kt_tree tree;
        kt_tree_state s;
        along_grow(&tree, n, &random, &s);
        const kt_twist_frame frame = frames[n % 3];
        kt_tree_kinematics(&tree, &s);
        const kt_twist known = kt_frame_bias(tree.model, tree.data, tree.count - 1, there, frame);
        kt_frame_jacobian_derivative(tree.model, tree.data, tree.count - 1, there, frame, matrix[0]);
        kt_frame_twist_derivative(tree.model, tree.data, tree.count - 1, there, frame, matrix[1]);
        for (int k = 0; k < 2; k++) {
            double product[ROWS];
            multiply(&tree, matrix[k], s.v, product);
            compare(&bias, product, (const double *)&known, 4e-14, n, k, (int)frame);
        }
        for (int j = 0; j < tree.nv; j++) {
            double column[ROWS];
            difference_twist(&tree, &s, j, frame, column);
            compare(&error, matrix[1] + ROWS * j, column, 4e-12, n, j, (int)frame);
        }
    }
}

/* Into the axes S of a marker, of a twist in those of its body. */
static kt_twist turned(kt_twist twist, kt_mat3 axes, kt_twist_frame frame) {
    if (frame == KT_TWIST_BODY) {
        twist.angular = kt_mat3_apply_transposed(axes, twist.angular);
        twist.linear = kt_mat3_apply_transposed(axes, twist.linear);
    }
    return twist;
}

/* Markers of random trees are turned by the Euler vector that is their place (tree.c). */
static void check_marker(const kt_tree *tree, const kt_tree_state *s, const kt_oracle_body *bodies, int b,
                         kt_worst error[3]) {
    static double jacobian[ROWS * KT_TREE_NV], change[ROWS * KT_TREE_NV];
    const int body = kt_body_find(tree->model, tree->body[b].name), m = kt_marker_find(tree->model, body, "tip");
    const kt_vec3 at = tree->body[b].markers[0].at;
    const kt_mat3 own = kt_mat3_from_euler_vector(at), axes = axes_of(&bodies[body]);
    const kt_pose pose = kt_marker_pose(tree->model, tree->data, body, m);
    const kt_mat3 expected = kt_mat3_multiply(axes, own);
    const kt_vec3 place = kt_vec3_add(vector(bodies[body].p), kt_mat3_apply(axes, at));
    for (int i = 0; i < 9; i++)
        kt_worst_near(&error[0], (&pose.rotation.x.x)[i], (&expected.x.x)[i], 4e-15, "body %d entry %d", b, i);
    for (int i = 0; i < 3; i++)
        kt_worst_near(&error[0], (&pose.position.x)[i], (&place.x)[i], 2e-14, "body %d place %d", b, i);
    for (int f = 0; f < 3; f++) {
        double product[ROWS];
        const kt_twist twist = turned(twist_of(&bodies[body], at, frames[f]), own, frames[f]);
        const kt_twist bias = turned(kt_frame_bias(tree->model, tree->data, body, at, frames[f]), own, frames[f]);
        const kt_twist its = kt_marker_bias(tree->model, tree->data, body, m, frames[f]);
        kt_marker_jacobian(tree->model, tree->data, body, m, frames[f], jacobian);
        multiply(tree, jacobian, s->v, product);
        compare(&error[1], product, (const double *)&twist, 4e-14, 0, b, f);
        compare(&error[2], (const double *)&its, (const double *)&bias, 4e-14, 0, b, f);
        kt_marker_jacobian_derivative(tree->model, tree->data, body, m, frames[f], change);
        multiply(tree, change, s->v, product);
        compare(&error[2], product, (const double *)&bias, 4e-14, 1, b, f);
        kt_marker_twist_derivative(tree->model, tree->data, body, m, frames[f], change);
        multiply(tree, change, s->v, product);
        compare(&error[2], product, (const double *)&bias, 4e-14, 2, b, f);
    }
}

KT_TEST(markers_have_the_quantities_of_their_frames) {
    kt_random random = kt_random_of_test();
    kt_worst error[3] = {kt_worst_make("pose of a marker"), kt_worst_make("J v in its axes"),
                         kt_worst_make("J' v in its axes")};
    for (int n = 0; n < TREES; n++) {
        kt_tree tree;
        kt_tree_state s;
        kt_oracle_body bodies[KT_TREE_SLOTS];
        along_grow(&tree, n, &random, &s);
        kt_tree_kinematics(&tree, &s);
        kt_oracle_motion(&tree, s.q, s.v, NULL, bodies);
        for (int b = 0; b + 1 < tree.count; b++)
            check_marker(&tree, &s, bodies, b, error);
    }
    for (int k = 0; k < 3; k++)
        kt_check_worst(&error[k]);
}

KT_TEST(marker_that_there_is_not_gives_nan) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    double one = 5.0;
    along_grow(&tree, 0, &random, &s);
    kt_tree_kinematics(&tree, &s);
    kt_check_true("pose", isnan(kt_marker_pose(tree.model, tree.data, 1, 1).position.x));
    kt_check_true("rotation", isnan(kt_marker_rotation(tree.model, 1, 1).x.x));
    kt_check_true("bias", isnan(kt_marker_bias(tree.model, tree.data, 1, -1, KT_TWIST_BODY).linear.x));
    kt_marker_jacobian(tree.model, tree.data, 1, 1, KT_TWIST_BODY, &one);
    kt_check_near("untouched", one, 5.0, 0.0);
}

KT_TEST(a_frame_that_is_none_gives_no_numbers) {
    kt_random random = kt_random_of_test();
    kt_tree tree;
    kt_tree_state s;
    const kt_tree_plan plan = kt_tree_plan_default();
    static const double seven = 7.0;
    double matrix[6 * KT_TREE_NV];
    int changed = 0, finite = 0;
    kt_tree_grow(&tree, &plan, &random);
    kt_tree_state_draw(&tree, &random, &s);
    kt_tree_kinematics(&tree, &s);
    for (int frame = -1; frame <= 99; frame += 4) {
        if (frame >= KT_TWIST_ALIGNED && frame <= KT_TWIST_WORLD)
            continue;
        for (int i = 0; i < 6 * tree.nv; i++)
            matrix[i] = seven;
        kt_frame_jacobian(tree.model, tree.data, 1, kt_vec3_make(0.1, 0.2, 0.3), (kt_twist_frame)frame, matrix);
        kt_frame_jacobian_derivative(tree.model, tree.data, 1, kt_vec3_make(0.1, 0.2, 0.3), (kt_twist_frame)frame,
                                     matrix);
        kt_frame_twist_derivative(tree.model, tree.data, 1, kt_vec3_make(0.1, 0.2, 0.3), (kt_twist_frame)frame, matrix);
        for (int i = 0; i < 6 * tree.nv; i++)
            changed += memcmp(&matrix[i], &seven, sizeof seven) != 0;
        const kt_twist bias =
            kt_frame_bias(tree.model, tree.data, 1, kt_vec3_make(0.1, 0.2, 0.3), (kt_twist_frame)frame);
        finite += isfinite(bias.angular.x) || isfinite(bias.linear.x);
    }
    kt_check_equal_int("numbers of matrices that have changed", changed, 0);
    kt_check_equal_int("twists with a number", finite, 0);
}
