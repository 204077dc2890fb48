/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>

/* Bounds: u = DBL_EPSILON / 2 an operation. A matrix from a quaternion rounds each entry (at most 1) about six times, a
 * quaternion from a matrix each component about five. */
#define EPS DBL_EPSILON

static kt_quat random_unit(kt_random *random) {
    double q[4];
    kt_random_direction(random, 4, q);
    return kt_quat_make(q[0], q[1], q[2], q[3]);
}

static kt_quat scaled(double s, kt_quat q) { return kt_quat_make(s * q.w, s * q.x, s * q.y, s * q.z); }

/* The quaternion itself, or its opposite: whichever is nearer. */
static double distance(kt_quat p, kt_quat q) {
    const double s = p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z < 0.0 ? -1.0 : 1.0;
    return fmax(fmax(fabs(p.w - s * q.w), fabs(p.x - s * q.x)), fmax(fabs(p.y - s * q.y), fabs(p.z - s * q.z)));
}

static kt_reference_matrix reference(kt_quat q) {
    return kt_reference_real(kt_reference_sandwich, 0, (double[4]){q.w, q.x, q.y, q.z}, 4);
}

KT_TEST(products_of_units_are_hamiltons) {
    const kt_quat i = {0.0, 1.0, 0.0, 0.0}, j = {0.0, 0.0, 1.0, 0.0}, k = {0.0, 0.0, 0.0, 1.0};
    const kt_quat minus_one = {-1.0, 0.0, 0.0, 0.0};
    KT_WORST exact = kt_worst_make("ii = jj = kk = -1, ij = k, jk = i, ki = j");
    const kt_quat products[] = {kt_quat_multiply(i, i), kt_quat_multiply(j, j), kt_quat_multiply(k, k),
                                kt_quat_multiply(i, j), kt_quat_multiply(j, k), kt_quat_multiply(k, i)};
    const kt_quat expected[] = {minus_one, minus_one, minus_one, k, i, j};
    for (int n = 0; n < 6; n++) {
        const kt_quat p = products[n], e = expected[n];
        kt_worst_below(&exact, fabs(p.w - e.w) + fabs(p.x - e.x) + fabs(p.y - e.y) + fabs(p.z - e.z), 0.0, "%d", n);
    }
}

KT_TEST(quaternion_product_composes_rotations) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("R(p q) against R(p) R(q)");
    for (int n = 0; n < 1000; n++) {
        const kt_quat p = random_unit(&random), q = random_unit(&random);
        const kt_reference_matrix product = kt_reference_multiply(reference(p), reference(q));
        const kt_mat3 observed = kt_mat3_from_quat(kt_quat_multiply(p, q));
        kt_worst_below(&error, kt_reference_difference(observed, product), 6.0 * EPS, "pair %d", n);
    }
}

/* The reference overflows nowhere: long double has exponents to spare. */
KT_TEST(matrix_of_a_quaternion_of_any_size_is_that_of_the_unit_one) {
    kt_random random = kt_random_of_test();
    static const double scales[] = {1.0,    1.3,    1e-100, 1e-140, 1e-141, 1e-160, 1e-200, 1e-300,
                                    3e-308, 1e-140, 1e139,  1e140,  1e141,  1e154,  1e200,  1.7e308};
    KT_WORST error = kt_worst_make("R(q)"), unit = kt_worst_make("|q / |q|| against 1");
    KT_WORST same = kt_worst_make("R(q / |q|)");
    for (size_t s = 0; s < sizeof scales / sizeof *scales; s++)
        for (int n = 0; n < 100; n++) {
            const kt_quat q = scaled(scales[s], random_unit(&random)), normal = kt_quat_normalize(q);
            kt_worst_below(&error, kt_reference_difference(kt_mat3_from_quat(q), reference(q)), 4.0 * EPS, "scale %g",
                           scales[s]);
            kt_worst_below(&same, kt_reference_difference(kt_mat3_from_quat(normal), reference(q)), 6.0 * EPS,
                           "scale %g", scales[s]);
            kt_worst_near(&unit, sqrt(kt_quat_norm_squared(normal)), 1.0, 3.0 * EPS, "scale %g", scales[s]);
        }
}

