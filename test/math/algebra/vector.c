/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON

/* Every size of angle: 1e-300 to 1 in powers, then up to four turns. The angle is rounded once, so bounds grow with it.
 */
static kt_vec3 random_vector(kt_random *random, int n, double *size) {
    *size = n % 2 == 0 ? kt_reference_magnitude(random, -300.0, 0.0) : kt_random_uniform(random, 0.0, 8.0 * KT_PI);
    return kt_reference_direction(random, *size);
}

static kt_reference_matrix exponential(kt_vec3 theta) {
    return kt_reference_real(kt_reference_exponential, 0, (double[3]){theta.x, theta.y, theta.z}, 3);
}

/* Entry by entry: (sin t / t) theta x + theta x theta x (...) bounded by |theta_k| + |theta_i theta_j| / 2 off the
 * diagonal. */
KT_TEST(matrix_of_an_euler_vector_is_the_exponential_series) {
    kt_random random = kt_random_of_test();
    KT_WORST diagonal = kt_worst_make("diagonal"), off = kt_worst_make("off the diagonal, relative");
    KT_WORST skewness = kt_worst_make("R'R - I");
    for (int n = 0; n < 4000; n++) {
        double t;
        const kt_vec3 theta = random_vector(&random, n, &t);
        const kt_mat3 r = kt_mat3_from_euler_vector(theta);
        const kt_reference_matrix e = exponential(theta);
        kt_worst_below(&skewness, kt_reference_skewness(r), 8.0 * EPS, "|theta| = %g", t);
        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            const double ti = fabs(kt_reference_component(theta, i)), tj = fabs(kt_reference_component(theta, j));
            const double tk = fabs(kt_reference_component(theta, k));
            const double size = t < 1.0 ? tk + 0.5 * ti * tj : fmax(1.0, t);
            kt_worst_near(&diagonal, kt_reference_entry(r, i, i), (double)creall(e.m[i][i]), 2.0 * EPS * fmax(1.0, t),
                          "|theta| = %g", t);
            kt_worst_near(&off, kt_reference_entry(r, i, j), (double)creall(e.m[i][j]), 3.0 * EPS * size,
                          "|theta| = %g", t);
            kt_worst_near(&off, kt_reference_entry(r, j, i), (double)creall(e.m[j][i]), 3.0 * EPS * size,
                          "|theta| = %g", t);
        }
    }
}

KT_TEST(no_rotation_is_exact) {
    const kt_vec3 zero = {0.0, 0.0, 0.0};
    const kt_mat3 identity = kt_mat3_identity();
    kt_check_below("exp(0) - I", kt_reference_distance(kt_mat3_from_euler_vector(zero), identity), 0.0);
    kt_check_below("log(I)", kt_vec3_norm(kt_euler_vector_from_mat3(identity)), 0.0);
    kt_check_below("log(1, 0, 0, 0)", kt_vec3_norm(kt_euler_vector_from_quat(kt_quat_identity())), 0.0);
    kt_check_below("G(0) - I", kt_reference_distance(kt_euler_vector_map(zero), identity), 0.0);
    kt_mat3 inverse = kt_mat3_identity();
    kt_check_equal_int("status", kt_euler_vector_map_inverse(zero, &inverse, NULL), KT_OK);
    kt_check_below("G(0)^-1 - I", kt_reference_distance(inverse, identity), 0.0);
    const kt_quat q = kt_quat_from_euler_vector(zero);
    kt_check_near("w", q.w, 1.0, 0.0);
    kt_check_below("v", fabs(q.x) + fabs(q.y) + fabs(q.z), 0.0);
}

/* |theta| has fifteen bits, and half angles are taken on the way. */
KT_TEST(subnormal_vectors_pass_unchanged) {
    const kt_vec3 tiny = {0x1p-1070, 0.0, -0x1p-1060};
    const kt_mat3 r = kt_mat3_from_euler_vector(tiny), g = kt_euler_vector_map(tiny);
    kt_check_near("R32", r.y.z, tiny.x, 0.0);
    kt_check_near("R21", r.x.y, tiny.z, 0.0);
    kt_check_near("G21, theta_z / 2", g.x.y, 0.5 * tiny.z, 0.0);
    const kt_vec3 back = kt_euler_vector_from_mat3(r);
    kt_check_near("z back", back.z, tiny.z, 0.0);
}

