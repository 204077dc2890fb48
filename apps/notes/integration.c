/* Chapter 5: accuracy and stability of integration methods. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "notes.h"

#include <math.h>

static bool stability(const char *name, kt_stability *s) {
    kt_error e = {0};
    const kt_method *method = kt_method_find(name);
    return works(kt_stability_make(method, method->stages, s, &e), &e);
}

/* |R(z)|, at z = i, and at infinity */
static bool gains(const char *name, const char *at_i, const char *at_infinity) {
    kt_stability s;
    const kt_complex i = {0.0, 1.0}, far = {-1e8, 0.0};
    if (!stability(name, &s))
        return false;
    tell(at_i, kt_stability_gain(&s, i));
    if (at_infinity)
        tell(at_infinity, kt_stability_gain(&s, far));
    return true;
}

static int decay(double t, const double *y, double *rate, void *user) {
    (void)user;
    rate[0] = -y[0] + sin(t);
    return 0;
}

/* The error at 1 s of y' = -y + sin t, y(0) = 1: y = 3/2 exp(-t) + (sin t - cos t) / 2. */
static double decay_error_of(const char *name, double step) {
    static double memory[65536 / sizeof(double)] __attribute__((aligned(64)));
    const kt_method *method = kt_method_find(name);
    kt_integrator_options options = kt_integrator_options_default();
    const kt_integrator_callbacks callbacks = {decay, NULL, NULL};
    kt_integrator *it = NULL;
    kt_error e = {0};
    const double y = 1.0;
    options.step = step;
    if (!works(kt_integrator_init(memory, sizeof memory, method, 1, &options, &it, &e), &e) ||
        !works(kt_integrator_start(it, 0.0, &y, &callbacks, &e), &e))
        return NAN;
    while (kt_integrator_time(it) < 1.0 - 1e-12)
        if (!works(kt_integrator_step(it, 1.0, &e), &e))
            return NAN;
    return fabs(kt_integrator_state(it)[0] - (1.5 * exp(-1.0) + 0.5 * (sin(1.0) - cos(1.0))));
}

static void check_method_order(const char *exercise, const char *name, double step) {
    tell(exercise, log2(decay_error_of(name, step) / decay_error_of(name, 0.5 * step)));
}

/* The error of the midpoint rule by the table of example 5.2, which is solved for the slope k:
 *
 *     k = f(y + h k / 2, t + h / 2),  y <- y + h k */
static double midpoint_error(int steps) {
    const double h = 1.0 / steps;
    double y = 1.0;
    for (int i = 0; i < steps; i++)
        y += h * (sin((i + 0.5) * h) - y) / (1.0 + 0.5 * h);
    return fabs(y - (1.5 * exp(-1.0) + 0.5 * (sin(1.0) - cos(1.0))));
}

bool integration(void) {
    kt_stability s;
    check_method_order("5.1E", "bdf2", 0.01);
    if (!gains("crank-nicolson", "5.2E", "5.2E.infinity") || !stability("euler", &s))
        return false;
    tell("5.1", kt_stability_real_limit(&s));
    if (!gains("implicit-euler", "5.2", "5.2.infinity") || !gains("bdf2", "5.3", "5.3.infinity") ||
        !gains("crank-nicolson", "5.4", NULL) || !gains("radau5", "5.5", "5.5.infinity"))
        return false;
    check_method_order("5.1X", "crank-nicolson", 0.01);
    tell("5.2X", log2(midpoint_error(100) / midpoint_error(200)));
    check_method_order("5.3X", "heun", 0.01);
    if (!stability("heun", &s))
        return false;
    tell("5.3X.limit", kt_stability_real_limit(&s));
    return true;
}
