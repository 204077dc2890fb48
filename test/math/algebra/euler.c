/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON

static const int sequences[12] = {121, 123, 131, 132, 212, 213, 231, 232, 312, 313, 321, 323};

static bool proper(int sequence) { return sequence / 100 == sequence % 10; }

/* |sin b| or |cos b|, zero at the singular middle angle. */
static double lever(int sequence, double b) { return fabs(proper(sequence) ? sin(b) : cos(b)); }

static double random_middle(kt_random *random, int sequence) {
    return proper(sequence) ? kt_random_uniform(random, 0.0, KT_PI)
                            : kt_random_uniform(random, -0.5 * KT_PI, 0.5 * KT_PI);
}

static kt_vec3 random_angles(kt_random *random, int sequence) {
    const double a = kt_random_uniform(random, -KT_PI, KT_PI), c = kt_random_uniform(random, -KT_PI, KT_PI);
    return kt_vec3_make(a, random_middle(random, sequence), c);
}

static kt_reference_matrix reference(int sequence, kt_vec3 a) {
    return kt_reference_real(kt_reference_euler, sequence, (double[3]){a.x, a.y, a.z}, 3);
}

static kt_mat3 matrix_of(int sequence, kt_vec3 angles) {
    kt_mat3 r = kt_mat3_identity();
    if (kt_mat3_from_euler(sequence, angles, &r, NULL) != KT_OK)
        kt_check_true("matrix from angles", false);
    return r;
}

static kt_vec3 angles_of(int sequence, kt_mat3 r, bool *singular) {
    kt_vec3 angles = {(double)NAN, (double)NAN, (double)NAN};
    if (kt_euler_from_mat3(sequence, r, &angles, singular, NULL) != KT_OK)
        kt_check_true("angles from matrix", false);
    return angles;
}

/* The difference of two angles, whole turns apart. */
static double turn_between(double a, double b) { return fabs(remainder(a - b, 2.0 * KT_PI)); }

KT_TEST(twelve_sequences_are_products_of_elementary_rotations) {
    kt_random random = kt_random_of_test();
    for (int s = 0; s < 12; s++) {
        KT_WORST error = kt_worst_make("R");
        for (int n = 0; n < 300; n++) {
            const kt_vec3 a = random_angles(&random, sequences[s]);
            kt_worst_below(&error, kt_reference_difference(matrix_of(sequences[s], a), reference(sequences[s], a)),
                           2.0 * EPS, "sequence %d, case %d", sequences[s], n);
        }
    }
}

/* [MSD A.3, A.4, A.5], element by element, the signs of A.5 mended (row 2, column 1 is sin a cos b). */
KT_TEST(three_sequences_of_the_notes_are_as_printed) {
    const kt_vec3 angles = {0.3, -0.7, 1.9};
    const double ca = cos(0.3), sa = sin(0.3), cb = cos(-0.7), sb = sin(-0.7), cc = cos(1.9), sc = sin(1.9);
    const kt_mat3 r313 = {{ca * cc - sa * cb * sc, sa * cc + ca * cb * sc, sb * sc},
                          {-ca * sc - sa * cb * cc, ca * cb * cc - sa * sc, sb * cc},
                          {sa * sb, -ca * sb, cb}};
    const kt_mat3 r123 = {{cb * cc, ca * sc + sa * sb * cc, sa * sc - ca * sb * cc},
                          {-cb * sc, ca * cc - sa * sb * sc, sa * cc + ca * sb * sc},
                          {sb, -sa * cb, ca * cb}};
    const kt_mat3 r321 = {{ca * cb, sa * cb, -sb},
                          {ca * sb * sc - sa * cc, ca * cc + sa * sb * sc, cb * sc},
                          {sa * sc + ca * sb * cc, sa * sb * cc - ca * sc, cb * cc}};
    kt_check_below("313", kt_reference_distance(matrix_of(313, angles), r313), EPS);
    kt_check_below("123", kt_reference_distance(matrix_of(123, angles), r123), EPS);
    kt_check_below("321", kt_reference_distance(matrix_of(321, angles), r321), EPS);
}

KT_TEST(elementary_rotations_leave_their_axis_alone_exactly) {
    KT_WORST error = kt_worst_make("zeros and ones");
    for (int axis = 0; axis < 3; axis++) {
        const kt_mat3 r = kt_mat3_about(axis, 0.7);
        for (int i = 0; i < 3; i++) {
            kt_worst_near(&error, kt_reference_entry(r, axis, i), i == axis, 0.0, "axis %d, row entry %d", axis, i);
            kt_worst_near(&error, kt_reference_entry(r, i, axis), i == axis, 0.0, "axis %d, column entry %d", axis, i);
        }
    }
}

