/* Rolling against reference results: the accelerations of the Whipple bicycle, a disc on its circle, a skate on a
 * slope.
 *
 * A bound that is not derived is three times the error measured when the test was written.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closed.h"

#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

/* ---- the bicycle ------------------------------------------------------------------------------------------------- */

/* Basu-Mandal et al. 2007, table 1. They take z up, x backwards and 3-1-3 angles. We take
 *     R = Rz(yaw) Rx(roll) Ry(pitch),
 *     x = -x, y = -y, yaw = theta, roll = pi/2 - psi, pitch = phi - pi. */
static const double psi = 0.9501292851472, phi = 3.1257073014894, thetad = 0.7830033527065, psid = 0.6068425835418,
                    phid = -0.0119185528069;
static const double xdd = -0.5041626315047, ydd = -0.3449706619454, zdd = -1.460452833298, thetadd = 0.8353281706379,
                    psidd = -7.8555281128244, phidd = 0.1205543897884, psifdd = -4.6198904039403,
                    betardd = 1.8472554144217, betafdd = 2.454807290455;

/* omega = Ry(-p) u, u = (r', y' sin r + p', y' cos r), and its rate, body axes. */
static kt_vec3 frame_acceleration(void) {
    const double pi = 3.14159265358979323846, r = pi / 2.0 - psi, p = phi - pi, r1 = -psid, y1 = thetad, p1 = phid;
    const double cr = cos(r), sr = sin(r), cp = cos(p), sp = sin(p);
    const kt_vec3 u = kt_vec3_make(r1, y1 * sr + p1, y1 * cr);
    const kt_vec3 rate = kt_vec3_make(-psidd, thetadd * sr + y1 * r1 * cr + phidd, thetadd * cr - y1 * r1 * sr);
    return kt_vec3_make(cp * rate.x - sp * rate.z - p1 * (sp * u.x + cp * u.z), rate.y,
                        sp * rate.x + cp * rate.z + p1 * (cp * u.x - sp * u.z));
}

/* The state is printed to 1e-13. Its errors are multiplied by the rates, up to 9 /s. The stiffest direction multiplies
 * them by up to ten. This gives 1e-11. */
KT_TEST(bicycle_has_the_published_accelerations) {
    kt_error error = {KT_OK, "", ""};
    double a[9];
    kt_case c = kt_case_open("bicycle-point");
    kt_need(kt_check_equal_int("tree", kt_model_nv(c.model), 9));
    kt_need(kt_check_equal_int("freedom", kt_model_mobility(c.model).minimal, 3));
    kt_simulation *simulation = kt_test_simulation(c.model, &c.scene.run, NULL);
    kt_need_fine("acceleration", kt_simulation_acceleration(simulation, a, &error), &error);
    const int frame = kt_case_v(&c, "frame");
    const kt_vec3 turning = frame_acceleration();
    const double bound = 1e-11;
    kt_check_near("x", a[frame], -xdd, bound);
    kt_check_near("y", a[frame + 1], -ydd, bound);
    kt_check_near("z", a[frame + 2], zdd, bound);
    kt_check_near("turning x", a[frame + 3], turning.x, bound);
    kt_check_near("turning y", a[frame + 4], turning.y, bound);
    kt_check_near("turning z", a[frame + 5], turning.z, bound);
    kt_check_near("steer", a[kt_case_v(&c, "fork")], psifdd, bound);
    kt_check_near("rear wheel", a[kt_case_v(&c, "rear")], betardd, bound);
    kt_check_near("front wheel", a[kt_case_v(&c, "front")], betafdd, bound);
}

/* ---- the disc ---------------------------------------------------------------------------------------------------- */

/* A disc has the radius rho, the mass m, and the inertias A and C (about its axis). It leans by alpha, and its centre
 * goes round with the rate w at the speed v. The moment of the contact force about the centre is the rate of angular
 * momentum,
 *     w cos(alpha) (A w sin(alpha) + C v / rho) = rho m (g sin(alpha) - w v cos(alpha)). */
static double steady_speed(double alpha, double w) {
    const double m = 1.0, rho = 0.2, a = 0.01, c = 0.02, g = 9.81;
    return (rho * m * g * sin(alpha) - a * w * w * sin(alpha) * cos(alpha)) / (w * cos(alpha) * (c / rho + rho * m));
}

static double disc_error(const kt_case *c, const kt_record *record, const void *about) {
    (void)about;
    const double w = 1.5, alpha = kt_degrees(20.0), radius = steady_speed(alpha, w) / w, angle = w * record->t;
    const kt_vec3 at = kt_closed_place(c, record, "steady", "middle");
    return kt_vec3_norm(
        kt_vec3_sub(at, kt_vec3_make(radius * sin(angle), -radius * (1.0 - cos(angle)), 0.2 * cos(alpha))));
}

KT_TEST(leaning_disc_rolls_round_its_circle) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 3e-10}, {"dop853", 0.0, 1e-12, 4e-12}, {"rk4", 1e-3, 0.0, 1.8e-9}};
    kt_scene_follow("rolling-disc", settings, COUNT_OF(settings), disc_error, NULL);
}

/* ---- the skate --------------------------------------------------------------------------------------------------- */

/* It turns evenly, at w, and slides along itself at s: s' = G cos(w t), G = g sin(alpha). Down the slope
 * x' = s cos(w t), across it y' = s sin(w t):
 *     x = G / (4 w^2) (1 - cos 2 w t),  y = G / (2 w) (t - sin(2 w t) / (2 w))
 */
static double skate_error(const kt_case *c, const kt_record *record, const void *about) {
    (void)about;
    const double w = 2.0, t = record->t, alpha = kt_degrees(10.0);
    const double pull = 9.81 * sin(alpha);
    const double x = pull / (4.0 * w * w) * (1.0 - cos(2.0 * w * t));
    const double y = pull / (2.0 * w) * (t - sin(2.0 * w * t) / (2.0 * w));
    const kt_vec3 at = kt_closed_place(c, record, "skate", "middle");
    return kt_vec3_norm(kt_vec3_sub(at, kt_vec3_make(x * cos(alpha), y, -x * sin(alpha))));
}

KT_TEST(skate_draws_cycloids_across_the_slope) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 3.3e-9}, {"dop853", 0.0, 1e-12, 3.3e-11}, {"rk4", 1e-2, 0.0, 4.5e-8}};
    kt_scene_follow("skate", settings, COUNT_OF(settings), skate_error, NULL);
}
