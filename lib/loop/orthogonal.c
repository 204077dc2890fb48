/* Orthogonal: the first end's z axis is normal to the second's. */
#include "loop/orientation.h"

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_orthogonal(end, &r);
    return 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_orthogonal) = {.rows = 1, .evaluate = evaluate, .part = {KT_PART_NORMAL}};
