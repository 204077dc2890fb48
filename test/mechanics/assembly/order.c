/* Projection does not change the order of a method. The tests also show the motion without projection. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- order ------------------------------------------------------------------------------------------------------- */

static const double duration = 0.8;

/* The four-bar, or the tree of the four-bar if its loop is left open. */
static void set_up(linkage *l, bool closed) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    if (!closed)
        l->description.loop_count = 0;
}

/* Positions and velocities at the end; those after the first are of no interest on the way. */
static void finish(bool closed, const char *method, double step, double tolerance, double *y) {
    static linkage l;
    linkage_run r;
    set_up(&l, closed);
    linkage_build(&l, 0.0);
    linkage_run_start(&r, &l, method, step, tolerance, false, 0.0);
    linkage_run_to(&r, duration);
    memcpy(y, l.q, 3 * sizeof *y);
    memcpy(y + 3, l.v, 3 * sizeof *y);
}

static double distance(const double *x, const double *y) {
    double sum = 0.0;
    for (int i = 0; i < 6; i++)
        sum += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(sum);
}

/* The slope of the error over the step, between `steps` and four times as many. */
static double slope(bool closed, const char *method, int steps, const double *exact) {
    double y[6], error[2];
    for (int k = 0; k < 2; k++) {
        finish(closed, method, duration / (k ? 4 * steps : steps), 0.0, y);
        error[k] = distance(y, exact);
    }
    return log(error[0] / error[1]) / log(4.0);
}

/* Every method up to order 5. Steps are such that errors lie between 1e-3 and 1e-10. */
KT_TEST(closed_loop_shows_every_method_s_order) {
    static const int steps[6] = {0, 2000, 800, 400, 600, 40};
    double exact[2][6];
    finish(false, "dop853", 0.0, 1e-14, exact[0]);
    finish(true, "dop853", 0.0, 1e-14, exact[1]);
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *m = kt_method_at(i);
        if (m->order > 5)
            continue;
        char what[40];
        const double tree = slope(false, m->name, steps[m->order], exact[0]);
        const double loop = slope(true, m->name, steps[m->order], exact[1]);
        snprintf(what, sizeof what, "%s, on a tree", m->name);
        kt_check_above(what, tree, m->order - 0.15); /* of order 5, the leading term is small on this tree */
        snprintf(what, sizeof what, "%s, on a closed loop", m->name);
        kt_check_near(what, loop, m->order, m->order < 5 ? 0.1 : 0.35);
    }
}

/* ---- drift ------------------------------------------------------------------------------------------------------- */

/* The four-bar without gravity: its crank turns round and round, and the motion has a period. Every slope that a method
 * receives has phi'' = 0, so only the method's own errors reach phi'. These errors are the same in each period, so phi'
 * has n of them after n periods. The angle phi collects the errors of phi', which are n (n - 1) / 2 times one error
 * times the period. It also collects n times its own error. */
static void turning(linkage *l) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    l->description.gravity = kt_vec3_make(0.0, 0.0, 0.0);
}

/* The crank's period, from a fine solution. */
static double find_period(void) {
    static linkage l;
    linkage_run r;
    const double turn = 2.0 * 3.14159265358979324;
    double period = 0.0;
    turning(&l);
    linkage_build(&l, 0.0);
    linkage_run_start(&r, &l, "dop853", 0.0, 1e-13, false, 0.0);
    const double from = l.q[0];
    while (l.q[0] < from + turn - 1e-6) {
        period += fmin(0.01, 0.5 * (from + turn - l.q[0]) / l.v[0]);
        linkage_run_to(&r, period);
    }
    period += (from + turn - l.q[0]) / l.v[0];
    return period;
}

/* phi and phi' along x and y (in the first end's frame) after some time, and the largest term of phi'. */
static void drift(const char *method, double step, bool loose, double time, double phi[2], double rate[3]) {
    static linkage l;
    linkage_run r;
    double a[15], residual[5], partial[5];
    kt_error e = {0};
    turning(&l);
    linkage_build(&l, 0.0);
    linkage_run_start(&r, &l, method, step, 0.0, loose, 0.0);
    linkage_run_to(&r, time);
    kt_need_fine("equations", kt_loop_equations(l.model, l.data, time, l.q, l.v, a, residual, partial, NULL, &e), &e);
    for (int k = 0; k < 2; k++) {
        phi[k] = residual[k];
        rate[k] = a[k] * l.v[0] + a[5 + k] * l.v[1] + a[10 + k] * l.v[2];
        for (int i = 0; i < 3; i++)
            rate[2] = fmax(k || i ? rate[2] : 0.0, fabs(a[5 * i + k] * l.v[i]));
    }
}

static double along(const double x[2], const double y[2]) { return (x[0] * y[0] + x[1] * y[1]) / hypot(y[0], y[1]); }

KT_TEST(loop_drifts_as_theory_says_without_projection) {
    static const struct {
        const char *method;
        double step, least; /* least: half of the drift that was measured, m */
    } cases[] = {{"kutta3", 5e-3, 2e-8}, {"rk4", 2e-2, 1e-5}, {"dopri5", 4e-2, 3e-7}};
    const double period = find_period();
    kt_check_above("period", period, 1.0);
    for (int i = 0; i < 3; i++) {
        const int order = kt_method_find(cases[i].method)->order;
        double phi[4][2], rate[4][3], finer[2], finer_rate[3];

        kt_note("%s", cases[i].method);
        for (int k = 0; k < 4; k++)
            drift(cases[i].method, cases[i].step, true, period * (1 << k), phi[k], rate[k]);
        drift(cases[i].method, 0.5 * cases[i].step, true, period * 4.0, finer, finer_rate);
        double bend[2][2]; /* phi(2 n) - 2 phi(n) = n^2 times the error of phi' in a period */
        for (int k = 0; k < 4; k++)
            bend[k / 2][k % 2] = phi[2 + k / 2][k % 2] - 2.0 * phi[1 + k / 2][k % 2];
        kt_check_near("phi' after 8 periods and after 4", along(rate[3], rate[2]) / hypot(rate[2][0], rate[2][1]), 2.0,
                      0.01);
        kt_check_near("phi's n^2 after 8 periods and after 4", along(bend[1], bend[0]) / hypot(bend[0][0], bend[0][1]),
                      4.0, 0.02);
        kt_check_above("order of phi'", log2(along(rate[2], finer_rate) / hypot(finer_rate[0], finer_rate[1])),
                       order - 0.1);
        kt_check_above("phi after 8 periods", hypot(phi[3][0], phi[3][1]), cases[i].least);
    }
}

KT_TEST(loop_stays_closed_with_projection) {
    static const char *const methods[] = {"euler", "heun", "rk4", "dopri5"};
    for (int i = 0; i < 4; i++) {
        double phi[2], rate[3];
        drift(methods[i], i ? 2e-2 : 1e-3, false, 20.0, phi, rate);
        kt_check_below(methods[i], hypot(phi[0], phi[1]), 4e-15);
        kt_check_below("phi'", hypot(rate[0], rate[1]), 10.0 * DBL_EPSILON * rate[2]); /* where project.c stops */
    }
}
