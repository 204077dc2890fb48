/* Rolling: a thin disc rolls on a plane without slip. End 1 is the disc's centre C with z along its axle a. End 2 is a
 * point S of the plane with x and y in the plane and z its normal n. The radius is rho, and
 *     c = n . a,  s = |n x a|
 *
 * The lowest direction in the disc, -t, and the contact point P, seen from S:
 *     t = (n - c a) / s = a x (n x a) / s
 *     P = C - rho t,   r = C - S,   P - S = r - rho t
 * The velocity of the disc's material point at P relative to the plane:
 *     W = w1 - w2
 *     U = v1 - v2 - w2 x r                  the rate of r as seen in the plane's frame
 *     y = U - rho W x t
 * The rows:
 *     y . x = 0,  y . y = 0                 non-holonomic
 *     y . n = 0                             with contact: the rate of the gap phi = n . r - rho s
 *                                           (its rate is n . U - rho s', and s' = W . (t x n) = n . (W x t))
 *
 * Each row is a velocity of end 1 relative to end 2 at P along k = x, y or n. In the terms of the loop descriptors its
 * force is -k and its moment -(P - S) x k. Differentiated in the plane's frame:
 *     a' = W x a,   c' = n . a',   s' = -c c' / s,   t' = -(c' a + c a' + s' t) / s
 *     y' = U' - rho (W' x t + W x t')
 *     U' = a1 - a2 - alpha2 x r - 2 w2 x U - w2 x (w2 x r)
 *     W' = alpha1 - alpha2 - w2 x W
 *     drift = k . (-2 w2 x U - w2 x (w2 x r) + rho ((w2 x W) x t - W x t'))
 * A ball that rolls, of a hard contact with friction (compile/one_sided.c), has t = n, s = 1 and t' = 0 in place of
 * these. If a disc may leave the plane, its rim alone, the third row, is the loop that bounds a side. A disc that lies
 * flat (s = 0) touches everywhere. In this case, t is along the disc's x axis, and t' has the value for s = 1e-6.
 *
 * A ball that rolls on a ball of radius R about S, of a hard contact, too, has n = r / |r| and the point P - S = R n.
 * With k1 along the part of a direction e of end 2 normal to n, and k2 = n x k1, the rows are k . y = 0:
 *     y     = v1 + w1 x (R n - r) - v2 - w2 x R n
 *     drift = k . (w1 x (R n' - r') - w2 x R n') + k' . y
 * Two directions e are used: the second direction replaces the first if the first is nearly parallel to n. Neither is a
 * coordinate axis: in a mechanism that moves in a plane, no row is then void.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

static const double FLAT = 1e-6;

typedef struct contact {
    kt_real c, s;
    kt_vector t, rate; /* t, t' */
} contact;

/* c, s and t of the formulas above, for a wheel on a plane with the normal n; `rate` is t'. `turning` is the velocity W
 * of the wheel as seen in the plane. */
static inline contact find_contact(const kt_loop_end *wheel, kt_vector n, kt_vector turning) {
    const kt_vector a = wheel->axes[2], across = kt_cross(n, a), rate = kt_cross(turning, a);
    contact k;
    k.c = kt_dot(n, a);
    k.s = kt_sqrt(kt_dot(across, across));
    k.t = kt_value(k.s) > 1e-150 ? kt_over(kt_cross(a, across), k.s) : wheel->axes[0];
    const kt_real s = kt_max(k.s, FLAT), c1 = kt_dot(n, rate), s1 = -k.c * c1 / s;
    k.rate = kt_over(-(kt_scale(c1, a) + kt_scale(k.c, rate) + kt_scale(s1, k.t)), s);
    return k;
}

/* The part of e normal to n, of length 1, and its rate. */
static inline void find_across(kt_vector n, kt_vector n_rate, kt_vector e, kt_vector e_rate, kt_vector *k,
                               kt_vector *rate) {
    const kt_real along = kt_dot(n, e), along_rate = kt_dot(n_rate, e) + kt_dot(n, e_rate);
    const kt_vector across = e - kt_scale(along, n);
    const kt_vector across_rate = e_rate - kt_scale(along, n_rate) - kt_scale(along_rate, n);
    const kt_real norm = kt_sqrt(kt_dot(across, across));
    *k = kt_over(across, norm);
    *rate = kt_over(across_rate - kt_scale(kt_dot(*k, across_rate), *k), norm);
}

/* The rows of a ball that rolls on another one: the points in contact have equal velocities along two directions k
 * across the line n of centres. The contact is at tube n from the second centre. Directions follow the second ball;
 * `first` and `second` are two vectors fixed in this ball, of which at most one is near n. */
static int evaluate_balls(const kt_loop_record *loop, const kt_loop_end end[2], kt_loop_row *rows) {
    const kt_vector *axes = end[1].axes, w1 = end[0].omega, w2 = end[1].omega;
    const kt_vector r = end[0].point - end[1].point, r_rate = end[0].velocity - end[1].velocity;
    const kt_real square = kt_dot(r, r), norm = kt_value(square) > 1e-300 ? kt_sqrt(square) : 1.0;
    const kt_vector n = kt_value(square) > 1e-300 ? kt_over(r, norm) : axes[2];
    const kt_vector n_rate = kt_over(r_rate - kt_scale(kt_dot(n, r_rate), n), norm);
    const kt_vector first = kt_scale(0.36, axes[0]) + kt_scale(0.48, axes[1]) + kt_scale(0.8, axes[2]);
    const kt_vector second = kt_scale(0.48, axes[0]) + kt_scale(0.6, axes[1]) - kt_scale(0.64, axes[2]);
    const double along = kt_value(kt_dot(n, first));
    const kt_vector e = along * along < 0.81 ? first : second;
    const kt_vector point = kt_scale(loop->tube, n), point_rate = kt_scale(loop->tube, n_rate);
    const kt_vector y = r_rate + kt_cross(w1, point - r) - kt_cross(w2, point);
    const kt_vector bias = kt_cross(w1, point_rate - r_rate) - kt_cross(w2, point_rate);
    kt_vector k[2], rate[2];
    find_across(n, n_rate, e, kt_cross(w2, e), &k[0], &rate[0]);
    k[1] = kt_cross(n, k[0]);
    rate[1] = kt_cross(n_rate, k[0]) + kt_cross(n, rate[0]);
    for (int i = 0; i < 2; i++)
        rows[i] = (kt_loop_row){
            .moment = kt_cross(k[i], point), .force = -k[i], .drift = kt_dot(k[i], bias) + kt_dot(rate[i], y)};
    return 2;
}

