/* Orientation closures: first order in the error, and right up to half a turn of it. If an axis should be normal to
 * another, the limit is a quarter turn, because no error is larger. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON
static const double PI = 3.141592653589793;

/* A first end anywhere, and a second one turned against it about a unit axis of the first by an angle. */
typedef struct pair {
    kt_loop_end end[2];
    kt_v4 axis; /* world */
} pair;

static kt_v4 turned(kt_v4 axis, double angle, kt_v4 u) {
    const kt_v4 across = kt_v4_cross(axis, u), half = kt_v4_splat(2.0 * sin(0.5 * angle) * sin(0.5 * angle));
    return u + kt_v4_splat(sin(angle)) * across + half * kt_v4_cross(axis, across);
}

static void turn_end(kt_loop_end *end, kt_v4 axis, double angle) {
    for (int k = 0; k < 3; k++)
        end->axes[k] = turned(axis, angle, end->axes[k]);
}

/* `axis` in the first end's frame. */
static pair pair_of(kt_random *random, const double axis[3], double angle) {
    pair p;
    const moving first = moving_random(random, 1.0);
    p.end[0] = p.end[1] = moving_end(&first, NULL);
    p.axis = kt_v4_apply(p.end[0].axes, (kt_v4){axis[0], axis[1], axis[2], 0.0});
    turn_end(&p.end[1], p.axis, angle);
    return p;
}

static int rows_of(int type, const kt_loop_end end[2], kt_loop_row *rows) {
    const kt_loop_record loop = {.type = type};
    return kt_loop_kinds_baseline[type]->evaluate(&loop, NULL, end, 0.0, rows);
}

/* Newton's step: the least w with moment . w = -residual in all rows (Gram-Schmidt on the rows, in long double).
 * Returns its size. */
