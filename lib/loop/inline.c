/* Inline: the second point stays on the first end's z axis; d_x = d_y = 0. */
#include "loop/relative.h"

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 2; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    return 2;
}

const kt_loop_kind KT_KERNEL(kt_loop_inline) = {.rows = 2, .evaluate = evaluate, .part = {KT_PART_X, KT_PART_Y}};
