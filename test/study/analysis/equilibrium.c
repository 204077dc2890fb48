/* Static equilibria against closed forms and against minima of the energy found by other means. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"
#include "small.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static kt_status find(const linkage *l, bool nearest, double *q, const double *tau, kt_equilibrium *found,
                      kt_error *error) {
    const kt_equilibrium_options options = {.nearest = nearest};
    kt_linearization *linearization = NULL;
    kt_status status = kt_linearization_create(l->model, NULL, &linearization, error);
    if (status == KT_OK)
        status = kt_equilibrium_find(linearization, &options, 0.0, q, tau, found, error);
    kt_linearization_free(linearization);
    return status;
}

static bool found(const linkage *l, bool nearest, double *q, const double *tau) {
    kt_equilibrium result = {0};
    kt_error error = {0};
    const kt_status status = find(l, nearest, q, tau, &result, &error);
    if (status == KT_OK)
        kt_note("%d steps, the last %.2g, acceleration %.2g", result.steps, result.distance, result.acceleration);
    return kt_fine("has an equilibrium", status, &error);
}

static const kt_vec3 none = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0};

/* Angles count from hanging. */
KT_TEST(pendulum_comes_to_rest_below_or_stays_where_it_balances) {
    const double starts[] = {0.25, -1.6, pi / 2.0, 2.5, 3.1, -3.1};
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.0, 0.0);
    linkage_compile(&l);
    KT_WORST hangs = kt_worst_make("hangs"); /* Newton's last step leaves its third power; measured: 7e-19 */
    double q = 0.0;
    for (size_t i = 0; i < sizeof starts / sizeof starts[0]; i++) {
        q = starts[i];
        if (found(&l, false, &q, NULL))
            kt_worst_near(&hangs, q, 0.0, 1e-17, "from %g", starts[i]);
    }
    q = pi;
    if (found(&l, false, &q, NULL))
        kt_check_near("balances", q, pi, 0.0);
    q = 2.9;
    if (found(&l, true, &q, NULL))
        kt_check_near("nearest is upright", q, pi, 1e-15);
    q = 0.4;
    if (found(&l, true, &q, NULL))
        kt_check_near("nearest is hanging", q, 0.0, 1e-19); /* measured: 1e-21 */
}

/* m g l / 2 sin(q) = tau for a bar of length l; beyond m g l / 2 nothing holds it. */
KT_TEST(motor_torque_lifts_a_pendulum_to_its_angle_or_turns_it_for_ever) {
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.0, 0.0);
    linkage_compile(&l);
    double q = 0.0, tau = 0.8 * 9.81 / 2.0;
    if (found(&l, false, &q, &tau))
        kt_check_near("angle", q, asin(0.8), 2e-15);
    kt_error error = {0};
    const double start = q = 0.1;
    tau = 1.01 * 9.81 / 2.0;
    kt_check_equal_int("too strong", find(&l, false, &q, &tau, NULL, &error), KT_ERROR_STEP);
    kt_check_contains("names the joint", error.where, "bar");
    kt_check_equal_bits("untouched", &q, &start, 1);
    kt_check_equal_int("nor nearby", find(&l, true, &q, &tau, NULL, &error), KT_ERROR_STEP);
}

/* A motor of 1.7 m g l / 2, which no position balances, next to a soft stop. The search stalls at the stop's edge,
 * which is no solution. */
KT_TEST(search_that_stalls_at_a_stop_has_found_nothing) {
    kt_effect stop = kt_effect_default();
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.0, 0.0);
    stop.type = KT_EFFECT_JOINT_LIMIT;
    stop.joint = "bar";
    const double most = 0.5 * 9.81, start = 0.5 * pi + 2.35990225534581;
    stop.lower = 0.5 * pi + 2.2524642590605497;
    stop.stiffness = most / 2.943;
    l.description.effects = &stop;
    l.description.effect_count = 1;
    linkage_compile(&l);
    for (int nearest = 0; nearest < 2; nearest++) {
        kt_error error = {0};
        double q = start, tau = 5.0 * most / 2.943;
        kt_check_equal_int("none", find(&l, nearest, &q, &tau, NULL, &error), KT_ERROR_STEP);
        kt_check_contains("names the joint", error.where, "bar");
        kt_check_equal_bits("untouched", &q, &start, 1);
    }
}