static double newton(const kt_loop_row *rows, int count, kt_v4 *step) {
    long double q[3][3], b[3], w[3] = {0.0L, 0.0L, 0.0L};
    for (int r = 0; r < count; r++) {
        long double square = 0.0L;
        b[r] = -(long double)rows[r].residual;
        for (int k = 0; k < 3; k++)
            q[r][k] = (long double)rows[r].moment[k];
        for (int i = 0; i < r; i++) {
            const long double dot = q[r][0] * q[i][0] + q[r][1] * q[i][1] + q[r][2] * q[i][2];
            b[r] -= dot * b[i];
            for (int k = 0; k < 3; k++)
                q[r][k] -= dot * q[i][k];
        }
        for (int k = 0; k < 3; k++)
            square += q[r][k] * q[r][k];
        b[r] /= sqrtl(square);
        for (int k = 0; k < 3; k++) {
            q[r][k] /= sqrtl(square);
            w[k] += b[r] * q[r][k];
        }
    }
    *step = (kt_v4){(double)w[0], (double)w[1], (double)w[2], 0.0};
    return (double)sqrtl(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
}

static double residual_size(const kt_loop_row *rows, int count) {
    double square = 0.0;
    for (int r = 0; r < count; r++)
        square += rows[r].residual * rows[r].residual;
    return sqrt(square);
}

/* An axis of the turn that makes the whole angle an error of this type. */
static void error_axis(kt_random *random, int type, double axis[3]) {
    kt_random_direction(random, type == KT_LOOP_PARALLEL ? 3 : 2, axis);
    if (type != KT_LOOP_PARALLEL)
        axis[2] = 0.0;
}

KT_TEST(residual_is_four_tangents_of_a_quarter_of_the_error) {
    kt_random random = kt_random_of_test();
    const int types[2] = {KT_LOOP_PARALLEL, KT_LOOP_COAXIAL};
    for (int i = 0; i < 2; i++) {
        KT_WORST size = kt_worst_make(kt_loop_type_name((kt_loop_type)types[i])),
                 way = kt_worst_make("  along the axis");
        for (int n = 0; n < 1000; n++) {
            double axis[3];
            kt_loop_row rows[3];
            error_axis(&random, types[i], axis);
            const double angle =
                n % 2 ? kt_random_uniform(&random, 0.0, PI) : pow(10.0, kt_random_uniform(&random, -16.0, 0.0));
            const pair p = pair_of(&random, axis, angle);
            const int count = rows_of(types[i], p.end, rows);
            /* an axis near half a turn: a rounding EPS of it turns the direction by EPS / sin */
            const double bound = 8.0 * EPS * (1.0 + angle / sin(0.5 * (PI - angle)));
            kt_worst_near(&size, residual_size(rows, count), 4.0 * tan(0.25 * angle), 16.0 * EPS, "angle %g", angle);
            for (int r = 0; r < count; r++)
                kt_worst_near(&way, rows[r].residual, 4.0 * tan(0.25 * angle) * axis[r], bound, "angle %g", angle);
        }
    }
    KT_WORST orthogonal = kt_worst_make("orthogonal: 2 tan(eps / 2)");
    for (int n = 0; n < 1000; n++) {
        double axis[3];
        kt_loop_row rows[1];
        error_axis(&random, KT_LOOP_ORTHOGONAL, axis);
        const double angle = kt_random_uniform(&random, 0.0, PI);
        const pair p = pair_of(&random, axis, angle);
        (void)rows_of(KT_LOOP_ORTHOGONAL, p.end, rows);
        kt_worst_near(&orthogonal, rows[0].residual, 2.0 * tan(0.5 * (0.5 * PI - angle)), 16.0 * EPS, "angle %g",
                      angle);
    }
}

/* [MSD 6.49, 6.50]: a small error theta n leaves the residual theta n, to third order. The errors of third order are
 *     theta^3 / 48    of 4 tan(theta / 4) - theta,
 *     theta^3 / 12    of 2 tan(theta / 2) - theta. */
KT_TEST(residuals_are_first_order_in_the_error) {
    kt_random random = kt_random_of_test();
    KT_WORST parallel = kt_worst_make("parallel"), coaxial = kt_worst_make("coaxial"),
             normal = kt_worst_make("orthogonal");
    for (int n = 0; n < 600; n++) {
        double axis[3];
        kt_loop_row rows[3];
        const double angle = pow(10.0, kt_random_uniform(&random, -12.0, -1.0)), cube = angle * angle * angle;
        kt_random_direction(&random, 3, axis);
        pair p = pair_of(&random, axis, angle);
        (void)rows_of(KT_LOOP_PARALLEL, p.end, rows);
        for (int k = 0; k < 3; k++)
            kt_worst_near(&parallel, rows[k].residual, angle * axis[k], cube / 47.0 + 6.0 * EPS, "angle %g", angle);
        error_axis(&random, KT_LOOP_COAXIAL, axis);
        p = pair_of(&random, axis, angle);
        (void)rows_of(KT_LOOP_COAXIAL, p.end, rows);
        for (int k = 0; k < 2; k++)
            kt_worst_near(&coaxial, rows[k].residual, angle * axis[k], cube / 47.0 + 6.0 * EPS, "angle %g", angle);
        p = pair_of(&random, axis, 0.5 * PI - angle);
        (void)rows_of(KT_LOOP_ORTHOGONAL, p.end, rows);
        kt_worst_near(&normal, rows[0].residual, angle, cube / 11.5 + 6.0 * EPS, "angle %g", angle);
    }
}

/* The Newton steps of the two residuals do not go too far, so the error falls at every step:
 *     residual            slope                   step back
 *     4 tan(theta / 4)    1 / cos^2(theta / 4)    2 sin(theta / 2)
 *     2 tan(eps / 2)      1 / cos^2(eps / 2)      sin(eps) */
KT_TEST(newton_steps_shrink_errors_up_to_half_a_turn) {
    kt_random random = kt_random_of_test();
    const int types[3] = {KT_LOOP_PARALLEL, KT_LOOP_COAXIAL, KT_LOOP_ORTHOGONAL};
    for (int i = 0; i < 3; i++) {
        const bool normal = types[i] == KT_LOOP_ORTHOGONAL;
        KT_WORST length = kt_worst_make(kt_loop_type_name((kt_loop_type)types[i]));
        KT_WORST left = kt_worst_make("  error left"), closed = kt_worst_make("  after six steps");
        for (int n = 0; n < 300; n++) {
            double axis[3];
            kt_loop_row rows[3];
            kt_v4 step;
            error_axis(&random, types[i], axis);
            const double most = normal ? 0.5 * PI : PI, error = most - pow(10.0, kt_random_uniform(&random, -2.9, 0.4));
            pair p = pair_of(&random, axis, normal ? 0.5 * PI - error : error);
            int count = rows_of(types[i], p.end, rows);
            const double back = normal ? sin(error) : 2.0 * sin(0.5 * error);
            /* near half a turn an axis' slopes across the error are as 1 / sin, and their rounding is */
            const double steep = types[i] == KT_LOOP_COAXIAL ? 1.0 + 1.0 / sin(error) : 1.0;
            kt_worst_near(&length, newton(rows, count, &step), fabs(back), 40.0 * EPS * steep, "error %g", error);
            turn_end(&p.end[1], p.axis, normal ? back : -back);
            count = rows_of(types[i], p.end, rows);
            const double rest = error - back, residual = normal ? 2.0 * tan(0.5 * rest) : 4.0 * tan(0.25 * rest);
            kt_worst_near(&left, residual_size(rows, count), fabs(residual), 16.0 * EPS, "error %g", error);

            p = pair_of(&random, axis, normal ? 0.5 * PI - error : error);
            for (int k = 0; k < 6; k++) {
                count = rows_of(types[i], p.end, rows);
                const double by = newton(rows, count, &step);
                if (by > 0.0)
                    turn_end(&p.end[1], step / kt_v4_splat(by), by);
            }
            count = rows_of(types[i], p.end, rows);
            kt_worst_below(&closed, residual_size(rows, count), 16.0 * EPS, "error %g", error);
        }
    }
}

/* The parallel closure's Jacobian is (1 + s) times a rotation. It is never badly conditioned, with
 *     s = tan^2(theta / 4). */
KT_TEST(equal_orientation_is_conformal) {
    kt_random random = kt_random_of_test();
    KT_WORST error = kt_worst_make("B B' - (1 + s)^2 1");
    for (int n = 0; n < 1000; n++) {
        double axis[3];
        kt_loop_row rows[3];
        error_axis(&random, KT_LOOP_PARALLEL, axis);
        const double angle = kt_random_uniform(&random, 0.0, PI), s = pow(tan(0.25 * angle), 2.0);
        const pair p = pair_of(&random, axis, angle);
        (void)rows_of(KT_LOOP_PARALLEL, p.end, rows);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                kt_worst_near(&error, kt_v4_dot(rows[i].moment, rows[j].moment), i == j ? (1.0 + s) * (1.0 + s) : 0.0,
                              20.0 * EPS, "angle %g", angle);
    }
}
