/* Span: one straight span of a rope (span.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/span.h"

static int evaluate_span(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                         kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_of_span(loop, end, &r, loop->gain, loop->phase[0]);
    return 1;
}

static void load_span(const kt_loop_record *loop, const kt_loop_end end[2], const double *lambda, kt_vector *moment,
                      kt_vector *force) {
    (void)lambda;
    kt_span_pull(end, loop->gain, loop->tension, moment, force);
}

static bool start_span(const kt_loop *loop, const kt_loop_start *at, kt_loop_record *record, kt_error *error) {
    return kt_span_start(loop, at, loop->radius2, record, error);
}

const kt_loop_kind KT_KERNEL(kt_loop_span) = {
    .rows = 1, .evaluate = evaluate_span, .part = {KT_PART_SPATIAL}, .start = start_span, .load = load_span};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"between", KT_KEY_ENDS, KT_LOOP_AT(between), "",
     "the centres of the pulleys, or a point to which the rope is tied", .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "n, of the first pulley, in its frame", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(second_axis), "", "of the second pulley, in its frame", "as axis",
     .needed = false},
    {"radius", KT_KEY_NUMBER, KT_LOOP_AT(radius), "m",
     "rho_1, of the first pulley; positive if the rope passes its centre on the left, looking along the rope with n "
     "towards the viewer; 0: the rope is tied to the point",
     .needed = false},
    {"radius2", KT_KEY_NUMBER, KT_LOOP_AT(radius2), "m", "rho_2, of the second pulley, likewise", .needed = false},
    {"tension", KT_KEY_NUMBER, KT_LOOP_AT(tension), "N", "of the rope at rest", .range = KT_RANGE_NOT_NEGATIVE},
    {"slack", KT_KEY_FLAG, KT_LOOP_AT(slack), "", "true: the rope only pulls, and may become slack", .needed = false},
    {"restitution", KT_KEY_NUMBER, KT_LOOP_AT(restitution), "",
     "e, of a rope that becomes taut: a span that lengthens at w returns at e w", .range = KT_RANGE_NOT_NEGATIVE},
    {"rest_velocity", KT_KEY_NUMBER, KT_LOOP_AT(rest_velocity), "m/s",
     "of a rope that becomes slack: a span that lengthens more slowly does not bounce", .range = KT_RANGE_NOT_NEGATIVE},
    KT_POISSON_KEY(KT_LOOP_AT(poisson), "of a rope that becomes slack: ")};
const kt_descriptor kt_loop_span_descriptor = {
    .name = "span",
    .help = "a rope runs straight from one pulley to another without slip; bearings carry its tension",
    .formula =
        "L - rho_1 chi_1 + rho_2 chi_2 = constant    L: length of the span;  chi: angle of its direction, in the "
        "frame of a pulley\n"
        "F = (lambda - tension) x    on the second pulley, x: direction of the span; lambda < 0 pulls",
    .example =
        "bodies:\n"
        "  - {name: drum, joint: {type: revolute, axis: y}, mass: 4, shape: {type: cylinder, radius: 0.1, length: "
        "0.2, axis: y}}\n"
        "  - {name: load, joint: {type: prismatic, axis: z, at: [0.1, 0, -1]}, mass: 2, shape: {type: sphere, "
        "radius: 0.05}}\n"
        "loops:\n"
        "  - {name: rope, type: span, between: [drum, load], axis: y, radius: 0.1}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
