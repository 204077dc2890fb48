/* Reactions against virtual work. The wrench of a row acts on the second end, and its opposite acts on the first at the
 * same point. For any small displacement of either end, they do the work d phi. The test takes differences of phi and
 * does not use its formula (equations.c tests it). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

static const double STEP = 0.004;

/* The end moved by `by` along or about a world axis through its point (direction 0 to 2: along, 3 to 5: about). */
static moving displaced(const moving *m, int direction, double by) {
    moving moved = *m;
    if (direction < 3) {
        moved.p[direction].x += (long double)by;
    } else {
        jet q[4];
        moving_turn(direction - 3, jet_constant((long double)by), q);
        moving_multiply(q, m->q, moved.q);
    }
    return moved;
}

static int residuals(const kt_loop_record *loop, const double *numbers, const moving m[2], double t,
                     kt_loop_row *rows) {
    const kt_loop_end end[2] = {moving_end(&m[0], NULL), moving_end(&m[1], NULL)};
    return kt_loop_kinds_baseline[loop->type]->evaluate(loop, numbers, end, t, rows);
}

/* d phi for a unit displacement: differences of sixth order, error step^6 / 140 of the seventh derivative. */
static void differences(const kt_loop_record *loop, const double *numbers, const moving m[2], int which, int direction,
                        double t, double slope[KT_LOOP_ROW_MAX]) {
    static const double weight[4] = {0.0, 0.75, -0.15, 1.0 / 60.0};
    kt_loop_row here[KT_LOOP_ROW_MAX];
    (void)residuals(loop, numbers, m, t, here);
    for (int r = 0; r < KT_LOOP_ROW_MAX; r++)
        slope[r] = 0.0;
    for (int i = -3; i <= 3; i++) {
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        moving moved[2] = {m[0], m[1]};
        moved[which] = displaced(&m[which], direction, (double)i * STEP);
        const int count = residuals(loop, numbers, moved, t, rows);
        for (int r = 0; r < count; r++) {
            double change = rows[r].residual - here[r].residual;
            if (loop->type == KT_LOOP_SCREW && r == 4) /* it may have gone over to the next turn of the thread */
                change = remainder(change, 6.283185307179586 * loop->pitch);
            slope[r] += (i < 0 ? -weight[-i] : weight[i]) * change / STEP;
        }
    }
}

/* Work of a row's wrench on the second end at p2 and of its opposite on the first end, also at p2. */
static double work(const kt_loop_row *row, kt_v4 d, int which, int direction) {
    kt_v4 shift = kt_v4_splat(0.0), turn = kt_v4_splat(0.0);
    if (direction < 3)
        shift[direction] = 1.0;
    else
        turn[direction - 3] = 1.0;
    if (which == 1)
        return kt_v4_dot(row->moment, turn) + kt_v4_dot(row->force, shift);
    return -kt_v4_dot(row->moment, turn) - kt_v4_dot(row->force, shift + kt_v4_cross(turn, d));
}

/* Places where no direction is near to undefined, so that seventh derivatives are moderate. */
static bool is_smooth(const kt_loop_record *loop, const moving m[2]) {
    const int type = loop->type;
    const moving r = moving_relative(&m[0], &m[1]);
    jet axes[3][3];
    moving_axes(r.q, axes);
    const double c = (double)axes[2][2].x;
    if (loop->type >= KT_LOOP_GEAR) { /* away from an axis, and from half a turn */
        const double x = (double)r.p[0].x, y = (double)r.p[1].x, u = (double)jet_dot(r.p, axes[0]).x;
        const double v = (double)jet_dot(r.p, axes[1]).x, one = atan2(y, x) - loop->bearing[0];
        const double two = atan2(v, u) - loop->bearing[1] - loop->sense * one, turn = 6.283185307179586;
        const double line = atan2((double)axes[2][1].x, (double)axes[2][0].x) - loop->bearing[0];
        return hypot(x, y) > 1.5 && hypot(u, v) > 1.5 && fabs(c) < 0.6 && fabs(remainder(one, turn)) < 2.8 &&
               fabs(remainder(two, turn)) < 2.8 && fabs(remainder(line, turn)) < 2.8;
    }
    if (type == KT_LOOP_ORTHOGONAL || type == KT_LOOP_UNIVERSAL || type == KT_LOOP_ROLLING)
        return fabs(c) < 0.7;
    if (type == KT_LOOP_DISTANCE)
        return (double)jet_dot(r.p, r.p).x > 1.0;
    const double rho = hypot((double)r.p[0].x, (double)r.p[1].x);
    if (type == KT_LOOP_SURFACE || type == KT_LOOP_CURVE) /* a helix: curve.c */
        return rho > 1.3 && hypot(rho - loop->radius, (double)r.p[2].x) > 1.2 && loop->pitch == 0.0;
    return c > -0.3 && (double)r.q[0].x > 0.05;
}

/* Bound: rounding, a few EPS / STEP = 6e-14, and the differences' own error; measured over twenty seeds: at most 0.6 of
 * it. */
KT_TEST(wrenches_do_the_work_of_the_residual) {
    kt_random random = kt_random_of_test();
    for (int type = 0; type < KT_LOOP_TYPE_COUNT; type++) {
        if (kt_loop_kinds_baseline[type]->rows == 0)
            continue;
        kt_worst error = kt_worst_make(kt_loop_type_name((kt_loop_type)type));
        for (int n = 0; n < 200; n++) {
            double numbers[MOVING_NUMBERS], slope[KT_LOOP_ROW_MAX];
            kt_loop_row rows[KT_LOOP_ROW_MAX];
            const kt_loop_record loop = moving_loop(&random, type, numbers);
            const moving m[2] = {moving_random(&random, 2.0), moving_random(&random, 2.0)};
            if (!is_smooth(&loop, m))
                continue;
            const int count = residuals(&loop, numbers, m, 1.0, rows);
            if (type == KT_LOOP_HOMOKINETIC &&
                fabs(rows[3].residual) > 3.8) /* next to the whole turn, where it jumps */
                continue;
            const kt_v4 d = moving_end(&m[1], NULL).point - moving_end(&m[0], NULL).point;
            for (int i = 0; i < 12; i++) {
                differences(&loop, numbers, m, i / 6, i % 6, 1.0, slope);
                for (int r = 0; r < count; r++)
                    if (rows[r].holonomic)
                        kt_worst_near(&error, work(&rows[r], d, i / 6, i % 6), slope[r], 1e-12,
                                      "%d, row %d, end %d, direction %d", n, r, i / 6, i % 6);
            }
        }
        if (error.count)
            kt_check_worst(&error);
    }
}