/* The vector comes back with an error of a few EPS of itself, at any size up to half a turn. The matrix is rounded to
 * EPS / 2 of entries as large as |theta|. The angle is then well conditioned in the quaternion. */
KT_TEST(euler_vector_of_a_matrix_returns) {
    kt_random random = kt_random_of_test();
    KT_WORST matrix = kt_worst_make("theta -> R -> theta, relative"),
             quat = kt_worst_make("theta -> q -> theta, relative");
    KT_WORST opposite = kt_worst_make("theta -> -q -> theta, relative");
    for (int n = 0; n < 4000; n++) {
        const double t =
            n % 2 == 0 ? kt_reference_magnitude(&random, -300.0, 0.0) : kt_random_uniform(&random, 0.0, KT_PI);
        const kt_vec3 theta = kt_reference_direction(&random, t);
        const kt_vec3 back = kt_euler_vector_from_mat3(kt_reference_rounded(exponential(theta)));
        kt_worst_below(&matrix, kt_vec3_norm_wide(kt_vec3_sub(back, theta)) / t, 6.0 * EPS, "|theta| = %.17g", t);
        const kt_quat q = kt_quat_from_euler_vector(theta);
        const kt_vec3 log = kt_euler_vector_from_quat(q);
        kt_worst_below(&quat, kt_vec3_norm_wide(kt_vec3_sub(log, theta)) / t, 4.0 * EPS, "|theta| = %.17g", t);
        const kt_vec3 same = kt_euler_vector_from_quat(kt_quat_make(-3.0 * q.w, -3.0 * q.x, -3.0 * q.y, -3.0 * q.z));
        kt_worst_below(&opposite, kt_vec3_norm_wide(kt_vec3_sub(same, theta)) / t, 4.0 * EPS, "|theta| = %.17g", t);
    }
}

KT_TEST(euler_vector_is_accurate_near_half_a_turn) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("theta -> R -> theta"), at = kt_worst_make("|theta| at half a turn");
    for (int n = 0; n < 2000; n++) {
        const double t = KT_PI - kt_reference_magnitude(&random, -14.0, -1.0);
        const kt_vec3 theta = kt_reference_direction(&random, t);
        const kt_vec3 back = kt_euler_vector_from_mat3(kt_reference_rounded(exponential(theta)));
        kt_worst_below(&error, kt_vec3_norm(kt_vec3_sub(back, theta)), 4.0 * EPS * KT_PI, "pi - |theta| = %g",
                       KT_PI - t);
    }
    /* Exactly half a turn, R = 2 n n' - I: n or -n, and the angle is pi. */
    for (int n = 0; n < 500; n++) {
        const kt_vec3 axis = kt_reference_direction(&random, 1.0);
        const kt_quat q = kt_quat_make(0.0, axis.x, axis.y, axis.z);
        const kt_vec3 back = kt_euler_vector_from_mat3(kt_mat3_from_quat(q));
        kt_worst_near(&at, kt_vec3_norm(back), KT_PI, 2.0 * EPS * KT_PI, "%d", n);
        kt_worst_below(&error, kt_vec3_norm(kt_vec3_cross(back, axis)), 4.0 * EPS * KT_PI, "half a turn, %d", n);
    }
    const kt_mat3 about_y = {{-1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, -1.0}};
    kt_check_near("half a turn about y", kt_euler_vector_from_mat3(about_y).y, KT_PI, 0.0);
}

