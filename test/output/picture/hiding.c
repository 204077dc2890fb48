/* Hidden surfaces: the order of painting, and the cuts of solids for it, against rays. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "rays.h"

#include "picture/camera.h"
#include "picture/hiding.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>

static kt_solid solid_at(kt_solid_type type, kt_vec3 at, kt_vec3 half) {
    return (kt_solid){.type = type, .half = half, .pose = {.rotation = kt_mat3_identity(), .position = at}};
}

/* The share if the pieces are painted as they were given. */
static double wrong_as_given(const kt_solid *solids, int count, double half, double least) {
    kt_pieces pieces = {0};
    for (int i = 0; i < count; i++)
        (void)kt_pieces_add(&pieces, &solids[i], i, true);
    const double share = wrong_share(&pieces, kt_vec3_make(0.0, 0.0, 0.0), half, 80, least);
    kt_pieces_free(&pieces);
    return share;
}

static kt_pieces sorted_of(const kt_solid *solids, int count) {
    kt_pieces pieces = {0};
    for (int i = 0; i < count; i++)
        (void)kt_pieces_add(&pieces, &solids[i], i, false);
    kt_check_true("sorted", kt_pieces_sort(&pieces, 1e-4, false));
    return pieces;
}

KT_TEST(ball_behind_a_box_is_painted_first_whatever_their_order) {
    const kt_solid box = solid_at(KT_SOLID_BOX, kt_vec3_make(0.0, 0.0, 1.0), kt_vec3_make(1.0, 1.0, 0.1));
    const kt_solid ball = solid_at(KT_SOLID_SPHERE, kt_vec3_make(0.5, 0.0, 0.0), kt_vec3_make(0.8, 0.8, 0.8));
    const kt_solid both[2][2] = {{box, ball}, {ball, box}};
    for (int i = 0; i < 2; i++) {
        kt_pieces sorted = sorted_of(both[i], 2);
        kt_check_equal_int("pieces", sorted.count, 2);
        kt_check_equal_int("first", sorted.items[0].solid.type, KT_SOLID_SPHERE);
        kt_check_equal_int("last", sorted.items[1].solid.type, KT_SOLID_BOX);
        kt_pieces_free(&sorted);
    }
}

/* Three bars, each of which lies over the next one: no order of whole bars is right. */
KT_TEST(bars_that_lie_over_each_other_in_a_circle_are_cut) {
    kt_solid bars[3];
    for (int i = 0; i < 3; i++) {
        const double angle = 2.0943951023931953 * i, c = cos(angle), s = sin(angle);
        bars[i] = kt_solid_rod(kt_vec3_make(0.3 * c - s, 0.3 * s + c, 0.5),
                               kt_vec3_make(0.3 * c + s, 0.3 * s - c, -0.5), 0.06);
    }
    kt_pieces sorted = sorted_of(bars, 3);
    kt_check_above("pieces", sorted.count, 4.0);
    kt_check_equal_int("points painted wrongly, in 1/6400",
                       lround(6400.0 * wrong_share(&sorted, kt_vec3_make(0.0, 0.0, 0.0), 1.2, 80, 0.02)), 0);
    kt_check_above("wrong as given", wrong_as_given(bars, 3, 1.2, 0.02), 0.005);
    kt_pieces_free(&sorted);
}

/* A rod enters a box at its front and leaves it at its back. It is in front from its own end to the box. */
KT_TEST(rod_through_a_box_is_cut_where_it_enters) {
    const kt_solid box = solid_at(KT_SOLID_BOX, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.5, 0.5, 0.5));
    const kt_solid rod = kt_solid_rod(kt_vec3_make(-0.45, 0.1, 1.2), kt_vec3_make(1.4, 0.1, -1.0), 0.04);
    const kt_solid both[] = {box, rod};
    kt_pieces sorted = sorted_of(both, 2);
    kt_check_above("pieces", sorted.count, 3.0);
    kt_check_equal_int("points painted wrongly, in 1/6400",
                       lround(6400.0 * wrong_share(&sorted, kt_vec3_make(0.0, 0.0, 0.0), 1.5, 80, 0.05)), 0);
    kt_check_above("as given", wrong_as_given((const kt_solid[]){rod, box}, 2, 1.5, 0.05), 0.02);
    kt_pieces_free(&sorted);
}

