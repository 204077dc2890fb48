/* Random gear trains with ratios of 1 to 1e6 a stage: degrees of freedom, motion and multipliers in closed form.
 *
 * Wheels form a tree of couplings, wheel i: s (q_p - R q_i) = 0 with its parent p. All angles are then multiples of
 * one, q_i = g_i x. Let I_i be the inertias and tau_i the torques. A free train accelerates at
 *     x'' = sum g_i tau_i / sum g_i^2 I_i,
 * and a locked one rests. The multiplier of a coupling balances all wheels beyond it: s R l is there the sum of
 * (tau - I a) g / g_i there. More couplings between wheels are redundant if they have the train's ratio, and lock the
 * train if they have another. The units of g are those of the fastest wheel, so that powers are comparable.
 *
 * Groups whose units differ by less than 4096 are not scaled (compile/group_units.c): bounds are that many
 * roundings. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/simulation.h"
#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

enum { WHEELS = 16, EXTRA = 3, TERMS = 2 * (WHEELS + EXTRA) };

typedef enum train_end { FREE, LOCKED, CONTRADICTS, ENDS } train_end;
static const char *const end_names[ENDS] = {"free", "locked", "contradicts"};

typedef struct train {
    linkage l;
    int wheels, parent[WHEELS], lock;
    int place[WHEELS];                 /* among the loops: that of a wheel's coupling with its parent */
    double row[WHEELS], ratio[WHEELS]; /* s and R of a wheel with its parent */
    double rate[WHEELS];               /* g */
    double inertia[WHEELS], torque[WHEELS];
    kt_term term[TERMS];
    int terms;
} train;

static kt_random *random_of_train;

static double power_of_ten(double low, double high) { return pow(10.0, kt_random_uniform(random_of_train, low, high)); }

static void couple(train *x, const char *name, int first, double by_first, int second, double by_second) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    kt_loop *loop = linkage_close(&x->l, name, KT_LOOP_COUPLING, NULL, none, NULL, none);
    kt_term *term = x->term + x->terms;
    x->terms += 2;
    term[0] = (kt_term){.joint = x->l.body[first].name, .coefficient = by_first};
    term[1] = (kt_term){.joint = x->l.body[second].name, .coefficient = by_second};
    loop->terms = term;
    loop->term_count = 2;
}

static void add_wheel(train *x, int i) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    char name[16];
    (void)snprintf(name, sizeof name, "g%d", i);
    kt_body *body = linkage_bar(&x->l, name, NULL, kt_vec3_make(i, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    body->mass = 1.0;
    body->com = none;
    x->inertia[i] = power_of_ten(-3.0, 0.0);
    x->torque[i] = kt_random_normal(random_of_train);
    body->inertia = kt_sym3_make(x->inertia[i], x->inertia[i], x->inertia[i], 0.0, 0.0, 0.0);
    if (i == 0)
        return;
    const int p = x->parent[i] =
        kt_random_int(random_of_train, 0, 1) ? i - 1 : kt_random_int(random_of_train, 0, i - 1);
    const double size = power_of_ten(0.0, 6.0), sign = kt_random_int(random_of_train, 0, 1) ? 1.0 : -1.0;
    x->ratio[i] = sign * (kt_random_int(random_of_train, 0, 3) ? size : 1.0 / size);
    x->row[i] = power_of_ten(-1.0, 1.0);
    x->rate[i] = x->rate[p] / x->ratio[i];
    x->place[i] = x->l.description.loop_count;
    if (kt_random_int(random_of_train, 0, 1))
        couple(x, name, p, x->row[i], i, -x->row[i] * x->ratio[i]);
    else
        couple(x, name, i, -x->row[i] * x->ratio[i], p, x->row[i]);
}

/* Between two wheels of comparable speed: a ratio beyond 1e6 is not made. */
static void add_extra(train *x, int k, double off) {
    char name[16];
    (void)snprintf(name, sizeof name, "extra%d", k);
    for (int tries = 0; tries < 200; tries++) {
        const int i = kt_random_int(random_of_train, 0, x->wheels - 1),
                  j = kt_random_int(random_of_train, 0, x->wheels - 1);
        if (i == j || fabs(log10(fabs(x->rate[i] / x->rate[j]))) > 6.0)
            continue;
        couple(x, name, i, 1.0, j, -x->rate[i] / x->rate[j] * off);
        return;
    }
    couple(x, name, 1, x->row[1], x->parent[1], -x->row[1] * x->rate[1] / x->rate[x->parent[1]] * off);
}

/* Couplings in any order unite sets of several wheels. */
static void shuffle_couplings(train *x) {
    for (int i = x->wheels - 1; i > 1; i--) {
        const int k = kt_random_int(random_of_train, 1, i), at = x->place[i], to = x->place[k];
        const kt_loop loop = x->l.loop[at];
        x->l.loop[at] = x->l.loop[to];
        x->l.loop[to] = loop;
        x->place[i] = to;
        x->place[k] = at;
    }
}

static void make_train(train *x, train_end end, int extra, kt_reduction reduction) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    double most = 0.0;
    linkage_begin(&x->l);
    x->l.options.reduction = kt_reduction_method_of(reduction);
    x->terms = 0;
    x->rate[0] = 1.0;
    x->wheels = kt_random_int(random_of_train, 2, WHEELS - 1);
    for (int i = 0; i < x->wheels; i++)
        add_wheel(x, i);
    shuffle_couplings(x);
    for (int i = 0; i < x->wheels; i++)
        most = fmax(most, fabs(x->rate[i]));
    for (int i = 0; i < x->wheels; i++)
        x->rate[i] /= most;
    for (int k = 0; k < extra; k++)
        add_extra(x, k, end == CONTRADICTS && k == 0 ? 1.25 : 1.0);
    x->lock = kt_random_int(random_of_train, 0, x->wheels - 1);
    if (end == LOCKED) {
        kt_loop *lock = linkage_close(&x->l, "lock", KT_LOOP_MOTION, NULL, none, NULL, none);
        lock->joint = x->l.body[x->lock].name;
        lock->function = kt_function_constant(0.0);
    }
    linkage_build(&x->l, 0.0);
}

