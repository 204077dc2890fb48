/* N four-bar windows in a row (IFToMM A02) against the exact motion, through positions where the freedom jumps from 1
 * to N + 1. The cranks turn together. With theta counted from upright, their motion is
 *     theta'' = c sin(theta),   c = (3/2) g (3 N + 1) / (4 N + 1).
 * The energy gives c: N + 1 cranks have the inertia 1/3, and N couplers are in translation. The reference is a Taylor
 * series (upright.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closed.h"
#include "upright.h"

#include <math.h>
#include <stdio.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

enum { BODIES_MAX = 5 };

typedef struct course {
    int windows;
    kt_upright start, *now;
} course;

/* The largest distance of a tip to where it should be. */
static double tips_error(const kt_case *c, const kt_record *record, const void *about) {
    const course *k = about;
    double worst = 0.0;
    if (record->index == 0)
        *k->now = k->start;
    kt_upright_move(k->now, (long double)record->t);
    for (int i = 0; i <= k->windows; i++) {
        char crank[16];
        snprintf(crank, sizeof crank, "crank%d", i);
        const kt_vec3 tip = kt_closed_place(c, record, crank, "tip");
        worst = fmax(worst, hypot(tip.x - i - (double)sinl(k->now->theta), tip.y - (double)cosl(k->now->theta)));
    }
    return worst;
}

static void follow(kt_case *c, int windows, double theta, double rate, const kt_setting *settings, size_t count) {
    kt_upright now;
    const course k = {
        windows, {(long double)kt_upright_windows(windows), 0.0L, (long double)theta, (long double)rate}, &now};
    kt_case_follow(c, settings, count, tips_error, &k);
}

/* ---- long runs --------------------------------------------------------------------------------------------------- */

/* An error of energy e moves the phase by an angle that grows as t. If e itself grows as t, the angle grows as t^2.
 * Therefore, the bounds of 10 s grow a hundredfold. Each bound is three times the measured error. */
KT_TEST(two_windows_pass_a_hundred_singular_positions_in_a_hundred_seconds) {
    static const kt_setting settings[] = {
        {"rk4", 1e-3, 0.0, 5e-8}, {"tsit5", 0.0, 1e-10, 3.3e-6}, {"dop853", 0.0, 1e-11, 6e-7}};
    kt_case c = kt_closed_open("n-four-bar-2", KT_REDUCTION_QR, KT_METRIC_IDENTITY);
    c.scene.run.duration = 100.0;
    c.scene.run.interval = 0.1;
    follow(&c, 2, 0.0, 1.0, settings, COUNT_OF(settings));
}

KT_TEST(forty_windows_pass_their_singular_positions_for_twenty_seconds) {
    static const kt_setting settings[] = {{"tsit5", 0.0, 1e-10, 1e-7}};
    kt_case c = kt_closed_open("n-four-bar-40", KT_REDUCTION_QR, KT_METRIC_IDENTITY);
    const kt_mobility dof = kt_model_mobility(c.model);
    kt_check_equal_int("tree", dof.tree, 81);
    kt_check_equal_int("rank", dof.rank, 80);
    kt_check_near("duration", c.scene.run.duration, 20.0, 0.0);
    follow(&c, 40, 0.0, 1.0, settings, COUNT_OF(settings));
}

/* ---- landing on the singular position ---------------------------------------------------------------------------- */

/* Two windows that start at theta with this rate: all joints turn by theta, cranks one way, couplers the other. */
static void start_at(kt_case *c, kt_body *bodies, double theta, double rate) {
    const kt_description *d = &c->scene.description;
    kt_need(kt_check_below("bodies of two windows", d->body_count, BODIES_MAX));
    for (int i = 0; i < d->body_count; i++) {
        const double way = d->bodies[i].parent == NULL ? -1.0 : 1.0;
        bodies[i] = d->bodies[i];
        bodies[i].joint.position[0] = way * theta;
        bodies[i].joint.velocity[0] = way * rate;
    }
    c->scene.description.bodies = bodies;
    kt_closed_compile(c, KT_REDUCTION_QR, KT_METRIC_IDENTITY);
}

/* The state of the windows `lead` before they pass theta at this rate. It is rounded, so they pass within 1e-15. Bounds
 * are three times the method's own error over 1 s; 1e-9 is promised. */
static void land(double lead, long double theta, long double rate) {
    static const kt_setting settings[] = {{"rk4", 1e-3, 0.0, 4e-11}, {"rk4", 5e-4, 0.0, 3e-12}};
    kt_body bodies[BODIES_MAX];
    kt_upright m = {(long double)kt_upright_windows(2), 0.0L, theta, rate};
    kt_upright_move(&m, -(long double)lead);
    kt_note("%g s before %.4Lf rad at %.3Lf rad/s", lead, theta, rate);
    kt_case c = kt_case_open("n-four-bar-2");
    c.scene.run.duration = 1.0;
    start_at(&c, bodies, (double)m.theta, (double)m.rate);
    follow(&c, 2, (double)m.theta, (double)m.rate, settings, COUNT_OF(settings));
}

static const long double QUARTER = 1.570796326794896619231321691639751442L;

KT_TEST(windows_start_on_a_singular_position) {
    land(0.0, QUARTER, 4.887L);
    land(0.0, QUARTER, 1.0L);
    land(0.0, 3.0L * QUARTER, -4.887L);
}

/* A step of 1e-3 s ends, or its middle stages lie, where the freedom jumps. */
KT_TEST(steps_and_stages_land_on_a_singular_position) {
    static const double leads[] = {5e-4, 1e-3, 2.5e-4, 0.01, 0.1};
    for (size_t i = 0; i < COUNT_OF(leads); i++) {
        land(leads[i], QUARTER, 4.887L);
        land(leads[i], 3.0L * QUARTER, 4.887L);
        land(leads[i], QUARTER, -1.0L);
    }
}