KT_TEST(euler_vector_is_an_elementary_rotation_about_a_tilted_axis) {
    kt_random random = kt_random_of_test();
    KT_WORST tilted = kt_worst_make("R3 R2 R3(t) R2' R3' - R(theta)"), axes = kt_worst_make("about coordinate axes");
    KT_WORST bits = kt_worst_make("R with theta along z keeps z, exactly");
    for (int n = 0; n < 1000; n++) {
        double t;
        const kt_vec3 theta = random_vector(&random, n, &t);
        const kt_mat3 r = kt_mat3_from_euler_vector(theta);
        const double azimuth = atan2(theta.y, theta.x), tilt = atan2(hypot(theta.x, theta.y), theta.z);
        const kt_mat3 q = kt_mat3_multiply(kt_mat3_about(2, azimuth), kt_mat3_about(1, tilt)); /* z to theta */
        const kt_mat3 product = kt_mat3_multiply(kt_mat3_multiply(q, kt_mat3_about(2, t)), kt_mat3_transpose(q));
        kt_worst_below(&tilted, kt_reference_distance(product, r), 2.0 * EPS * fmax(2.0, t), "|theta| = %g", t);
        for (int axis = 0; axis < 3; axis++) {
            const kt_vec3 along = kt_vec3_scale(t, kt_reference_column(kt_mat3_identity(), axis));
            kt_worst_below(&axes, kt_reference_distance(kt_mat3_from_euler_vector(along), kt_mat3_about(axis, t)),
                           3.0 * EPS, "%g about %d", t, axis);
        }
        const kt_mat3 planar = kt_mat3_from_euler_vector(kt_vec3_make(0.0, 0.0, t));
        kt_worst_below(&bits, fabs(planar.z.x) + fabs(planar.z.y) + fabs(planar.x.z) + fabs(planar.y.z), 0.0, "%g", t);
        kt_worst_near(&bits, planar.z.z, 1.0, 0.0, "%g", t);
    }
}

KT_TEST(huge_vectors_still_give_rotations) {
    const kt_vec3 huge[] = {{1e10, -2e10, 3e10}, {1e160, 1e160, -1e160}, {1.7e308, 0.0, 1.0}};
    for (int n = 0; n < 3; n++) {
        kt_check_below("R'R - I", kt_reference_skewness(kt_mat3_from_euler_vector(huge[n])), 8.0 * EPS);
        kt_check_near("norm of q", kt_quat_norm_squared(kt_quat_from_euler_vector(huge[n])), 1.0, 4.0 * EPS);
    }
    kt_check_true("NaN stays", isnan(kt_mat3_from_euler_vector(kt_vec3_make((double)NAN, 0.0, 0.0)).x.y));
}

/* ---- G ----------------------------------------------------------------------------------------------------------- */

static void check_map(kt_worst *world, kt_worst *body, kt_vec3 theta, double t) {
    const double p[3] = {theta.x, theta.y, theta.z};
    long double in_world[3][4], in_body[3][4];
    kt_reference_map(kt_reference_exponential, 0, p, 3, false, in_world);
    kt_reference_map(kt_reference_exponential, 0, p, 3, true, in_body);
    const kt_mat3 g = kt_euler_vector_map(theta);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            kt_worst_near(world, kt_reference_entry(g, i, k), (double)in_world[i][k], 4.0 * EPS, "|theta| = %g", t);
            kt_worst_near(body, kt_reference_entry(g, k, i), (double)in_body[i][k], 4.0 * EPS, "|theta| = %g", t);
        }
}

KT_TEST(euler_vector_map_is_the_derivative_of_the_exponential) {
    kt_random random = kt_random_of_test();
    KT_WORST world = kt_worst_make("omega = G thetadot"), body = kt_worst_make("R' omega = G' thetadot");
    for (int n = 0; n < 500; n++) {
        double t;
        const kt_vec3 theta = random_vector(&random, n, &t);
        check_map(&world, &body, theta, t);
    }
    static const double joins[] = {0.9999999, 1.0, 1.0000001, 1.9999999, 2.0, 2.0000001, KT_PI, 2.0 * KT_PI};
    for (int n = 0; n < 8; n++)
        check_map(&world, &body, kt_reference_direction(&random, joins[n]), joins[n]);
}

/* G = sum (theta x)^n / (n + 1)!, and G^-1 = sum B_n (theta x)^n / n! with Bernoulli's numbers: for theta = (a, b, 0)
 * the entry 12 has no linear term, so it shows c and e alone, with c = 1/6 - t^2/120 + t^4/5040 - ... and e = 1/12 +
 * t^2/720 + t^4/30240 + t^6/1209600 + ... */
