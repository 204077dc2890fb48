/* Loops of several states, one state after the other, with the code for one state. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/by_lane.h"

static kt_v4 load_vector(const double *x, size_t width) { return (kt_v4){x[0], x[width], x[2 * width], 0.0}; }

static void put3(kt_v4 a, size_t width, double *x) {
    for (size_t k = 0; k < 3; k++)
        x[k * width] = a[k];
}

/* Loads the motion of an end of one lane, whose first number is at x. */
static void load_loop_end(const double *x, size_t width, kt_loop_end *end) {
    for (size_t k = 0; k < 3; k++)
        end->axes[k] = load_vector(x + 3 * k * width, width);
    end->point = load_vector(x + 9 * width, width);
    end->omega = load_vector(x + 12 * width, width);
    end->velocity = load_vector(x + 15 * width, width);
    end->turn = x[18 * width];
    end->alpha = end->linear = kt_v4_splat(0.0);
}

static void put_row(const kt_loop_row *row, size_t width, double *x) {
    put3(row->moment, width, x);
    put3(row->force, width, x + 3 * width);
    x[6 * width] = row->residual;
    x[7 * width] = row->rate;
    x[8 * width] = row->drift;
}

int KT_KERNEL(kt_loop_evaluate_by_lane)(const kt_loop_record *loop, const double *numbers, const kt_loop_lanes *at,
                                        unsigned *flags) {
    int count = 0;
    for (size_t lane = 0; lane < at->width; lane++) {
        kt_loop_end end[2];
        kt_loop_row rows[KT_LOOP_ROW_MAX];
        for (int k = 0; k < 2; k++)
            load_loop_end(at->end[k] + lane, at->width, &end[k]);
        count = KT_KERNEL(kt_loop_kinds)[loop->kind]->evaluate(loop, numbers, end, at->t[lane], rows);
        *flags = 0;
        for (int r = 0; r < count; r++) {
            put_row(&rows[r], at->width, at->row + (size_t)r * at->row_stride + lane);
            *flags |= (rows[r].holonomic ? 1U : 0U) << r;
        }
    }
    return count;
}

double KT_KERNEL(kt_loop_relate_by_lane)(const kt_loop_record *loop, const double *numbers, const kt_loop_lanes *at) {
    double closes = 0.0;
    for (size_t lane = 0; lane < at->width; lane++) {
        const kt_relation_row row =
            KT_KERNEL(kt_loop_kinds)[loop->kind]->relate(loop, numbers, at->end[0][lane], at->t[lane]);
        at->row[lane] = row.residual;
        at->row[at->width + lane] = row.rate;
        at->row[2 * at->width + lane] = row.drift;
        closes = row.closes;
    }
    return closes;
}
