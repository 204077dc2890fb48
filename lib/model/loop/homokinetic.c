/* Homokinetic (constant-velocity joint): the points coincide, and both ends turn alike about their z axes, at any angle
 * between these. With theta of orientation.h, theta0 that at the start, and p = 4 tan((theta - theta0) / 4),
 *     phi   = p
 *     phi'  = (1 + p^2 / 16) theta'
 *     phi'' = (1 + p^2 / 16) (theta'' + p theta'^2 / 8)
 * theta' = k . w, and k lies along the bisector e + f of the axes. The relative angular velocity thus stays in the
 * plane that bisects the joint. Shafts that turn in place have equal rates [Masarati and Morandini 2008, Multibody
 * System Dynamics 20]:
 *     w = W2 f - W1 e,  (e + f) . w = (1 + e . f) (W2 - W1) = 0
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/orientation.h"

static int evaluate_homokinetic(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                                kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 3; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    const kt_axis_turn turn = kt_axis_turn_of(end, &r);
    const kt_real p = 4.0 * kt_tan(0.25 * kt_remainder(turn.theta - loop->angle, KT_TURN));
    const kt_real slope = 1.0 + p * p / 16.0, rate = kt_dot(turn.k, r.w);
    rows[3] = (kt_loop_row){.moment = kt_scale(slope, turn.k),
                            .force = kt_vector_zero(),
                            .residual = p,
                            .drift = slope * (turn.bias + 0.125 * p * rate * rate),
                            .holonomic = true};
    return 4;
}

const kt_loop_kind KT_KERNEL(kt_loop_homokinetic) = {.rows = 4,
                                                     .evaluate = evaluate_homokinetic,
                                                     .part = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_SPATIAL},
                                                     .initial_angle = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "of either shaft, in the frames of both ends", .needed = false},
};
const kt_descriptor kt_loop_homokinetic_descriptor = {
    .name = "homokinetic",
    .help = "constant-velocity joint: two shafts turn alike at any angle between them",
    .formula = "the equations of spherical, and\n"
               "theta = theta0    theta: angle about the axis, theta0 at the start;  whole turns are not "
               "counted",
    .example = "bodies:\n"
               "  - name: drive\n"
               "    joint: {type: revolute, axis: x, velocity: 5}\n"
               "    mass: 1\n"
               "    shape: {type: rod, from: [-0.4, 0, 0], to: [0, 0, 0], radius: 0.02}\n"
               "  - name: wheel\n"
               "    joint: {type: revolute, axis: x, rotation: {axis: z, angle: 40 deg}, velocity: 5}\n"
               "    mass: 2\n"
               "    shape: {type: rod, to: [0.4, 0, 0], radius: 0.05}\n"
               "loops:\n"
               "  - {name: joint, type: homokinetic, between: [drive, wheel], axis: x}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
