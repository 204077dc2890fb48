/* Dense output beside kinks of the right-hand side, against a closed form. A mass falls onto a spring that acts on one
 * side,
 *
 *     x'' = -g                       x > 0
 *     x'' = -g + p - k x             x < 0
 *
 * with p = 0 (an elastic stop) or a preload, for which the force jumps. In a third problem, the force jumps at a time.
 * An adaptive step ends where its error estimate passes. The estimate of some methods does not contain the slope at the
 * end of the step. If the step ends just beyond a kink, this slope has the force beyond, which the step does not have.
 *
 * The closed form starts from the integrator's own state at the beginning of each step. Hence the test compares errors
 * within one step, inside and at its end, and no error accumulates. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <math.h>
#include <string.h>

static const double g = 9.81;

typedef struct kinked {
    double stiffness, preload; /* of the one-sided spring */
    double instant, push;      /* a force that jumps at this time */
} kinked;

static int kinked_slope(double t, const double *y, double *dydt, void *user) {
    const kinked *p = user;
    dydt[0] = y[1];
    dydt[1] = -g + (y[0] < 0.0 ? p->preload - p->stiffness * y[0] : 0.0) + (t > p->instant ? p->push : 0.0);
    return 0;
}

/* Moves the state over h with constant equations: those of the spring if `inside`. */
static void move_smoothly(const kinked *p, bool inside, double force, double h, double *y) {
    const double x = y[0], v = y[1];
    if (!inside) {
        y[0] = x + v * h + 0.5 * force * h * h;
        y[1] = v + force * h;
        return;
    }
    const double w = sqrt(p->stiffness), rest = (force + p->preload) / p->stiffness, c = cos(w * h), s = sin(w * h);
    y[0] = rest + (x - rest) * c + v / w * s;
    y[1] = -(x - rest) * w * s + v * c;
}

/* Whether the mass crosses x = 0 within h, and when. The states of the test cross at most once within an interval that
 * is short against the period; *y is not on the crossing itself. */
static bool crosses(const kinked *p, bool inside, double force, double h, const double *y, double *when) {
    double a = 0.0, b = h, z[2];
    memcpy(z, y, sizeof z);
    move_smoothly(p, inside, force, h, z);
    if ((z[0] < 0.0) == inside)
        return false;
    for (int i = 0; i < 200; i++) {
        const double middle = 0.5 * (a + b);
        memcpy(z, y, sizeof z);
        move_smoothly(p, inside, force, middle, z);
        *((z[0] < 0.0) == inside ? &a : &b) = middle;
    }
    *when = b;
    return true;
}

/* The solution from the state y at t over h. */
static void move(const kinked *p, double t, double h, double *y) {
    const double most = 0.05 / sqrt(p->stiffness > 1.0 ? p->stiffness : 1.0), end = t + h;
    while (t < end) {
        double piece = fmin(most, end - t), when;
        if (t < p->instant && t + piece > p->instant)
            piece = p->instant - t;
        const double force = -g + (t >= p->instant ? p->push : 0.0);
        const bool inside = y[0] < 0.0 || (y[0] == 0.0 && y[1] < 0.0);
        const bool leaves = crosses(p, inside, force, piece, y, &when);
        move_smoothly(p, inside, force, leaves ? when : piece, y);
        if (leaves)
            y[0] = inside ? fmax(y[0], 0.0) : fmin(y[0], -0.0);
        t = end - t <= (leaves ? when : piece) ? end : t + (leaves ? when : piece);
    }
}

/* The largest errors of all steps, with velocities in units of the spring's frequency. */
typedef struct errors {
    double inside; /* over the error at the end or the tolerance, whichever is larger */
    double end;    /* over the tolerance */
} errors;

static errors measure_steps(const kt_method *method, const kinked *p, const double *start, double tolerance) {
    kt_integrator_options options = kt_integrator_options_default();
    kt_integrator_callbacks callbacks = {kinked_slope, NULL, (void *)(size_t)p};
    const double w = fmax(sqrt(p->stiffness), 1.0);
    errors worst = {0.0, 0.0};
    kt_error error;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    kt_integrator *it = integrator_make(method, 2, options);
    kt_fine("start", kt_integrator_start(it, 0.0, start, &callbacks, &error), &error);
    while (kt_integrator_time(it) < 2.0 && integrator_step(it, 2.0)) {
        const double t0 = kt_integrator_previous_time(it), h = kt_integrator_time(it) - t0;
        double inside = 0.0, end = 0.0;
        for (int i = 1; i <= 8; i++) {
            double exact[2], value[2];
            memcpy(exact, kt_integrator_previous_state(it), sizeof exact);
            move(p, t0, 0.125 * i * h, exact);
            integrator_value(it, i < 8 ? t0 + 0.125 * i * h : kt_integrator_time(it), value);
            const double error_here = fmax(fabs(value[0] - exact[0]), fabs(value[1] - exact[1]) / w);
            if (i < 8)
                inside = fmax(inside, error_here);
            else
                end = error_here;
        }
        worst.end = fmax(worst.end, end / tolerance);
        worst.inside = fmax(worst.inside, inside / fmax(end, tolerance));
    }
    return worst;
}

/* A random problem: an elastic stop, a stop with a preload, or a force that jumps at a time. */
static kinked draw_kinked(kt_random *random, int kind) {
    kinked p = {.instant = HUGE_VAL};
    if (kind < 2)
        p.stiffness = pow(10.0, kt_random_uniform(random, 2.0, 5.0));
    if (kind == 1)
        p.preload = g + kt_random_uniform(random, 0.0, 5.0);
    if (kind == 2) {
        p.instant = kt_random_uniform(random, 0.2, 1.8);
        p.push = kt_random_uniform(random, 1.0, 9.0);
    }
    return p;
}

/* Ends of steps are compared for the springs alone: simulations end their steps at jumps in time. Measured in 600
 * problems: 360 inside (tsit5), 1000 at ends (radau5). The last slope in the sums of rkc4 is at 0.73 h or later.
 * Without the slope at the end, its steps have up to 9e5 times the tolerance. With Hermite's cubic, its records have up
 * to 7e5 times the tolerance. */
KT_TEST(steps_and_dense_output_beside_kinks_keep_their_tolerance) {
    kt_random random = kt_random_of_test();
    const int samples = kt_sample(24);
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        if (method->embedded_order == 0)
            continue;
        KT_WORST inside = kt_worst_make(method->name), end = kt_worst_make("at the ends of steps");
        for (int sample = 0; sample < samples; sample++) {
            const kinked p = draw_kinked(&random, sample % 3);
            const double start[2] = {kt_random_uniform(&random, 0.2, 2.0), kt_random_uniform(&random, -1.0, 1.0)};
            const errors found = measure_steps(method, &p, start, pow(10.0, kt_random_uniform(&random, -9.0, -4.0)));
            kt_worst_below(&inside, found.inside, 1e3, "sample %d", sample);
            if (sample % 3 < 2)
                kt_worst_below(&end, found.end, 2e3, "sample %d", sample);
        }
    }
}
