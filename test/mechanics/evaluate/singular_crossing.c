/* Through singular positions: the motion goes on as it came. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double pi = 3.14159265358979324;

/* theta'' = c sin(theta), in long double, RK4 at 5e-5 s: 1e-15. */
typedef struct exact {
    long double c, theta, rate;
} exact;

static void exact_advance(exact *e, double duration) {
    const int steps = (int)(fabs(duration) / 5e-5) + 1;
    const long double h = (long double)duration / steps;
    for (int i = 0; i < steps; i++) {
        const long double k1 = e->rate, l1 = e->c * sinl(e->theta);
        const long double k2 = e->rate + h / 2 * l1, l2 = e->c * sinl(e->theta + h / 2 * k1);
        const long double k3 = e->rate + h / 2 * l2, l3 = e->c * sinl(e->theta + h / 2 * k2);
        const long double k4 = e->rate + h * l3, l4 = e->c * sinl(e->theta + h * k3);
        e->theta += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        e->rate += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
    }
}

/* The distance of the first crank's tip from its exact place, over `duration`. */
static double worst_distance(linkage *l, int n, exact e, const char *method, double step, double tolerance,
                             double duration, long *evaluations) {
    linkage_run r;
    double worst = 0.0;
    e.c = (long double)windows_acceleration(n, pi / 2.0);
    linkage_run_start(&r, l, method, step, tolerance, false, 0.0);
    for (int i = 1; i <= (int)(duration / 0.5 + 0.5) && worst < 1.0; i++) {
        exact_advance(&e, 0.5);
        linkage_run_to(&r, 0.5 * i);
        worst = fmax(worst, hypot(sin(-l->q[0]) - (double)sinl(e.theta), cos(l->q[0]) - (double)cosl(e.theta)));
    }
    if (evaluations)
        *evaluations = r.evaluations;
    return worst;
}

/* The benchmark's double four-bar: ten crossings in 10 s. */
KT_TEST(two_windows_follow_the_exact_motion) {
    static linkage l;
    static const char *const names[] = {"qr", "partition", "svd", "qr, metric of mass"};
    for (int way = 0; way < 4; way++) {
        linkage_windows(&l, 2, 0.0, 1.0, KT_LOOP_REVOLUTE);
        l.options.reduction = kt_reduction_method_of((kt_reduction)(way % 3));
        l.options.metric = way == 3 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
        linkage_build(&l, 0.0);
        kt_check_below(names[way], worst_distance(&l, 2, (exact){0.0L, 0.0L, 1.0L}, "rk4", 1e-3, 0.0, 10.0, NULL),
                       1e-9);
    }
}

/* Steps end at the singular position, or stages meet it (two windows: reference/closed_singular). The start lies there,
 * or before it by a whole number of steps, or by half a step more. If five windows start there, rounding alone decides
 * the branch of each of them. Measured differences are 6e-11 to 1.4e-6 m. There were twelve rates from `3 to 3.4`
 * rad/s, in the plane and in space. The worst of these rates is among those below. */
KT_TEST(steps_and_stages_of_five_windows_may_land_on_a_singular_position) {
    static linkage l;
    static const struct {
        double before, rate, bound;
    } cases[] = {{0.1, 3.0, 1e-9}, {0.1005, 3.0, 1e-9}, {0.25, 3.0, 1e-9},
                 {0.0, 3.0, 5e-8}, {0.0, 3.037, 5e-8},  {0.0, 3.074, 5e-6}};
    enum { WINDOWS = 5 };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        exact e = {(long double)windows_acceleration(WINDOWS, pi / 2.0), (long double)(pi / 2.0),
                   (long double)cases[k].rate};
        exact_advance(&e, -cases[k].before);
        linkage_windows(&l, WINDOWS, (double)e.theta, (double)e.rate, KT_LOOP_REVOLUTE);
        char what[60];
        snprintf(what, sizeof what, "%g s before", cases[k].before);
        linkage_build(&l, 0.0);
        e.theta = (long double)-l.q[0];
        e.rate = (long double)-l.v[0];
        kt_check_below(what, worst_distance(&l, WINDOWS, e, "rk4", 1e-3, 0.0, 10.0, NULL), cases[k].bound);
    }
}

/* The effects of rounding near such positions must not mislead the error control: forty windows at 1e-11. The number of
 * rejected steps depends on where they happen to end. Evaluations are therefore the mean of runs at five tolerances. */
