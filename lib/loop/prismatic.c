/* Prismatic: the equations of inline and parallel; translation along z is free. */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static int evaluate_prismatic(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                              kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 2; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    kt_row_parallel(end, &r, rows + 2);
    return 5;
}

const kt_loop_kind KT_KERNEL(kt_loop_prismatic) = {
    .rows = 5,
    .evaluate = evaluate_prismatic,
    .part = {KT_PART_X, KT_PART_Y, KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("in the frame of the first end"), .needed = false},
};
const kt_descriptor kt_loop_prismatic_descriptor = {
    .name = "prismatic",
    .help = KT_WORDS("a translation along the axis is left free"),
    .formula = KT_WORDS("the equations of inline and of parallel"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: prismatic, between: [world, box], axis: z}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
