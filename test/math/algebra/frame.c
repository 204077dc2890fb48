/* Poses, triads, the nearest rotation, and the small matrix helpers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>

#define EPS DBL_EPSILON

static kt_pose random_pose(kt_random *random) {
    kt_pose p;
    p.rotation = kt_reference_random(random);
    p.position = kt_reference_direction(random, kt_random_uniform(random, 0.1, 2.0));
    return p;
}

/* Positions are below 4 m, each coordinate a sum of seven rounded terms. */
KT_TEST(poses_compose_and_invert) {
    kt_random random = kt_random_of_test();
    KT_WORST chain = kt_worst_make("(a b) u - a (b u)"), back = kt_worst_make("a^-1 a u - u");
    KT_WORST group = kt_worst_make("(a b)^-1 - b^-1 a^-1");
    for (int n = 0; n < 500; n++) {
        const kt_pose a = random_pose(&random), b = random_pose(&random), ab = kt_pose_compose(a, b);
        const kt_vec3 u = kt_reference_direction(&random, 1.0);
        const kt_vec3 off = kt_vec3_sub(kt_pose_apply(ab, u), kt_pose_apply(a, kt_pose_apply(b, u)));
        kt_worst_below(&chain, kt_vec3_norm(off), 10.0 * EPS, "%d", n);
        const kt_vec3 again = kt_pose_apply(kt_pose_invert(a), kt_pose_apply(a, u));
        kt_worst_below(&back, kt_vec3_norm(kt_vec3_sub(again, u)), 10.0 * EPS, "%d", n);
        const kt_pose left = kt_pose_invert(ab), right = kt_pose_compose(kt_pose_invert(b), kt_pose_invert(a));
        kt_worst_below(&group, kt_vec3_norm(kt_vec3_sub(left.position, right.position)), 10.0 * EPS, "%d", n);
        kt_worst_below(&group, kt_reference_distance(left.rotation, right.rotation), 0.0, "rotation, %d", n);
    }
    const kt_vec3 u = {1.0, 2.0, 3.0}, same = kt_pose_apply(kt_pose_identity(), u);
    kt_check_equal_bits("identity", &same.x, &u.x, 3);
}

/* A quarter turn about z, then one metre along the new x, which is the old y. */
KT_TEST(pose_takes_local_points_to_the_reference_frame) {
    kt_pose a = kt_pose_identity();
    a.rotation = kt_mat3_about(2, 0.5 * KT_PI);
    a.position = kt_vec3_make(10.0, 20.0, 30.0);
    const kt_vec3 p = kt_pose_apply(a, kt_vec3_make(1.0, 0.0, 0.0));
    kt_check_near("x", p.x, 10.0, EPS);
    kt_check_near("y", p.y, 21.0, EPS);
    kt_check_near("z", p.z, 30.0, EPS);
}

KT_TEST(skew_matrix_is_the_cross_product) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("(u x) v - u x v"), volume = kt_worst_make("det R");
    for (int n = 0; n < 200; n++) {
        const kt_vec3 u = kt_reference_direction(&random, 1.0), v = kt_reference_direction(&random, 1.0);
        const kt_vec3 off = kt_vec3_sub(kt_mat3_apply(kt_mat3_skew(u), v), kt_vec3_cross(u, v));
        kt_worst_below(&error, kt_vec3_norm(off), 0.0, "%d", n);
        kt_worst_near(&volume, kt_mat3_determinant(kt_reference_random(&random)), 1.0, 3.0 * EPS, "%d", n);
    }
    const kt_mat3 left = {{0.0, 1.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 0.0, 2.0}};
    kt_check_near("det of a mirror stretched twice", kt_mat3_determinant(left), -2.0, 0.0);
}

/* Rdot = omega x R against the difference of two turned matrices. The error is h^2 / 6 |omega|^3 and EPS / h. */
KT_TEST(matrix_rate_is_the_derivative_and_returns) {
    kt_random random = kt_random_of_test();
    KT_WORST derivative = kt_worst_make("Rdot"), back = kt_worst_make("omega -> Rdot -> omega");
    const double h = 1e-5;
    for (int n = 0; n < 200; n++) {
        const kt_mat3 r = kt_reference_random(&random);
        const kt_vec3 omega = kt_reference_direction(&random, 1.0);
        const kt_mat3 rate = kt_mat3_rate_world(r, omega);
        const kt_mat3 after = kt_mat3_multiply(kt_mat3_from_euler_vector(kt_vec3_scale(h, omega)), r);
        const kt_mat3 before = kt_mat3_multiply(kt_mat3_from_euler_vector(kt_vec3_scale(-h, omega)), r);
        const kt_mat3 difference = kt_mat3_scale(0.5 / h, kt_mat3_add(after, kt_mat3_scale(-1.0, before)));
        kt_worst_below(&derivative, kt_reference_distance(rate, difference), h * h / 6.0 + 3.0 * EPS / h, "%d", n);
        kt_worst_below(&back, kt_vec3_norm(kt_vec3_sub(kt_mat3_angular_world(r, rate), omega)), 4.0 * EPS, "%d", n);
    }
}