KT_TEST(small_angle_terms_of_the_map_keep_their_digits) {
    kt_random random = kt_random_of_test();
    KT_WORST map = kt_worst_make("c a b, relative"), back = kt_worst_make("e a b, relative");
    for (int n = 0; n < 1000; n++) {
        const double t =
            n % 2 == 0 ? kt_reference_magnitude(&random, -140.0, -2.0) : kt_random_uniform(&random, 0.0, 0.3);
        const double angle = kt_random_uniform(&random, 0.1, 1.4), a = t * cos(angle), b = t * sin(angle);
        const long double la = (long double)a, lb = (long double)b, t2 = la * la + lb * lb;
        const long double c =
            (1.0L -
             t2 / 20.0L * (1.0L - t2 / 42.0L * (1.0L - t2 / 72.0L * (1.0L - t2 / 110.0L * (1.0L - t2 / 156.0L))))) /
            6.0L;
        const long double e =
            (1.0L +
             t2 / 60.0L *
                 (1.0L +
                  t2 / 42.0L * (1.0L + t2 / 40.0L * (1.0L + t2 * 10.0L / 396.0L * (1.0L + t2 * 691.0L / 27300.0L))))) /
            12.0L;
        const kt_vec3 theta = {a, b, 0.0};
        kt_mat3 inverse = kt_mat3_identity();
        if (kt_euler_vector_map_inverse(theta, &inverse, NULL) != KT_OK)
            kt_check_true("status", false);
        kt_worst_near(&map, kt_euler_vector_map(theta).y.x / a / b / (double)c, 1.0, 4.0 * EPS, "t = %g", t);
        kt_worst_near(&back, inverse.y.x / a / b / (double)e, 1.0, 5.0 * EPS, "t = %g", t);
    }
}

/* |G^-1| is about (t/2) / |sin(t/2)|. The angle t itself is rounded. The bound includes both errors. */
KT_TEST(euler_vector_map_times_its_inverse_is_one) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("G G^-1 - I");
    for (int n = 0; n < 4000; n++) {
        double t;
        const kt_vec3 theta = random_vector(&random, n, &t);
        const double condition = fmax(1.0, 0.5 * t / fabs(sin(0.5 * t)));
        kt_mat3 inverse = kt_mat3_identity();
        if (kt_euler_vector_map_inverse(theta, &inverse, NULL) != KT_OK)
            kt_check_true("status", false);
        const kt_mat3 one = kt_mat3_multiply(kt_euler_vector_map(theta), inverse);
        kt_worst_below(&error, kt_reference_distance(one, kt_mat3_identity()), 3.0 * EPS * condition * condition,
                       "|theta| = %g", t);
    }
}

KT_TEST(full_turns_are_reported_as_singular) {
    kt_random random = kt_random_of_test();
    for (int turns = 1; turns <= 4; turns++) {
        const kt_vec3 theta = kt_reference_direction(&random, turns * 2.0 * KT_PI);
        kt_mat3 inverse, before;
        memset(&inverse, 0x55, sizeof inverse);
        before = inverse;
        kt_error error;
        kt_check_equal_int("status", kt_euler_vector_map_inverse(theta, &inverse, &error), KT_ERROR_SINGULAR);
        kt_check_contains("message", error.message, "full turns");
        kt_check_equal_bits("output", &inverse.x.x, &before.x.x, 9);
        const kt_vec3 near = kt_vec3_scale(1.0 + 1e-12, theta);
        kt_check_equal_int("next to it", kt_euler_vector_map_inverse(near, &inverse, &error), KT_OK);
    }
    kt_error error;
    kt_mat3 inverse = kt_mat3_identity();
    kt_check_equal_int("NaN", kt_euler_vector_map_inverse(kt_vec3_make(0.0, (double)NAN, 0.0), &inverse, &error),
                       KT_ERROR_NOT_FINITE);
}

/* ---- axis and angle ---------------------------------------------------------------------------------------------- */

