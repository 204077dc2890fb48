/* Closed mechanisms against their tables, with every reduction and both metrics. The choice of the eliminated equations
 * and of the metric of a projection must not change the motion.
 *
 * These errors are promised:
 *     Andrews' squeezer            1e-9 rad
 *     Bricard's ring               1e-8 m
 *     windows, fixed steps         1e-9 m
 *     windows, adaptive steps      1e-7 m
 *     slider-crank                 1e-8
 * Each bound is three times the error measured when the test was written, if this is less.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closed.h"

#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static void compare(const char *scene, const char *reference, const char *columns, const kt_setting *settings,
                    size_t count, kt_error_of *error_of) {
    const kt_table table = kt_table_open(reference, columns);
    for (int reduction = 0; reduction < 3; reduction++)
        for (int metric = 0; metric < 2; metric++) {
            const kt_case c = kt_closed_open(scene, (kt_reduction)reduction, (kt_metric)metric);
            kt_case_compare(&c, &table, settings, count, error_of);
        }
}

static double squeezer_error(const kt_case *c, const kt_record *record, const void *about) {
    static const char *const joints[] = {"K1", "K2", "K3", "K4", "K5", "K6", "K7"};
    const double *row = about;
    double worst = 0.0;
    for (int i = 0; i < 7; i++)
        worst = fmax(worst, fabs(kt_closed_q(c, record, joints[i]) - row[i]));
    const kt_vec3 f = kt_closed_place(c, record, "K1", "F");
    return fmax(worst, hypot(f.x - row[14], f.y - row[15]));
}

KT_TEST(squeezer_keeps_its_table_however_it_is_reduced) {
    static const kt_setting settings[] = {{"dop853", 0.0, 1e-12, 5e-12}};
    compare("andrews", "A03_andrews_squeezer",
            "beta theta gamma phi delta omega epsilon d/dt beta d/dt theta d/dt gamma d/dt phi d/dt delta d/dt omega "
            "d/dt epsilon xF yF",
            settings, COUNT_OF(settings), squeezer_error);
}

/* P1 to P4 of the table are the ends of the first four rods. */
static double ring_error(const kt_case *c, const kt_record *record, const void *about) {
    static const char *const rods[] = {"rod1", "rod2", "rod3", "rod4"};
    const double *row = about;
    double worst = 0.0;
    for (int i = 0; i < 4; i++, row += 3)
        worst = fmax(worst, kt_vec3_norm(kt_vec3_sub(kt_closed_place(c, record, rods[i], "end"),
                                                     kt_vec3_make(row[0], row[1], row[2]))));
    return worst;
}

KT_TEST(overconstrained_ring_keeps_its_table_however_it_is_reduced) {
    static const kt_setting settings[] = {{"dop853", 0.0, 1e-11, 1.5e-9}, {"tsit5", 0.0, 1e-11, 1.6e-10}};
    compare("bricard", "A04_bricard", "P1x P1y P1z P2x P2y P2z P3x P3y P3z P4x P4y P4z v_P3x v_P3y v_P3z", settings,
            COUNT_OF(settings), ring_error);
}

static double windows_error(const kt_case *c, const kt_record *record, const void *about) {
    const double *row = about;
    const kt_vec3 tip = kt_closed_place(c, record, "crank0", "tip");
    return hypot(tip.x - row[2], tip.y - row[3]);
}

KT_TEST(two_windows_keep_their_table_through_ten_singular_positions_however_they_are_reduced) {
    static const kt_setting settings[] = {
        {"rk4", 1e-3, 0.0, 3e-10}, {"dopri5", 0.0, 1e-10, 1e-7}, {"tsit5", 0.0, 1e-10, 3e-8}};
    compare("n-four-bar-2", "A02_n_four_bar", "theta_rad thetadot_rad_s xB0 yB0 vxB0 vyB0", settings,
            COUNT_OF(settings), windows_error);
}

static double slider_crank_error(const kt_case *c, const kt_record *record, const void *about) {
    const double *row = about;
    const double angle = kt_closed_q(c, record, "crank") - row[0], slide = kt_closed_q(c, record, "slide") - row[1],
                 rod = kt_closed_q(c, record, "rod") - row[2], rate = kt_closed_v(c, record, "crank") - row[3];
    return fmax(fmax(fabs(angle), fabs(slide)), fmax(fabs(rod), fabs(rate)));
}

KT_TEST(slider_crank_keeps_its_table_however_it_is_reduced) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 4e-11}, {"dopri5", 0.0, 1e-10, 8e-10}};
    compare("slider-crank-spring", "slider_crank_ida", "q x p qdot", settings, COUNT_OF(settings), slider_crank_error);
}