KT_TEST(vectors_of_any_size_are_normalised) {
    kt_random random = kt_random_of_test();
    KT_WORST length = kt_worst_make("|a / |a|| - 1"), direction = kt_worst_make("a / |a| - n"),
             norm = kt_worst_make("|a|, relative");
    for (int n = 0; n < 2000; n++) {
        const double size = n % 4 == 0 ? kt_reference_magnitude(&random, -141.0, -139.0)
                                       : kt_reference_magnitude(&random, -300.0, 307.0);
        const kt_vec3 unit = kt_reference_direction(&random, 1.0), a = kt_vec3_scale(size, unit),
                      b = kt_vec3_normalize(a);
        kt_worst_near(&length, kt_vec3_norm(b), 1.0, 3.0 * EPS, "|a| = %g", size);
        kt_worst_below(&direction, kt_vec3_norm(kt_vec3_sub(b, unit)), 4.0 * EPS, "|a| = %g", size);
        kt_worst_near(&norm, kt_vec3_norm_wide(a) / size, 1.0, 4.0 * EPS, "|a| = %g", size);
    }
    kt_check_near("smallest number", kt_vec3_normalize(kt_vec3_make(0.0, -0x1p-1074, 0.0)).y, -1.0, 0.0);
    kt_check_true("zero gives NaN", isnan(kt_vec3_normalize(kt_vec3_make(0.0, 0.0, 0.0)).x));
}

/* ---- the nearest rotation ---------------------------------------------------------------------------------------- */

/* Q = R exactly where A = R S with S symmetric and positive: the factors of the polar decomposition are unique. */
KT_TEST(nearest_rotation_is_the_polar_factor) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("Q - R"), skewness = kt_worst_make("Q'Q - I");
    for (int n = 0; n < 1000; n++) {
        const double size = kt_reference_magnitude(&random, -16.0, -1.0);
        const kt_mat3 r = kt_reference_random(&random);
        double e[6];
        for (int i = 0; i < 6; i++)
            e[i] = kt_random_uniform(&random, -size, size);
        const kt_mat3 stretch = {{1.0 + e[0], e[3], e[4]}, {e[3], 1.0 + e[1], e[5]}, {e[4], e[5], 1.0 + e[2]}};
        const kt_mat3 q = kt_mat3_orthonormalize(kt_mat3_multiply(r, stretch));
        kt_worst_below(&error, kt_reference_distance(q, r), 4.0 * EPS, "stretch %g", size);
        kt_worst_below(&skewness, kt_reference_skewness(q), 4.0 * EPS, "stretch %g", size);
    }
}

/* ---- triads ------------------------------------------------------------------------------------------------------ */

static double column_of(kt_mat3 m, int col, int row) {
    return kt_reference_component(kt_reference_column(m, col % 3), row);
}

/* The columns start at `which`, in cyclic order. For an axis +e_m they are e_m, e_m+1, e_m+2. For -e_m they are -e_m,
 * e_m+1, -e_m+2. */
KT_TEST(triad_about_a_coordinate_axis_is_an_exact_cyclic_permutation) {
    KT_WORST error = kt_worst_make("entries 0, 1, -1"), zeros = kt_worst_make("no -0");
    for (int which = 0; which < 3; which++)
        for (int m = 0; m < 3; m++)
            for (int s = 1; s >= -1; s -= 2) {
                double n[3] = {s * -0.0, s * 0.0, -0.0};
                n[m] = s;
                const kt_mat3 triad = kt_triad_from_axis(kt_vec3_make(n[0], n[1], n[2]), which);
                for (int row = 0; row < 3; row++) {
                    const double expected[3] = {s * (row == m), row == (m + 1) % 3, s * (row == (m + 2) % 3)};
                    for (int k = 0; k < 3; k++) {
                        const double entry = column_of(triad, which + k, row);
                        kt_worst_near(&error, entry, expected[k], 0.0, "axis %d %d, which %d", s, m, which);
                        kt_worst_below(&zeros, entry == 0.0 && signbit(entry) ? 1.0 : 0.0, 0.0, "axis %d %d", s, m);
                    }
                }
                if (m == which && s == 1)
                    kt_worst_below(&error, kt_reference_distance(triad, kt_mat3_identity()), 0.0, "identity %d", m);
            }
    const kt_mat3 plane = kt_triad_from_axis(kt_vec3_make(1.0, 0.0, 0.0), 2);
    kt_check_true("plane about x: y, z", plane.x.y == 1.0 && plane.y.z == 1.0 && plane.z.x == 1.0);
}

