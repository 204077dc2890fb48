/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>

#define EPS DBL_EPSILON

/* Q diag(m) Q' with its rounding: EPS of the largest entry. */
static kt_sym3 turned(kt_mat3 q, kt_vec3 m) { return kt_sym3_rotate(q, kt_sym3_make(m.x, m.y, m.z, 0.0, 0.0, 0.0)); }

static double largest(kt_sym3 s) {
    return fmax(fmax(fmax(fabs(s.xx), fabs(s.yy)), fabs(s.zz)), fmax(fmax(fabs(s.xy), fabs(s.xz)), fabs(s.yz)));
}

static double distance(kt_sym3 a, kt_sym3 b) {
    return largest(kt_sym3_make(a.xx - b.xx, a.yy - b.yy, a.zz - b.zz, a.xy - b.xy, a.xz - b.xz, a.yz - b.yz));
}

static kt_sym3 random_sym3(kt_random *random) {
    double e[6];
    for (int i = 0; i < 6; i++)
        e[i] = kt_random_uniform(random, -1.0, 1.0);
    return kt_sym3_make(e[0], e[1], e[2], e[3], e[4], e[5]);
}

/* (R S R') (R u) = R (S u) */
KT_TEST(turned_symmetric_matrix_acts_on_turned_vectors) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("(R S R') R u - R S u"), sum = kt_worst_make("(A + B) u - A u - B u");
    for (int n = 0; n < 500; n++) {
        const kt_mat3 r = kt_reference_random(&random);
        const kt_sym3 s = random_sym3(&random), t = random_sym3(&random);
        const kt_vec3 u = kt_reference_direction(&random, 1.0);
        const kt_vec3 left = kt_sym3_apply(kt_sym3_rotate(r, s), kt_mat3_apply(r, u));
        const kt_vec3 right = kt_mat3_apply(r, kt_sym3_apply(s, u));
        kt_worst_below(&error, kt_vec3_norm(kt_vec3_sub(left, right)), 10.0 * EPS, "%d", n);
        const kt_vec3 both = kt_vec3_add(kt_sym3_apply(s, u), kt_sym3_apply(t, u));
        kt_worst_below(&sum, kt_vec3_norm(kt_vec3_sub(kt_sym3_apply(kt_sym3_add(s, t), u), both)), 6.0 * EPS, "%d", n);
    }
}

/* Eigenvalues of Q diag(m) Q' are m. (Weyl: they move no more than the matrix.) */
KT_TEST(eigenvalues_are_found_at_every_scale) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("eigenvalues, relative to the largest");
    for (int n = 0; n < 4000; n++) {
        const double scale = kt_reference_magnitude(&random, -300.0, 150.0);
        double m[3];
        for (int i = 0; i < 3; i++)
            m[i] = i == 2 ? scale
                          : scale * (n % 3 == 0 ? kt_random_uniform(&random, -1.0, 1.0)
                                                : kt_reference_magnitude(&random, -20.0, 0.0));
        if (n % 5 == 0)
            m[1] = m[n % 10 == 0 ? 0 : 2];
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++)
                if (m[j] > m[j + 1]) {
                    const double c = m[j];
                    m[j] = m[j + 1];
                    m[j + 1] = c;
                }
        const kt_vec3 e = kt_sym3_eigenvalues(turned(kt_reference_random(&random), kt_vec3_make(m[0], m[1], m[2])));
        const double size = fmax(fabs(m[0]), fabs(m[2]));
        for (int i = 0; i < 3; i++)
            kt_worst_near(&error, kt_reference_component(e, i) / size, m[i] / size, 5.0 * EPS, "case %d, scale %g", n,
                          scale);
    }
}

/* Coefficients of the characteristic polynomial: trace, sum of the principal minors, determinant. */
KT_TEST(eigenvalues_are_the_roots_of_the_characteristic_polynomial) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("invariants");
    for (int n = 0; n < 1000; n++) {
        const kt_sym3 s = random_sym3(&random);
        const kt_vec3 e = kt_sym3_eigenvalues(s);
        const double minors = s.xx * s.yy - s.xy * s.xy + s.xx * s.zz - s.xz * s.xz + s.yy * s.zz - s.yz * s.yz;
        const double determinant = s.xx * (s.yy * s.zz - s.yz * s.yz) - s.xy * (s.xy * s.zz - s.yz * s.xz) +
                                   s.xz * (s.xy * s.yz - s.yy * s.xz);
        kt_worst_near(&error, e.x + e.y + e.z, s.xx + s.yy + s.zz, 10.0 * EPS, "trace, %d", n);
        kt_worst_near(&error, e.x * e.y + e.y * e.z + e.z * e.x, minors, 20.0 * EPS, "minors, %d", n);
        kt_worst_near(&error, e.x * e.y * e.z, determinant, 20.0 * EPS, "determinant, %d", n);
        kt_worst_below(&error, e.x <= e.y && e.y <= e.z ? 0.0 : 1.0, 0.0, "order, %d", n);
    }
}

