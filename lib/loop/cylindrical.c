/* Cylindrical: the equations of inline and coaxial; rotation about z and translation along it are free. */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static int evaluate_cylindrical(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                                kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 2; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    kt_row_coaxial(end, &r, rows + 2);
    return 4;
}

const kt_loop_kind KT_KERNEL(kt_loop_cylindrical) = {
    .rows = 4, .evaluate = evaluate_cylindrical, .part = {KT_PART_X, KT_PART_Y, KT_PART_TILT_X, KT_PART_TILT_Y}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("in the frames of both ends"), .needed = false},
};
const kt_descriptor kt_loop_cylindrical_descriptor = {
    .name = "cylindrical",
    .help = KT_WORDS("a rotation about the axis and a translation along it are left free"),
    .formula = KT_WORDS("the equations of inline and of coaxial"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: cylindrical, between: [world, box], axis: z}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