/* An error EPS / 2 in the matrix is EPS / 2 / lever in a and c, which are rounded to EPS / 2 of themselves. */
KT_TEST(euler_angles_of_a_matrix_return) {
    kt_random random = kt_random_of_test();
    for (int s = 0; s < 12; s++) {
        const int sequence = sequences[s];
        KT_WORST outer = kt_worst_make("a and c"), middle = kt_worst_make("b"), flag = kt_worst_make("not singular");
        for (int n = 0; n < 500; n++) {
            const kt_vec3 a = random_angles(&random, sequence);
            bool singular = true;
            const kt_vec3 back = angles_of(sequence, kt_reference_rounded(reference(sequence, a)), &singular);
            const double bound = 0.6 * EPS / lever(sequence, a.y) + 0.6 * EPS * KT_PI;
            kt_worst_below(&outer, turn_between(back.x, a.x), bound, "sequence %d, case %d", sequence, n);
            kt_worst_below(&outer, turn_between(back.z, a.z), bound, "sequence %d, case %d", sequence, n);
            kt_worst_near(&middle, back.y, a.y, EPS, "sequence %d, case %d", sequence, n);
            kt_worst_below(&flag, singular ? 1.0 : 0.0, 0.0, "sequence %d, case %d", sequence, n);
        }
    }
}

/* However near the singular middle angle, and at it: the angles found are the rotation. A flagged one is moved to
 * the singularity, by up to 16 EPS. */
KT_TEST(euler_angles_reproduce_the_matrix_near_their_singularities) {
    kt_random random = kt_random_of_test();
    static const double ends[2][2] = {{-0.5 * KT_PI, 0.5 * KT_PI}, {0.0, KT_PI}};
    for (int s = 0; s < 12; s++) {
        const int sequence = sequences[s];
        KT_WORST error = kt_worst_make("R -> angles -> R"), range = kt_worst_make("range of b");
        for (int n = 0; n < 500; n++) {
            kt_vec3 a = random_angles(&random, sequence);
            const double off = n % 10 == 0 ? 0.0 : kt_reference_magnitude(&random, -18.0, -0.5);
            a.y = n % 2 == 0 ? ends[proper(sequence)][0] + off : ends[proper(sequence)][1] - off;
            kt_mat3 r = kt_reference_rounded(reference(sequence, a));
            if (n % 3 == 0) { /* turned forth and back, for noise of an EPS or two in the small entries as well */
                const kt_mat3 q = kt_reference_random(&random);
                r = kt_mat3_multiply(kt_mat3_transpose(q), kt_mat3_multiply(q, r));
            }
            bool singular;
            const kt_vec3 back = angles_of(sequence, r, &singular);
            kt_worst_below(&error, kt_reference_distance(matrix_of(sequence, back), r),
                           singular ? 22.0 * EPS : 6.0 * EPS, "sequence %d, off by %g", sequence, off);
            kt_worst_below(&range,
                           fmax(0.0, fmax(ends[proper(sequence)][0] - back.y, back.y - ends[proper(sequence)][1])), 0.0,
                           "sequence %d, off by %g", sequence, off);
        }
    }
}

KT_TEST(singular_middle_angles_are_flagged_and_give_a_zero_third_angle) {
    kt_random random = kt_random_of_test();
    static const double ends[2][2] = {{-0.5 * KT_PI, 0.5 * KT_PI}, {0.0, KT_PI}};
    KT_WORST flag = kt_worst_make("flagged at it, not next to it"), third = kt_worst_make("c = 0");
    KT_WORST reproduced = kt_worst_make("R -> angles -> R");
    for (int s = 0; s < 12; s++)
        for (int n = 0; n < 100; n++) {
            kt_vec3 a = random_angles(&random, sequences[s]);
            a.y = ends[proper(sequences[s])][n % 2];
            const kt_mat3 r = matrix_of(sequences[s], a);
            bool singular = false;
            const kt_vec3 back = angles_of(sequences[s], r, &singular);
            kt_worst_below(&flag, singular ? 0.0 : 1.0, 0.0, "sequence %d", sequences[s]);
            kt_worst_near(&third, back.z, 0.0, 0.0, "sequence %d", sequences[s]);
            kt_worst_below(&reproduced, kt_reference_distance(matrix_of(sequences[s], back), r), 4.0 * EPS,
                           "sequence %d", sequences[s]);
            a.y += n % 2 == 0 ? 1e-13 : -1e-13;
            (void)angles_of(sequences[s], matrix_of(sequences[s], a), &singular);
            kt_worst_below(&flag, singular ? 1.0 : 0.0, 0.0, "next to it, sequence %d", sequences[s]);
        }
    kt_vec3 angles;
    kt_check_equal_int("without a flag", kt_euler_from_mat3(313, kt_mat3_identity(), &angles, NULL, NULL), KT_OK);
}