KT_TEST(adaptive_steps_pass_singular_positions) {
    static linkage l;
    static const struct {
        int n;
        double duration;
    } cases[] = {{2, 10.0}, {10, 5.0}, {40, 2.0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const int n = cases[i].n;
        double sum = 0.0, worst = 0.0;
        for (int k = 0; k < 5; k++) {
            long evaluations = 0;
            linkage_windows(&l, n, 0.0, 1.0, KT_LOOP_REVOLUTE);
            linkage_build(&l, 0.0);
            const double distance = worst_distance(&l, n, (exact){0.0L, 0.0L, 1.0L}, "dop853", 0.0,
                                                   (1.0 - 0.1 * k) * 1e-11, cases[i].duration, &evaluations);
            worst = distance <= worst ? worst : distance; /* keeps a NaN */
            sum += (double)evaluations / cases[i].duration;
        }
        kt_note("%d windows", n);
        kt_check_below("distance", worst, n == 40 ? 1e-10 : 1e-8);
        kt_check_below("evaluations a second", sum / 5.0, 600.0);
    }
}

/* The acceleration itself, at distances from 0 to 0.1 rad and at any speed. Interpolation errs by some 4e-11 rad/s^2.
 * Rounding errs by 3e-11 v^2, enlarged by the chain. The model is given at an angle of the cranks, and each other crank
 * is turned on by `off`. */
static void check_near_crossing(int n, double given, double off) {
    static linkage l;
    static const double rates[] = {1e-6, 1e-3, 0.3, 1.0, 5.0, 30.0};
    KT_WORST worst = kt_worst_make("acceleration");
    linkage_windows(&l, n, given, 1.0, KT_LOOP_REVOLUTE);
    linkage_compile(&l);
    for (int k = -13; k <= 13; k++) {
        const double x = k ? copysign(0.1 * pow(10.0, -0.5 * (13 - abs(k))), k) : 0.0, theta = pi / 2.0 + x;
        for (size_t s = 0; s < sizeof rates / sizeof rates[0]; s++) {
            double a[LINKAGE_BODIES];
            for (int i = 0; i < l.nv; i++) {
                l.q[i] = i <= n ? -theta + (i % 2 ? off : 0.0) : theta;
                l.v[i] = i <= n ? -rates[s] : rates[s];
            }
            linkage_accelerate(&l, 0.0, a);
            for (int i = 0; i < l.nv; i++)
                kt_worst_near(&worst, i <= n ? -a[i] : a[i], windows_acceleration(n, theta),
                              6e-10 + n * 1e-9 * rates[s] * rates[s], "given at %g, x = %g, rate %g, %d", given, x,
                              rates[s], i);
        }
    }
}

KT_TEST(accelerations_near_a_singular_position_are_those_of_the_motion) {
    for (int n = 2; n <= 8; n *= 2)
        check_near_crossing(n, 0.0, 0.0);
}

/* A window of cranks of 1 m. Its first tip is at `(sin(theta), cos(theta))`, and a rod of 1 m connects it to a slide on
 * the line x = X. The rod lies across the slide but for `slack` in the window's singular position, `theta = pi / 2`:
 *     y = cos(theta) + r,   r^2 = 1 - (X - sin(theta))^2,   X = 2 - slack
 *     (5/3 + m y'^2) theta'' = tau - m y' y'' theta'^2
 * The slide's motion y(theta) varies within sqrt(2 slack), for all units of the joints. */
static double slide_error(double slack, double off, double rate) {
    static linkage l;
    const double m = 2.0, tau = 1.5, theta = pi / 2.0 + off, x = 2.0 - slack - sin(theta);
    const double r = sqrt(1.0 - x * x), dx = -cos(theta), dr = -x * dx / r;
    const double ddr = -(dx * dx + x * sin(theta) + dr * dr) / r;
    const double dy = -sin(theta) + dr, ddy = -cos(theta) + ddr;
    const double of_motion = (tau - m * dy * ddy * rate * rate) / (5.0 / 3.0 + m * dy * dy);
    double a[LINKAGE_BODIES], forces[LINKAGE_BODIES] = {-tau}, error = (double)NAN;
    kt_error e = {0};
    linkage_windows(&l, 1, theta, rate, KT_LOOP_REVOLUTE);
    l.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    kt_body *slide = linkage_bar(&l, "slide", NULL, kt_vec3_make(2.0 - slack, 0.0, 0.0), kt_vec3_make(0.0, 0.1, 0.0),
                                 cos(theta) + r, dy * rate);
    slide->joint.type = KT_JOINT_PRISMATIC;
    slide->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    slide->mass = m;
    linkage_close(&l, "rod", KT_LOOP_DISTANCE, "crank0", kt_vec3_make(0.0, 1.0, 0.0), "slide",
                  kt_vec3_make(0.0, 0.0, 0.0))
        ->function = kt_function_constant(1.0);
    linkage_compile(&l);
    kt_need_fine("moves", kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, l.v, forces, NULL, a, &e), &e);
    error = fabs(-a[0] - of_motion) / fmax(1.0, fabs(of_motion));
    return error;
}