KT_TEST(axis_and_angle_return) {
    kt_random random = kt_random_of_test();
    KT_WORST matrix = kt_worst_make("R"), angles = kt_worst_make("angle, relative"), axes = kt_worst_make("axis");
    for (int n = 0; n < 2000; n++) {
        const double a =
            n % 2 == 0 ? kt_reference_magnitude(&random, -300.0, 0.0) : kt_random_uniform(&random, 0.0, KT_PI);
        const double length = kt_reference_magnitude(&random, -300.0, 300.0);
        const kt_vec3 axis = kt_reference_direction(&random, length);
        const kt_vec3 unit = kt_vec3_scale(1.0 / length, axis);
        const kt_reference_matrix e =
            kt_reference_real(kt_reference_axis_angle, 0, (double[4]){unit.x, unit.y, unit.z, a}, 4);
        kt_mat3 r = kt_mat3_identity();
        if (kt_mat3_from_axis_angle(axis, a, &r, NULL) != KT_OK)
            kt_check_true("status", false);
        kt_vec3 back = {0.0, 0.0, 0.0};
        double angle;
        kt_axis_angle_from_mat3(r, &back, &angle);
        kt_worst_below(&matrix, kt_reference_difference(r, e), 6.0 * EPS, "angle %g, length %g", a, length);
        kt_worst_near(&angles, angle / a, 1.0, 5.0 * EPS, "angle %g, length %g", a, length);
        kt_worst_below(&axes, kt_vec3_norm(kt_vec3_sub(back, unit)), 5.0 * EPS, "angle %g, length %g", a, length);
    }
    kt_vec3 axis;
    double angle;
    kt_axis_angle_from_mat3(kt_mat3_identity(), &axis, &angle);
    kt_check_true("the identity turns about z by nothing",
                  axis.x == 0.0 && axis.y == 0.0 && axis.z == 1.0 && angle == 0.0);
}

