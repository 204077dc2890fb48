/* Inplane: the second point stays in the plane through the first, normal to its z axis; d_z = 0. */
#include "loop/relative.h"

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_along(&r, end[0].axes[2]);
    return 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_inplane) = {.rows = 1, .evaluate = evaluate, .part = {KT_PART_Z}};
