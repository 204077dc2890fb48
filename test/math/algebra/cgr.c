/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>

#define EPS DBL_EPSILON

/* The size |g| ranges from 1e-300 to 1e8, which is a half turn but for 4e-8 rad. */
static kt_vec3 random_cgr(kt_random *random, int n, double *size) {
    *size = n % 2 == 0 ? kt_reference_magnitude(random, -300.0, 0.0) : kt_reference_magnitude(random, -2.0, 8.0);
    return kt_reference_direction(random, *size);
}

static kt_reference_matrix reference(kt_vec3 g) {
    return kt_reference_real(kt_reference_cgr, 0, (double[3]){g.x, g.y, g.z}, 3);
}

KT_TEST(matrix_of_cgr_parameters_is_the_cayley_transform) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("R"), small = kt_worst_make("off the diagonal, relative");
    for (int n = 0; n < 3000; n++) {
        double size;
        const kt_vec3 g = random_cgr(&random, n, &size);
        const kt_mat3 r = kt_mat3_from_cgr(g);
        const kt_reference_matrix e = reference(g);
        kt_worst_below(&error, kt_reference_difference(r, e), 4.0 * EPS, "|g| = %g", size);
        for (int i = 0; i < 3 && size < 1.0; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;
            const double scale = fabs(kt_reference_component(g, k)) +
                                 0.5 * fabs(kt_reference_component(g, i) * kt_reference_component(g, j));
            kt_worst_near(&small, kt_reference_entry(r, i, j), (double)creall(e.m[i][j]), 4.0 * EPS * scale, "|g| = %g",
                          size);
            kt_worst_near(&small, kt_reference_entry(r, j, i), (double)creall(e.m[j][i]), 4.0 * EPS * scale, "|g| = %g",
                          size);
        }
    }
}

/* [MSD A.17], against Euler vectors and quaternions. */
KT_TEST(cgr_parameters_are_twice_the_tangent_of_half_the_angle) {
    kt_random random = kt_random_of_test();
    KT_WORST matrix = kt_worst_make("R(2 tan(t/2) n) - R(t n)");
    for (int n = 0; n < 1000; n++) {
        const double t =
            n % 2 == 0 ? kt_reference_magnitude(&random, -300.0, 0.0) : kt_random_uniform(&random, 0.0, KT_PI);
        const kt_vec3 axis = kt_reference_direction(&random, 1.0);
        const kt_mat3 r = kt_mat3_from_cgr(kt_vec3_scale(2.0 * tan(0.5 * t), axis));
        kt_worst_below(&matrix, kt_reference_distance(r, kt_mat3_from_euler_vector(kt_vec3_scale(t, axis))), 5.0 * EPS,
                       "angle %g", t);
    }
}

/* dg / dR grows as 1 + |g|^2 / 4. Therefore |dg| / |g| grows as |g| near half a turn. */
KT_TEST(cgr_parameters_of_a_matrix_return) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("g -> R -> g, relative");
    for (int n = 0; n < 3000; n++) {
        double size;
        const kt_vec3 g = random_cgr(&random, n, &size);
        kt_vec3 back = {0.0, 0.0, 0.0};
        if (kt_cgr_from_mat3(kt_reference_rounded(reference(g)), &back, NULL) != KT_OK)
            kt_check_true("status", false);
        kt_worst_below(&error, kt_vec3_norm_wide(kt_vec3_sub(back, g)) / size, 3.0 * EPS * (1.0 + 0.25 * size),
                       "|g| = %g", size);
    }
}

KT_TEST(half_turns_have_no_cgr_parameters) {
    kt_random random = kt_random_of_test();
    KT_WORST untouched = kt_worst_make("output");
    for (int n = 0; n < 200; n++) {
        const kt_vec3 axis = kt_reference_direction(&random, 1.0);
        const kt_mat3 r = kt_mat3_from_quat(kt_quat_make(0.0, axis.x, axis.y, axis.z));
        kt_vec3 g = {1.0, 2.0, 3.0};
        kt_error error;
        if (kt_cgr_from_mat3(r, &g, &error) != KT_ERROR_SINGULAR)
            kt_check_true("status", false);
        if (n == 0)
            kt_check_contains("message", error.message, "half a turn");
        kt_worst_near(&untouched, g.x + 10.0 * g.y + 100.0 * g.z, 321.0, 0.0, "%d", n);
    }
    kt_mat3 broken = kt_mat3_identity();
    broken.y.z = (double)NAN;
    kt_vec3 g;
    kt_error error;
    kt_check_equal_int("NaN", kt_cgr_from_mat3(broken, &g, &error), KT_ERROR_NOT_FINITE);
}

/* Entries of G are at most 1. Those of its inverse are at most 1 + |g|^2 / 4. */
KT_TEST(cgr_map_is_the_derivative_of_the_cayley_transform) {
    kt_random random = kt_random_of_test();
    KT_WORST map = kt_worst_make("omega = G gdot"), back = kt_worst_make("G^-1 G - I");
    for (int n = 0; n < 500; n++) {
        double size;
        const kt_vec3 g = random_cgr(&random, n, &size);
        long double expected[3][4];
        kt_reference_map(kt_reference_cgr, 0, (double[3]){g.x, g.y, g.z}, 3, false, expected);
        const kt_mat3 observed = kt_cgr_map(g);
        for (int i = 0; i < 9; i++)
            kt_worst_near(&map, kt_reference_entry(observed, i / 3, i % 3), (double)expected[i / 3][i % 3], 4.0 * EPS,
                          "|g| = %g", size);
        const kt_mat3 one = kt_mat3_multiply(kt_cgr_map_inverse(g), observed);
        kt_worst_below(&back, kt_reference_distance(one, kt_mat3_identity()), 3.0 * EPS * (1.0 + 0.5 * size),
                       "|g| = %g", size);
    }
}

/* 4 / (4 + g'g) g / 2 = 2 / |g| where g'g would overflow. */
KT_TEST(huge_cgr_parameters_are_half_turns) {
    const kt_vec3 g = {0.0, 0.0, 1e200};
    kt_check_near("G21 |g| / 2", kt_cgr_map(g).x.y * 0.5e200, 1.0, 4.0 * EPS);
    kt_check_near("R11", kt_mat3_from_cgr(g).x.x, -1.0, EPS);
    kt_check_near("R33", kt_mat3_from_cgr(g).z.z, 1.0, 0.0);
}
