/* Curves whose rows follow from the nearest point: helices and splines, on the curve and off it.
 *
 * The rows across a curve are along normals that do not turn about its tangent. No closed form in the library's numbers
 * has these normals. In any frame, however, |phi|^2 is the square of the distance. Therefore,
 *     (|phi|^2)'  = 2 phi . phi',   (|phi|^2)'' = 2 (|phi'|^2 + phi . phi'')
 * for a point that moves as p0 + u t + a t^2 / 2 in the first end's frame, against differences of order six.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 512 };
#define STEP 0.002

static const kt_vec3 bow[] = {{-0.5, 0.1, 0.0}, {0.2, 0.6, 0.1}, {0.9, 0.4, -0.3}, {1.3, -0.3, -0.1}, {1.2, -1.0, 0.4}};

/* A loop of this curve, whose arc length is to be f. */
static kt_loop_record loop_of(const kt_track *track, kt_function f, double numbers[NUMBERS]) {
    kt_loop loop = kt_loop_default();
    loop.type = KT_LOOP_CURVE;
    loop.curve = *track;
    loop.function = f;
    kt_loop_record r = {.type = KT_LOOP_CURVE, .row_count = 3};
    r.curve = kt_curve_compile(&f, numbers, 0);
    r.number = kt_curve_number_count(&f);
    if (!kt_check_true("numbers fit", r.number + kt_loop_kinds_baseline[KT_LOOP_CURVE]->number_count(&loop) <= NUMBERS))
        return r;
    kt_loop_kinds_baseline[KT_LOOP_CURVE]->prepare(NULL, &loop, numbers, &r);
    return r;
}

static void rows_at(const kt_loop_record *loop, const double *numbers, kt_v4 p, kt_v4 u, double t,
                    kt_loop_row rows[3]) {
    kt_loop_end end[2];
    memset(end, 0, sizeof end);
    for (int k = 0; k < 3; k++)
        end[0].axes[k][k] = end[1].axes[k][k] = 1.0;
    end[1].point = p;
    end[1].velocity = u;
    (void)kt_loop_kinds_baseline[KT_LOOP_CURVE]->evaluate(loop, numbers, end, t, rows);
}

static kt_v4 moved(kt_v4 p, kt_v4 u, kt_v4 a, double t) {
    return p + kt_v4_splat(t) * u + kt_v4_splat(0.5 * t * t) * a;
}

static kt_v4 draw(kt_random *random, double most) {
    return (kt_v4){kt_random_uniform(random, -most, most), kt_random_uniform(random, -most, most),
                   kt_random_uniform(random, -most, most), 0.0};
}

/* The rows' phi along the motion at times around 0: first and second differences of order six. */
static void differences(const kt_loop_record *loop, const double *numbers, kt_v4 p, kt_v4 u, kt_v4 a, double first[3],
                        double second[3]) {
    static const double slope[4] = {0.0, 0.75, -0.15, 1.0 / 60.0}, bend[4] = {-49.0 / 18.0, 1.5, -0.15, 1.0 / 90.0};
    for (int k = 0; k < 3; k++)
        first[k] = second[k] = 0.0;
    for (int i = -3; i <= 3; i++) {
        kt_loop_row rows[3];
        const double t = i * STEP;
        rows_at(loop, numbers, moved(p, u, a, t), moved(u, a, kt_v4_splat(0.0), t), t, rows);
        for (int k = 0; k < 3; k++) {
            first[k] += (i < 0 ? -slope[-i] : slope[i]) * rows[k].residual / STEP;
            second[k] += bend[abs(i)] * rows[k].residual / (STEP * STEP);
        }
    }
}

/* Differences have rounding of some EPS / STEP^2 = 5e-11. Their own error is the sixth power of the step times
 * derivatives that grow near the centre of curvature, from which the points stay away. The third derivative jumps at a
 * knot of a spline. A knot within the steps leaves some STEP^2 of the second derivative, and such draws are left out.
 * Measured over twenty seeds: at most 0.4 of the bounds. */
