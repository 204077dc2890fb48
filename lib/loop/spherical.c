/* Spherical: the two points coincide; d = 0, in the first end's axes. */
#include "loop/relative.h"

#ifndef KT_NO_LOOPS
static int evaluate_spherical(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                              kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 3; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    return 3;
}

const kt_loop_kind KT_KERNEL(kt_loop_spherical) = {
    .rows = 3, .evaluate = evaluate_spherical, .part = {KT_PART_X, KT_PART_Y, KT_PART_Z}};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
};
const kt_descriptor kt_loop_spherical_descriptor = {
    .name = "spherical",
    .help = KT_WORDS("the two points coincide"),
    .formula = KT_WORDS("d = 0    d: from the first point to the second"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: spherical, between: [world, box.corner]}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
