/* Scenes of single joints, whose motion has a closed form in elementary functions.
 *
 * Each bound is three times the error measured when the test was written, unless a comment gives another reason.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static const double g = 9.81;

static kt_vec3 marker_position(const kt_case *c, const kt_record *record, const char *name, const char *marker) {
    int body = kt_body_find(c->model, name);
    return kt_point_position(c->model, record->data, body,
                             kt_marker_at(c->model, body, kt_marker_find(c->model, body, marker)));
}

/* ---- conical pendulum (universal joint) -------------------------------------------------------------------------- */

/* A circle at 30 degrees below the pivot, W = sqrt(g / (l cos(theta))): the place of the bob. */
static double cone_error(const kt_case *c, const kt_record *record, const void *about) {
    const double theta = kt_degrees(30.0), w = sqrt(g / cos(theta)), t = record->t;
    const kt_vec3 bob = marker_position(c, record, "string", "bob");
    (void)about;
    return kt_vec3_norm(kt_vec3_sub(bob, kt_vec3_make(-sin(theta) * cos(w * t), sin(theta) * sin(w * t), -cos(theta))));
}

KT_TEST(conical_pendulum_goes_round_in_a_circle) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 7e-11},
                                          {"dop853", 0.0, 1e-13, 1e-12},
                                          {"dopri5", 0.0, 1e-10, 2.5e-9},
                                          {"rk4", 1e-3, 0.0, 7e-11}};
    kt_scene_follow("conical-pendulum", settings, COUNT_OF(settings), cone_error, NULL);
    kt_case c = kt_case_open("conical-pendulum");
    kt_case_order(&c, "rk4", 0.01, 4.0, cone_error, NULL);
}

/* ---- nut on a screw ---------------------------------------------------------------------------------------------- */

/* (I + m p^2) angle'' = -m g p: a parabola, which every method of order 2 has exactly but for rounding. Rounding is
 * 1.4e-14 rad a step once the angle is above 64 rad. The angle reaches 128 rad at the end. Over 300 steps, random
 * rounding adds up to 2.5e-13 rad. The worst case is 4e-12 rad. */
static double nut_error(const kt_case *c, const kt_record *record, const void *about) {
    const double m = 1.5, radius = 0.08, p = 0.06 / kt_degrees(360.0), inertia = 0.5 * m * radius * radius;
    const double t = record->t, angle = -0.5 * m * g * p / (inertia + m * p * p) * t * t;
    const kt_vec3 rim = marker_position(c, record, "nut", "rim");
    (void)about;
    return fmax(fabs(record->q[0] - angle), fabs(rim.z - p * angle) / p);
}

KT_TEST(nut_sinks_on_its_screw_with_constant_acceleration) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 1e-12}, {"midpoint", 0.01, 0.0, 1e-12}};
    kt_scene_follow("screw", settings, COUNT_OF(settings), nut_error, NULL);
}

/* ---- puck on a slope (planar joint) ------------------------------------------------------------------------------ */

/* The centre of mass draws a parabola, and the spin of 12 rad/s stays. The distance of this centre from the middle is
 *     d = 0.3 * 0.05 / 0.8 m. */
static double puck_error(const kt_case *c, const kt_record *record, const void *about) {
    const double d = 0.3 * 0.05 / 0.8, spin = 12.0, t = record->t, slope = g * sin(kt_degrees(10.0));
    const double x = d + 0.3 * t, y = (1.5 + spin * d) * t - 0.5 * slope * t * t;
    const double *q = record->q;
    (void)c;
    (void)about;
    return fmax(fmax(fabs(q[0] - (x - d * cos(spin * t))), fabs(q[1] - (y - d * sin(spin * t)))),
                fabs(q[2] - spin * t));
}

KT_TEST(puck_draws_loops_about_a_parabola) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 1.5e-11}, {"dopri5", 0.0, 1e-10, 5e-10}, {"rk4", 1e-3, 0.0, 1e-11}};
    kt_scene_follow("puck", settings, COUNT_OF(settings), puck_error, NULL);
}