/* The rows y . x and y . y (form RIM: neither), and with contact y . n. A ball touches along n wherever it turns:
 * c = 0, s = 1, t = n. */
static int evaluate_rolling(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                            kt_loop_row *rows) {
    (void)numbers, (void)t;
    if (loop->form == KT_ROLLING_BALLS)
        return evaluate_balls(loop, end, rows);
    const double rho = loop->radius;
    const kt_vector w2 = end[1].omega, n = end[1].axes[2];
    const kt_vector r = end[0].point - end[1].point, turning = end[0].omega - w2;
    const contact at = loop->form == KT_ROLLING_BALL ? (contact){.c = 0.0, .s = 1.0, .t = n, .rate = kt_vector_zero()}
                                                     : find_contact(&end[0], n, turning);
    const kt_vector point = r - kt_scale(rho, at.t);
    const kt_vector carried = kt_cross(w2, r), u = end[0].velocity - end[1].velocity - carried;
    const kt_vector bias = kt_scale(rho, kt_cross(kt_cross(w2, turning), at.t) - kt_cross(turning, at.rate)) -
                           kt_cross(w2, u + u + carried);
    const bool is_rim = loop->form == KT_ROLLING_RIM, touches = is_rim || loop->contact;
    const int first = is_rim ? 2 : 0, count = touches ? 3 - first : 2;
    for (int k = 0; k < count; k++) {
        const kt_vector direction = end[1].axes[first + k];
        rows[k] =
            (kt_loop_row){.moment = kt_cross(direction, point), .force = -direction, .drift = kt_dot(direction, bias)};
    }
    if (touches) {
        rows[count - 1].residual = kt_dot(n, r) - rho * at.s;
        rows[count - 1].holonomic = true;
    }
    return count;
}

static int rolling_row_count(const kt_loop *loop) { return loop->side != KT_SIDE_NONE ? 1 : loop->holonomic ? 3 : 2; }

/* Chooses what rolls: the rim of a disc with a one-sided contact, two balls, a ball on a plane, or a disc. */
/* NOLINTNEXTLINE(readability-non-const-parameter): a type with numbers of its own writes them */
static void choose_form(const kt_description *description, const kt_loop *loop, double *numbers,
                        kt_loop_record *record) {
    (void)description, (void)numbers;
    record->tube = loop->surface.tube;
    record->form = loop->side != KT_SIDE_NONE                ? KT_ROLLING_RIM
                   : loop->surface.tube > 0.0                ? KT_ROLLING_BALLS
                   : loop->surface.type == KT_SURFACE_SPHERE ? KT_ROLLING_BALL
                                                             : KT_ROLLING_DISC;
}

const kt_loop_kind KT_KERNEL(kt_loop_rolling) = {
    .rows = 3, .evaluate = evaluate_rolling, .row_count = rolling_row_count, .prepare = choose_form};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"wheel", KT_KEY_END, KT_LOOP_AT(between[0]), "", "the centre of the wheel, a thin disc", .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "the axle, in the frame of the wheel", .needed = false},
    {"radius", KT_KEY_NUMBER, KT_LOOP_AT(radius), "m", "rho", .range = KT_RANGE_POSITIVE, .needed = true},
    {"on", KT_KEY_END, KT_LOOP_AT(between[1]), "", "a frame in the plane that it rolls on; reactions act on its body",
     .needed = true},
    {"normal", KT_KEY_AXIS, KT_LOOP_AT(axis2), "", "n, the normal of the plane, in that frame", .needed = false},
    {"holonomic", KT_KEY_FLAG, KT_LOOP_AT(holonomic), "", "whether the wheel is kept on the plane, the third equation",
     "true", .needed = false},
};
const kt_descriptor kt_loop_rolling_descriptor = {
    .name = "rolling",
    .help = "a wheel rolls on a plane without slip",
    .formula = "v . x = 0,  v . y = 0    v: velocity of the wheel at the contact point, less that of the plane;  x, y: "
               "in the plane\n"
               "n . r = rho |n x a|      r: from the plane to the centre of the wheel;  a: the axle",
    .example = "bodies:\n"
               "  - name: wheel\n"
               "    joint:\n"
               "      type: free\n"
               "      position: {position: [0, 0, 0.3]}\n"
               "      velocity: {linear: [0.9, 0, 0], angular: [0, 3, 0]}\n"
               "    mass: 2\n"
               "    shape: {type: cylinder, radius: 0.3, length: 0.02, axis: y}\n"
               "loops:\n"
               "  - name: road\n"
               "    type: rolling\n"
               "    wheel: wheel\n"
               "    axis: y\n"
               "    radius: 0.3\n"
               "    on: world\n"
               "    normal: z\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