/* Sequences with three axes are regular at zero: each angle keeps its digits, however small next to the others. */
KT_TEST(small_euler_angles_keep_their_digits) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("relative error of each angle"), rpy = kt_worst_make("of roll, pitch, yaw");
    for (int s = 0; s < 12; s++)
        for (int n = 0; n < 500 && !proper(sequences[s]); n++) {
            const kt_vec3 a = kt_vec3_make(kt_reference_magnitude(&random, -300.0, -0.5),
                                           -kt_reference_magnitude(&random, -300.0, -0.5),
                                           kt_reference_magnitude(&random, -300.0, -0.5));
            bool singular;
            const kt_vec3 b = angles_of(sequences[s], matrix_of(sequences[s], a), &singular);
            const kt_vec3 c = kt_rpy_from_mat3(kt_mat3_from_rpy(a), &singular);
            for (int i = 0; i < 3; i++) {
                const double expected = kt_reference_component(a, i);
                kt_worst_near(&error, kt_reference_component(b, i) / expected, 1.0, 4.0 * EPS,
                              "sequence %d, angle %d: %g", sequences[s], i, expected);
                kt_worst_near(&rpy, kt_reference_component(c, i) / expected, 1.0, 4.0 * EPS, "angle %d: %g", i,
                              expected);
            }
        }
}

KT_TEST(euler_map_is_the_derivative_of_the_matrix) {
    kt_random random = kt_random_of_test();
    for (int s = 0; s < 12; s++) {
        KT_WORST error = kt_worst_make("omega = G rates");
        for (int n = 0; n < 200; n++) {
            kt_vec3 a = random_angles(&random, sequences[s]);
            if (n % 2 == 0)
                a = kt_vec3_scale(kt_reference_magnitude(&random, -300.0, 0.0), a);
            long double expected[3][4];
            kt_reference_map(kt_reference_euler, sequences[s], (double[3]){a.x, a.y, a.z}, 3, false, expected);
            kt_mat3 g = kt_mat3_identity();
            if (kt_euler_map(sequences[s], a, &g, NULL) != KT_OK)
                kt_check_true("status", false);
            for (int i = 0; i < 9; i++)
                kt_worst_near(&error, kt_reference_entry(g, i / 3, i % 3), (double)expected[i / 3][i % 3], 1.5 * EPS,
                              "sequence %d, case %d", sequences[s], n);
        }
    }
}

/* The inverse holds numbers of 1 / lever; so does its error. */
KT_TEST(euler_map_times_its_inverse_is_one) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("G^-1 G - I"), rpy = kt_worst_make("roll, pitch, yaw: G^-1 G - I");
    for (int s = 0; s < 12; s++)
        for (int n = 0; n < 500; n++) {
            kt_vec3 a = random_angles(&random, sequences[s]);
            if (n % 2 == 0)
                a.y = (proper(sequences[s]) ? 0.0 : 0.5 * KT_PI) + kt_reference_magnitude(&random, -14.0, 0.0);
            kt_mat3 g = kt_mat3_identity(), inverse = g;
            if (kt_euler_map(sequences[s], a, &g, NULL) != KT_OK ||
                kt_euler_map_inverse(sequences[s], a, &inverse, NULL) != KT_OK)
                kt_check_true("status", false);
            kt_worst_below(&error, kt_reference_distance(kt_mat3_multiply(inverse, g), kt_mat3_identity()),
                           2.0 * EPS / lever(sequences[s], a.y), "sequence %d, b = %g", sequences[s], a.y);
            if (kt_rpy_map_inverse(a, &inverse, NULL) == KT_OK)
                kt_worst_below(&rpy,
                               kt_reference_distance(kt_mat3_multiply(inverse, kt_rpy_map(a)), kt_mat3_identity()),
                               2.0 * EPS / fabs(cos(a.y)), "b = %g", a.y);
        }
    kt_check_above("cases of roll, pitch, yaw", (double)rpy.count, 2000.0);
}

