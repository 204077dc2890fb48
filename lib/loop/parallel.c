/* Parallel: equal orientation. */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static int evaluate_parallel(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                             kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    kt_row_parallel(end, &r, rows);
    return 3;
}

const kt_loop_kind KT_KERNEL(kt_loop_parallel) = {
    .rows = 3, .evaluate = evaluate_parallel, .part = {KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
};
const kt_descriptor kt_loop_parallel_descriptor = {
    .name = "parallel",
    .help = KT_WORDS("both ends have the same orientation"),
    .formula = KT_WORDS("4 tan(theta / 4) n = 0    theta n: the rotation from the first frame to the second"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: parallel, between: [world, box]}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
