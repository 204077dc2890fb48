/* Coaxial: the z axes of both ends have one direction. */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static int evaluate_coaxial(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                            kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    kt_row_coaxial(end, &r, rows);
    return 2;
}

const kt_loop_kind KT_KERNEL(kt_loop_coaxial) = {
    .rows = 2, .evaluate = evaluate_coaxial, .part = {KT_PART_TILT_X, KT_PART_TILT_Y}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("in the frames of both ends"), .needed = false},
};
const kt_descriptor kt_loop_coaxial_descriptor = {
    .name = "coaxial",
    .help = KT_WORDS("the axes of both ends are parallel"),
    .formula =
        KT_WORDS("4 tan(theta / 4) h = 0    theta, h: angle and direction of the least rotation from the first axis to "
                 "the second"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: coaxial, between: [world, box], axis: z}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