KT_TEST(eigenvalues_of_diagonal_matrices_are_exact) {
    const kt_vec3 e = kt_sym3_eigenvalues(kt_sym3_make(3.0, -1.0, 0x1p-1074, 0.0, 0.0, 0.0));
    kt_check_near("smallest", e.x, -1.0, 0.0);
    kt_check_near("middle", e.y, 0.0, 0.0); /* below 2^-1074 once scaled to one */
    kt_check_near("largest", e.z, 3.0, 0.0);
    const kt_vec3 z = kt_sym3_eigenvalues(kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
    kt_check_near("of zero", fabs(z.x) + fabs(z.y) + fabs(z.z), 0.0, 0.0);
    const kt_vec3 tiny = kt_sym3_eigenvalues(kt_sym3_make(0x1p-1074, 0.0, 0.0, 0.0, 0.0, 0.0));
    kt_check_near("smallest number", tiny.z, 0x1p-1074, 0.0);
    const kt_vec3 infinite = kt_sym3_eigenvalues(kt_sym3_make(1.0, 2.0, (double)INFINITY, 0.0, 0.0, 0.0));
    kt_check_true("one infinite entry, no eigenvalues", isnan(infinite.x) && isnan(infinite.y) && isnan(infinite.z));
    kt_check_true("NaN", isnan(kt_sym3_eigenvalues(kt_sym3_make(1.0, 1.0, 1.0, 0.0, (double)NAN, 0.0)).y));
}

/* ---- parallel axes ----------------------------------------------------------------------------------------------- */

/* The inertia of point masses, sum m (r'r I - r r'). The sum about the point is compared with the shifted sum about the
 * centre of mass. */
KT_TEST(shifted_inertia_is_that_of_the_same_points) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("inertia about a point");
    for (int n = 0; n < 300; n++) {
        double mass[6], total = 0.0;
        kt_vec3 at[6], com = {0.0, 0.0, 0.0};
        for (int i = 0; i < 6; i++) {
            mass[i] = kt_random_uniform(&random, 0.1, 1.0);
            at[i] = kt_reference_direction(&random, kt_random_uniform(&random, 0.0, 2.0));
            total += mass[i];
            com = kt_vec3_add(com, kt_vec3_scale(mass[i], at[i]));
        }
        com = kt_vec3_scale(1.0 / total, com);
        kt_sym3 about_point = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, about_com = about_point;
        for (int i = 0; i < 6; i++) { /* m (r x)'(r x), by the cross product with each axis */
            for (int place = 0; place < 2; place++) {
                const kt_vec3 r = place == 0 ? at[i] : kt_vec3_sub(at[i], com);
                const kt_mat3 s = kt_mat3_skew(r);
                kt_sym3 *sum = place == 0 ? &about_point : &about_com;
                *sum =
                    kt_sym3_add(*sum, kt_sym3_make(mass[i] * kt_vec3_dot(s.x, s.x), mass[i] * kt_vec3_dot(s.y, s.y),
                                                   mass[i] * kt_vec3_dot(s.z, s.z), mass[i] * kt_vec3_dot(s.x, s.y),
                                                   mass[i] * kt_vec3_dot(s.x, s.z), mass[i] * kt_vec3_dot(s.y, s.z)));
            }
        }
        kt_worst_below(&error, distance(kt_sym3_shift(about_com, total, com), about_point),
                       6.0 * EPS * largest(about_point), "%d", n);
    }
}

/* ---- what a body can have ---------------------------------------------------------------------------------------- */

