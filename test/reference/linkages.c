/* Linkages and shafts against closed forms. Geometry relates the positions of the joints, and the energy gives the
 * rate.
 *
 * Each bound is three times the error measured when the test was written, unless a comment gives another reason.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <float.h>
#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static double angle_of(const kt_case *c, const kt_record *record, const char *joint) {
    return record->q[kt_case_q(c, joint)];
}

static double rate_of(const kt_case *c, const kt_record *record, const char *joint) {
    return record->v[kt_case_v(c, joint)];
}

static kt_vec3 position_of(const kt_case *c, const kt_record *record, const char *name, const char *marker) {
    const int body = kt_body_find(c->model, name);
    return kt_point_position(c->model, record->data, body,
                             kt_marker_at(c->model, body, kt_marker_find(c->model, body, marker)));
}

/* ---- slider-crank ------------------------------------------------------------------------------------------------ */

/* Crank a, rod l: sin(p) = (a / l) sin(q), x = a cos(q) + l cos(p), and with p' = (a cos(q)) / (l cos(p)) q', the rod's
 * middle at (a cos(q) + l/2 cos(p), a/2 sin(q)): 2 T = J(q) q'^2 = J(q0) q0'^2. */
static double crank_inertia(double q, double *rod, double *piston) {
    const double a = 0.08, l = 0.25, crank = 0.008, m_rod = 0.3, m_piston = 0.4;
    const double p = asin(a / l * sin(q)), turn = a * cos(q) / (l * cos(p));
    const double slide = -a * sin(q) - l * sin(p) * turn;
    const double middle_x = -a * sin(q) - 0.5 * l * sin(p) * turn, middle_y = 0.5 * a * cos(q);
    const double rod_inertia = m_rod * (l * l / 12.0 + 0.25 * 0.012 * 0.012);
    *rod = p;
    *piston = a * cos(q) + l * cos(p);
    return crank + m_piston * slide * slide + m_rod * (middle_x * middle_x + middle_y * middle_y) +
           rod_inertia * turn * turn;
}

static double slider_crank_error(const kt_case *c, const kt_record *record, const void *about) {
    const double q = angle_of(c, record, "crank"), rate = rate_of(c, record, "crank");
    double rod, piston;
    const double energy = crank_inertia(kt_degrees(45.0), &rod, &piston) * 40.0 * 40.0;
    const double expected = sqrt(energy / crank_inertia(q, &rod, &piston));
    (void)about;
    return fmax(fmax(fabs(angle_of(c, record, "rod") + q + rod), fabs(angle_of(c, record, "piston") - piston)),
                fabs(rate / expected - 1.0));
}

KT_TEST(slider_crank_turns_as_its_energy_says) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 3e-10},
                                          {"dop853", 0.0, 1e-12, 2e-12},
                                          {"dopri5", 0.0, 1e-10, 1e-9},
                                          {"rk4", 2e-4, 0.0, 1.1e-10}};
    kt_scene_follow("slider-crank", settings, COUNT_OF(settings), slider_crank_error, NULL);
}

/* ---- Stewart platform -------------------------------------------------------------------------------------------- */

/* Each leg ends at its point of the platform. Its length is the distance between base and platform. */
static double leg_error(const kt_case *c, const kt_record *record, const void *about) {
    static const char *const pistons[] = {"piston1", "piston2", "piston3", "piston4", "piston5", "piston6"};
    static const char *const cylinders[] = {"cylinder1", "cylinder2", "cylinder3",
                                            "cylinder4", "cylinder5", "cylinder6"};
    static const char *const points[] = {"p1", "p2", "p3", "p4", "p5", "p6"};
    double worst = 0.0;
    for (int i = 0; i < 6; i++) {
        const kt_vec3 p = position_of(c, record, "platform", points[i]);
        const kt_vec3 base = kt_body_pose(c->model, record->data, kt_body_find(c->model, cylinders[i])).position;
        worst = fmax(worst, kt_vec3_norm(kt_vec3_sub(p, position_of(c, record, pistons[i], "tip"))));
        worst = fmax(worst, fabs(kt_vec3_norm(kt_vec3_sub(p, base)) - angle_of(c, record, pistons[i])));
    }
    (void)about;
    return worst;
}

KT_TEST(legs_of_a_stewart_platform_end_at_its_joints) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 16 * DBL_EPSILON}, {"rk4", 5e-3, 0.0, 16 * DBL_EPSILON}};
    kt_scene_follow("stewart", settings, COUNT_OF(settings), leg_error, NULL);
}

/* ---- two methods ------------------------------------------------------------------------------------------------- */

/* If no closed form of a motion exists, two methods of different order must give the same motion. */
static void agree(const char *scene, double bound) {
    static const kt_setting eighth = {"dop853", 0.0, 1e-13, 0.0}, fifth = {"tsit5", 0.0, 1e-13, 0.0};
    kt_case c = kt_case_open(scene);
    kt_case_agree(&c, &eighth, &fifth, bound);
}

KT_TEST(two_methods_move_linkages_alike) {
    agree("four-bar", 5e-11);
    agree("watt", 8e-11);
    agree("stephenson", 4e-11);
    agree("peaucellier", 1.5e-12);
    agree("scissor-lift", 4e-12);
    agree("stewart", 4e-13);
}

KT_TEST(two_methods_move_the_bicycle_and_the_disc_alike) {
    agree("bicycle", 4e-12);
    agree("rolling-disc", 3e-11);
}
