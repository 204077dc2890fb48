/* Rolling against closed forms: a wheel that goes straight, one that leans in a circle, one that lies flat. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

#include <float.h>

#define EPS DBL_EPSILON

static jet linear(double at, double rate) { return jet_make((long double)at, (long double)rate, 0.0L); }

static kt_loop_record disc_of(double radius) {
    return (kt_loop_record){.type = KT_LOOP_ROLLING, .radius = radius, .contact = true};
}

static int evaluate(const kt_loop_record *loop, const moving m[2], kt_v4 acceleration[2][2], kt_loop_end end[2],
                    kt_loop_row rows[3]) {
    for (int k = 0; k < 2; k++)
        end[k] = moving_end(&m[k], acceleration[k]);
    return kt_loop_kinds_baseline[KT_LOOP_ROLLING]->evaluate(loop, NULL, end, 0.0, rows);
}

static void turn_by(moving *m, int k, jet angle) {
    jet q[4];
    moving_turn(k, angle, q);
    moving_multiply(m->q, q, m->q);
}

/* A wheel in the plane's frame. It turns by the heading yaw about the normal, then its axle by `lean` against the
 * plane, and then by the spin about the axle. Upright (lean = 0) it rolls along x for yaw = 0, at -radius spin' with
 * the axle along -y. */
static moving wheel(jet x, jet y, double radius, jet yaw, jet lean, jet spin) {
    const jet zero = jet_constant(0.0L);
    moving m = {{x, y, jet_scale((long double)radius, jet_cos(lean))}, {jet_constant(1.0L), zero, zero, zero}};
    turn_by(&m, 2, yaw);
    turn_by(&m, 0, jet_add(jet_constant(2.0L * atanl(1.0L)), lean));
    turn_by(&m, 2, spin);
    return m;
}

/* The worst phi, phi' and phi'' of the three rows of rolling motions on planes that themselves move. */
typedef struct verdict {
    kt_worst gap, first, second;
} verdict;

static verdict verdict_make(void) {
    return (verdict){kt_worst_make("gap"), kt_worst_make("phi'"), kt_worst_make("phi''")};
}

static void judge(verdict *v, const kt_loop_record *loop, kt_random *random, const moving *relative) {
    kt_loop_end end[2];
    kt_loop_row rows[3];
    kt_v4 acceleration[2][2];
    const moving plane = moving_random(random, 1.0), m[2] = {moving_compose(&plane, relative), plane};
    const int count = evaluate(loop, m, acceleration, end, rows);
    const moving_rates scale = moving_scales(end, acceleration);
    for (int k = 0; k < count; k++) {
        const moving_rates rates = moving_rates_of(&rows[k], end, acceleration);
        kt_worst_near(&v->first, rates.first, 0.0, EPS * scale.first, "radius %g, row %d", loop->radius, k);
        kt_worst_near(&v->second, rates.second, 0.0, EPS * scale.second, "radius %g, row %d", loop->radius, k);
    }
    if (count > 2)
        kt_worst_near(&v->gap, rows[2].residual, 0.0, 4.0 * EPS, "radius %g", loop->radius);
}

static void report(const verdict *v) {
    kt_check_worst(&v->gap);
    kt_check_worst(&v->first);
    kt_check_worst(&v->second);
}

KT_TEST(straight_rolling_has_the_speed_of_the_rim) {
    kt_random random = kt_random_of_test();
    verdict v = verdict_make();
    for (int n = 0; n < 100; n++) {
        const double radius = kt_random_uniform(&random, 0.2, 2.0), spin = kt_random_normal(&random);
        const double gain = kt_random_normal(&random), yaw = kt_random_uniform(&random, -3.0, 3.0);
        const jet turned = jet_make(0.3L, (long double)spin, (long double)gain);
        /* the axle is along (sin yaw, -cos yaw, 0): the wheel goes along (cos yaw, sin yaw, 0), against the spin */
        const jet gone = jet_scale(-(long double)radius, turned);
        const jet x = jet_scale(cosl((long double)yaw), gone), y = jet_scale(sinl((long double)yaw), gone);
        const moving relative = wheel(x, y, radius, linear(yaw, 0.0), linear(0.0, 0.0), turned);
        const kt_loop_record disc = disc_of(radius);
        judge(&v, &disc, &random, &relative);
    }
    report(&v);
}

/* A wheel of radius rho turns at Omega about the vertical through the origin. Its contact is on a circle of radius R,
 * to the right of its middle. Its top leans in by beta. The centre is at R - rho sin(beta) from the vertical. Its axle
 * goes with the turning frame, in which the material at the contact passes at -Omega R: so rho spin' = -Omega R. */
KT_TEST(a_leaning_wheel_rolls_in_a_circle) {
    kt_random random = kt_random_of_test();
    verdict v = verdict_make();
    for (int n = 0; n < 100; n++) {
        const double radius = kt_random_uniform(&random, 0.2, 1.0), lean = kt_random_uniform(&random, -1.3, 1.3);
        const double circle = kt_random_uniform(&random, 1.0, 3.0), turning = kt_random_normal(&random);
        const jet yaw = linear(kt_random_uniform(&random, -3.0, 3.0), turning);
        const jet spin = linear(kt_random_uniform(&random, -3.0, 3.0), -turning * circle / radius);
        const jet arm = jet_constant((long double)circle - (long double)radius * sinl((long double)lean));
        const jet x = jet_mul(arm, jet_sin(yaw)), y = jet_scale(-1.0L, jet_mul(arm, jet_cos(yaw)));
        const moving relative = wheel(x, y, radius, yaw, linear(-lean, 0.0), spin);
        const kt_loop_record disc = disc_of(radius);
        judge(&v, &disc, &random, &relative);
    }
    report(&v);
}