/* ---- sleeve on a rod (cylindrical joint) ------------------------------------------------------------------------- */

/* The slide is independent of the swing. For any motion of the swing,
 *     s = t - g cos(40 deg) t^2 / 2. */
static double slide_error(const kt_case *c, const kt_record *record, const void *about) {
    const double t = record->t;
    (void)c;
    (void)about;
    return fabs(record->q[1] - (t - 0.5 * g * cos(kt_degrees(40.0)) * t * t));
}

KT_TEST(sleeve_slides_down_its_rod_with_constant_acceleration) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 2e-14}, {"rk4", 1e-2, 0.0, 2e-14}};
    kt_scene_follow("sleeve", settings, COUNT_OF(settings), slide_error, NULL);
}

/* ---- pendulum on a trolley (prismatic joint) --------------------------------------------------------------------- */

/* No force acts along the rail, and the start is at rest with theta = 90 degrees. The second line follows from the
 * energy:
 *     x = (m l / (M + m)) (1 - sin(theta)),
 *     theta'^2 (1 - (m / (M + m)) cos^2(theta)) = 2 (g / l) cos(theta). */
static double trolley_error(const kt_case *c, const kt_record *record, const void *about) {
    const double share = 1.0 / 3.0, x = record->q[0], theta = record->q[1], rate = record->v[1];
    (void)c;
    (void)about;
    return fmax(fabs(x - share * (1.0 - sin(theta))),
                fabs(rate * rate * (1.0 - share * cos(theta) * cos(theta)) - 2.0 * g * cos(theta)));
}

KT_TEST(trolley_and_pendulum_swing_about_their_centre_of_mass) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 2.5e-9},
                                          {"dop853", 0.0, 1e-13, 6e-11},
                                          {"dopri5", 0.0, 1e-10, 4e-8},
                                          {"rk4", 1e-3, 0.0, 6e-10}};
    kt_scene_follow("trolley", settings, COUNT_OF(settings), trolley_error, NULL);
}

/* ---- bead in a tube (a slider on a hinge) ------------------------------------------------------------------------ */

/* With I the shaft's and the tube's inertia about the vertical and Ib the bead's own, s the way along the tube, which
 * rises by 40 degrees, and c = cos(40 deg): L = (I + Ib + m c^2 s^2) w,   2 T = L w + m s'^2,   V = m g s sin(40 deg)
 * stay L and T + V, and give w and |s'| at every s; at the start w = 6.5, s = 0.3, s' = 0. */
static double bead_error(const kt_case *c, const kt_record *record, const void *about) {
    const double tilt = kt_degrees(40.0), cosine = cos(tilt), m = 0.25;
    const double across = 0.2 * (1.4 * 1.4 / 3.0 + 0.25 * 0.02 * 0.02), along = 0.5 * 0.2 * 0.02 * 0.02;
    const double own =
        0.5 * 0.12 * 0.12 + across * cosine * cosine + along * sin(tilt) * sin(tilt) + 0.4 * m * 0.018 * 0.018;
    const double s = record->q[1], start = 0.3;
    const double momentum = (own + m * cosine * cosine * start * start) * 6.5;
    const double spin = momentum / (own + m * cosine * cosine * s * s);
    const double squared = (momentum * (6.5 - spin) - 2.0 * m * g * sin(tilt) * (s - start)) / m;
    (void)c;
    (void)about;
    return fmax(fabs(record->v[0] - spin), fabs(record->v[1] * record->v[1] - squared));
}

KT_TEST(bead_trades_spin_for_height) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 8e-10},
                                          {"dop853", 0.0, 1e-13, 5e-12},
                                          {"dopri5", 0.0, 1e-10, 5e-9},
                                          {"rk4", 1e-3, 0.0, 1.1e-11}};
    kt_scene_follow("bead", settings, COUNT_OF(settings), bead_error, NULL);
}