KT_TEST(smallest_quaternion_is_a_rotation_and_zero_is_not) {
    const double tiny = 0x1p-1074;
    const kt_quat half = kt_quat_normalize(kt_quat_make(tiny, 0.0, tiny, 0.0));
    kt_check_near("w of (1, 0, 1, 0) 2^-1074", half.w, sqrt(0.5), EPS);
    kt_check_near("y", half.y, sqrt(0.5), EPS);
    const kt_quat zero = kt_quat_normalize(kt_quat_make(0.0, 0.0, 0.0, 0.0));
    kt_check_true("zero gives NaN", isnan(zero.w) && isnan(zero.x) && isnan(zero.y) && isnan(zero.z));
    kt_check_true("and so does its matrix", isnan(kt_mat3_from_quat(kt_quat_make(0.0, 0.0, 0.0, 0.0)).x.x));
    kt_check_true("an infinite one gives NaN", isnan(kt_quat_normalize(kt_quat_make(1.0, HUGE_VAL, 0.0, 0.0)).x));
    kt_check_true("a NaN stays", isnan(kt_quat_normalize(kt_quat_make(1.0, (double)NAN, 0.0, 0.0)).w));
}

/* Every one of the four branches, by a large component at each place, and each tie between them. */
KT_TEST(quaternion_of_a_matrix_returns) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("q -> R -> q");
    int largest[4] = {0};
    for (int n = 0; n < 4000; n++) {
        double p[4];
        kt_random_direction(&random, 4, p);
        if (n % 2 == 1) /* as small as they come, each in turn as the only large one */
            for (int i = 0; i < 4; i++)
                p[i] *= i == n / 2 % 4 ? 1.0 : kt_reference_magnitude(&random, -20.0, 0.0);
        const kt_quat q = kt_quat_normalize(kt_quat_make(p[0], p[1], p[2], p[3]));
        const kt_quat observed = kt_quat_from_mat3(kt_reference_rounded(reference(q)));
        kt_worst_below(&error, distance(observed, q), 3.0 * EPS, "%d: %g %g %g %g", n, q.w, q.x, q.y, q.z);
        kt_worst_below(&error, observed.w < 0.0 ? 1.0 : 0.0, 0.0, "sign of w at %d", n);
        int m = 0;
        for (int i = 1; i < 4; i++)
            m = fabs(p[i]) > fabs(p[m]) ? i : m;
        largest[m]++;
    }
    for (int i = 0; i < 4; i++)
        kt_check_above("cases with this component largest", largest[i], 500.0);
    static const double signs[2] = {1.0, -1.0};
    KT_WORST ties = kt_worst_make("ties");
    for (int n = 1; n < 16; n++)
        for (int s = 0; s < 16; s++) {
            const kt_quat q =
                kt_quat_normalize(kt_quat_make((n & 1) * signs[s & 1], (n >> 1 & 1) * signs[s >> 1 & 1],
                                               (n >> 2 & 1) * signs[s >> 2 & 1], (n >> 3 & 1) * signs[s >> 3 & 1]));
            kt_worst_below(&ties, distance(kt_quat_from_mat3(kt_reference_rounded(reference(q))), q), 3.0 * EPS,
                           "%d %d", n, s);
        }
}

/* Off the diagonal, entries of R as small as 1e-300 carry the angle; it must come back with its digits. */
KT_TEST(small_rotations_keep_their_digits) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("|v - v'| / |v|");
    for (int n = 0; n < 2000; n++) {
        const double size = kt_reference_magnitude(&random, -300.0, -3.0);
        const kt_vec3 v = kt_reference_direction(&random, size);
        const kt_quat q = kt_quat_normalize(kt_quat_make(1.0, v.x, v.y, v.z));
        const kt_quat back = kt_quat_from_mat3(kt_mat3_from_quat(q));
        const kt_vec3 off = kt_vec3_make(back.x - q.x, back.y - q.y, back.z - q.z);
        kt_worst_below(&error, kt_vec3_norm_wide(off) / size, 4.0 * EPS, "size %g", size);
    }
}