/* -x / sqrt(1 + x^2), as of a string over a pulley next to the rail. */
static int pull(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)t, (void)v, (void)balance;
    *force = -q / sqrt(1.0 + q * q);
    return 0;
}

/* Newton's step from x leads to -x^3, away from rest where |x| > 1: a step that has gone too far does not count.
 * Forces of four roundings of that of a unit are none. */
KT_TEST(force_that_saturates_leads_to_rest_from_afar) {
    const double starts[] = {0.5, -1.2, 3.0, 6.0, -40.0};
    kt_effect effect = kt_effect_default();
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "slider", NULL, none, down, 0.0, 0.0)->joint.type = KT_JOINT_PRISMATIC;
    l.body[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    effect.type = KT_EFFECT_CUSTOM;
    effect.joint = "slider";
    effect.joint_force = pull;
    l.description.effects = &effect;
    l.description.effect_count = 1;
    KT_WORST worst = kt_worst_make("position");
    linkage_compile(&l);
    for (size_t i = 0; i < sizeof starts / sizeof starts[0]; i++) {
        double q = starts[i];
        if (found(&l, false, &q, NULL))
            kt_worst_near(&worst, q, 0.0, 4.0 * DBL_EPSILON, "from %g", starts[i]);
    }
}

/* Torques within r = 4 eps of the stiffest joint's torque count as none. That torque is `g N^2 / 2` with links of 1 kg
 * and 1 m. Link i is turned by theta_i from straight. It loads its joint with `g (N - i - 1/2) theta_i` more than the
 * next joint. Thus theta_i is the difference of two torques over this factor. A joint's angle is the difference of two
 * links' theta. */
static double straight(int n, int i) {
    const double g = 9.81, r = 4.0 * DBL_EPSILON * g * n * n / 2.0;
    const double own = 2.0 * r / (g * (n - i - 0.5)), before = i ? 2.0 * r / (g * (n - i + 0.5)) : 0.0;
    return own + before;
}

KT_TEST(hanging_chain_straightens_from_anywhere) {
    enum { N = 10 };
    linkage l;
    kt_random random = kt_random_of_test();
    linkage_begin(&l);
    for (int i = 0; i < N; i++)
        linkage_bar(&l, (const char[2]){(char)('a' + i), 0}, i ? l.body_name[i - 1] : NULL, i ? down : none, down, 0.0,
                    0.0);
    linkage_compile(&l);
    KT_WORST worst = kt_worst_make("angle from straight");
    for (int round = 0; round < 5; round++) {
        double q[N];
        for (int i = 0; i < N; i++)
            q[i] = kt_random_uniform(&random, -2.0, 2.0);
        if (!found(&l, false, q, NULL))
            continue;
        for (int i = 0; i < N; i++) /* whole turns between links count for nothing */
            kt_worst_near(&worst, remainder(q[i], 2.0 * pi), 0.0, straight(N, i), "round %d link %d", round, i);
    }
}

/* The search starts nearly horizontal. reduction/cost measures its cost. */
KT_TEST(long_chain_comes_to_hang) {
    enum { N = 96 };
    static linkage l;
    static double q[N];
    const kt_vec3 along = {1.0, 0.0, 0.0};
    linkage_begin(&l);
    for (int i = 0; i < N; i++) {
        char name[8];
        (void)snprintf(name, sizeof name, "b%d", i);
        linkage_bar(&l, name, i ? l.body_name[i - 1] : NULL, i ? along : none, along, i ? 0.0 : 0.35, 0.0);
    }
    linkage_compile(&l);
    KT_WORST worst = kt_worst_make("angle from straight");
    memcpy(q, l.q, sizeof q);
    (void)found(&l, false, q, NULL);
    for (int i = 0; i < N; i++)
        kt_worst_near(&worst, remainder(q[i] + (i ? 0.0 : pi / 2.0), 2.0 * pi), 0.0, straight(N, i), "%d", i);
}

/* Height of a four-bar's centre of mass over its crank's angle, from the geometry of two circles. The ends of coupler
 * and rocker meet on the same side as in four_bar_default. */
