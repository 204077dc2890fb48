/* Scenes whose motion has a closed form in elliptic functions, at every record and with the scene's own settings.
 *
 * sn, cn and dn come from GSL; m = k^2 is their parameter. Each bound is three times the error measured when the test
 * was written.
 *
 * Symmetric tops, spherical pendulums (Goldstein, Classical Mechanics, 5-7): u = cos(theta) of the axis against the
 * upward vertical; a = I3 w3 / I1, b = Lz / I1, beta = 2 m g l / I1, alpha = (2 E - I3 w3^2) / I1:
 *     u'^2 = f(u) = (alpha - beta u) (1 - u^2) - (b - a u)^2
 *          = beta u^3 - (alpha + a^2) u^2 + (2 a b - beta) u + alpha - b^2 = beta (u - u1) (u - u2) (u - u3)
 *     u = u1 + (u2 - u1) sn^2(kappa t + K | m),  kappa = sqrt(beta (u3 - u1)) / 2,  m = (u2 - u1) / (u3 - u1)
 * where the motion starts at the higher turning point u2. If it starts at the lower one, u1, K is left out. One root is
 * the start itself. The two others are the roots of beta u^2 + B u + C with
 *     B = beta u0 - alpha - a^2,   C = 2 a b - beta + B u0.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <math.h>

#include <gsl/gsl_errno.h>
#include <gsl/gsl_sf_elljac.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static const double g = 9.81;

typedef struct jacobi {
    double sn, cn, dn;
} jacobi;

/* NaN where GSL finds fault, which fails the check. */
static jacobi jacobi_at(double x, double m) {
    jacobi j;
    if (gsl_sf_elljac_e(x, m, &j.sn, &j.cn, &j.dn) != GSL_SUCCESS)
        j.sn = j.cn = j.dn = (double)NAN;
    return j;
}

/* ---- pendulums --------------------------------------------------------------------------------------------------- */

/* A swing that begins at rest, with w^2 the squared frequency of small swings:
 *     sin(u / 2) = sin(u0 / 2) cd(w t | sin^2(u0 / 2)). */
typedef struct swing {
    double start, squared_frequency;
} swing;

static double swing_error(const kt_case *c, const kt_record *record, const void *about) {
    const swing *s = about;
    const double k = sin(0.5 * s->start);
    const jacobi j = jacobi_at(sqrt(s->squared_frequency) * record->t, k * k);
    (void)c;
    return fabs(record->q[0] - 2.0 * asin(k * j.cn / j.dn));
}

KT_TEST(simple_pendulum_follows_elliptic_functions_at_every_record) {
    const swing s = {kt_degrees(-90.0), g};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 1.4e-11},     {"dop853", 0.0, 1e-13, 2.5e-12}, {"dopri5", 0.0, 1e-12, 2e-10},
        {"dopri5", 0.0, 1e-9, 2.4e-7}, {"dopri5", 0.0, 1e-6, 2.1e-4},   {"tsit5", 0.0, 1e-9, 2e-8},
        {"dop853", 0.0, 1e-9, 1.2e-8}, {"bs32", 0.0, 1e-6, 6.6e-4},     {"rk4", 1e-3, 0.0, 5e-11}};
    kt_scene_follow("pendulum", settings, COUNT_OF(settings), swing_error, &s);
    kt_case c = kt_case_open("pendulum");
    kt_case_order(&c, "rk4", 4e-3, 4.0, swing_error, &s);
    kt_case_order(&c, "dopri5", 0.02, 5.0, swing_error, &s);
}

/* The sleeve's swing about its rod. The sleeve has 0.4 kg and 0.04 m radius. The arm has 0.6 kg, a length of 0.5 m and
 * 0.01 m radius. Only the part of gravity across the rod acts. */
KT_TEST(sleeve_swings_about_its_rod_as_a_pendulum) {
    const double inertia = 0.5 * 0.4 * 0.04 * 0.04 + 0.6 * (0.5 * 0.5 / 3.0 + 0.25 * 0.01 * 0.01);
    const swing s = {kt_degrees(120.0), 0.6 * 0.25 * g * sin(kt_degrees(40.0)) / inertia};
    static const kt_setting settings[] = {{NULL, 0.0, 0.0, 7e-11},
                                          {"dop853", 0.0, 1e-13, 1e-12},
                                          {"dopri5", 0.0, 1e-10, 2e-9},
                                          {"rk4", 1e-3, 0.0, 4.5e-11}};
    kt_scene_follow("sleeve", settings, COUNT_OF(settings), swing_error, &s);
}

/* ---- tops -------------------------------------------------------------------------------------------------------- */

typedef struct top {
    const char *body;
    double i1, i3, moment; /* about the fixed point; m g l */
    double side;           /* the centre of mass lies on the body's z axis: 1 above the fixed point, -1 below it */
    double start;          /* u at the start, a turning point */
    double spin;           /* w3 */
    double across;         /* angular velocity across the axis at the start */
    double vertical;       /* Lz */
} top;

static double height(const top *p, double t) {
    const double a = p->i3 * p->spin / p->i1, b = p->vertical / p->i1, beta = 2.0 * p->moment / p->i1;
    const double u0 = p->start, alpha = p->across * p->across + beta * u0;
    const double linear = beta * u0 - alpha - a * a, constant = 2.0 * a * b - beta + linear * u0;
    const double root = sqrt(linear * linear - 4.0 * beta * constant);
    const double u3 = (root - linear) / (2.0 * beta), other = 2.0 * constant / (root - linear);
    const double u1 = fmin(other, u0), u2 = fmax(other, u0), m = (u2 - u1) / (u3 - u1);
    const jacobi j = jacobi_at(0.5 * sqrt(beta * (u3 - u1)) * t, m);
    const double sn = u0 >= other ? j.cn / j.dn : j.sn; /* sn(x + K) = cn / dn */
    return u1 + (u2 - u1) * sn * sn;
}