KT_TEST(inertias_of_bodies_pass) {
    kt_random random = kt_random_of_test();
    int failed = 0;
    for (int n = 0; n < 3000; n++) {
        const double scale = kt_reference_magnitude(&random, -290.0, 150.0);
        /* second moments a, b, c >= 0 along the axes; plates have one of zero, rods two, points three */
        double s[3];
        for (int i = 0; i < 3; i++)
            s[i] = n % 4 > i ? 0.0 : scale * kt_reference_magnitude(&random, -12.0, 0.0);
        const kt_vec3 m = {s[1] + s[2], s[0] + s[2], s[0] + s[1]};
        kt_vec3 moments = {-1.0, -1.0, -1.0};
        if (kt_inertia_check(turned(kt_reference_random(&random), m), &moments) != KT_INERTIA_VALID || moments.z < 0.0)
            failed++;
    }
    kt_check_equal_int("rejected", failed, 0);
    kt_check_equal_int("no inertia", kt_inertia_check(kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), NULL),
                       KT_INERTIA_VALID);
}

/* Beyond 1e-10 of the largest moment, by a factor of two on either side. */
KT_TEST(inertias_of_no_body_are_told_apart_by_their_fault) {
    kt_random random = kt_random_of_test();
    int wrong = 0;
    for (int n = 0; n < 1000; n++) {
        const double scale = kt_reference_magnitude(&random, -290.0, 150.0);
        const double a = kt_random_uniform(&random, 0.3, 1.0), b = kt_random_uniform(&random, 0.3, 1.0), big = a + b;
        const kt_mat3 q = kt_reference_random(&random);
        const kt_vec3 allowed = kt_vec3_scale(scale, kt_vec3_make(a, b, big * (1.0 + 0.5e-10)));
        const kt_vec3 triangle = kt_vec3_scale(scale, kt_vec3_make(a, big * (1.0 + 2e-10), b));
        const kt_vec3 barely = kt_vec3_scale(scale, kt_vec3_make(-0.4e-10 * a, a, a));
        const kt_vec3 negative = kt_vec3_scale(scale, kt_vec3_make(a, a, -2e-10 * a));
        wrong += kt_inertia_check(turned(q, allowed), NULL) != KT_INERTIA_VALID;
        wrong += kt_inertia_check(turned(q, triangle), NULL) != KT_INERTIA_TRIANGLE;
        wrong += kt_inertia_check(turned(q, barely), NULL) != KT_INERTIA_VALID;
        wrong += kt_inertia_check(turned(q, negative), NULL) != KT_INERTIA_NEGATIVE;
    }
    kt_check_equal_int("wrong answers", wrong, 0);
    kt_check_equal_int("wholly negative", kt_inertia_check(kt_sym3_make(-1.0, -1.0, -1.0, 0.0, 0.0, 0.0), NULL),
                       KT_INERTIA_NEGATIVE);
    /* positive diagonal, but a product of inertia too large: moments 1 - 2 and 1 + 2 */
    kt_check_equal_int("product too large", kt_inertia_check(kt_sym3_make(1.0, 1.0, 1.0, 2.0, 0.0, 0.0), NULL),
                       KT_INERTIA_NEGATIVE);
    kt_vec3 moments = {7.0, 7.0, 7.0};
    kt_check_equal_int("NaN", kt_inertia_check(kt_sym3_make(1.0, (double)NAN, 1.0, 0.0, 0.0, 0.0), &moments),
                       KT_INERTIA_NOT_FINITE);
    kt_check_near("moments untouched", moments.x, 7.0, 0.0);
    /* finite entries of one size, but moments 3 M, 0, 0 and 1.5 M, 1.5 M, 0 */
    const double m = DBL_MAX, half = -0.5 * DBL_MAX;
    kt_check_equal_int("one overflows", kt_inertia_check(kt_sym3_make(m, m, m, m, m, m), &moments),
                       KT_INERTIA_NOT_FINITE);
    kt_check_equal_int("two overflow", kt_inertia_check(kt_sym3_make(m, m, m, half, half, half), &moments),
                       KT_INERTIA_NOT_FINITE);
    kt_check_near("moments untouched", moments.x, 7.0, 0.0);
}

KT_TEST(excess_is_what_the_triangle_inequality_is_broken_by) {
    kt_check_near("3.3 against 1 + 2", kt_inertia_excess(kt_sym3_make(1.0, 3.3, 2.0, 0.0, 0.0, 0.0)), 0.1, 1e-15);
    kt_check_near("equality", kt_inertia_excess(kt_sym3_make(1.0, 3.0, 2.0, 0.0, 0.0, 0.0)), 0.0, 0.0);
    kt_check_near("within rounding", kt_inertia_excess(kt_sym3_make(1.0, 3.0 + 1e-11, 2.0, 0.0, 0.0, 0.0)), 0.0, 0.0);
    kt_check_true("one moment alone", isinf(kt_inertia_excess(kt_sym3_make(0.0, 1.0, 0.0, 0.0, 0.0, 0.0))));
}