static double four_bar_height(const four_bar *f, double crank) {
    const double x = f->crank * cos(crank), y = f->crank * sin(crank);
    const double dx = f->ground - x, dy = -y, d = hypot(dx, dy);
    const double along = (d * d + f->coupler * f->coupler - f->rocker * f->rocker) / (2.0 * d);
    const double aside = sqrt(f->coupler * f->coupler - along * along);
    const double py = y + along * dy / d + aside * dx / d;
    return 0.5 * (f->crank * y + f->coupler * (y + py) + f->rocker * py); /* masses are the lengths */
}

/* Its slope, differenced to the fourth order. */
static double four_bar_slope(const four_bar *f, double crank) {
    const double h = 1e-3;
    return (8.0 * (four_bar_height(f, crank + h) - four_bar_height(f, crank - h)) -
            (four_bar_height(f, crank + 2.0 * h) - four_bar_height(f, crank - 2.0 * h))) /
           (12.0 * h);
}

static double lowest(const four_bar *f, double from, double to) {
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (from + to);
        *(four_bar_slope(f, middle) > 0.0 ? &to : &from) = middle;
    }
    return 0.5 * (from + to);
}

KT_TEST(four_bar_rests_where_its_energy_is_least) {
    const four_bar f = four_bar_default();
    linkage l;
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    if (found(&l, false, l.q, NULL)) {
        const double turned = remainder(l.q[0], 2.0 * pi);
        kt_check_near("crank", turned, lowest(&f, turned - 0.5, turned + 0.4), 2e-12);
        kt_check_above("is a minimum, to the left", four_bar_height(&f, turned - 0.1),
                       four_bar_height(&f, turned) + 1e-4);
        kt_check_above("is a minimum, to the right", four_bar_height(&f, turned + 0.1),
                       four_bar_height(&f, turned) + 1e-4);
    }
}

/* A slider on a spring of 5 N/m sinks by m g / k, many lengths of its own. Its neighbour on a level rail does not move.
 * If a constant force pushes the neighbour, it runs away. */
KT_TEST(spring_stretches_and_neutral_freedoms_stay) {
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "weight", NULL, none, kt_vec3_make(0.1, 0.0, 0.0), -0.2, 0.0)->joint.type = KT_JOINT_PRISMATIC;
    linkage_bar(&l, "cart", NULL, none, kt_vec3_make(0.1, 0.0, 0.0), 0.3, 0.0)->joint.type = KT_JOINT_PRISMATIC;
    l.body[0].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    l.body[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    kt_effect spring = kt_effect_of(KT_EFFECT_SPRING, NULL);
    spring.stiffness = 0.05;
    spring.between[0].at = kt_vec3_make(0.0, 1.0, 0.0);
    spring.between[1].body = "weight";
    spring.length = 0.5;
    l.description.effects = &spring;
    l.description.effect_count = 1;
    linkage_compile(&l);
    kt_error error = {0};
    double q[2] = {l.q[0], l.q[1]}, tau[2] = {0.0, 0.0};
    if (found(&l, false, q, NULL)) {
        kt_check_near("weight", q[0], 1.0 - 0.5 - 0.1 * 9.81 / 0.05, 1e-13);
        kt_check_near("cart", q[1], 0.3, 0.0);
    }
    tau[1] = 1e-3;
    kt_check_equal_int("runs away", find(&l, false, q, tau, NULL, &error), KT_ERROR_STEP);
    kt_check_contains("names the joint", error.where, "cart");
    kt_check_contains("says so", error.message, "accelerates without bound");
}

KT_TEST(driven_loop_has_no_equilibrium) {
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.0, 0.0);
    kt_loop *loop = linkage_close(&l, "drive", KT_LOOP_MOTION, NULL, none, NULL, none);
    loop->joint = "bar";
    loop->function = kt_function_sine(0.3, 1.0, 0.0, 0.0);
    linkage_build(&l, 0.0);
    kt_error error = {0};
    kt_check_equal_int("is rejected", find(&l, false, l.q, NULL, NULL, &error), KT_ERROR_CONSTRAINT);
    kt_check_text("names the loop", error.where, "loop 'drive'");
}