static kt_quat unit_rate(int k) { return kt_quat_make(k == 0, k == 1, k == 2, k == 3); }

/* [MSD A.32, A.36], columns of 2 E and 2 G. If q is not normalised, the derivative is that of R(q / |q|), so that all
 * four of its columns exist. They are 2 / |q| long. */
KT_TEST(angular_velocity_of_a_quaternion_is_the_derivative_of_its_matrix) {
    kt_random random = kt_random_of_test();
    KT_WORST world = kt_worst_make("omega = 2 E qdot"), body = kt_worst_make("R' omega = 2 G qdot");
    for (int n = 0; n < 500; n++) {
        const double size = n % 2 == 0 ? 1.0 : kt_random_uniform(&random, 0.5, 2.0);
        const kt_quat q = scaled(size, random_unit(&random));
        const double p[4] = {q.w, q.x, q.y, q.z};
        long double in_world[3][4], in_body[3][4];
        kt_reference_map(kt_reference_sandwich, 0, p, 4, false, in_world);
        kt_reference_map(kt_reference_sandwich, 0, p, 4, true, in_body);
        for (int k = 0; k < 4; k++) {
            const kt_vec3 w = kt_quat_angular_world(q, unit_rate(k)), b = kt_quat_angular_body(q, unit_rate(k));
            for (int i = 0; i < 3; i++) {
                kt_worst_near(&world, kt_reference_component(w, i), (double)in_world[i][k], 3.0 * EPS * 2.0 / size,
                              "%d, entry %d %d", n, i, k);
                kt_worst_near(&body, kt_reference_component(b, i), (double)in_body[i][k], 3.0 * EPS * 2.0 / size,
                              "%d, entry %d %d", n, i, k);
            }
        }
    }
}

KT_TEST(rate_of_a_quaternion_gives_back_its_angular_velocity) {
    kt_random random = kt_random_of_test();
    kt_worst world = kt_worst_make("world"), body = kt_worst_make("body"), norm = kt_worst_make("q'qdot = 0");
    KT_WORST frames = kt_worst_make("omega in world = R omega in body");
    for (int n = 0; n < 1000; n++) {
        const kt_quat q = scaled(kt_random_uniform(&random, 0.5, 2.0), random_unit(&random));
        const double n2 = kt_quat_norm_squared(q), size = kt_reference_magnitude(&random, -10.0, 10.0);
        const kt_vec3 omega = kt_reference_direction(&random, size);
        const kt_quat rate = kt_quat_rate_world(q, omega), body_rate = kt_quat_rate_body(q, omega);
        const kt_vec3 off = kt_vec3_sub(kt_quat_angular_world(q, rate), omega);
        const kt_vec3 body_off = kt_vec3_sub(kt_quat_angular_body(q, body_rate), omega);
        const kt_vec3 turned = kt_mat3_apply(kt_mat3_from_quat(q), omega);
        kt_worst_below(&world, kt_vec3_norm(off), 4.0 * EPS * size, "%d", n);
        kt_worst_below(&body, kt_vec3_norm(body_off), 4.0 * EPS * size, "%d", n);
        kt_worst_below(&frames, kt_vec3_norm(kt_vec3_sub(kt_quat_angular_world(q, body_rate), turned)),
                       6.0 * EPS * size, "%d", n);
        kt_worst_near(&norm, q.w * rate.w + q.x * rate.x + q.y * rate.y + q.z * rate.z, 0.0, 2.0 * EPS * n2 * size,
                      "%d", n);
    }
    kt_check_worst(&world);
    kt_check_worst(&body);
    kt_check_worst(&norm);
}
