/* Random closed mechanisms, in space and in planes, reduced by dense matrices and by fronts. Independent coordinates,
 * the forces of actuators and operational-space inertia are tested. They are compared with the equations of motion in
 * long double (constraint/tangle.h) and with forward dynamics. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "kinetree/control.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EPS DBL_EPSILON
enum { MECHANISMS = 60, TASK = 3 };

typedef struct subject {
    tangle g;
    tangle_system s;
    double error;                /* eps times how ill-conditioned the loops are there */
    int list[KT_TREE_NV], count; /* independent coordinates */
    void *work;
    size_t size;
} subject;

/* Independent coordinates: those in which elimination with full pivoting of A finds no pivot. */
static void choose(subject *u) {
    static double a[TANGLE_ROWS * KT_TREE_NV];
    const int nv = u->g.tree.nv, rows = u->g.rows;
    bool used_row[TANGLE_ROWS] = {false}, used[KT_TREE_NV] = {false};
    memcpy(a, u->s.jacobian, sizeof a);
    for (;;) {
        int p = 0, q = 0;
        double most = 1e-9;
        for (int c = 0; c < nv; c++)
            for (int r = 0; r < rows; r++)
                if (!used[c] && !used_row[r] && fabs(a[c * rows + r]) > most)
                    most = fabs(a[c * rows + r]), p = r, q = c;
        if (most <= 1e-9)
            break;
        used[q] = used_row[p] = true;
        for (int r = 0; r < rows; r++)
            for (int c = 0; c < nv && r != p; c++)
                if (c != q)
                    a[c * rows + r] -= a[c * rows + p] * a[q * rows + r] / a[q * rows + p];
        for (int r = 0; r < rows; r++)
            a[q * rows + r] = r == p ? a[q * rows + r] : 0.0;
    }
    u->count = 0;
    for (int c = 0; c < nv; c++)
        if (!used[c])
            u->list[u->count++] = c;
}