static double gap_between(const kt_solid *a, const kt_solid *b) {
    const double ra = kt_vec3_norm(a->half) + a->half.x, rb = kt_vec3_norm(b->half) + b->half.x;
    return kt_vec3_norm(kt_vec3_sub(a->pose.position, b->pose.position)) - ra - rb;
}

/* Solids that lie apart: no point is wrong by more than a thousandth, of this seed nor of thirty others. */
KT_TEST(random_solids_hide_each_other_as_rays_tell) {
    kt_random random = kt_random_of_test();
    double wrong = 0.0, given = 0.0;
    for (int trial = 0; trial < 12; trial++) {
        kt_solid solids[14];
        int count = 0;
        for (int attempt = 0; attempt < 200 && count < 14; attempt++) {
            double x[4];
            kt_random_direction(&random, 4, x);
            kt_solid one = solid_at(
                (kt_solid_type)(attempt % 4),
                kt_vec3_make(kt_random_normal(&random), kt_random_normal(&random), 3.0 * kt_random_normal(&random)),
                kt_vec3_make(0.25, 0.25, attempt % 4 == KT_SOLID_SPHERE ? 0.25 : 0.6));
            one.pose.rotation = kt_mat3_from_quat(kt_quat_make(x[0], x[1], x[2], x[3]));
            bool free = true;
            for (int i = 0; i < count; i++)
                free = free && gap_between(&one, &solids[i]) > 0.0;
            if (free)
                solids[count++] = one;
        }
        kt_pieces sorted = sorted_of(solids, count);
        wrong = fmax(wrong, wrong_share(&sorted, kt_vec3_make(0.0, 0.0, 0.0), 3.0, 80, 1e-3));
        given = fmax(given, wrong_as_given(solids, count, 3.0, 1e-3));
        kt_pieces_free(&sorted);
    }
    kt_check_equal_int("points painted wrongly at most, in 1/6400", lround(6400.0 * wrong), 0);
    kt_check_above("as given", given, 0.05);
}

/* ---- views ------------------------------------------------------------------------------------------------------- */

static void expect_axes(const char *what, kt_camera camera, kt_vec3 right, kt_vec3 up) {
    kt_check_below(what, kt_vec3_norm(kt_vec3_sub(camera.axes.x, right)) + kt_vec3_norm(kt_vec3_sub(camera.axes.y, up)),
                   8.0 * DBL_EPSILON);
}

KT_TEST(views_along_axes_have_the_usual_directions) {
    const kt_vec3 x = {1.0, 0.0, 0.0}, y = {0.0, 1.0, 0.0}, z = {0.0, 0.0, 1.0}, front = {0.0, -1.0, 0.0};
    expect_axes("along z, y up", kt_camera_facing(z, y), x, y);
    expect_axes("along y, z up", kt_camera_facing(front, z), x, z);
    expect_axes("along x, z up", kt_camera_facing(x, z), y, z);
    expect_axes("from above, z up", kt_camera_facing(z, z), x, y);
    expect_axes("the front, z up", kt_camera_around(z, 0.0, 0.0), x, z);
    expect_axes("the front, y up", kt_camera_around(y, 0.0, 0.0), x, y);
    expect_axes("the right, z up", kt_camera_around(z, 1.5707963267948966, 0.0), y, z);
    expect_axes("straight down, z up", kt_camera_around(z, 0.0, 1.5707963267948966), x, y);
}

KT_TEST(projection_keeps_lengths_across_the_view) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("orthonormal, right-handed");
    for (int i = 0; i < 100; i++) {
        double d[3];
        kt_random_direction(&random, 3, d);
        const kt_camera c = kt_camera_around(kt_vec3_make(0.0, 0.0, 1.0), kt_random_uniform(&random, -4.0, 4.0),
                                             kt_random_uniform(&random, -1.5, 1.5));
        const kt_vec3 seen = kt_camera_point(&c, kt_vec3_make(d[0], d[1], d[2]));
        kt_worst_near(&error, kt_mat3_determinant(c.axes), 1.0, 16.0 * DBL_EPSILON, "determinant %d", i);
        kt_worst_near(&error, kt_vec3_norm(seen), 1.0, 16.0 * DBL_EPSILON, "length %d", i);
        kt_worst_near(&error, kt_vec3_dot(c.axes.x, kt_vec3_make(0.0, 0.0, 1.0)), 0.0, 16.0 * DBL_EPSILON, "level %d",
                      i);
    }
}
