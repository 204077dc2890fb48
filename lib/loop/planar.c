/* Planar: inplane and coaxial; free to slide along x and y and to turn about z. */
#include "loop/orientation.h"

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_along(&r, end[0].axes[2]);
    kt_row_coaxial(end, &r, rows + 1);
    return 3;
}

const kt_loop_kind KT_KERNEL(kt_loop_planar) = {
    .rows = 3, .evaluate = evaluate, .part = {KT_PART_Z, KT_PART_TILT_X, KT_PART_TILT_Y}};
