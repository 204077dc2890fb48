/* Worm: the threads of a worm drive a wheel. Their axes n_1 and n_2 are at right angles, and d, from the first centre
 * to the second, is normal to both, d = a e. r_1 is the pitch radius of the worm, r_2 = a - r_1 that of the wheel. A
 * worm of z_1 starts moves its threads by r_2 z_1 / z_2 along -n_1 for each radian (z_1 < 0: left-handed threads).
 * With the angles beta_k of d in the frames of worm and wheel (plane_angle.h)
 *     phi = c_1 beta_1 + c_2 beta_2,   c_1 = r_2 z_1 / z_2,   c_2 = -q r_2,   q = (n_2 x e) . n_1 = +-1
 * and phi repeats after 2 pi r_2 gcd(z_1, z_2) / z_2. tan(gamma) = c_1 / r_1 gives the lead angle gamma. The
 * multiplier is the tangential force on the wheel along -n_1. At the pitch point P = C_1 + r_1 e the wheel receives
 *     F = lambda (tan(gamma) n_1 x e - n_1) + |lambda| tan(alpha) / cos(gamma) e
 * with the pressure angle alpha of the normal section [Niemann and Winter, Maschinenelemente 3, chapter 23].
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/plane_angle.h"

static int evaluate_worm(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                         kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    rows[0] = kt_row_of_angles(loop, end, &r, loop->gain);
    rows[0].residual = kt_plane_reduce(rows[0].residual, loop->period);
    return 1;
}

/* NOLINTBEGIN(readability-non-const-parameter): the outputs of the kind */
static void load_worm(const kt_loop_record *loop, const kt_loop_end end[2], const double *lambda, kt_vector *moment,
                      kt_vector *force) {
    const kt_vector n = end[0].axes[2], d = end[1].point - end[0].point;
    const kt_vector e = kt_over(d, kt_sqrt(kt_dot(d, d))), t = kt_cross(n, e);
    *force = kt_scale(lambda[0], kt_scale(loop->slope[2], t) + kt_scale(loop->slope[1], n)) +
             kt_scale(fabs(lambda[0]) * loop->slope[0], e);
    *moment = kt_cross(kt_scale(loop->radius, e) - d, *force);
}
/* NOLINTEND(readability-non-const-parameter) */

/* Checks teeth, axes and centres in the given positions. d must be normal to both axes and longer than r_1. */
static bool check_worm(const kt_loop *loop, const kt_loop_start *at, kt_vec3 d, kt_error *error) {
    const kt_vec3 n = at->end[0].rotation.z, m = at->end[1].rotation.z;
    const double a = kt_vec3_norm(d), along = kt_vec3_dot(n, d), aside = kt_vec3_dot(m, d);
    if (loop->teeth == 0.0 || loop->teeth != floor(loop->teeth) || !(loop->teeth2 > 0.0) ||
        loop->teeth2 != floor(loop->teeth2))
        return kt_plane_fault(error,
                              "teeth, the starts of the worm, and teeth2 of the wheel are whole numbers, and not 0");
    if (fabs(kt_vec3_dot(n, m)) > KT_PLANE_CLOSE)
        return kt_plane_fault(error, "the axes of worm and wheel are not at right angles; correct axis or axis2");
    if (fabs(along) <= KT_PLANE_CLOSE * a && fabs(aside) <= KT_PLANE_CLOSE * a && a > loop->radius)
        return true;
    (void)snprintf(
        error->message, sizeof error->message,
        "the centres are not where the axes are nearest, %.6g m apart and farther than the radius of %.6g m: "
        "they differ by %.3g m along the axis of the worm and %.3g m along that of the wheel; move the ends",
        a, loop->radius, along, aside);
    return false;
}

/* Measures a worm in its initial position: the pitch radius of the wheel, the lead of the thread and the side of the
 * wheel. The period is the angle after which both return to the same teeth. */
static bool start_worm(const kt_loop *loop, const kt_loop_start *at, kt_loop_record *record, kt_error *error) {
    const kt_vec3 d = kt_vec3_sub(at->end[1].position, at->end[0].position);
    if (!check_worm(loop, at, d, error))
        return false;
    const double wheel = kt_vec3_norm(d) - loop->radius;
    const double side = kt_vec3_dot(kt_vec3_cross(at->end[1].rotation.z, d), at->end[0].rotation.z);
    double a = fabs(loop->teeth), b = loop->teeth2;
    record->gain[0] = wheel * loop->teeth / loop->teeth2;
    record->gain[1] = -copysign(wheel, side);
    while (b > 0.0) { /* their greatest common divisor */
        const double left = fmod(a, b);
        a = b, b = left;
    }
    record->period = KT_PLANE_TURN * wheel * a / loop->teeth2;
    const double lead = record->gain[0] / loop->radius;
    record->slope[0] = tan(loop->pressure_angle) * sqrt(1.0 + lead * lead);
    record->slope[1] = -1.0;
    record->slope[2] = lead;
    kt_plane_start(at, record);
    return true;
}

const kt_loop_kind KT_KERNEL(kt_loop_worm) = {
    .rows = 1, .evaluate = evaluate_worm, .part = {KT_PART_SPATIAL}, .start = start_worm, .load = load_worm};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"between", KT_KEY_ENDS, KT_LOOP_AT(between), "", "the points of the axes of worm and wheel that are nearest",
     .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "n_1, of the worm, in its frame", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(second_axis), "", "n_2, of the wheel, in its frame", "as axis", .needed = false},
    {"radius", KT_KEY_NUMBER, KT_LOOP_AT(radius), "m",
     "r_1, pitch radius of the worm; the wheel has the rest of the "
     "distance",
     .range = KT_RANGE_POSITIVE, .needed = true},
    {"teeth", KT_KEY_NUMBER, KT_LOOP_AT(teeth), "", "z_1, starts of the worm; negative: left-handed threads",
     .needed = true},
    {"teeth2", KT_KEY_NUMBER, KT_LOOP_AT(teeth2), "", "z_2, of the wheel", .range = KT_RANGE_POSITIVE, .needed = true},
    {"pressure_angle", KT_KEY_NUMBER, KT_LOOP_AT(pressure_angle), "rad", "alpha, of the normal section", "20 deg",
     .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_loop_worm_descriptor = {
    .name = "worm",
    .help = "a worm drives a wheel whose axis is at a right angle; the bearings carry the force of the teeth",
    .formula =
        "r_2 (z_1 / z_2 beta_1 +- beta_2) = constant    beta: angle of the line of centres, in the frame of a "
        "wheel\n"
        "F = lambda (tan(gamma) n_1 x e - n_1) + |lambda| tan(alpha) / cos(gamma) e    on the wheel;  tan(gamma) "
        "= r_2 z_1 / (r_1 z_2)",
    .example = "bodies:\n"
               "  - {name: worm, joint: {type: revolute, axis: x, velocity: 60}, mass: 1, shape: {type: cylinder, "
               "radius: 0.02, length: 0.1, axis: x}}\n"
               "  - {name: wheel, joint: {type: revolute, axis: y, at: [0, 0, 0.1]}, mass: 3, shape: {type: cylinder, "
               "radius: 0.08, length: 0.02, axis: y}}\n"
               "loops:\n"
               "  - {name: mesh, type: worm, between: [worm, wheel], axis: x, axis2: y, radius: 0.02, teeth: 2, "
               "teeth2: 40}\n"
               "initial: {hold: [worm]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