/* The least rotation between the nearest coordinate axis and n: that about their cross product. */
KT_TEST(triad_about_any_axis_is_the_nearest_cyclic_one_turned_least) {
    kt_random random = kt_random_of_test();
    KT_WORST skewness = kt_worst_make("orthonormal"), hand = kt_worst_make("right-handed"),
             column = kt_worst_make("axis");
    KT_WORST least = kt_worst_make("least rotation");
    for (int n = 0; n < 3000; n++) {
        const int which = n % 3;
        kt_vec3 axis = kt_reference_direction(&random, 1.0);
        if (n % 2 == 0) { /* next to a coordinate axis */
            const kt_vec3 small = kt_reference_direction(&random, kt_reference_magnitude(&random, -20.0, -1.0));
            const double e = n % 4 == 0 ? 1.0 : -1.0;
            const int m = kt_random_int(&random, 0, 2);
            axis = kt_vec3_normalize(kt_vec3_add(kt_vec3_scale(e, kt_reference_column(kt_mat3_identity(), m)), small));
        }
        const kt_mat3 triad = kt_triad_from_axis(axis, which);
        kt_worst_below(&skewness, kt_reference_skewness(triad), 4.0 * EPS, "%d", n);
        kt_worst_near(&hand, kt_mat3_determinant(triad), 1.0, 4.0 * EPS, "%d", n);
        kt_worst_below(&column, kt_vec3_norm(kt_vec3_sub(kt_reference_column(triad, which), axis)), 0.0, "%d", n);
        int m = 0;
        for (int i = 1; i < 3; i++)
            if (fabs(kt_reference_component(axis, i)) > fabs(kt_reference_component(axis, m)))
                m = i;
        const double s = kt_reference_component(axis, m) > 0.0 ? 1.0 : -1.0;
        const kt_vec3 nearest = kt_vec3_scale(s, kt_reference_column(kt_mat3_identity(), m));
        const kt_vec3 about = kt_vec3_cross(nearest, axis);
        const double sine = kt_vec3_norm(about), angle = atan2(sine, kt_vec3_dot(nearest, axis));
        const kt_mat3 turn = kt_mat3_from_euler_vector(kt_vec3_scale(sine > 0.0 ? angle / sine : 0.0, about));
        const kt_mat3 expected = kt_mat3_multiply(turn, kt_triad_from_axis(nearest, which));
        kt_worst_below(&least, kt_reference_distance(triad, expected), 5.0 * EPS, "%d", n);
    }
}

KT_TEST(triad_where_several_axes_are_nearest_takes_the_one_asked_for) {
    const double third = sqrt(1.0 / 3.0), half = sqrt(0.5);
    KT_WORST error = kt_worst_make("continuous towards the axis chosen");
    for (int which = 0; which < 3; which++) {
        double n[3] = {third, third, third};
        const kt_mat3 tie = kt_triad_from_axis(kt_vec3_make(n[0], n[1], n[2]), which);
        n[which] += 1e-9;
        const kt_mat3 alone = kt_triad_from_axis(kt_vec3_normalize(kt_vec3_make(n[0], n[1], n[2])), which);
        kt_worst_below(&error, kt_reference_distance(tie, alone), 2e-9, "three, which %d", which);
        double two[3] = {half, half, half};
        two[which] = 0.0;
        const kt_mat3 pair = kt_triad_from_axis(kt_vec3_make(two[0], two[1], two[2]), which);
        two[(which + 1) % 3] += 1e-9;
        const kt_mat3 near_pair = kt_triad_from_axis(kt_vec3_normalize(kt_vec3_make(two[0], two[1], two[2])), which);
        kt_worst_below(&error, kt_reference_distance(pair, near_pair), 2e-9, "two, which %d", which);
    }
}
