/* Bodies that turn in space against tables and closed forms: Lagrange's top, steady precession, the flip.
 *
 * Orientations are compared by the angle of the rotation between them. Each bound is three times the error measured
 * when the test was written.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <float.h>
#include <math.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static kt_quat quat_at(const double *q) { return kt_quat_make(q[0], q[1], q[2], q[3]); }

static double distance(const double *a, const double *b) {
    return kt_vec3_norm(kt_vec3_make(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
}

/* Orientation (rad), angular velocity over a spin of 20 rad/s, and the axis as the marker shows it. */
static double top_error(const kt_case *c, const kt_record *record, const void *about) {
    const double *row = about;
    int body = kt_body_find(c->model, "top"), tip = kt_marker_find(c->model, body, "tip");
    const double angle = kt_angle_between(quat_at(record->q), quat_at(row + 6));
    const double rate = distance(record->v, row + 3) / 20.0;
    const kt_vec3 axis = kt_point_position(c->model, record->data, body, kt_marker_at(c->model, body, tip));
    const double seen[] = {axis.x, axis.y, axis.z};
    return fmax(angle, fmax(rate, distance(seen, row)));
}

KT_TEST(lagrange_top_keeps_its_table) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 2e-11},     {"dop853", 0.0, 1e-9, 2e-8}, {"dopri5", 0.0, 1e-10, 1.2e-8},
        {"tsit5", 0.0, 1e-10, 4e-9}, {"rk4", 1e-3, 0.0, 5e-8},
    };
    kt_case c = kt_case_open("lagrange-top");
    kt_table table = kt_table_open("lagrange_top", "axis_x axis_y axis_z w1 w2 w3 q0 q1 q2 q3");
    kt_case_compare(&c, &table, settings, COUNT_OF(settings), top_error);
}

/* Energy, and vertical angular momentum about the fixed point. */
static int top_invariants(const kt_case *c, const kt_record *record, double *out) {
    const double i1 = 1.0, i3 = 0.3;
    const kt_mat3 r = kt_mat3_from_quat(quat_at(record->q));
    const double *w = record->v;
    (void)c;
    out[0] = record->kinetic + record->potential;
    out[1] = kt_mat3_apply(r, kt_vec3_make(i1 * w[0], i1 * w[1], i3 * w[2])).z;
    return 2;
}

static int top_spin(const kt_case *c, const kt_record *record, double *out) {
    (void)c;
    out[0] = record->v[2];
    return 1;
}

/* The energy without the spin, counted from the pivot, is about 3 J. The momentum of the spin is 6 N m s. */
KT_TEST(lagrange_top_keeps_energy_and_vertical_momentum) {
    static const char *const names[KT_INVARIANTS_MAX] = {"energy", "vertical momentum"};
    static const double scale[] = {7.0, 6.0};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 4e-12}, {"dopri5", 0.0, 1e-10, 5e-9}, {"rk4", 1e-3, 0.0, 1e-9}};
    kt_case c = kt_case_open("lagrange-top");
    kt_case_conserve(&c, settings, COUNT_OF(settings), top_invariants, names, scale);
}

/* No moment acts about the axis, and I1 = I2 to the bit. Only one rounding changes the spin: that of the inertias moved
 * to the fixed point. The method and its step have no influence. */
KT_TEST(lagrange_top_keeps_its_spin_to_rounding) {
    static const char *const names[KT_INVARIANTS_MAX] = {"spin"};
    static const double scale[] = {20.0 * DBL_EPSILON};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 16.0}, {"dopri5", 0.0, 1e-5, 16.0}, {"rk4", 0.02, 0.0, 16.0}};
    kt_case c = kt_case_open("lagrange-top");
    kt_case_conserve(&c, settings, COUNT_OF(settings), top_spin, names, scale);
}

/* ---- steady precession ------------------------------------------------------------------------------------------- */

/* The axis turns about the vertical at W, the body about its axis at w3 - W cos(theta):
 * R(t) = Rz(W t) Rx(theta) Rz((w3 - W cos(theta)) t), with W from data/lagrange_top.json. */
