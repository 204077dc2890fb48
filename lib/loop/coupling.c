/* Coupling: sum of coefficient * position = offset; gears, pulleys, mimic joints. */
#include "loop/loop.h"

#ifndef KT_NO_LOOPS
static kt_relation_row relate(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    double offset[3];
    kt_curve_evaluate(&loop->curve, numbers, t, offset);
    return (kt_relation_row){.residual = sum - offset[0], .closes = 1.0};
}

const kt_loop_kind KT_KERNEL(kt_loop_coupling) = {.relate = relate};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"coefficients", KT_KEY_TERMS, KT_LOOP_AT(terms), "",
     KT_WORDS("c_i, a mapping of joints of one coordinate to numbers"), .needed = true},
    {"offset", KT_KEY_NUMBER, KT_LOOP_AT(offset), "rad|m", KT_WORDS("what the terms add up to"), .needed = false},
};
const kt_descriptor kt_loop_coupling_descriptor = {
    .name = "coupling",
    .help = KT_WORDS("joint positions in a linear relation: gears, pulleys, joints that follow others"),
    .formula = KT_WORDS("sum of c_i q_i = offset"),
    .example = KT_WORDS("bodies:\n"
                        "  - name: pinion\n"
                        "    joint: {type: revolute, axis: y}\n"
                        "    mass: 1\n"
                        "    shape: {type: rod, to: [0, 0, 0.1]}\n"
                        "  - name: gear\n"
                        "    joint: {type: revolute, axis: y, at: [0.4, 0, 0], position: 30 deg}\n"
                        "    mass: 2\n"
                        "    shape: {type: rod, to: [0, 0, 0.3]}\n"
                        "loops:\n"
                        "  - {name: mesh, type: coupling, coefficients: {pinion: 1, gear: 3}, offset: 90 deg}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