/* The power, for x' = 1, to which the rounding of torques is relative. */
static double power_of(const train *x, const double *a) {
    double sum = 0.0;
    for (int i = 0; i < x->wheels; i++)
        sum += fabs(x->rate[i]) * (fabs(x->torque[i]) + fabs(x->inertia[i] * a[i]));
    return sum;
}

static double inertia_of(const train *x) {
    double sum = 0.0;
    for (int i = 0; i < x->wheels; i++)
        sum += x->rate[i] * x->rate[i] * x->inertia[i];
    return sum;
}

static double acceleration_of(const train *x, train_end end) {
    double power = 0.0;
    for (int i = 0; i < x->wheels; i++)
        power += x->rate[i] * x->torque[i];
    return end == FREE ? power / inertia_of(x) : 0.0;
}

/* Couplings alone, and at most a lock: each multiplier follows from the wheels on the side without the lock. */
static void check_multipliers(const train *x, train_end end, const double *a, const double *lambda, kt_worst *worst,
                              int n) {
    double beyond[WHEELS] = {0.0}, all = 0.0; /* power of the torques of a wheel and those beyond it */
    bool has_lock[WHEELS] = {false};
    for (int i = x->wheels - 1; i >= 0; i--) {
        beyond[i] += x->rate[i] * (x->torque[i] - x->inertia[i] * a[i]);
        has_lock[i] |= end == LOCKED && i == x->lock;
        if (i > 0) {
            beyond[x->parent[i]] += beyond[i];
            has_lock[x->parent[i]] |= has_lock[i];
        }
    }
    all = beyond[0];
    for (int i = 1; i < x->wheels; i++) {
        const double power = has_lock[i] ? beyond[i] - all : beyond[i];
        kt_worst_near(worst, lambda[x->place[i]] * x->row[i] * x->ratio[i] * x->rate[i], power,
                      4096.0 * DBL_EPSILON * power_of(x, a), "train %d, coupling %d", n, i);
    }
    if (end == LOCKED)
        kt_worst_near(worst, lambda[x->wheels - 1] * x->rate[x->lock], -all, 4096.0 * DBL_EPSILON * power_of(x, a),
                      "train %d, lock", n);
}

static void check_trains(kt_reduction reduction, int count) {
    static train x;
    kt_random random = kt_random_of_test();
    random_of_train = &random;
    KT_WORST accelerations = kt_worst_make("accelerations"), multipliers = kt_worst_make("multipliers");
    KT_WORST freedoms = kt_worst_make("degrees of freedom");
    for (int n = 0; n < count; n++) {
        const train_end end = (train_end)kt_random_int(&random, 0, ENDS - 1);
        const int extra = end == CONTRADICTS ? 1 : kt_random_int(&random, 0, 1) * kt_random_int(&random, 0, EXTRA);
        double a[LINKAGE_NQ], lambda[LINKAGE_LOOPS];
        kt_error e = {0};
        make_train(&x, end, extra, reduction);
        const int dofs = kt_model_mobility(x.l.model).minimal;
        kt_worst_near(&freedoms, dofs, end == FREE ? 1.0 : 0.0, 0.5, "train %d, %s", n, end_names[end]);
        if (!kt_fine("acceleration",
                     kt_acceleration_evaluate(x.l.model, x.l.data, 0.0, x.l.q, x.l.v, x.torque, NULL, a, &e), &e) ||
            !kt_fine("multipliers",
                     kt_multiplier_evaluate(x.l.model, x.l.data, 0.0, x.l.q, x.l.v, x.torque, NULL, lambda, &e), &e))
            continue;
        const double due = acceleration_of(&x, end), size = power_of(&x, a) / inertia_of(&x);
        for (int i = 0; i < x.wheels; i++)
            kt_worst_near(&accelerations, a[i] / x.rate[i], due, 4096.0 * DBL_EPSILON * size, "train %d, %s, wheel %d",
                          n, end_names[end], i);
        if (extra == 0)
            check_multipliers(&x, end, a, lambda, &multipliers, n);
    }
}

