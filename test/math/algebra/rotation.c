/* SPDX-License-Identifier: Apache-2.0 */
#include "reference.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define EPS DBL_EPSILON

static kt_mat3 evaluate(kt_rotation description) {
    kt_mat3 r = kt_mat3_identity();
    kt_error error;
    if (kt_rotation_evaluate(&description, &r, &error) != KT_OK)
        kt_check_text("evaluation", error.message, "no error");
    return r;
}

/* Evaluates an invalid description. The status is the expected one, the output untouched, and the message contains
 * `part`. */
static void reject(const char *what, kt_rotation description, kt_status status, const char *part) {
    kt_mat3 r, before;
    memset(&r, 0x55, sizeof r);
    before = r;
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int(what, kt_rotation_evaluate(&description, &r, &error), status);
    kt_check_equal_int("code", error.code, status);
    kt_check_contains("message", error.message, part);
    kt_check_equal_bits("output", &r.x.x, &before.x.x, 9);
    kt_check_equal_int("without an error to fill", kt_rotation_evaluate(&description, &r, NULL), status);
}

KT_TEST(zeroed_description_is_the_identity) {
    kt_rotation description;
    memset(&description, 0, sizeof description);
    kt_check_below("R - I", kt_reference_distance(evaluate(description), kt_mat3_identity()), 0.0);
}

/* One rotation in every description: an angle of 0.7 rad about (1, 2, 3) / sqrt(14). */
KT_TEST(every_description_of_a_rotation_is_the_same_rotation) {
    const double angle = 0.7, s = 1.0 / sqrt(14.0);
    const kt_vec3 axis = {1.0, 2.0, 3.0}, n = kt_vec3_scale(s, axis);
    const kt_reference_matrix e = kt_reference_real(kt_reference_axis_angle, 0, (double[4]){n.x, n.y, n.z, angle}, 4);
    const kt_mat3 r = kt_reference_rounded(e);
    const double half = sin(0.5 * angle);
    const kt_vec3 rpy = kt_rpy_from_mat3(r, NULL);
    struct {
        const char *name;
        kt_rotation description;
    } ways[] = {
        {"quaternion", kt_rotation_quaternion(cos(0.5 * angle), half * n.x, half * n.y, half * n.z)},
        {"rpy", kt_rotation_rpy(rpy.x, rpy.y, rpy.z)},
        {"vector", kt_rotation_vector(kt_vec3_scale(angle, n))},
        {"cgr", kt_rotation_cgr(kt_vec3_scale(2.0 * tan(0.5 * angle), n))},
        {"axis and angle", kt_rotation_axis_angle(axis, angle)},
        {"matrix", kt_rotation_matrix(r)},
    };
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        const kt_mat3 observed = evaluate(ways[i].description);
        kt_check_below(ways[i].name, kt_reference_difference(observed, e), 4.0 * EPS);
        kt_check_below("orthonormal", kt_reference_skewness(observed), 4.0 * EPS);
    }
    static const int sequences[] = {121, 123, 131, 132, 212, 213, 231, 232, 312, 313, 321, 323};
    for (int i = 0; i < 12; i++) {
        kt_vec3 a;
        kt_check_equal_int("angles", kt_euler_from_mat3(sequences[i], r, &a, NULL, NULL), KT_OK);
        const kt_mat3 observed = evaluate(kt_rotation_euler(sequences[i], a.x, a.y, a.z));
        kt_check_below("euler", kt_reference_difference(observed, e), 4.0 * EPS);
    }
}

/* scene-files.md: R = Rz(yaw) Ry(pitch) Rx(roll); Euler angles left to right about carried axes; matrices by rows.
 * Quarter turns distinguish the orders: e.g. yaw then roll takes z to x, roll then yaw takes it to -y. */