/* Measured: 1.6e-7; 5e-2 from neighbours at the distance for motions that vary within their units. */
KT_TEST(acceleration_is_interpolated_from_as_near_as_the_motion_varies) {
    KT_WORST worst = kt_worst_make("acceleration");
    for (int k = 0; k < 4; k++)
        for (int i = -2; i <= 2; i++) {
            const double slack = 0.04 * pow(0.5, k), off = 2e-4 * i;
            kt_worst_below(&worst, slide_error(slack, off, 1.0), 1e-6, "slack %g, %g from it", slack, off);
        }
}

/* The usual size of the equations' directions decides whether a position is near. A model whose start has small
 * directions must not take them for usual. Otherwise the rounding of the state, 4 units here, would be divided by the
 * cube of the distance.
 */
KT_TEST(models_given_near_a_singular_position_know_it_as_one) {
    for (int k = -2; k <= 2; k++)
        check_near_crossing(2, pi / 2.0 + 0.05 * k, 4.0 * DBL_EPSILON);
}

/* Two cranks of length a on pivots b apart, a coupler of length b that crosses the ground: |AB| = b is
 *     sin((r - c) / 2) (a sin((r - c) / 2) - b sin((r + c) / 2)) = 0
 * in the angles c of the crank and r of the rocker. The first factor is the parallelogram. The second is the crossed
 * branch, `(b - a) sin(r / 2) cos(c / 2) + (b + a) cos(r / 2) sin(c / 2) = 0`. They meet if all lies in one line, twice
 * in a turn. The motion stays crossed, and keeps its energy. */
KT_TEST(crossed_cranks_stay_crossed) {
    static linkage l;
    const double a = 1.0, b = 2.0, start = 1.2, other = 2.0 * atan(-(b + a) / (b - a) * tan(start / 2.0));
    const double x = b + a * cos(other) - a * cos(start), y = a * sin(other) - a * sin(start);
    const char *hold[] = {"crank"};
    const four_bar f = {.crank = a,
                        .coupler = b,
                        .rocker = a,
                        .ground = b,
                        .size = 1.0,
                        .type = KT_LOOP_REVOLUTE,
                        .rate = 9.0,
                        .angle = {start, atan2(y, x) - start, other}};
    linkage_four_bar(&l, &f);
    l.description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
    l.description.hold = hold;
    l.description.hold_count = 1;
    linkage_build(&l, 0.0);
    linkage_run r;
    KT_WORST relation = kt_worst_make("the rocker against the crank"), energy = kt_worst_make("energy");
    kt_error e = {0};
    double first = 0.0;
    linkage_run_start(&r, &l, "dop853", 0.0, 1e-11, false, 0.0);
    for (int i = 0; i <= 200; i++) {
        const double t = 0.02 * i;
        linkage_run_to(&r, t);
        kt_need_fine("kinematics", kt_kinematics_update(l.model, l.data, l.q, l.v, NULL, &e), &e);
        const double crank = 0.5 * l.q[0], rocker = 0.5 * l.q[2], now = kt_kinetic_energy(l.model, l.data);
        first = i ? first : now;
        kt_worst_near(&relation, (b - a) * sin(rocker) * cos(crank), -(b + a) * cos(rocker) * sin(crank), 1e-11,
                      "t = %g", t);
        kt_worst_near(&energy, now, first, 1e-11 * first, "t = %g", t);
    }
    kt_check_above("half turns of the crank, flat after each", (l.q[0] - start) / pi, 6.0);
}