typedef struct precession {
    const char *body;
    double rate; /* W */
} precession;

static double precession_error(const kt_case *c, const kt_record *record, const void *about) {
    const precession *p = about;
    const double theta = kt_degrees(30.0), spin = 50.0, t = record->t;
    const double own = (spin - p->rate * cos(theta)) * t;
    const kt_quat round = kt_quat_make(cos(0.5 * p->rate * t), 0.0, 0.0, sin(0.5 * p->rate * t));
    const kt_quat tilt = kt_quat_make(cos(0.5 * theta), sin(0.5 * theta), 0.0, 0.0);
    const kt_quat turn = kt_quat_make(cos(0.5 * own), 0.0, 0.0, sin(0.5 * own));
    return kt_angle_between(quat_at(record->q + kt_case_q(c, p->body)),
                            kt_quat_multiply(round, kt_quat_multiply(tilt, turn)));
}

KT_TEST(tops_precess_steadily_at_both_rates) {
    static const precession slow = {"slow", 0.33341827272629624744}, fast = {"fast", 16.987089802962476688};
    static const kt_setting for_slow[] = {
        {NULL, 0.0, 0.0, 3e-9}, {"dop853", 0.0, 1e-12, 3e-11}, {"rk4", 1e-3, 0.0, 5e-6}};
    static const kt_setting for_fast[] = {
        {NULL, 0.0, 0.0, 3e-8}, {"dop853", 0.0, 1e-12, 2e-10}, {"rk4", 1e-3, 0.0, 2e-5}};
    kt_case c = kt_case_open("precessing-top");
    kt_case_follow(&c, for_slow, COUNT_OF(for_slow), precession_error, &slow);
    kt_case_follow(&c, for_fast, COUNT_OF(for_fast), precession_error, &fast);
}

/* ---- the flip ---------------------------------------------------------------------------------------------------- */

/* A free joint: place, then orientation; velocity, then angular velocity. */
static double flip_error(const kt_case *c, const kt_record *record, const void *about) {
    const double *row = about, origin[] = {0.0, 0.0, 0.0};
    (void)c;
    return fmax(kt_angle_between(quat_at(record->q + 3), quat_at(row + 3)),
                fmax(distance(record->v + 3, row) / 5.0, distance(record->q, origin)));
}

KT_TEST(flip_keeps_its_table) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 7e-10},     {"dop853", 0.0, 1e-9, 4e-8}, {"dopri5", 0.0, 1e-10, 1e-8},
        {"tsit5", 0.0, 1e-10, 2e-9}, {"rk4", 1e-3, 0.0, 1.5e-9},
    };
    kt_case c = kt_case_open("flip");
    kt_table table = kt_table_open("free_rigid_body", "w1 w2 w3 q0 q1 q2 q3");
    kt_case_compare(&c, &table, settings, COUNT_OF(settings), flip_error);
}

/* Kinetic energy and the angular momentum in the world, R I w: a fixed vector. Scales: 2T and |L| of the table's file.
 */
static int flip_invariants(const kt_case *c, const kt_record *record, double *out) {
    const kt_wrench momentum = kt_momentum(c->model, record->data);
    out[0] = record->kinetic;
    out[1] = momentum.moment.x;
    out[2] = momentum.moment.y;
    out[3] = momentum.moment.z;
    return 4;
}

KT_TEST(flip_keeps_energy_and_angular_momentum_over_four_flips) {
    static const char *const names[KT_INVARIANTS_MAX] = {"energy", "momentum about x", "momentum about y",
                                                         "momentum about z"};
    static const double scale[] = {25.0, 10.0, 10.0, 10.0};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 2e-11}, {"dopri5", 0.0, 1e-10, 1e-9}, {"rk4", 1e-3, 0.0, 2e-11}};
    kt_case c = kt_case_open("flip");
    kt_case_conserve(&c, settings, COUNT_OF(settings), flip_invariants, names, scale);
}
