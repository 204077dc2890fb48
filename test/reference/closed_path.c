/* Joints of constant velocity, curves and surfaces against closed forms: equal speeds, a bead that slides down a helix
 * evenly, and the angular momentum of a marble on a ring.
 *
 * A bound that is not derived is three times the error measured when the test was written.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closed.h"

#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

/* ---- constant velocity ------------------------------------------------------------------------------------------- */

/* The ratio of the speeds, which is 1: the rounding of projections. */
static double ratio_error(const kt_case *c, const kt_record *record, const void *about) {
    (void)about;
    return fabs(kt_closed_v(c, record, "wheel") / kt_closed_v(c, record, "drive") - 1.0);
}

KT_TEST(shafts_at_forty_degrees_turn_alike) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 1e-13}, {"rk4", 1e-2, 0.0, 1e-13}, {"radau5", 0.0, 1e-6, 1e-13}};
    kt_scene_follow("constant-velocity", settings, COUNT_OF(settings), ratio_error, NULL);
}

/* Both inertias J = m r^2 / 2 turn about their axes with equal speeds:
 *     (J1 + J2) w' = 6 sin(3 pi t),   w = w0 + (2 / pi) (1 - cos(3 pi t)) / (J1 + J2). */
static double speed_error(const kt_case *c, const kt_record *record, const void *about) {
    (void)about;
    const double pi = 3.14159265358979323846, inertia = 0.5 * 2.0 * 0.04 * 0.04 + 0.5 * 8.0 * 0.25 * 0.25;
    const double speed = 10.0 + 2.0 / pi * (1.0 - cos(3.0 * pi * record->t)) / inertia;
    return fabs(kt_closed_v(c, record, "wheel") - speed);
}

KT_TEST(motor_turns_both_shafts_as_one) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 1.7e-9}, {"dop853", 0.0, 1e-12, 1.2e-11}};
    kt_scene_follow("constant-velocity", settings, COUNT_OF(settings), speed_error, NULL);
}

/* ---- the helix --------------------------------------------------------------------------------------------------- */

/* The path along the wire is
 *     s = v0 t - g h t^2 / (2 L),   L^2 = R^2 + h^2,   v0 = sqrt(10),
 * and the angle is s / L. */
static double helix_error(const kt_case *c, const kt_record *record, const void *about) {
    (void)about;
    const double R = 0.6, h = 0.2, L = hypot(R, h), t = record->t;
    const double angle = (sqrt(10.0) * t - 9.81 * h / (2.0 * L) * t * t) / L;
    const kt_vec3 at = kt_closed_place(c, record, "bead", "middle");
    return kt_vec3_norm(kt_vec3_sub(at, kt_vec3_make(R * cos(angle), R * sin(angle), h * angle)));
}

KT_TEST(bead_slides_evenly_along_a_helix) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 3.5e-9}, {"dop853", 0.0, 1e-12, 2.6e-11}, {"rk4", 1e-3, 0.0, 7.5e-9}};
    kt_scene_follow("spiral-wire", settings, COUNT_OF(settings), helix_error, NULL);
}

/* ---- the ring ---------------------------------------------------------------------------------------------------- */

/* The motion keeps its angular momentum and its energy, per mass:
 *     x y' - y x' = 1.4 * 2.5,   E = 2.5^2 / 2 + 1.5^2 / 2.
 * The distance from the tube's middle is 0.4. */
static double ring_error(const kt_case *c, const kt_record *record, const void *about) {
    (void)about;
    const int q = kt_case_q(c, "marble"), v = kt_case_v(c, "marble");
    const double *p = record->q + q, *u = record->v + v;
    const double spin = p[0] * u[1] - p[1] * u[0] - 1.4 * 2.5;
    const double energy = 0.5 * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) + 9.81 * p[2] - 0.5 * (2.5 * 2.5 + 1.5 * 1.5);
    const double gap = hypot(hypot(p[0], p[1]) - 1.0, p[2]) - 0.4;
    return fmax(fabs(spin), fmax(fabs(energy), fabs(gap)));
}

KT_TEST(marble_keeps_its_spin_and_energy_on_the_ring) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 1.1e-9}, {"dop853", 0.0, 1e-12, 8.4e-11}, {"rk4", 1e-3, 0.0, 3.3e-10}};
    kt_scene_follow("torus-marble", settings, COUNT_OF(settings), ring_error, NULL);
}