/* false: not to be used, near a singular position. */
static bool draw(subject *u, int n, kt_random *random) {
    tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
    double a[KT_TREE_NV];
    kt_error e = {0};
    plan.options.structure = n % 4 < 2 ? KT_STRUCTURE_DENSE : KT_STRUCTURE_FRONTS;
    u->work = NULL;
    tangle_grow(&u->g, &plan, random);
    tangle_system_of(&u->g, &u->s);
    if (!kt_fine("acceleration",
                 kt_acceleration_evaluate(u->g.tree.model, u->g.tree.data, u->g.t, u->g.q, u->g.v, u->g.tau,
                                          u->g.external, a, &e),
                 &e) ||
        tangle_was_near_singular(u->g.tree.model, u->g.tree.data))
        return false;
    const double reach = tangle_reach(&u->g, false);
    if (!(reach < 1e3))
        return false;
    u->error = EPS * reach * reach;
    choose(u);
    u->size = kt_actuation_work_size(u->g.tree.model);
    u->work = aligned_alloc(KT_ALIGNMENT, (u->size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    if (u->work)
        memset(u->work, 0xff, u->size); /* NaN: previous contents must not matter */
    return u->work != NULL;
}

static void release(subject *u) { free(u->work); }

/* Calls one check for each mechanism that can be used. */
typedef void check(subject *u, kt_random *random, kt_worst *worst, int n);

static void for_all(const char *what, check *one) {
    static subject u;
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make(what);
    int taken = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        if (draw(&u, n, &random)) {
            taken++;
            one(&u, &random, &worst, n);
        }
        release(&u);
    }
    kt_check_above("mechanisms", taken, MECHANISMS * 3 / 4);
}

/* A x - b of all equations against the largest term of them. */
static double violation(const subject *u, const double *x, const double *b) {
    const int nv = u->g.tree.nv;
    double most = 0.0, size = 1.0;
    for (int r = 0; r < u->g.rows; r++) {
        double sum = b ? -b[r] : 0.0;
        size = fmax(size, fabs(sum));
        for (int i = 0; i < nv; i++) {
            sum += u->s.jacobian[i * u->g.rows + r] * x[i];
            size = fmax(size, fabs(u->s.jacobian[i * u->g.rows + r] * x[i]));
        }
        most = isnan(sum) ? (double)NAN : fmax(most, fabs(sum));
    }
    return most / size;
}

/* Bounds of this file: measured over 20 seeds, the worst of which is about half of the bound. */
static void basis_of(subject *u, kt_random *random, kt_worst *worst, int n) {
    static double basis[KT_TREE_NV * KT_TREE_NV];
    const int nv = u->g.tree.nv;
    kt_error e = {0};
    (void)random;
    kt_need_fine("basis",
                 kt_independent_basis(u->g.tree.model, u->g.tree.data, u->work, u->size, u->g.t, u->g.q,
                                      (kt_coordinate_list){u->list, u->count}, basis, NULL, &e),
                 &e);
    for (int c = 0; c < u->count; c++) {
        kt_worst_below(worst, violation(u, basis + c * nv, NULL), 50.0 * u->error, "mechanism %d column %d", n, c);
        for (int i = 0; i < u->count; i++)
            kt_worst_near(worst, basis[c * nv + u->list[i]], i == c ? 1.0 : 0.0, 1e-300, "mechanism %d unit %d %d", n,
                          i, c);
    }
}

KT_TEST(columns_of_an_independent_basis_keep_loops_closed) { for_all("A B", basis_of); }

static void complete(subject *u, kt_random *random, kt_worst *worst, int n) {
    const kt_coordinate_list list = {u->list, u->count};
    double v[KT_TREE_NV], a[KT_TREE_NV], given[KT_TREE_NV], rate[TANGLE_ROWS];
    kt_error e = {0};
    for (int i = 0; i < u->g.tree.nv; i++)
        v[i] = a[i] = given[i] = kt_random_uniform(random, -1.0, 1.0);
    kt_need_fine("equations",
                 kt_loop_equations(u->g.tree.model, u->g.tree.data, u->g.t, u->g.q, NULL, NULL, NULL, rate, NULL, &e),
                 &e);
    kt_need_fine("velocities",
                 kt_velocity_complete(u->g.tree.model, u->g.tree.data, u->work, u->size, u->g.t, u->g.q, list, v, &e),
                 &e);
    kt_need_fine("accelerations",
                 kt_acceleration_complete(u->g.tree.model, u->g.tree.data, u->work, u->size, u->g.t, u->g.q, u->g.v,
                                          list, a, &e),
                 &e);
    kt_worst_below(worst, violation(u, v, rate), 50.0 * u->error, "mechanism %d velocities", n);
    kt_worst_below(worst, violation(u, a, u->s.drift), 50.0 * u->error, "mechanism %d accelerations", n);
    for (int i = 0; i < u->count; i++)
        kt_check_equal_bits("given", &v[u->list[i]], &given[u->list[i]], 1);
}

KT_TEST(completed_velocities_and_accelerations_satisfy_the_loops) { for_all("A v - b', A a - b''", complete); }

/* Forward dynamics with the forces against the accelerations. */
static void compare_motion(subject *u, kt_coordinate_list list, const double *forces, const double *a, double part,
                           kt_worst *worst, int n) {
    const int nv = u->g.tree.nv;
    static double load[KT_TREE_NV], moved[KT_TREE_NV], unused[KT_TREE_NV];
    double tau[KT_TREE_NV] = {0.0}, again[KT_TREE_NV];
    kt_error e = {0};
    for (int i = 0; i < list.count; i++)
        tau[list.index[i]] = forces[i];
    kt_need_fine("forward",
                 kt_acceleration_evaluate(u->g.tree.model, u->g.tree.data, u->g.t, u->g.q, u->g.v, tau, u->g.external,
                                          again, &e),
                 &e);
    memcpy(load, u->s.force, sizeof load); /* with u->g.tau: replaced by these */
    for (int i = 0; i < nv; i++)
        u->s.force[i] += tau[i] - u->g.tau[i];
    (void)tangle_solve(&u->g, &u->s, (tangle_way){.mixes = true, .by = a}, unused, moved);
    for (int i = 0; i < nv; i++)
        kt_worst_near(worst, again[i], a[i], part * moved[i], "mechanism %d coordinate %d of %d", n, i, nv);
    memcpy(u->s.force, load, sizeof load);
}

static bool accelerations_of(subject *u, kt_random *random, double *a) {
    kt_error e = {0};
    for (int i = 0; i < u->g.tree.nv; i++)
        a[i] = kt_random_uniform(random, -1.0, 1.0);
    return kt_fine("accelerations",
                   kt_acceleration_complete(u->g.tree.model, u->g.tree.data, u->work, u->size, u->g.t, u->g.q, u->g.v,
                                            (kt_coordinate_list){u->list, u->count}, a, &e),
                   &e);
}

static bool actuate(subject *u, const double *a, kt_coordinate_list list, const double *weights, double *forces) {
    kt_error e = {0};
    return kt_fine("actuation",
                   kt_actuation_evaluate(u->g.tree.model, u->g.tree.data, u->work, u->size, u->g.t, u->g.q, u->g.v, a,
                                         u->g.external, list, weights, forces, NULL, &e),
                   &e);
}

static void actuate_exactly(subject *u, kt_random *random, kt_worst *worst, int n) {
    const kt_coordinate_list list = {u->list, u->count};
    double a[KT_TREE_NV], forces[KT_TREE_NV];
    if (accelerations_of(u, random, a) && actuate(u, a, list, NULL, forces))
        compare_motion(u, list, forces, a, 5.0, worst, n);
}

KT_TEST(as_many_actuators_as_freedoms_cause_the_accelerations) { for_all("a by forward dynamics", actuate_exactly); }

/* All coordinates driven: the sum of w f^2 is least where W f is a motion that the loops allow. */
static void actuate_all(subject *u, kt_random *random, kt_worst *worst, int n) {
    const int nv = u->g.tree.nv;
    int all[KT_TREE_NV];
    double a[KT_TREE_NV], forces[KT_TREE_NV], weights[KT_TREE_NV];
    for (int i = 0; i < nv; i++) {
        all[i] = i;
        weights[i] = kt_random_uniform(random, 0.3, 3.0);
    }
    if (!accelerations_of(u, random, a) || !actuate(u, a, (kt_coordinate_list){all, nv}, weights, forces))
        return;
    compare_motion(u, (kt_coordinate_list){all, nv}, forces, a, 60.0, worst, n);
    for (int i = 0; i < nv; i++)
        forces[i] *= weights[i];
    kt_worst_below(worst, violation(u, forces, NULL), 50.0 * u->error, "mechanism %d least", n);
}

KT_TEST(more_actuators_than_freedoms_share_the_least_weighted_forces) {
    for_all("a by forward dynamics, and A W f", actuate_all);
}

/* Accelerations that unit forces cause, in long double, without drift. With a Jacobian, also the inertia of a task. */
static void feel(subject *u, kt_random *random, kt_worst *worst, int n) {
    static double x[KT_TREE_NV], moved[KT_TREE_NV], y[KT_TREE_NV], jacobian[TASK * KT_TREE_NV];
    static double consistent[TASK * KT_TREE_NV];
    const int nv = u->g.tree.nv;
    double inertia[TASK * TASK];
    kt_error e = {0};
    kt_mass_inverse *inverse = kt_test_mass_inverse(u->g.tree.model, TASK);
    kt_need_fine("terms", kt_mass_inverse_compute(inverse, u->g.tree.data, u->g.t, u->g.q, &e), &e);
    kt_residual elsewhere; /* the contents of the data meanwhile must not matter */
    (void)kt_fine("residual",
                  kt_loop_residual(u->g.tree.model, u->g.tree.data, u->g.t + 1.0, u->g.q, u->g.v, &elsewhere, &e), &e);
    for (int i = 0; i < nv; i++)
        u->s.force[i] = y[i] = kt_random_uniform(random, -1.0, 1.0);
    memset(u->s.drift, 0, sizeof u->s.drift);
    (void)tangle_solve(&u->g, &u->s, (tangle_way){.mixes = true}, x, moved);
    (void)kt_fine("applies", kt_mass_inverse_apply(inverse, 1, y, &e), &e);
    for (int i = 0; i < nv; i++)
        kt_worst_near(worst, y[i], x[i], 5.0 * moved[i], "mechanism %d coordinate %d", n, i);
    for (int i = 0; i < TASK * nv; i++)
        jacobian[i] = kt_random_uniform(random, -1.0, 1.0);
    const kt_status status = kt_operational_inertia(inverse, TASK, jacobian, inertia, consistent, NULL, &e);
    kt_check_equal_int("as many rows as freedoms", status, u->count < TASK ? KT_ERROR_SINGULAR : KT_OK);
    for (int c = 0; c < TASK && status == KT_OK; c++) {
        /* the force on the task that accelerates it by one moves the mechanism by the consistent inverse */
        memset(u->s.force, 0, sizeof u->s.force);
        for (int i = 0; i < nv; i++)
            for (int r = 0; r < TASK; r++)
                u->s.force[i] += jacobian[TASK * i + r] * inertia[TASK * c + r];
        (void)tangle_solve(&u->g, &u->s, (tangle_way){.mixes = true}, x, moved);
        for (int i = 0; i < nv; i++)
            kt_worst_near(worst, consistent[c * nv + i], x[i], 5.0 * moved[i], "mechanism %d task %d coordinate %d", n,
                          c, i);
        for (int r = 0; r < TASK; r++) {
            double sum = 0.0, size = 0.0;
            for (int i = 0; i < nv; i++) {
                sum += jacobian[TASK * i + r] * x[i];
                size += fabs(jacobian[TASK * i + r] * moved[i]);
            }
            kt_worst_near(worst, sum, r == c ? 1.0 : 0.0, 5.0 * size, "mechanism %d task %d %d", n, r, c);
        }
    }
}

KT_TEST(operational_inertia_respects_the_loops) { for_all("accelerations", feel); }
