/* Places where a direction is undefined: coincident points, opposite axes, a wheel that lies flat. Every number there
 * is finite, and where a gap is to be closed its rows lead out. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON
static const double CLEARANCE = 1e-3; /* KT_AXIS_CLEARANCE */

/* Ends with velocities, whose axes are so turned and whose points so far apart. */
static void ends_of(kt_random *random, const moving *relative, kt_loop_end end[2]) {
    const moving a = moving_random(random, 1.0), b = moving_compose(&a, relative);
    end[0] = moving_end(&a, NULL);
    end[1] = moving_end(&b, NULL);
}

/* At rest, exactly: axes of the second are the first's, signs changed; so is its point. */
static void aligned(kt_random *random, double sx, double sy, double sz, kt_loop_end end[2]) {
    const moving a = moving_random(random, 1.0), b = moving_random(random, 1.0);
    end[0] = moving_end(&a, NULL);
    end[1] = moving_end(&b, NULL);
    end[1].point = end[0].point;
    end[1].axes[0] = kt_v4_splat(sx) * end[0].axes[0];
    end[1].axes[1] = kt_v4_splat(sy) * end[0].axes[1];
    end[1].axes[2] = kt_v4_splat(sz) * end[0].axes[2];
}

static double largest(const kt_loop_row *rows, int count) {
    double most = 0.0;
    for (int r = 0; r < count; r++) {
        const double x[4] = {rows[r].residual, rows[r].rate, rows[r].drift,
                             sqrt(kt_v4_dot(rows[r].moment, rows[r].moment) + kt_v4_dot(rows[r].force, rows[r].force))};
        for (int k = 0; k < 4; k++)
            most = fabs(x[k]) <= most ? most : fabs(x[k]); /* keeps a NaN */
    }
    return most;
}

KT_TEST(undefined_directions_leave_every_number_finite) {
    kt_random random = kt_random_of_test();
    const double signs[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        if (kt_loop_kinds_baseline[type]->rows == 0)
            continue;
        KT_WORST size = kt_worst_make(kt_loop_type_name((kt_loop_type)type));
        for (int n = 0; n < 40; n++) {
            double numbers[MOVING_NUMBERS];
            kt_loop_end end[2];
            kt_loop_row rows[KT_LOOP_ROW_MAX];
            const kt_loop_record loop = moving_loop(&random, type, numbers);
            aligned(&random, signs[n % 4][0], signs[n % 4][1], signs[n % 4][2], end);
            const int count = kt_loop_kinds_baseline[type]->evaluate(&loop, numbers, end, 1.0, rows);
            kt_worst_below(&size, isfinite(largest(rows, count)) ? 0.0 : 1.0, 0.0, "%d", n);
        }
    }
}

KT_TEST(opposite_axes_are_half_a_turn_apart) {
    kt_random random = kt_random_of_test();
    KT_WORST size = kt_worst_make("residual"), slope = kt_worst_make("slope about its axis");
    for (int n = 0; n < 40; n++) {
        kt_loop_end end[2];
        kt_loop_row rows[2];
        const kt_loop_record loop = {.type = KT_LOOP_COAXIAL};
        aligned(&random, n % 2 ? 1.0 : -1.0, n % 2 ? -1.0 : 1.0, -1.0, end);
        (void)kt_loop_kinds_baseline[KT_LOOP_COAXIAL]->evaluate(&loop, NULL, end, 0.0, rows);
        /* e_x leads out: the error is about e_y. Slopes are those of the clearance. */
        const double slant = cos(0.25 * (3.141592653589793 - asin(CLEARANCE)));
        kt_worst_near(&size, rows[0].residual, 0.0, 8.0 * EPS / CLEARANCE, "%d: e_x", n);
        kt_worst_near(&size, rows[1].residual, 4.0, 8.0 * EPS, "%d: e_y", n);
        kt_worst_near(&slope, kt_v4_dot(rows[1].moment, end[0].axes[1]), 1.0 / (slant * slant), 16.0 * EPS / CLEARANCE,
                      "%d", n);
    }
}

KT_TEST(an_axis_on_the_line_it_should_be_normal_to_is_a_quarter_turn_off) {
    kt_random random = kt_random_of_test();
    KT_WORST size = kt_worst_make("residual"), slope = kt_worst_make("slope about e_y");
    for (int n = 0; n < 40; n++) {
        kt_loop_end end[2];
        kt_loop_row row;
        const kt_loop_record loop = {.type = KT_LOOP_ORTHOGONAL};
        const double sign = n % 2 ? 1.0 : -1.0, slant = cos(0.5 * (0.5 * 3.141592653589793 - asin(CLEARANCE)));
        aligned(&random, sign, 1.0, sign, end);
        (void)kt_loop_kinds_baseline[KT_LOOP_ORTHOGONAL]->evaluate(&loop, NULL, end, 0.0, &row);
        kt_worst_near(&size, row.residual, sign * 2.0, 8.0 * EPS, "%d", n);
        /* turning about e_y from z to x opens the angle: less error for z, more for -z */
        kt_worst_near(&slope, kt_v4_dot(row.moment, end[0].axes[1]), -1.0 / (slant * slant), 16.0 * EPS, "%d", n);
    }
}

