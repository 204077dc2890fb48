/* Inplane: the second point stays in the plane through the first, normal to its z axis; d_z = 0. */
#include "loop/relative.h"

#ifndef KT_NO_LOOPS
static int evaluate_inplane(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                            kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_along(&r, end[0].axes[2]);
    return 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_inplane) = {.rows = 1, .evaluate = evaluate_inplane, .part = {KT_PART_Z}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("the normal of the plane, in the frame of the first end"),
     .needed = false},
};
const kt_descriptor kt_loop_inplane_descriptor = {
    .name = "inplane",
    .help = KT_WORDS("the second point stays in a plane through the first"),
    .formula = KT_WORDS("e_z . d = 0    e_z = axis, of the first end;  d: from its point to the second"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: inplane, between: [world, box], axis: x}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
