/* Motion: a joint's position follows a function of time; phi = q - f(t), phi_t = -f', and -f'' in phi''. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/loop.h"

static kt_relation_row motion_relation(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    double f[3];
    kt_curve_evaluate(&loop->curve, numbers, t, f);
    return (kt_relation_row){.residual = sum - f[0], .rate = -f[1], .drift = -f[2], .closes = 1.0};
}

const kt_loop_kind KT_KERNEL(kt_loop_motion) = {.relate = motion_relation};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_JOINT_KEY(kt_loop, "the joint whose motion is given, of one coordinate"),
    {"position", KT_KEY_FUNCTION, KT_LOOP_AT(function), "rad|m", "f, a function of time", .needed = true},
};
const kt_descriptor kt_loop_motion_descriptor = {
    .name = "motion",
    .help = "the position of a joint is a function of time",
    .formula = "q = f(t)",
    .example =
        "bodies:\n"
        "  - {name: crank, joint: {type: revolute, axis: y}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}\n"
        "loops:\n"
        "  - {name: drive, type: motion, joint: crank, position: {ramp: {from: 0, to: 90 deg, start: 0.2, end: 0.8}}}\n"
        "initial: {hold: [crank]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
