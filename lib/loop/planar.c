/* Planar: the equations of inplane and coaxial; translation along x and y and rotation about z are free. */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static int evaluate_planar_loop(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                                kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_along(&r, end[0].axes[2]);
    kt_row_coaxial(end, &r, rows + 1);
    return 3;
}

const kt_loop_kind KT_KERNEL(kt_loop_planar) = {
    .rows = 3, .evaluate = evaluate_planar_loop, .part = {KT_PART_Z, KT_PART_TILT_X, KT_PART_TILT_Y}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("the normal of the plane, in the frames of both ends"),
     .needed = false},
};
const kt_descriptor kt_loop_planar_descriptor = {
    .name = "planar",
    .help = KT_WORDS("translations in a plane and a rotation about its normal are left free"),
    .formula = KT_WORDS("the equations of inplane and of coaxial"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: planar, between: [world, box], axis: x}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
