/* The stiff flyball governor (IFToMM A05) against its table, with its angles, rates and height.
 *
 * Each bound is three times the error measured when the test was written.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static double governor_error(const kt_case *c, const kt_record *record, const void *about) {
    const double *row = about, *q = record->q, *v = record->v;
    const int shaft = kt_case_q(c, "shaft"), slider = kt_case_q(c, "slider"), right = kt_case_q(c, "right"),
              left = kt_case_q(c, "left");
    double worst = fmax(fabs(q[shaft] - row[0]), fmax(fabs(q[slider] - row[1]), fabs(q[right] - row[2])));
    worst = fmax(worst, fabs(q[left] + row[2]));
    return fmax(worst, fmax(fabs(v[shaft] - row[3]), fmax(fabs(v[slider] - row[4]), fabs(v[right] - row[5]))));
}

/* Runge-Kutta 4 is stable below 2.78 / 8117 s = 3.43e-4 s. */
KT_TEST(stiff_governor_keeps_its_table) {
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 1.2e-7},
                                          {"dopri5", 0.0, 1e-9, 5e-9},
                                          {"dop853", 0.0, 1e-9, 2.2e-7},
                                          {"tsit5", 0.0, 1e-6, 1e-5},
                                          {"rk4", 2.5e-4, 0.0, 6e-8}};
    kt_case c = kt_case_open("flyball-governor");
    kt_table table = kt_table_open("A05_flyball_governor", "phi_rad s_m alpha_rad phidot sdot alphadot");
    kt_case_compare(&c, &table, settings, COUNT_OF(settings), governor_error);
}