/* The cosine of the axis against the vertical. */
static double top_error(const kt_case *c, const kt_record *record, const void *about) {
    const top *p = about;
    const double *q = record->q + kt_case_q(c, p->body);
    const double u = p->side * kt_mat3_from_quat(kt_quat_make(q[0], q[1], q[2], q[3])).z.z;
    return fabs(u - height(p, record->t));
}

KT_TEST(lagrange_top_nutates_as_elliptic_functions_say) {
    static const top p = {"top", 1.0, 0.3, 9.81 * 0.5, 1.0, 0.5, 20.0, 0.0, 0.3 * 20.0 * 0.5};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 6e-12}, {"dopri5", 0.0, 1e-10, 8e-9}, {"rk4", 1e-3, 0.0, 6e-9}};
    kt_scene_follow("lagrange-top", settings, COUNT_OF(settings), top_error, &p);
}

/* The one that sleeps sinks by 1e-3 alone, the other one bows to 71 degrees from the vertical. */
KT_TEST(upright_tops_sleep_or_bow_as_elliptic_functions_say) {
    static const top asleep = {"asleep", 1.0, 0.3, 9.81 * 0.5, 1.0, 1.0, 20.0, 0.1, 0.3 * 20.0};
    static const top tired = {"tired", 1.0, 0.3, 9.81 * 0.5, 1.0, 1.0, 12.0, 0.1, 0.3 * 12.0};
    static const kt_setting of_asleep[] = {
        {NULL, 0.0, 0.0, 1e-10}, {"dop853", 0.0, 1e-12, 1e-12}, {"rk4", 1e-3, 0.0, 1.5e-10}};
    static const kt_setting of_tired[] = {
        {NULL, 0.0, 0.0, 5e-9}, {"dop853", 0.0, 1e-12, 4e-11}, {"rk4", 1e-3, 0.0, 1e-8}};
    kt_scene_follow("spinning-top", of_asleep, COUNT_OF(of_asleep), top_error, &asleep);
    kt_scene_follow("spinning-top", of_tired, COUNT_OF(of_tired), top_error, &tired);
}

/* A hanging top without spin. It is a ball of 2 kg and 0.1 m radius, 1 m below the joint. It starts at 60 degrees from
 * straight down, pushed at 1.5 rad/s. */
KT_TEST(spherical_pendulum_rises_and_sinks_as_elliptic_functions_say) {
    const double i1 = 2.0 * (1.0 + 0.4 * 0.1 * 0.1);
    const top p = {"pendulum", i1, 0.0, 2.0 * g, -1.0, -0.5, 0.0, 1.5, i1 * 1.5 * sin(kt_degrees(60.0))};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 7e-11}, {"dopri5", 0.0, 1e-10, 6e-9}, {"rk4", 1e-3, 0.0, 2.5e-11}};
    kt_scene_follow("spherical-pendulum", settings, COUNT_OF(settings), top_error, &p);
}

/* Energy and vertical angular momentum, which the closed form does not see one by one. */
static int pendulum_invariants(const kt_case *c, const kt_record *record, double *out) {
    out[0] = record->kinetic + record->potential;
    out[1] = kt_momentum(c->model, record->data).moment.z;
    return 2;
}

KT_TEST(spherical_pendulum_keeps_energy_and_vertical_momentum) {
    static const char *const names[KT_INVARIANTS_MAX] = {"energy", "vertical momentum"};
    static const double scale[] = {1.0, 1.0};
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 3e-9}, {"dopri5", 0.0, 1e-10, 8e-8}, {"rk4", 1e-3, 0.0, 8e-12}};
    kt_case c = kt_case_open("spherical-pendulum");
    kt_case_conserve(&c, settings, COUNT_OF(settings), pendulum_invariants, names, scale);
}

/* ---- the flip ---------------------------------------------------------------------------------------------------- */

/* Euler's equations for I = (1, 2, 3) and w = (0.01, 5, 0.01) at the start: w1 = A1 cn x, w2 = A2 sn x, w3 = A3 dn x,
 * x = p t + x0, constants as in data/free_rigid_body.json. */
static double flip_error(const kt_case *c, const kt_record *record, const void *about) {
    const double a1 = 5.00000999999000002, a3 = 2.8867686664042432989, p = 2.8867686664042432989;
    const jacobi j = jacobi_at(p * record->t + 6.5958653803444946057, 0.99999200009599884801);
    const double *w = record->v + 3;
    (void)c;
    (void)about;
    return kt_vec3_norm(kt_vec3_make(w[0] - a1 * j.cn, w[1] - a1 * j.sn, w[2] - a3 * j.dn));
}

/* Each flip multiplies a difference by
 *     1 / (1 - m) = 1.25e5.
 * No computation in double precision stays below about 1e-9. At 1e-13, rounding causes all of the error. Twelve runs
 * with tolerances between 1e-13 and half of that differ by 2e-10 to 2e-8. */
KT_TEST(flip_turns_over_as_elliptic_functions_say) {
    static const kt_setting settings[] = {
        {NULL, 0.0, 0.0, 4e-9}, {"dop853", 0.0, 1e-13, 2e-8}, {"dopri5", 0.0, 1e-10, 3e-7}, {"rk4", 1e-3, 0.0, 2e-8}};
    kt_scene_follow("flip", settings, COUNT_OF(settings), flip_error, NULL);
}