KT_TEST(axis_of_zero_length_is_rejected) {
    kt_error error;
    kt_mat3 r = kt_mat3_identity(), before = r;
    const kt_vec3 zero = {0.0, -0.0, 0.0}, infinite = {0.0, (double)INFINITY, 0.0}, z = {0.0, 0.0, 1.0};
    kt_check_equal_int("zero", kt_mat3_from_axis_angle(zero, 1.0, &r, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("message", error.message, "not zero, such as [0, 0, 1]");
    kt_check_equal_int("infinite", kt_mat3_from_axis_angle(infinite, 1.0, &r, &error), KT_ERROR_NOT_FINITE);
    kt_check_equal_int("angle", kt_mat3_from_axis_angle(z, (double)NAN, &r, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("message", error.message, "or angle nan is not finite");
    kt_check_equal_bits("output", &r.x.x, &before.x.x, 9);
    /* of the others z alone is given */
    kt_check_equal_int("z", kt_mat3_from_axis_angle(z, 0.7, &r, &error), KT_OK);
    kt_check_near("cosine", r.x.x, cos(0.7), 2.0 * EPS);
    kt_check_near("sine", r.x.y, sin(0.7), 2.0 * EPS);
}

/* The unit axis moves along a tangent p: the derivative of R along (p, adot). */
KT_TEST(rates_of_axis_and_angle_are_the_derivative_and_return) {
    kt_random random = kt_random_of_test();
    KT_WORST forward = kt_worst_make("omega"), back = kt_worst_make("omega -> rates -> omega");
    KT_WORST tangent = kt_worst_make("n'ndot");
    for (int n = 0; n < 500; n++) {
        const double a =
            n % 2 == 0 ? kt_reference_magnitude(&random, -10.0, 0.0) : kt_random_uniform(&random, 0.0, 6.0);
        const kt_vec3 axis = kt_reference_direction(&random, 1.0), omega = kt_reference_direction(&random, 1.0);
        const kt_vec3 p = kt_vec3_cross(axis, kt_reference_direction(&random, 1.0));
        long double map[3][4];
        kt_reference_map(kt_reference_axis_angle, 0, (double[4]){axis.x, axis.y, axis.z, a}, 4, false, map);
        const kt_vec3 w = kt_axis_angle_angular_world(axis, a, p, 0.7);
        for (int i = 0; i < 3; i++) {
            long double expected = map[i][3] * (long double)0.7;
            for (int k = 0; k < 3; k++)
                expected += map[i][k] * (long double)kt_reference_component(p, k);
            kt_worst_near(&forward, kt_reference_component(w, i), (double)expected, 4.0 * EPS * fmax(1.0, a),
                          "angle %g", a);
        }
        kt_vec3 axis_rate = {0.0, 0.0, 0.0};
        double angle_rate = 0.0;
        if (kt_axis_angle_rate_world(axis, a, omega, &axis_rate, &angle_rate, NULL) != KT_OK)
            kt_check_true("status", false);
        const kt_vec3 again = kt_axis_angle_angular_world(axis, a, axis_rate, angle_rate);
        kt_worst_below(&back, kt_vec3_norm(kt_vec3_sub(again, omega)), 4.0 * EPS, "angle %g", a);
        kt_worst_near(&tangent, kt_vec3_dot(axis, axis_rate), 0.0, 4.0 * EPS / fabs(sin(0.5 * a)), "angle %g", a);
    }
}

KT_TEST(axis_of_no_rotation_has_no_rate) {
    const kt_vec3 z = {0.0, 0.0, 1.0};
    static const double angles[] = {0.0, 1e-16, 2.0 * KT_PI, -4.0 * KT_PI};
    for (int n = 0; n < 4; n++) {
        kt_vec3 axis_rate = {1.0, 2.0, 3.0};
        double angle_rate = 4.0;
        kt_error error;
        kt_check_equal_int("status", kt_axis_angle_rate_world(z, angles[n], z, &axis_rate, &angle_rate, &error),
                           KT_ERROR_SINGULAR);
        kt_check_contains("message", error.message, "an axis has no rate");
        kt_check_true("outputs", axis_rate.x == 1.0 && axis_rate.z == 3.0 && angle_rate == 4.0);
    }
}

KT_TEST(rates_of_what_is_not_finite_are_rejected) {
    const kt_vec3 z = {0.0, 0.0, 1.0}, infinite = {0.0, (double)INFINITY, 0.0};
    const struct {
        kt_vec3 axis, omega;
        double angle;
        const char *words;
    } wrong[] = {{infinite, z, 0.5, "axis [0, inf, 0], angle 0.5"},
                 {z, z, (double)INFINITY, "angle inf or"},
                 {z, infinite, 0.5, "angular velocity [0, inf, 0] is not finite"}};
    for (int n = 0; n < 3; n++) {
        kt_vec3 axis_rate = {1.0, 2.0, 3.0};
        double angle_rate = 4.0;
        kt_error error = {KT_OK, "", ""};
        kt_check_equal_int(
            "status",
            kt_axis_angle_rate_world(wrong[n].axis, wrong[n].angle, wrong[n].omega, &axis_rate, &angle_rate, &error),
            KT_ERROR_NOT_FINITE);
        kt_check_contains("message", error.message, wrong[n].words);
        kt_check_true("outputs", axis_rate.x == 1.0 && axis_rate.z == 3.0 && angle_rate == 4.0);
    }
}

/* The logarithm of q is that of any multiple of it, to the ends of the range of double. */
KT_TEST(euler_vector_of_a_quaternion_does_not_depend_on_its_length) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("difference");
    static const double lengths[] = {1e-300, 1e-160, 1e160, 1e300, -1e-160, -1e160};
    for (int n = 0; n < 200; n++) {
        const kt_vec3 theta = kt_reference_direction(&random, kt_random_uniform(&random, 1e-3, 3.1));
        const kt_quat q = kt_quat_from_euler_vector(theta);
        for (int k = 0; k < 6; k++) {
            const double l = lengths[k];
            const kt_quat p = kt_quat_make(l * q.w, l * q.x, l * q.y, l * q.z);
            const kt_vec3 again = kt_euler_vector_from_quat(p);
            kt_worst_below(&worst, kt_vec3_norm(kt_vec3_sub(again, theta)), 6.0 * EPS * kt_vec3_norm(theta) + EPS * EPS,
                           "length %g", l);
        }
    }
    /* a third of a turn about (1, 1, 1), from the largest numbers and from the smallest */
    static const double ends[] = {DBL_MAX, 5e-324};
    for (int k = 0; k < 2; k++) {
        const kt_vec3 third = kt_euler_vector_from_quat(kt_quat_make(ends[k], ends[k], ends[k], ends[k]));
        kt_check_near("x", third.x, 2.0 * KT_PI / 3.0 / sqrt(3.0), 4.0 * EPS);
        kt_check_near("z", third.z, 2.0 * KT_PI / 3.0 / sqrt(3.0), 4.0 * EPS);
    }
}
