/* Orthogonal: the first end's z axis is normal to the second's. */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static int evaluate_orthogonal(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                               kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_orthogonal(end, &r);
    return 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_orthogonal) = {
    .rows = 1, .evaluate = evaluate_orthogonal, .part = {KT_PART_NORMAL}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("in the frame of the first end"), .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(axis2), "", KT_WORDS("in the frame of the second end"), .needed = false},
};
const kt_descriptor kt_loop_orthogonal_descriptor = {
    .name = "orthogonal",
    .help = KT_WORDS("the axes of both ends are at right angles"),
    .formula = KT_WORDS("2 tan(eps / 2) = 0    eps: the angle that is missing to a right one"),
    .example =
        KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: orthogonal, between: [world, box], axis: x, axis2: y}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
