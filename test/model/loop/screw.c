/* The thread of a screw. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON
static const double PI = 3.141592653589793;

/* The fifth row of a screw with this pitch, the second end turned about z by `turned` and moved along it by `along`. */
static kt_loop_row advance(kt_random *random, double pitch, double start, double turned, double along) {
    const jet zero = jet_constant(0.0L);
    moving relative = {{zero, zero, jet_constant((long double)along)}, {zero, zero, zero, zero}};
    moving_turn(2, jet_constant((long double)turned), relative.q);
    moving a = moving_random(random, 0.0);
    const moving b = moving_compose(&a, &relative);
    const kt_loop_end end[2] = {moving_end(&a, NULL), moving_end(&b, NULL)};
    const kt_loop_record loop = {.type = KT_LOOP_SCREW, .pitch = pitch, .angle = start};
    kt_loop_row rows[5];
    (void)kt_loop_kinds_baseline[KT_LOOP_SCREW]->evaluate(&loop, NULL, end, 0.0, rows);
    return rows[4];
}

/* A lead is 2 pi pitch; a gap counts from the nearest turn of the thread. Rounding: of an advance of 63 pitch, a few
 * times. */
KT_TEST(a_nut_may_be_on_any_turn_of_its_thread) {
    kt_random random = kt_random_of_test();
    KT_WORST phi = kt_worst_make("phi");
    for (int n = 0; n < 1000; n++) {
        const double pitch = (n % 2 ? -1.0 : 1.0) * pow(10.0, kt_random_uniform(&random, -4.0, 1.0));
        const double start = kt_random_uniform(&random, -PI, PI), turned = kt_random_uniform(&random, -60.0, 60.0);
        const double gap = 0.99 * PI * pitch * kt_random_uniform(&random, -1.0, 1.0);
        const double along = pitch * (turned - start) + gap;
        const kt_loop_row row = advance(&random, pitch, start, turned, along);
        kt_worst_near(&phi, row.residual, gap, 200.0 * EPS * fabs(pitch), "pitch %g, turned %g", pitch, turned);
    }
}

KT_TEST(a_screw_without_pitch_does_not_advance) {
    kt_random random = kt_random_of_test();
    const double pitches[4] = {0.0, -0.0, 1e-310, 1e-320};
    for (int i = 0; i < 4; i++) {
        const kt_loop_row row = advance(&random, pitches[i], 0.5, 2.0, i < 2 ? 0.7 : 0.0);
        kt_check_near("phi", row.residual, i < 2 ? 0.7 : -1.5 * pitches[i], i < 2 ? 4.0 * EPS : 2e-323);
        kt_check_near("moment", sqrt(kt_v4_dot(row.moment, row.moment)), 0.0, 0.0);
    }
}