KT_TEST(descriptions_mean_what_the_scene_page_says) {
    const double quarter = 0.5 * KT_PI;
    const kt_mat3 rpy = evaluate(kt_rotation_rpy(quarter, 0.0, quarter));
    kt_check_near("rpy: z -> Rz Rx z = Rz (-y) = x", rpy.z.x, 1.0, 2.0 * EPS);
    const kt_mat3 pitch = evaluate(kt_rotation_rpy(0.0, quarter, 0.0));
    kt_check_near("pitch: z -> x", pitch.z.x, 1.0, 2.0 * EPS);
    const kt_mat3 euler = evaluate(kt_rotation_euler(312, quarter, quarter, 0.0));
    kt_check_near("euler 312: z -> R3 R1 z = x", euler.z.x, 1.0, 2.0 * EPS);
    const kt_mat3 third = evaluate(kt_rotation_euler(312, 0.0, quarter, quarter));
    kt_check_near("euler 312: z -> R1 R2 z = R1 x = x", third.z.x, 1.0, 2.0 * EPS);
    kt_rotation rows = {KT_ROTATION_MATRIX, 0, {0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0}};
    const kt_mat3 z = evaluate(rows);
    kt_check_true("matrix by rows: x -> y", z.x.y == 1.0 && z.y.x == -1.0);
    const kt_rotation again = kt_rotation_matrix(z);
    kt_check_equal_bits("and back", again.value, rows.value, 9);
}

/* Written with six decimals each entry is off by up to 0.5e-6; the nearest rotation is within that of the true one. */
KT_TEST(matrices_of_six_decimals_are_accepted_and_made_orthonormal) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("R"), skewness = kt_worst_make("R'R - I");
    for (int n = 0; n < 1000; n++) {
        const kt_mat3 r = kt_reference_random(&random);
        kt_rotation written = kt_rotation_matrix(r);
        for (int i = 0; i < 9; i++)
            written.value[i] = round(1e6 * written.value[i]) / 1e6;
        const kt_mat3 observed = evaluate(written);
        kt_worst_below(&error, kt_reference_distance(observed, r), 1e-6, "%d", n);
        kt_worst_below(&skewness, kt_reference_skewness(observed), 4.0 * EPS, "%d", n);
    }
}

KT_TEST(permutations_and_planar_matrices_keep_their_zeros_and_ones) {
    const kt_mat3 turn = {{0.0, 0.0, -1.0}, {1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}};
    kt_check_below("signed permutation", kt_reference_distance(evaluate(kt_rotation_matrix(turn)), turn), 0.0);
    const kt_mat3 planar = {{0.866025, 0.5, 0.0}, {-0.5, 0.866025, 0.0}, {0.0, 0.0, 1.0}};
    const kt_mat3 r = evaluate(kt_rotation_matrix(planar));
    kt_check_near("R33", r.z.z, 1.0, 0.0);
    kt_check_below("rest of row and column 3", fabs(r.z.x) + fabs(r.z.y) + fabs(r.x.z) + fabs(r.y.z), 0.0);
    kt_check_near("R21 / R11", r.x.y / r.x.x, 0.5 / 0.866025, 2.0 * EPS);
}

KT_TEST(quaternion_norm_is_allowed_a_thousandth) {
    const double in = 1.0 + 0.999e-3, out = 1.0 + 1.001e-3;
    const kt_mat3 r = evaluate(kt_rotation_quaternion(0.6 * in, 0.0, 0.8 * in, 0.0));
    const kt_mat3 exact = kt_mat3_about(1, 2.0 * atan2(0.8, 0.6));
    kt_check_below("norm 1.000999", kt_reference_distance(r, exact), 4.0 * EPS);
    reject("norm 1.001001", kt_rotation_quaternion(0.6 * out, 0.0, 0.8 * out, 0.0), KT_ERROR_ARGUMENT,
           "divide each number by the norm");
    reject("norm 0.998", kt_rotation_quaternion(0.998, 0.0, 0.0, 0.0), KT_ERROR_ARGUMENT, "norm 0.998");
    reject("norm 0", kt_rotation_quaternion(0.0, 0.0, 0.0, 0.0), KT_ERROR_ARGUMENT, "write [1, 0, 0, 0]");
    reject("norm 1e200", kt_rotation_quaternion(1e200, 0.0, 0.0, 0.0), KT_ERROR_ARGUMENT, "norm 1e+200");
}