KT_TEST(rows_are_the_rates_of_the_distance_and_of_the_arc_length) {
    kt_random random = kt_random_of_test();
    const kt_track tracks[2] = {{.type = KT_TRACK_HELIX, .radius = 0.8, .pitch = 0.3},
                                {.type = KT_TRACK_SPLINE, .points = bow, .point_count = 5}};
    for (int which = 0; which < 2; which++) {
        double numbers[NUMBERS];
        const kt_loop_record loop = loop_of(&tracks[which], kt_function_sine(0.3, 0.4, 0.2, 0.7), numbers);
        kt_worst worst[4] = {kt_worst_make("across'"), kt_worst_make("across''"), kt_worst_make("arc length'"),
                             kt_worst_make("arc length''")};
        int drawn = 0;
        for (int n = 0; n < 4000 && drawn < 300; n++) {
            const kt_v4 u = draw(&random, 1.0), a = draw(&random, 1.0);
            const double t = kt_random_uniform(&random, -2.0, 2.0), off = 0.1;
            kt_v4 p = {0.8 * cos(t), 0.8 * sin(t), 0.3 * t, 0.0};
            if (which) {
                const kt_vec3 q = bow[n % 5], r = bow[(n + 1) % 5];
                const double x = kt_random_uniform(&random, 0.1, 0.9);
                if (n % 5 == 4)
                    continue;
                p = kt_v4_from(kt_vec3_add(kt_vec3_scale(x, q), kt_vec3_scale(1.0 - x, r)));
            }
            p += draw(&random, off);
            kt_loop_row rows[3], side[3];
            double first[3], second[3];
            rows_at(&loop, numbers, p, u, 0.0, rows);
            bool one_piece = true;
            for (int i = -3; which && i <= 3; i += 6) { /* the arc lengths of the knots */
                rows_at(&loop, numbers, moved(p, u, a, i * STEP), u, i * STEP, side);
                for (int k = 0; k < loop.count; k++)
                    one_piece &=
                        (numbers[loop.number + (size_t)(loop.count + k)] < rows[2].residual + 0.7 + 0.3 * sin(0.2)) ==
                        (numbers[loop.number + (size_t)(loop.count + k)] <
                         side[2].residual + 0.7 + 0.3 * sin(6.283185307179586 * 0.4 * i * STEP + 0.2));
            }
            if (!one_piece)
                continue;
            drawn++;
            differences(&loop, numbers, p, u, a, first, second);
            for (int k = 0; k < 3; k++) {
                const double rate = kt_v4_dot(rows[k].force, u) + rows[k].rate;
                const double rise = kt_v4_dot(rows[k].force, a) + rows[k].drift;
                kt_worst *w = worst + (k < 2 ? 0 : 2);
                kt_worst_near(&w[0], rate, first[k], k < 2 ? 1e-10 : 2e-9, "%d, row %d", n, k);
                kt_worst_near(&w[1], rise, second[k], 2e-7, "%d, row %d", n, k);
            }
        }
        kt_check_true("draws", drawn == 300);
        for (int i = 0; i < 4; i++)
            kt_check_worst(&worst[i]);
    }
}

/* A spline through 33 points of a half circle of radius 1, with h = pi / 32. Inside, the error is within the circle's
 * fourth derivative times
 *     h^4 / 384 = 2.4e-7.
 * It is larger next to the ends, where a natural spline has no curvature (measured: 5e-4). The test applies the former
 * bound to the middle. The arc length may be below that of the circle by as much as that of the chords,
 *     h^2 pi / 24 = 1.3e-3. */
KT_TEST(spline_of_a_half_circle_is_nearly_one) {
    enum { POINTS = 33 };
    const double pi = 3.14159265358979323846;
    kt_vec3 points[POINTS];
    double numbers[NUMBERS];
    for (int i = 0; i < POINTS; i++)
        points[i] = kt_vec3_make(cos(pi * i / (POINTS - 1)), sin(pi * i / (POINTS - 1)), 0.0);
    const kt_track track = {.type = KT_TRACK_SPLINE, .points = points, .point_count = POINTS};
    const kt_loop_record loop = loop_of(&track, kt_function_constant(0.0), numbers);
    KT_WORST through = kt_worst_make("at its points"), between = kt_worst_make("between them");
    KT_WORST length = kt_worst_make("arc length between neighbours");
    double before = 0.0;
    for (int i = 0; i < POINTS; i++) {
        kt_loop_row rows[3];
        rows_at(&loop, numbers, kt_v4_from(points[i]), kt_v4_splat(0.0), 0.0, rows);
        kt_worst_near(&through, hypot(rows[0].residual, rows[1].residual), 0.0, 1e-17, "%d", i);
        if (i > 8 && i < 25) {
            const double angle = pi * (i + 0.5) / (POINTS - 1);
            kt_worst_near(&length, rows[2].residual - before, pi / (POINTS - 1), 1e-7, "%d", i);
            rows_at(&loop, numbers, (kt_v4){1.2 * cos(angle), 1.2 * sin(angle), 0.0, 0.0}, kt_v4_splat(0.0), 0.0, rows);
            kt_worst_near(&between, hypot(rows[0].residual, rows[1].residual), 0.2, 3e-7, "%d", i);
            rows_at(&loop, numbers, kt_v4_from(points[i]), kt_v4_splat(0.0), 0.0, rows);
        }
        before = rows[2].residual;
    }
    kt_check_near("arc length of all", before, pi, 2e-3);
}

/* Two points: the straight line through them, and beyond them. */
KT_TEST(spline_of_two_points_is_a_line) {
    const kt_vec3 points[2] = {{1.0, 0.0, 0.0}, {1.0, 2.0, 0.0}};
    double numbers[NUMBERS];
    const kt_track track = {.type = KT_TRACK_SPLINE, .points = points, .point_count = 2};
    const kt_loop_record loop = loop_of(&track, kt_function_constant(0.0), numbers);
    for (int i = -1; i < 4; i++) {
        kt_loop_row rows[3];
        rows_at(&loop, numbers, (kt_v4){1.3, 0.9 * i, 0.4, 0.0}, kt_v4_splat(0.0), 0.0, rows);
        kt_check_near("distance", hypot(rows[0].residual, rows[1].residual), 0.5, 1e-15);
        kt_check_near("arc length", rows[2].residual, 0.9 * i, 4e-15);
    }
}