KT_TEST(singular_euler_maps_are_reported) {
    static const double ends[2][2] = {{-0.5 * KT_PI, 2.5 * KT_PI}, {0.0, -3.0 * KT_PI}};
    kt_error error;
    for (int s = 0; s < 12; s++)
        for (int n = 0; n < 2; n++) {
            kt_mat3 inverse, before;
            memset(&inverse, 0x55, sizeof inverse);
            before = inverse;
            const kt_vec3 a = {0.3, ends[proper(sequences[s])][n], 0.2};
            kt_check_equal_int("status", kt_euler_map_inverse(sequences[s], a, &inverse, &error), KT_ERROR_SINGULAR);
            kt_check_equal_bits("output", &inverse.x.x, &before.x.x, 9);
        }
    kt_check_contains("message", error.message, "sequence 323 fall together");
    kt_mat3 inverse = kt_mat3_identity();
    kt_check_equal_int("pitch of 90 degrees", kt_rpy_map_inverse(kt_vec3_make(0.1, 0.5 * KT_PI, 0.2), &inverse, &error),
                       KT_ERROR_SINGULAR);
}

KT_TEST(roll_pitch_yaw_is_sequence_321_backwards) {
    kt_random random = kt_random_of_test();
    KT_WORST matrix = kt_worst_make("R = Rz(yaw) Ry(pitch) Rx(roll)"), map = kt_worst_make("omega"),
             back = kt_worst_make("back");
    for (int n = 0; n < 500; n++) {
        const kt_vec3 a = random_angles(&random, 321), rpy = {a.z, a.y, a.x};
        const kt_mat3 r = kt_mat3_from_rpy(rpy), g = kt_rpy_map(rpy);
        kt_worst_below(&matrix, kt_reference_difference(r, reference(321, a)), 2.0 * EPS, "%d", n);
        long double expected[3][4];
        kt_reference_map(kt_reference_euler, 321, (double[3]){a.x, a.y, a.z}, 3, false, expected);
        for (int i = 0; i < 9; i++)
            kt_worst_near(&map, kt_reference_entry(g, i / 3, 2 - i % 3), (double)expected[i / 3][i % 3], 1.5 * EPS,
                          "%d", n);
        bool singular;
        const kt_vec3 found = kt_rpy_from_mat3(r, &singular);
        kt_worst_below(&back, fmax(turn_between(found.x, rpy.x), turn_between(found.z, rpy.z)), 2.0 * EPS / cos(rpy.y),
                       "%d", n);
    }
    bool singular = false;
    const kt_vec3 up = kt_rpy_from_mat3(kt_mat3_from_rpy(kt_vec3_make(0.3, 0.5 * KT_PI, 0.7)), &singular);
    kt_check_true("pitch of 90 degrees is flagged", singular);
    kt_check_near("roll", up.x, 0.0, 0.0);
    kt_check_near("yaw, which takes over what is left", up.z, 0.4, 2.0 * EPS);
}

KT_TEST(unknown_sequences_are_rejected) {
    int rejected = 0;
    kt_error error;
    kt_mat3 m = kt_mat3_identity(), before = m;
    kt_vec3 angles = {1.0, 2.0, 3.0};
    for (int sequence = -400; sequence <= 1400; sequence++)
        if (kt_mat3_from_euler(sequence, kt_vec3_make(0.1, 0.2, 0.3), &m, &error) != KT_OK) {
            rejected++;
            if (kt_euler_map(sequence, angles, &m, &error) != KT_ERROR_ARGUMENT ||
                kt_euler_map_inverse(sequence, angles, &m, &error) != KT_ERROR_ARGUMENT ||
                kt_euler_from_mat3(sequence, m, &angles, NULL, &error) != KT_ERROR_ARGUMENT)
                kt_check_true("all calls reject it", false);
        } else {
            m = before;
        }
    kt_check_equal_int("all but twelve", rejected, 1801 - 12);
    kt_check_equal_bits("output", &m.x.x, &before.x.x, 9);
    kt_check_near("angles", angles.x + 10.0 * angles.y + 100.0 * angles.z, 321.0, 0.0);
    kt_check_equal_int("311", kt_mat3_from_euler(311, angles, &m, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("message", error.message, "311 is none of 121 123");
    angles.z = (double)NAN;
    kt_check_equal_int("NaN", kt_mat3_from_euler(321, angles, &m, &error), KT_ERROR_NOT_FINITE);
    m.z.x = (double)INFINITY;
    kt_check_equal_int("infinite entry", kt_euler_from_mat3(321, m, &angles, NULL, &error), KT_ERROR_NOT_FINITE);
}
