/* Rack: the pitch circle of a wheel rolls on the pitch line of a rack. The line goes through the second end's point S
 * along t, its z axis. n is the axis of the wheel, r the pitch radius, d = S - C, and gamma the angle of t in the
 * frame of the wheel:
 *     phi = t . d - k r gamma - phi_0,   gamma = atan2(t . y, t . x),   k = sign of e . (n x t)
 * where e leads from the centre C to the line, normal to it. With g = n x t / |p|^2, p = t - (n . t) n:
 *     gamma'  = g . (w x t) = w . (t x g)
 *     gamma'' = g . t'' - 2 (p . t') (g . t') / |p|^2,   t' = w x t,   t'' = (w' - w1 x w2) x t + w x (w x t)
 * The rate of t . d as seen from the rack is t . (u - w x d) (plane_angle.h). A whole turn changes phi by 2 pi r; the
 * residual is the nearest to 0, as the rack counts the turns. The multiplier is the force on the rack along t, and the
 * teeth push the rack away from the wheel besides. At the pitch point P = C + r e
 *     F = lambda t + |lambda| tan(alpha) e
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/plane_angle.h"

/* In the record: gain[0] = k r, phase[0] = phi_0, and bearing[0] is the angle of t at the start, from which gamma
 * counts. */
static int evaluate_rack(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double time,
                         kt_loop_row *rows) {
    (void)numbers, (void)time;
    const kt_loop_relative r = kt_loop_relative_of(end);
    const kt_vector n = end[0].axes[2], t = end[1].axes[2], w2 = end[1].omega;
    const kt_real x = kt_dot(t, end[0].axes[0]), y = kt_dot(t, end[0].axes[1]);
    const kt_real square = kt_max(x * x + y * y, KT_PLANE_LEAST);
    const kt_vector g = kt_over(kt_cross(n, t), square), turned = kt_cross(r.w, t);
    const kt_vector bent = kt_cross(r.w, turned) - kt_cross(r.turning, t);
    const kt_real outward = kt_dot(t, turned) - kt_dot(n, t) * kt_dot(n, turned);
    const kt_vector rate = r.u - kt_cross(r.w, r.d);
    const kt_vector bias = -kt_cross(w2, rate + rate + kt_cross(w2, r.d));
    const kt_real gamma = kt_remainder(kt_atan2(y, x) - loop->bearing[0], KT_PLANE_TURN);
    const kt_real along = kt_dot(t, r.d) - loop->gain[0] * gamma - loop->phase[0];
    rows[0] = (kt_loop_row){.force = t,
                            .moment = -kt_cross(r.d, t) - kt_scale(loop->gain[0], kt_cross(t, g)),
                            .residual = kt_plane_reduce(along, loop->period),
                            .holonomic = true};
    rows[0].drift = kt_dot(t, bias) - loop->gain[0] * (kt_dot(g, bent) - 2.0 * outward * kt_dot(g, turned) / square);
    return 1;
}

/* NOLINTBEGIN(readability-non-const-parameter): the outputs of the kind */
static void load_rack(const kt_loop_record *loop, const kt_loop_end end[2], const double *lambda, kt_vector *moment,
                      kt_vector *force) {
    const kt_vector t = end[1].axes[2], arm = kt_scale(loop->gain[0], kt_cross(end[0].axes[2], t)); /* r e */
    *force = kt_scale(lambda[0], t) + kt_scale(fabs(lambda[0]) * loop->slope[0], arm);
    *moment = kt_cross(arm - (end[1].point - end[0].point), *force);
}
/* NOLINTEND(readability-non-const-parameter) */

/* Measures a rack in its initial position: signed pitch radius, pressure angle, direction of the pitch line and
 * position along it. Rejects a line that does not touch the pitch circle. */
static bool start_rack(const kt_loop *loop, const kt_loop_start *at, kt_loop_record *record, kt_error *error) {
    const kt_vec3 n = at->end[0].rotation.z, t = at->end[1].rotation.z;
    const kt_vec3 d = kt_vec3_sub(at->end[1].position, at->end[0].position);
    const double out = kt_vec3_dot(kt_vec3_cross(n, t), d), off = kt_vec3_dot(n, d), radius = loop->radius;
    if (fabs(kt_vec3_dot(n, t)) > KT_PLANE_CLOSE)
        return kt_plane_fault(error, "the pitch line is not normal to the axis of the wheel; correct axis or axis2");
    if (fabs(fabs(out) - radius) > KT_PLANE_CLOSE * radius || fabs(off) > KT_PLANE_CLOSE * radius) {
        (void)snprintf(error->message, sizeof error->message,
                       "the pitch line does not touch the pitch circle of %.6g m in the given positions: it passes the "
                       "centre at %.6g m, and %.3g m along the axis; correct the radius or the ends, or give positions "
                       "in which the mechanism is closed",
                       radius, fabs(out), off);
        return false;
    }
    record->gain[0] = copysign(radius, out);
    record->slope[0] = tan(loop->pressure_angle) / radius;
    record->bearing[0] = atan2(kt_vec3_dot(t, at->end[0].rotation.y), kt_vec3_dot(t, at->end[0].rotation.x));
    record->phase[0] = kt_vec3_dot(t, d);
    record->period = KT_PLANE_TURN * radius;
    return true;
}

const kt_loop_kind KT_KERNEL(kt_loop_rack) = {
    .rows = 1, .evaluate = evaluate_rack, .part = {KT_PART_SPATIAL}, .start = start_rack, .load = load_rack};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"between", KT_KEY_ENDS, KT_LOOP_AT(between), "", "the centre of the wheel, and a point of the pitch line",
     .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "n, of the wheel, in its frame", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(second_axis), "", "t, the direction of the pitch line, in the frame of the rack",
     "as axis", .needed = false},
    {"radius", KT_KEY_NUMBER, KT_LOOP_AT(radius), "m", "r, pitch radius of the wheel", .range = KT_RANGE_POSITIVE,
     .needed = true},
    {"pressure_angle", KT_KEY_NUMBER, KT_LOOP_AT(pressure_angle), "rad", "alpha", "20 deg",
     .range = KT_RANGE_NOT_NEGATIVE},
};
const kt_descriptor kt_loop_rack_descriptor = {
    .name = "rack",
    .help = "a toothed wheel meshes with a rack; bearings and guides carry the force of the teeth",
    .formula = "t . d -+ r gamma = constant    d: from the wheel to the rack;  gamma: angle of t in the frame of the "
               "wheel\n"
               "F = lambda t + |lambda| tan(alpha) e    on the rack at the pitch point;  e: from the wheel to the line",
    .example = "bodies:\n"
               "  - {name: pinion, joint: {type: revolute, axis: z}, mass: 1, shape: {type: cylinder, radius: 0.05, "
               "length: 0.02}}\n"
               "  - {name: bar, joint: {type: prismatic, axis: x, at: [0, 0.05, 0], velocity: 0.1}, mass: 2, shape: "
               "{type: box, size: [0.6, 0.02, 0.02]}}\n"
               "loops:\n"
               "  - {name: mesh, type: rack, between: [pinion, bar], axis: z, axis2: x, radius: 0.05}\n"
               "initial: {hold: [bar]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
