/* Coaxial: the z axes of both ends have one direction. */
#include "loop/orientation.h"

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    kt_row_coaxial(end, &r, rows);
    return 2;
}

const kt_loop_kind KT_KERNEL(kt_loop_coaxial) = {
    .rows = 2, .evaluate = evaluate, .part = {KT_PART_TILT_X, KT_PART_TILT_Y}};
