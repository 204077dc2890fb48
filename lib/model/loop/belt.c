/* Belt: two spans between two pulleys (span.h), the second one on the other side of both. A crossed belt passes the
 * second pulley on the other side than the first. With phi_1 and phi_2 of the spans, the rows are
 *     (phi_1 - phi_2) / 2     the belt does not slip; its multiplier is lambda_2 - lambda_1, between its tensions
 *     phi_1 + phi_2           it keeps its length; void if the pulleys keep their distance
 * so that the spans have the multipliers mu_2 +- mu_1 / 2. A belt whose length is void has the tension at rest and half
 * of the difference in either span.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/span.h"

static int evaluate_belt(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                         kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    const double other[2] = {-loop->gain[0], -loop->gain[1]};
    const kt_loop_row one = kt_row_of_span(loop, end, &r, loop->gain, loop->phase[0]);
    const kt_loop_row two = kt_row_of_span(loop, end, &r, other, loop->phase[1]);
    rows[0] = (kt_loop_row){.moment = kt_scale(0.5, one.moment - two.moment),
                            .force = kt_scale(0.5, one.force - two.force),
                            .residual = 0.5 * (one.residual - two.residual),
                            .drift = 0.5 * (one.drift - two.drift),
                            .holonomic = true};
    rows[1] = (kt_loop_row){.moment = one.moment + two.moment,
                            .force = one.force + two.force,
                            .residual = one.residual + two.residual,
                            .drift = one.drift + two.drift,
                            .holonomic = true};
    return 2;
}

/* Adds the wrench of the belt at rest: both spans pull with the same tension. */
static void load_belt(const kt_loop_record *loop, const kt_loop_end end[2], const double *lambda, kt_vector *moment,
                      kt_vector *force) {
    const double other[2] = {-loop->gain[0], -loop->gain[1]};
    (void)lambda;
    kt_span_pull(end, loop->gain, loop->tension, moment, force);
    kt_span_pull(end, other, loop->tension, moment, force);
}

static bool start_belt(const kt_loop *loop, const kt_loop_start *at, kt_loop_record *record, kt_error *error) {
    return kt_span_start(loop, at, loop->crossed ? -loop->radius2 : loop->radius2, record, error);
}

const kt_loop_kind KT_KERNEL(kt_loop_belt) = {.rows = 2,
                                              .evaluate = evaluate_belt,
                                              .part = {KT_PART_SPATIAL, KT_PART_SPATIAL},
                                              .start = start_belt,
                                              .load = load_belt};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"between", KT_KEY_ENDS, KT_LOOP_AT(between), "", "the centres of the pulleys", .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "of the first pulley, in its frame", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(second_axis), "", "of the second pulley, in its frame", "as axis",
     .needed = false},
    {"radius", KT_KEY_NUMBER, KT_LOOP_AT(radius), "m", "of the first pulley", .range = KT_RANGE_POSITIVE,
     .needed = true},
    {"radius2", KT_KEY_NUMBER, KT_LOOP_AT(radius2), "m", "of the second pulley", .range = KT_RANGE_POSITIVE,
     .needed = true},
    {"crossed", KT_KEY_FLAG, KT_LOOP_AT(crossed), "", "true: the spans cross, and the pulleys turn in opposite senses",
     .needed = false},
    {"tension", KT_KEY_NUMBER, KT_LOOP_AT(tension), "N", "of both spans at rest", .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_loop_belt_descriptor = {
    .name = "belt",
    .help = "a belt runs around two pulleys without slip; the bearings carry both spans",
    .formula =
        "L_k -+ rho_1 chi_1 +- rho_2 chi_2 = constant    for both spans, as of span: their difference, and their "
        "sum\n"
        "F_k = (lambda_2 +- lambda_1 / 2 - tension) x_k    on the second pulley",
    .example =
        "bodies:\n"
        "  - {name: motor, joint: {type: revolute, axis: z, velocity: 30}, mass: 1, shape: {type: cylinder, "
        "radius: 0.05, length: 0.02}}\n"
        "  - {name: fan, joint: {type: revolute, axis: z, at: [0.5, 0, 0], velocity: 10}, mass: 4, shape: {type: "
        "cylinder, radius: 0.15, length: 0.02}}\n"
        "loops:\n"
        "  - {name: belt, type: belt, between: [motor, fan], axis: z, radius: 0.05, radius2: 0.15, tension: "
        "200}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