KT_TEST(what_is_no_rotation_is_rejected_with_the_way_to_mend_it) {
    const kt_vec3 zero = {0.0, 0.0, 0.0};
    reject("zero axis", kt_rotation_axis_angle(zero, 1.0), KT_ERROR_ARGUMENT, "give one that is not zero");
    reject("sequence", kt_rotation_euler(311, 0.0, 0.0, 0.0), KT_ERROR_ARGUMENT, "none twice in a row");
    kt_mat3 m = kt_mat3_identity();
    m.y.y = 1.0 + 2e-6;
    reject("column too long", kt_rotation_matrix(m), KT_ERROR_ARGUMENT, "column 2 of the rotation matrix has length");
    m.y.y = 1.0 + 0.9e-6;
    kt_check_below("just not too long", kt_reference_distance(evaluate(kt_rotation_matrix(m)), kt_mat3_identity()),
                   EPS);
    m = kt_mat3_identity();
    m.z.x = 3e-6;
    reject("columns askew", kt_rotation_matrix(m), KT_ERROR_ARGUMENT, "columns 1 and 3");
    m = kt_mat3_identity();
    m.x.x = -1.0;
    reject("mirror", kt_rotation_matrix(m), KT_ERROR_ARGUMENT, "it mirrors");
    m = kt_mat3_identity();
    m.x = kt_vec3_make(1e200, 1e200, 0.0);
    m.y = kt_vec3_make(1e200, -1e200, 0.0);
    reject("entries that overflow", kt_rotation_matrix(m), KT_ERROR_ARGUMENT, "has length inf");
    kt_rotation unknown;
    memset(&unknown, 0, sizeof unknown);
    static const int types[2] = {8, -1};
    memcpy(&unknown.type, &types[0], sizeof unknown.type);
    reject("type", unknown, KT_ERROR_ARGUMENT, "rotation type 8 does not exist");
    memcpy(&unknown.type, &types[1], sizeof unknown.type);
    reject("type", unknown, KT_ERROR_ARGUMENT, "rotation type -1 does not exist");
}

KT_TEST(every_number_of_a_description_must_be_finite) {
    const kt_vec3 u = {1.0, 0.0, 0.0};
    const kt_rotation valid[] = {kt_rotation_quaternion(1.0, 0.0, 0.0, 0.0),
                                 kt_rotation_rpy(0.1, 0.2, 0.3),
                                 kt_rotation_euler(313, 0.1, 0.2, 0.3),
                                 kt_rotation_vector(u),
                                 kt_rotation_cgr(u),
                                 kt_rotation_axis_angle(u, 0.1),
                                 kt_rotation_matrix(kt_mat3_identity())};
    static const int counts[] = {4, 3, 3, 3, 3, 4, 9};
    int wrong = 0, cases = 0;
    for (size_t k = 0; k < sizeof valid / sizeof *valid; k++)
        for (int i = 0; i < 9; i++) {
            kt_rotation broken = valid[k];
            broken.value[i] = i % 2 == 0 ? (double)NAN : -(double)INFINITY;
            kt_mat3 r = kt_mat3_identity();
            const kt_status expected = i < counts[k] ? KT_ERROR_NOT_FINITE : KT_OK; /* unread values do not count */
            wrong += kt_rotation_evaluate(&broken, &r, NULL) != expected;
            cases++;
        }
    kt_check_equal_int("wrong answers", wrong, 0);
    kt_check_equal_int("cases", cases, 63);
    reject("message", kt_rotation_rpy(0.0, (double)NAN, 0.0), KT_ERROR_NOT_FINITE, "number 2 of the rotation 'rpy' is");
}

KT_TEST(missing_arguments_are_rejected) {
    kt_rotation none;
    memset(&none, 0, sizeof none);
    kt_mat3 r = kt_mat3_identity();
    kt_check_equal_int("no description", kt_rotation_evaluate(NULL, &r, NULL), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no output", kt_rotation_evaluate(&none, NULL, NULL), KT_ERROR_ARGUMENT);
}