/* A ball of radius r on one of radius R, whose centre circles about z at the rate p and the angle theta. Rolling leaves
 * the spin s about the line of centres n free:
 *     w = p (R + r) / r (z - cos(theta) n) + s n
 * Seen from n, w - p z is constant: the ball spins about an axis that leans by beta. */
KT_TEST(a_ball_that_spins_rolls_around_another_one) {
    kt_random random = kt_random_of_test();
    verdict v = verdict_make();
    for (int i = 0; i < 100; i++) {
        const double R = kt_random_uniform(&random, 0.3, 1.0), r = kt_random_uniform(&random, 0.2, 1.0);
        const double p = kt_random_normal(&random), theta = kt_random_uniform(&random, 0.3, 2.8);
        const double s = kt_random_normal(&random), along = s - p * (R + r) / r * cos(theta);
        const double x = along * sin(theta), z = along * cos(theta) + p * (R + r) / r - p, beta = atan2(x, z);
        const jet yaw = linear(kt_random_uniform(&random, -3.0, 3.0), p), zero = jet_constant(0.0L);
        const long double reach = (long double)R + (long double)r, flat = reach * sinl((long double)theta);
        moving ball = {{jet_scale(flat, jet_cos(yaw)), jet_scale(flat, jet_sin(yaw)),
                        jet_constant(reach * cosl((long double)theta))},
                       {jet_constant(1.0L), zero, zero, zero}};
        turn_by(&ball, 2, yaw);
        turn_by(&ball, 1, linear(beta, 0.0));
        turn_by(&ball, 2, linear(kt_random_uniform(&random, -3.0, 3.0), hypot(x, z)));
        judge(&v, &(kt_loop_record){.type = KT_LOOP_ROLLING, .form = KT_ROLLING_BALLS, .tube = R, .radius = r}, &random,
              &ball);
    }
    kt_check_worst(&v.first);
    kt_check_worst(&v.second);
}

/* A multiplier's force acts at the contact: no moment about it; tangential ones are along x and y of the plane. */
KT_TEST(rolling_forces_pass_through_the_contact) {
    kt_random random = kt_random_of_test();
    KT_WORST moment = kt_worst_make("moment about the contact"), force = kt_worst_make("force");
    for (int n = 0; n < 200; n++) {
        kt_loop_end end[2];
        kt_loop_row rows[3];
        const double radius = kt_random_uniform(&random, 0.2, 1.5);
        const moving m[2] = {moving_random(&random, 2.0), moving_random(&random, 2.0)};
        const kt_loop_record disc = disc_of(radius);
        (void)evaluate(&disc, m, (kt_v4[2][2]){0}, end, rows);
        /* the lowest point of the rim, found by trying: the least height is where its derivative vanishes */
        const kt_v4 normal = end[1].axes[2], centre = end[0].point - end[1].point;
        const double down = atan2(-kt_v4_dot(normal, end[0].axes[1]), -kt_v4_dot(normal, end[0].axes[0]));
        const kt_v4 rim =
            kt_v4_splat(radius * cos(down)) * end[0].axes[0] + kt_v4_splat(radius * sin(down)) * end[0].axes[1];
        for (int k = 0; k < 3; k++) {
            const kt_v4 about = rows[k].moment - kt_v4_cross(centre + rim, rows[k].force);
            const kt_v4 wrong = rows[k].force + end[1].axes[k];
            kt_worst_below(&moment, sqrt(kt_v4_dot(about, about)), 1e-14, "%d, row %d", n, k);
            kt_worst_below(&force, sqrt(kt_v4_dot(wrong, wrong)), 0.0, "%d, row %d", n, k);
        }
        kt_worst_near(&moment, rows[2].residual, kt_v4_dot(normal, centre + rim), 1e-14, "%d, gap", n);
    }
}

/* s = 0: every point of the rim is as low as the others; its x axis's is taken, and all numbers are finite. */
KT_TEST(a_wheel_that_lies_flat_touches_on_its_x_axis) {
    kt_random random = kt_random_of_test();
    for (int sign = -1; sign < 2; sign += 2) {
        kt_loop_end end[2];
        kt_loop_row rows[3];
        kt_v4 acceleration[2][2];
        const double radius = 0.7;
        moving plane = moving_random(&random, 1.0);
        const moving up = moving_random(&random, 1.0), m[2] = {up, plane};
        const kt_loop_record disc = disc_of(radius);
        (void)evaluate(&disc, m, acceleration, end, rows);
        end[1].axes[2] = kt_v4_splat(sign) * end[0].axes[2];
        end[1].axes[1] = kt_v4_splat(sign) * end[0].axes[1];
        end[1].axes[0] = end[0].axes[0];
        const kt_loop_record loop = {.type = KT_LOOP_ROLLING, .radius = radius, .contact = true};
        (void)kt_loop_kinds_baseline[KT_LOOP_ROLLING]->evaluate(&loop, NULL, end, 0.0, rows);
        const kt_v4 centre = end[0].point - end[1].point, contact = centre - kt_v4_splat(radius) * end[0].axes[0];
        kt_check_near("gap", rows[2].residual, kt_v4_dot(centre, end[1].axes[2]), 4.0 * EPS);
        for (int k = 0; k < 3; k++) {
            const kt_v4 wrong = rows[k].moment - kt_v4_cross(contact, rows[k].force);
            kt_check_below("moment about the contact", sqrt(kt_v4_dot(wrong, wrong)), 4.0 * EPS);
            kt_check_true("drift is finite", isfinite(rows[k].drift));
        }
    }
}
