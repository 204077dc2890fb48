/* Screw: inline, coaxial, and an advance along z of `pitch` metres for each radian of rotation since the start:
 *     phi = d_z - pitch (theta - theta0)
 * (orientation.h has theta, also where the axes are not closed). Whole revolutions are not counted. Among all angles
 * that give this rotation, the angle with the least abs(phi) is used. A nut may thus be anywhere on its thread.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

static kt_real screw_advance(const kt_loop_record *loop, kt_real theta, kt_real along) {
    const double lead = KT_TURN * loop->pitch;
    const kt_real phi = along - loop->pitch * (theta - loop->angle);
    return lead != 0.0 ? kt_remainder(phi, lead) : phi;
}

static int evaluate_screw(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                          kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 2; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    kt_row_coaxial(end, &r, rows + 2);

    const kt_axis_turn turn = kt_axis_turn_of(end, &r);
    rows[4] = kt_row_along(&r, end[0].axes[2]);
    rows[4].residual = screw_advance(loop, turn.theta, rows[4].residual);
    rows[4].moment = kt_scale(-loop->pitch, turn.k);
    rows[4].drift -= loop->pitch * turn.bias;
    return 5;
}

const kt_loop_kind KT_KERNEL(kt_loop_screw) = {.rows = 5, .evaluate = evaluate_screw, .initial_angle = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "in the frames of both ends", .needed = false},
    {"pitch", KT_KEY_NUMBER, KT_LOOP_AT(pitch), "m/rad", "advance along the axis for each radian",
     .range = KT_RANGE_ANY, .needed = true},
};
const kt_descriptor kt_loop_screw_descriptor = {
    .name = "screw",
    .help = "a rotation about the axis, and a translation along it in proportion, are left free",
    .formula = "the equations of inline and of coaxial, and\n"
               "e_z . d = pitch (theta - theta0)    theta: angle about the axis, theta0 at the start;  whole turns are "
               "not counted",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: screw, between: [world, box], axis: z, pitch: 0.02}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