/* A parallelogram whose crank is driven by a polynomial of `count` coefficients. */
static void describe_driven_parallelogram(linkage *l, const double *turn, int count) {
    four_bar f = {.crank = 1.0, .coupler = 2.0, .rocker = 1.0, .ground = 2.0, .size = 1.0, .type = KT_LOOP_REVOLUTE};
    f.angle[0] = f.angle[2] = 0.4;
    f.angle[1] = -0.4;
    linkage_four_bar(l, &f);
    kt_loop *loop =
        linkage_close(l, "drive", KT_LOOP_MOTION, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL, kt_vec3_make(0.0, 0.0, 0.0));
    loop->joint = "crank";
    loop->function = kt_function_polynomial(turn, count);
}

/* Where a driven parallelogram lies flat, nothing drives the rocker for an instant. */
KT_TEST(driven_parallelogram_passes_its_change_points) {
    static linkage l;
    const double turn[] = {0.4, 1.7};
    describe_driven_parallelogram(&l, turn, 2);
    linkage_build(&l, 0.0);
    linkage_run r;
    KT_WORST crank = kt_worst_make("crank"), rocker = kt_worst_make("rocker");
    linkage_run_start(&r, &l, "rk4", 2e-3, 0.0, false, 0.0);
    for (int i = 0; i <= 100; i++) {
        linkage_run_to(&r, 0.1 * i);
        kt_worst_near(&crank, l.q[0], turn[0] + turn[1] * 0.1 * i, 1e-13, "t = %g", 0.1 * i);
        kt_worst_near(&rocker, l.q[2], turn[0] + turn[1] * 0.1 * i, 1e-12, "t = %g", 0.1 * i);
    }
}

/* The crank's angle, rate and acceleration. */
static void drive_at(const double c[4], double t, double *angle, double *rate, double *acceleration) {
    *angle = c[0] + t * (c[1] + t * (c[2] + t * c[3]));
    *rate = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
    *acceleration = 2.0 * c[2] + 6.0 * c[3] * t;
}

/* The same with a drive that accelerates: the rocker does as the crank, flat or nearly so. The neighbouring states are
 * those of the motion only where the drive goes along with them. */
KT_TEST(driven_parallelogram_accelerates_with_its_drive_where_it_lies_flat) {
    static linkage l;
    const double turn[] = {0.4, 1.7, 0.6, -0.3};
    describe_driven_parallelogram(&l, turn, 4);
    KT_WORST worst = kt_worst_make("acceleration");
    linkage_compile(&l);
    for (int k = -8; k <= 8; k++) {
        const double x = k ? copysign(0.1 * pow(10.0, -0.8 * (8 - abs(k))), k) : 0.0, sign[3] = {1.0, -1.0, 1.0};
        double t = 1.4, angle, rate, acceleration, a[3];
        for (int i = 0; i < 20; i++) { /* Newton's method for the time at which it is x from lying flat */
            drive_at(turn, t, &angle, &rate, &acceleration);
            t -= (angle - pi - x) / rate;
        }
        for (int i = 0; i < 3; i++) {
            l.q[i] = sign[i] * angle;
            l.v[i] = sign[i] * rate;
        }
        linkage_accelerate(&l, t, a);
        for (int i = 0; i < 3; i++)
            kt_worst_near(&worst, sign[i] * a[i], acceleration, 1e-9, "x = %g, joint %d", x, i);
    }
}

/* Parts outside the loops change nothing in the way they cross, for all speeds. */
KT_TEST(fast_rotor_beside_does_not_disturb_a_crossing) {
    static linkage l;
    double a[LINKAGE_BODIES], alone[LINKAGE_BODIES];
    for (int rotor = 0; rotor < 2; rotor++) {
        linkage_windows(&l, 3, pi / 2.0, 2.0, KT_LOOP_REVOLUTE);
        if (rotor) {
            linkage_bar(&l, "rotor", NULL, kt_vec3_make(9.0, 0.0, 0.0), kt_vec3_make(0.2, 0.0, 0.0), 0.3, 3000.0);
            linkage_bar(&l, "wing", "rotor", kt_vec3_make(0.2, 0.0, 0.0), kt_vec3_make(0.2, 0.1, 0.0), 0.3, -2000.0);
        }
        linkage_build(&l, 0.0);
        linkage_accelerate(&l, 0.0, rotor ? a : alone);
    }
    kt_check_equal_bits("accelerations", a, alone, 7);
}
