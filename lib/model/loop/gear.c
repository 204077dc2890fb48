/* Gear: the pitch circles of two wheels roll on each other. Their axes n_1 and n_2 are parallel (spur and helical
 * wheels) or meet (bevel wheels). d leads from the first centre to the second, and beta_k is its angle in the frame of
 * wheel k (plane_angle.h). With the pitch radii r_k, negative for a ring with internal teeth,
 *     phi = c_1 beta_1 + c_2 beta_2 - h n_1 . d - phi_0,   c_1 = r_1,  c_2 = s r_2,  s = sign of (n_1 x d) . (n_2 x d)
 * No angle of a carrier is needed: beta_k counts from the line of centres. For fixed parallel axes, the rates are
 * -r_1 w_1 - s r_2 w_2, which is Willis's equation in the frame of any carrier. The multiplier is the tangential force
 * on the second wheel along t = n_1 x e, where e is the part of d normal to n_1, of length 1. phi_0 is the value in the
 * given positions, and h the tangent of the helix angle (positive: right-handed teeth on the first wheel).
 *
 * Teeth make phi periodic: a wheel that advances by a tooth meshes as before. beta_k counts no whole turns, which
 * change phi by 2 pi c_k, a multiple of the period 2 pi r_1 gcd(z_1, z_2) / z_1. The residual is the nearest to 0. If
 * the radii are in no ratio of whole numbers, the joints count the turns (plane_angle.h).
 *
 * The force of the teeth acts at the pitch point P = C_1 + r_1 e. Besides t it has parts that do no work, as long as
 * the axes keep their places: along -h n_1, and a part that drives the wheels apart, whichever flank carries. It lies
 * in the plane of the axes, normal to the pitch line l = c_2 n_1 + c_1 n_2, the axis of the relative rotation [Niemann
 * and Winter, Maschinenelemente 2, chapter 21]. With the normal pressure angle alpha and the helix angle b
 *     F = lambda (t - h n_1) + |lambda| tan(alpha) / cos(b) m,   m = +-(t x l) / |l|
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/plane_angle.h"

/* In the record: gain = (c_1, c_2), slope[1] = -h, phase[0] = phi_0. */
static int evaluate_gear(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                         kt_loop_row *rows) {
    (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    const kt_vector n = end[0].axes[2];
    rows[0] = kt_row_of_angles(loop, end, &r, loop->gain);
    rows[0].force = rows[0].force + kt_scale(loop->slope[1], n);
    rows[0].residual = rows[0].residual + loop->slope[1] * kt_dot(n, r.d) - loop->phase[0];
    rows[0].residual = kt_plane_reduce(rows[0].residual, loop->period);
    rows[0].drift = rows[0].drift + loop->slope[1] * kt_dot(n, r.coriolis);
    return 1;
}

/* NOLINTBEGIN(readability-non-const-parameter): the outputs of the kind */
/* The wrench of the teeth on the second wheel, at its point, for the multiplier `lambda`. slope[0] is the
 * parting force for a unit of tangential force, along `apart`, normal to t and to the common line of the pitch
 * surfaces. */
static void load_gear(const kt_loop_record *loop, const kt_loop_end end[2], const double *lambda, kt_vector *moment,
                      kt_vector *force) {
    const kt_vector n = end[0].axes[2], d = end[1].point - end[0].point;
    const kt_vector across = d - kt_scale(kt_dot(n, d), n);
    const kt_vector e = kt_over(across, kt_sqrt(kt_dot(across, across))), t = kt_cross(n, e);
    const kt_vector line = kt_scale(loop->gain[1], n) + kt_scale(loop->gain[0], end[1].axes[2]);
    const kt_vector apart = kt_cross(t, kt_over(line, kt_sqrt(kt_dot(line, line))));
    const double outward = kt_value(kt_dot(apart, e)) < 0.0 ? -loop->slope[0] : loop->slope[0];
    *force = kt_scale(lambda[0], t + kt_scale(loop->slope[1], n)) + kt_scale(fabs(lambda[0]) * outward, apart);
    *moment = kt_cross(kt_scale(loop->gain[0], e) - d, *force);
}
/* NOLINTEND(readability-non-const-parameter) */

/* ---- from the given positions ------------------------------------------------------------------------------------ */

/* The wheels as the given positions and the keys describe them. */
typedef struct wheels {
    kt_vec3 axis[2], d, across[2]; /* across: d less its part along the axis */
    double apart[2];               /* their lengths */
    bool parallel, counted;        /* counted: by the joints */
    double radius[2], teeth[2];    /* negative: internal teeth */
} wheels;

/* The wheels at the start: d from the first centre to the second and, for each wheel, its axis and the part of d
 * across this axis. */
static wheels wheels_at(const kt_loop *loop, const kt_loop_start *at) {
    wheels w = {.d = kt_vec3_sub(at->end[1].position, at->end[0].position),
                .radius = {loop->radius, loop->radius2},
                .teeth = {loop->teeth, loop->teeth2}};
    for (int k = 0; k < 2; k++) {
        w.axis[k] = at->end[k].rotation.z;
        w.across[k] = kt_vec3_sub(w.d, kt_vec3_scale(kt_vec3_dot(w.d, w.axis[k]), w.axis[k]));
        w.apart[k] = kt_vec3_norm(w.across[k]);
    }
    w.parallel = kt_vec3_norm(kt_vec3_cross(w.axis[0], w.axis[1])) < KT_PLANE_CLOSE;
    w.counted = w.parallel && at->counted[0] && at->counted[1];
    return w;
}

/* The smallest whole numbers in the ratio of the radii: convergents of its continued fraction. Returns false if none
 * below 10000 has it within rounding of decimal numbers. */
static bool count_virtual_teeth(wheels *w) {
    const double ratio = fabs(w->radius[0] / w->radius[1]);
    double p[2] = {1.0, floor(ratio)}, q[2] = {0.0, 1.0}, x = ratio;
    while (fabs(p[1] - ratio * q[1]) > 1e-12 * p[1] * q[1] || p[1] == 0.0) {
        x = 1.0 / (x - floor(x));
        const double up = floor(x) * p[1] + p[0], down = floor(x) * q[1] + q[0];
        if (!(up < 1e4 && down < 1e4))
            return false;
        p[0] = p[1], q[0] = q[1];
        p[1] = up, q[1] = down;
    }
    w->teeth[0] = copysign(p[1], w->radius[0]);
    w->teeth[1] = copysign(q[1], w->radius[1]);
    return true;
}

/* Checks numbers of teeth and radii: either or both may be given, in one ratio. Without teeth, radii in a ratio of
 * whole numbers give virtual teeth. If no such ratio exists, the joints must count the turns. */
static bool find_teeth(const kt_loop *loop, wheels *w, kt_error *error) {
    const bool has_teeth = loop->teeth != 0.0 && loop->teeth2 != 0.0, none = loop->teeth == 0.0 && loop->teeth2 == 0.0;
    const bool has_radii = loop->radius != 0.0 && loop->radius2 != 0.0;
    if (!has_teeth && !none)
        return kt_plane_fault(error, "only one wheel has teeth; give teeth and teeth2");
    if (!has_radii && (loop->radius != 0.0 || loop->radius2 != 0.0))
        return kt_plane_fault(error, "only one wheel has a radius; give radius and radius2");
    if (!has_teeth && !has_radii)
        return kt_plane_fault(error, "the wheels have no size; give teeth and teeth2, or radius and radius2");
    if (loop->teeth != floor(loop->teeth) || loop->teeth2 != floor(loop->teeth2))
        return kt_plane_fault(error, "numbers of teeth are whole; correct teeth or teeth2");
    if (!has_teeth && !count_virtual_teeth(w) && !w->counted)
        return kt_plane_fault(error,
                              "the radii are in no ratio of whole numbers below 10000, and joints between the wheels "
                              "do not count their turns; give teeth and teeth2");
    const double *size = w->teeth[0] != 0.0 ? w->teeth : w->radius;
    if (size[0] < 0.0 && size[1] < 0.0)
        return kt_plane_fault(error, "both wheels are rings; only one radius or number of teeth may be negative");
    if (has_radii && has_teeth &&
        !(fabs(w->radius[0] * w->teeth[1] - w->radius[1] * w->teeth[0]) <=
          KT_PLANE_CLOSE * fabs(w->radius[0] * w->teeth[1])))
        return kt_plane_fault(error,
                              "the radii and the teeth are in different ratios; leave the radii or the teeth out");
    return true;
}

/* Finds both pitch radii: as given, from the module, or from the distance of the axes and the ratio of teeth. A ring
 * has a negative radius. */
static bool find_radii(const kt_loop *loop, wheels *w, kt_error *error) {
    const double *size = w->teeth[0] != 0.0 ? w->teeth : w->radius, sum = size[0] + size[1];
    const double ring = size[0] < 0.0 || size[1] < 0.0 ? -1.0 : 1.0; /* C_2 - C_1 = (r_1 + r_2) e */
    if (w->parallel && !(ring * sum > 0.0))
        return kt_plane_fault(error, "a ring is larger than the wheel within it; correct the teeth or the radii");
    if (!(w->apart[0] > 0.0 && w->apart[1] > 0.0))
        return kt_plane_fault(error, "the centre of a wheel is on the axis of the other; move one of the ends");
    for (int k = 0; k < 2; k++)
        w->radius[k] = loop->radius != 0.0   ? ring * w->radius[k]
                       : loop->module != 0.0 ? 0.5 * ring * loop->module * w->teeth[k] / cos(loop->helix_angle)
                       : w->parallel         ? w->apart[0] * w->teeth[k] / sum
                                             : copysign(w->apart[k], w->teeth[k]);
    return true;
}

/* Whether the pitch circles touch. */
static bool check_pitch_point(const kt_loop *loop, const wheels *w, kt_error *error) {
    const kt_vec3 first = kt_vec3_scale(w->radius[0] / w->apart[0], w->across[0]);
    const kt_vec3 second = kt_vec3_sub(w->d, kt_vec3_scale(w->radius[1] / w->apart[1], w->across[1]));
    const double gap = kt_vec3_norm(kt_vec3_sub(first, second)), size = fabs(w->radius[0]) + fabs(w->radius[1]);
    if (!w->parallel && loop->helix_angle != 0.0)
        return kt_plane_fault(error, "a helix angle needs parallel axes; leave it out");
    if (gap <= KT_PLANE_CLOSE * size)
        return true;
    (void)snprintf(error->message, sizeof error->message,
                   "the pitch circles, of %.6g m and %.6g m, do not touch in the given positions: they are %.3g m "
                   "apart; the centres are %.6g m apart, %.3g m of it along the first axis; correct the radii, the "
                   "teeth, the module or the ends, or give positions in which the mechanism is closed",
                   w->radius[0], w->radius[1], gap, kt_vec3_norm(w->d), kt_vec3_dot(w->d, w->axis[0]));
    return false;
}

static double greatest_divisor(double a, double b) {
    for (a = fabs(a), b = fabs(b); b > 0.0;) {
        const double left = fmod(a, b);
        a = b, b = left;
    }
    return a;
}

/* How phi repeats: by teeth, or by whole turns of the line of centres. */
static double find_period(const wheels *w) {
    if (w->teeth[0] == 0.0)
        return KT_PLANE_TURN * fabs(w->radius[0] + w->radius[1]);
    return KT_PLANE_TURN * fabs(w->radius[0] / w->teeth[0]) * greatest_divisor(w->teeth[0], w->teeth[1]);
}

/* Finds the numbers of the record in the given positions, in which the gear is closed. */
static bool start_gear(const kt_loop *loop, const kt_loop_start *at, kt_loop_record *record, kt_error *error) {
    wheels w = wheels_at(loop, at);
    if (!find_teeth(loop, &w, error) || !find_radii(loop, &w, error) || !check_pitch_point(loop, &w, error))
        return false;
    const bool same = kt_vec3_dot(kt_vec3_cross(w.axis[0], w.d), kt_vec3_cross(w.axis[1], w.d)) > 0.0;
    const double helix = tan(loop->helix_angle);
    record->gain[0] = w.radius[0];
    record->gain[1] = same ? w.radius[1] : -w.radius[1];
    record->period = find_period(&w);
    record->counted = w.teeth[0] == 0.0;
    record->slope[0] = copysign(tan(loop->pressure_angle) / cos(loop->helix_angle), w.radius[0] * w.radius[1]);
    record->slope[1] = helix != 0.0 ? -helix : 0.0;
    record->phase[0] = record->slope[1] * kt_vec3_dot(w.axis[0], w.d);
    kt_plane_start(at, record);
    return true;
}

const kt_loop_kind KT_KERNEL(kt_loop_gear) = {
    .rows = 1, .evaluate = evaluate_gear, .part = {KT_PART_SPATIAL}, .start = start_gear, .load = load_gear};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"between", KT_KEY_ENDS, KT_LOOP_AT(between), "", "the centres of the wheels, on their axes", .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "n_1, of the first wheel, in its frame", .needed = false},
    {"axis2", KT_KEY_AXIS, KT_LOOP_AT(second_axis), "", "n_2, of the second wheel, in its frame", "as axis",
     .needed = false},
    {"radius", KT_KEY_NUMBER, KT_LOOP_AT(radius), "m", "r_1, pitch radius of the first wheel; negative: a ring",
     "from the teeth", .needed = false},
    {"radius2", KT_KEY_NUMBER, KT_LOOP_AT(radius2), "m", "r_2, of the second wheel", "from the teeth", .needed = false},
    {"teeth", KT_KEY_NUMBER, KT_LOOP_AT(teeth), "", "z_1, of the first wheel; negative: a ring with internal teeth",
     "from the radii", .needed = false},
    {"teeth2", KT_KEY_NUMBER, KT_LOOP_AT(teeth2), "", "z_2, of the second wheel", "from the radii", .needed = false},
    {"module", KT_KEY_NUMBER, KT_LOOP_AT(module), "m", "of the normal section, r = m z / (2 cos b)",
     "from the places of the axes", .range = KT_RANGE_NOT_NEGATIVE},
    {"pressure_angle", KT_KEY_NUMBER, KT_LOOP_AT(pressure_angle), "rad", "alpha, of the normal section", "20 deg",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"helix_angle", KT_KEY_NUMBER, KT_LOOP_AT(helix_angle), "rad",
     "b, of parallel wheels; positive: right-handed teeth on the first wheel", .needed = false},
};
const kt_descriptor kt_loop_gear_descriptor = {
    .name = "gear",
    .help = "two toothed wheels mesh, with parallel or intersecting axes; the bearings carry the force of the teeth",
    .formula =
        "r_1 beta_1 +- r_2 beta_2 = constant    beta: angle of the line of centres, in the frame of a wheel\n"
        "F = lambda (t - tan(b) n_1) + |lambda| tan(alpha) / cos(b) m    on the second wheel at the pitch point; "
        " t: tangent;  m: drives the wheels apart",
    .example = "bodies:\n"
               "  - {name: pinion, joint: {type: revolute, axis: z, velocity: 9}, mass: 1, shape: {type: cylinder, "
               "radius: 0.05, length: 0.02}}\n"
               "  - {name: wheel, joint: {type: revolute, axis: z, at: [0.2, 0, 0], velocity: -3}, mass: 9, shape: "
               "{type: cylinder, radius: 0.15, length: 0.02}}\n"
               "loops:\n"
               "  - {name: mesh, type: gear, between: [pinion, wheel], axis: z, teeth: 20, teeth2: 60}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