KT_TEST(gear_trains_with_large_ratios_move_and_rest_as_in_closed_form) {
    check_trains(KT_REDUCTION_QR, KT_SHORT(100, 2000));
}
KT_TEST(gear_trains_by_svd) { check_trains(KT_REDUCTION_SVD, KT_SHORT(20, 300)); }
KT_TEST(gear_trains_by_partition) { check_trains(KT_REDUCTION_PARTITION, KT_SHORT(20, 300)); }

/* Two turns of the fastest wheel in a second. A contradiction would be judged at velocities of 1e-20. */
KT_TEST(gear_trains_with_large_ratios_run) {
    static train x;
    kt_random random = kt_random_of_test();
    random_of_train = &random;
    KT_WORST angles = kt_worst_make("angles");
    for (int n = 0; n < KT_SHORT(10, 100); n++) {
        const train_end end = (train_end)kt_random_int(&random, 0, ENDS - 1);
        kt_run run = kt_run_default();
        kt_simulation *s = NULL;
        kt_error e = {0};
        make_train(&x, end, end == CONTRADICTS, KT_REDUCTION_QR);
        const double due = acceleration_of(&x, end), t = due == 0.0 ? 1.0 : sqrt(2.0 / fabs(due));
        kt_need_fine("simulation", kt_simulation_create(x.l.model, &run, NULL, &s, &e), &e);
        if (kt_fine("torques", kt_simulation_set_torque(s, x.torque, &e), &e) &&
            kt_fine(end_names[end], kt_simulation_advance(s, t, &e), &e))
            for (int i = 0; i < x.wheels; i++)
                kt_worst_near(&angles, kt_simulation_positions(s)[i] / x.rate[i], due * t * t / 2.0, 1e-9,
                              "train %d, wheel %d", n, i);
        kt_simulation_free(s);
    }
}

/* A differential joins three wheels: q0 = 1e6 (q1 + q2). Two degrees of freedom, of which each drives its own wheel:
 * with inertias I and torques t, I0 a0 = t0 - l, I1 a1 = t1 + 1e6 l, I2 a2 = t2 + 1e6 l. */
KT_TEST(differential_with_a_large_ratio_has_two_degrees_of_freedom) {
    static const double ratio = 1e6, inertia[3] = {0.01, 0.02, 0.03}, torque[3] = {1.0, 0.3, -0.2};
    static linkage l;
    const kt_vec3 none = {0.0, 0.0, 0.0};
    kt_term term[3] = {{"w0", 1.0}, {"w1", -1e6}, {"w2", -1e6}};
    double a[3], l_due = 0.0;
    kt_error e = {0};
    linkage_begin(&l);
    for (int i = 0; i < 3; i++) {
        kt_body *body =
            linkage_bar(&l, term[i].joint, NULL, kt_vec3_make(i, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
        body->mass = 1.0;
        body->com = none;
        body->inertia = kt_sym3_make(inertia[i], inertia[i], inertia[i], 0.0, 0.0, 0.0);
    }
    kt_loop *loop = linkage_close(&l, "differential", KT_LOOP_COUPLING, NULL, none, NULL, none);
    loop->terms = term;
    loop->term_count = 3;
    linkage_build(&l, 0.0);
    kt_check_equal_int("degrees of freedom", kt_model_mobility(l.model).minimal, 2);
    kt_need_fine("acceleration", kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, l.v, torque, NULL, a, &e), &e);
    /* (t0 - l) / I0 = R (t1 + R l) / I1 + R (t2 + R l) / I2 */
    l_due = (torque[0] / inertia[0] - ratio * (torque[1] / inertia[1] + torque[2] / inertia[2])) /
            (1.0 / inertia[0] + ratio * ratio * (1.0 / inertia[1] + 1.0 / inertia[2]));
    kt_check_near("first wheel", a[1], (torque[1] + ratio * l_due) / inertia[1], 1e-12 * torque[1] / inertia[1]);
    kt_check_near("second wheel", a[2], (torque[2] + ratio * l_due) / inertia[2], 1e-12 * torque[1] / inertia[1]);
    kt_check_near("fast wheel", a[0], (torque[0] - l_due) / inertia[0], 1e-9 * torque[0] / inertia[0]);
}
