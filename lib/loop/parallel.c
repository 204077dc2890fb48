/* Parallel: equal orientation. */
#include "loop/orientation.h"

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    kt_row_parallel(end, &r, rows);
    return 3;
}

const kt_loop_kind KT_KERNEL(kt_loop_parallel) = {
    .rows = 3, .evaluate = evaluate, .part = {KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z}};