/* States on both sides of the limit of the clearance, 2e-10 rad apart. phi has the slope 2. Slopes across the error are
 * proportional to 1 / tilt. The slope of the normal closure is stationary. */
KT_TEST(equations_go_over_into_the_clearance_without_a_jump) {
    kt_random random = kt_random_of_test();
    const int types[2] = {KT_LOOP_COAXIAL, KT_LOOP_ORTHOGONAL};
    for (int i = 0; i < 2; i++) {
        KT_WORST residual = kt_worst_make(kt_loop_type_name((kt_loop_type)types[i]));
        KT_WORST moment = kt_worst_make("  moment, relative");
        for (int n = 0; n < 100; n++) {
            kt_loop_row rows[2][2];
            const double around = kt_random_uniform(&random, -3.0, 3.0);
            const moving a = moving_random(&random, 1.0);
            for (int k = 0; k < 2; k++) {
                moving relative = {{jet_constant(0), jet_constant(0), jet_constant(0)},
                                   {jet_constant(1), jet_constant(0), jet_constant(0), jet_constant(0)}};
                const double tilt = 3.141592653589793 - asin(CLEARANCE) * (k ? 1.0 + 1e-7 : 1.0 - 1e-7);
                jet q[4];
                moving_turn(2, jet_constant((long double)around), relative.q);
                moving_turn(0, jet_constant((long double)tilt), q);
                moving_multiply(relative.q, q, relative.q);
                const moving b = moving_compose(&a, &relative);
                const kt_loop_end end[2] = {moving_end(&a, NULL), moving_end(&b, NULL)};
                const kt_loop_record loop = {.type = types[i]};
                (void)kt_loop_kinds_baseline[types[i]]->evaluate(&loop, NULL, end, 0.0, rows[k]);
            }
            for (int r = 0; r < 2 - i; r++) {
                const kt_v4 jump = rows[0][r].moment - rows[1][r].moment, whole = rows[1][r].moment;
                kt_worst_near(&residual, rows[0][r].residual, rows[1][r].residual, 5e-10, "%d, row %d", n, r);
                kt_worst_below(&moment, sqrt(kt_v4_dot(jump, jump) / kt_v4_dot(whole, whole)), i ? 2e-9 : 2e-7,
                               "%d, row %d", n, r);
            }
        }
    }
}

/* |d| = L from |d| = 0: along the first end's x axis. */
KT_TEST(coincident_points_part_along_x) {
    kt_random random = kt_random_of_test();
    kt_loop_end end[2];
    kt_loop_row row;
    double numbers[MOVING_NUMBERS];
    const kt_loop_record loop = moving_loop(&random, KT_LOOP_DISTANCE, numbers);
    const jet length = moving_length(1.0);
    for (int tiny = 0; tiny < 2; tiny++) {
        aligned(&random, 1.0, 1.0, 1.0, end);
        if (tiny)
            end[0].point = end[1].point = kt_v4_splat(0.0), end[1].point[1] = 1e-160;
        (void)kt_loop_kinds_baseline[KT_LOOP_DISTANCE]->evaluate(&loop, numbers, end, 1.0, &row);
        const kt_v4 difference = row.force - end[0].axes[0];
        kt_check_near("direction", kt_v4_dot(difference, difference), 0.0, 0.0);
        kt_check_near("phi", row.residual, (double)-length.x, EPS * 4.0);
        kt_check_near("phi_t", row.rate, (double)-length.d, EPS * 4.0);
        kt_check_near("drift", row.drift, (double)-length.dd, EPS * 8.0);
    }
}

/* Half a turn exactly, where the quaternion's sign is free: still the distance 4. */
KT_TEST(half_a_turn_is_not_closed) {
    kt_random random = kt_random_of_test();
    KT_WORST size = kt_worst_make("|phi| of parallel");
    for (int n = 0; n < 60; n++) {
        kt_loop_end end[2];
        kt_loop_row rows[3];
        const kt_loop_record loop = {.type = KT_LOOP_PARALLEL};
        const moving relative = {
            {jet_constant(0), jet_constant(0), jet_constant(0)},
            {jet_constant(0), jet_constant(n % 3 == 0), jet_constant(n % 3 == 1), jet_constant(n % 3 == 2)}};
        ends_of(&random, &relative, end);
        (void)kt_loop_kinds_baseline[KT_LOOP_PARALLEL]->evaluate(&loop, NULL, end, 0.0, rows);
        double square = 0.0;
        for (int k = 0; k < 3; k++)
            square += rows[k].residual * rows[k].residual;
        kt_worst_near(&size, sqrt(square), 4.0, 16.0 * EPS, "%d", n);
    }
}
