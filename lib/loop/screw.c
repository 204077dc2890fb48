/* Screw: inline, coaxial, and an advance along z of `pitch` metres for each radian of rotation since the start:
 *     phi = d_z - pitch (theta - theta0)
 * theta is the angle of the rotation about z that, with the least rotation that takes z to the second end's z, makes up
 * the relative rotation (q = (w, x, y, z): theta = 2 atan2(z, w)):
 *     theta   = atan2(e_y . f_x - e_x . f_y, e_x . f_x + e_y . f_y)
 * With e = e_z, f = f_z, c = e . f and w the relative angular velocity,
 *     theta'  = k . w,                               k = (e + f) / (1 + c)
 *     theta'' = k . w' - (k . w) c' / (1 + c),       c' = w . (f x e)        (w . f' = w . (w x f) = 0)
 * also where the axes are not closed. (Differentiate tan(theta / 2) = z / w of q and insert
 * f = (2 (x z + w y), 2 (y z - w x), 2 (w^2 + z^2) - 1).)
 * Whole revolutions are not counted: of all angles that give this rotation, the one with the least |phi| is taken, so
 * that a nut may be anywhere on its thread.
 */
#include "loop/orientation.h"

#ifndef KT_NO_LOOPS
static const double TURN = 6.283185307179586;

static kt_real advance(const kt_loop_record *loop, const kt_loop_end end[2], kt_real along) {
    const kt_vector *e = end[0].axes, *f = end[1].axes;
    const kt_real theta = kt_atan2(kt_dot(e[1], f[0]) - kt_dot(e[0], f[1]), kt_dot(e[0], f[0]) + kt_dot(e[1], f[1]));
    const double lead = TURN * loop->pitch;
    const kt_real phi = along - loop->pitch * (theta - loop->angle);
    return lead != 0.0 ? kt_remainder(phi, lead) : phi;
}

static int evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                    kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    for (int k = 0; k < 2; k++)
        rows[k] = kt_row_along(&r, end[0].axes[k]);
    kt_row_coaxial(end, &r, rows + 2);

    kt_real sine;
    const kt_vector e = end[0].axes[2], f = kt_axis_not_opposite(end, &sine);
    const kt_real c = 1.0 + kt_dot(e, f);
    const kt_vector k = kt_over(e + f, c);
    const kt_real bend = -kt_dot(k, r.w) * kt_dot(r.w, kt_cross(f, e)) / c - kt_dot(k, r.turning);
    rows[4] = kt_row_along(&r, e);
    rows[4].residual = advance(loop, end, rows[4].residual);
    rows[4].moment = kt_scale(-loop->pitch, k);
    rows[4].drift -= loop->pitch * bend;
    return 5;
}

const kt_loop_kind KT_KERNEL(kt_loop_screw) = {.rows = 5, .evaluate = evaluate};
#endif

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", KT_WORDS("in the frames of both ends"), .needed = false},
    {"pitch", KT_KEY_NUMBER, KT_LOOP_AT(pitch), "m/rad", KT_WORDS("advance along the axis for each radian"),
     .range = KT_RANGE_ANY, .needed = true},
};
const kt_descriptor kt_loop_screw_descriptor = {
    .name = "screw",
    .help = KT_WORDS("a rotation about the axis, and a translation along it in proportion, are left free"),
    .formula = KT_WORDS(
        "the equations of inline and of coaxial, and\n"
        "e_z . d = pitch (theta - theta0)    theta: angle about the axis, theta0 at the start;  whole turns are "
        "not counted"),
    .example = KT_WORDS(KT_EXAMPLE_BOX "  - {name: hold, type: screw, between: [world, box], axis: z, pitch: 0.02}\n"),
    KT_DESCRIPTOR_KEYS,
};
#endif
