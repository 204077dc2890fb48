/* Bundled scenes with auxiliary states, against closed forms and a second integration. The GNU Scientific Library
 * (rk8pd) integrates equations that are written down here once more. The tested methods are an explicit, a stabilised,
 * implicit and multistep ones.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "scenes.h"

#include "kinetree/mechanism.h"
#include "kinetree/scene.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>
#include <math.h>
#include <string.h>

enum { NUMBERS = 8 };

/* ---- the equations once more: y = (q, v, x) ---------------------------------------------------------------------- */

static double clamp(double x, double a, double b) { return fmin(fmax(x, a), b); }

static int motor(double t, const double y[], double dydt[], void *unused) {
    const double R = 0.8, L = 0.02, k = 0.05, twist = 6.0 * (y[0] - y[1]) + 0.01 * (y[2] - y[3]);
    (void)t, (void)unused;
    dydt[0] = y[2];
    dydt[1] = y[3];
    dydt[2] = (k * y[4] - twist) / 3e-4;
    dydt[3] = (twist - 2e-4 * y[3]) / 4e-3;
    dydt[4] = (12.0 - R * y[4] - k * y[2]) / L;
    return GSL_SUCCESS;
}

static int cylinder(double t, const double y[], double dydt[], void *unused) {
    const double z = y[0], v = y[1], spool = y[2], below = y[3], above = y[4], open = fmax(spool, 0.0),
                 shut = fmin(spool, 0.0);
    (void)t, (void)unused;
    dydt[0] = v;
    dydt[1] = (1e3 * (below - above) - 900.0 * v) / 200.0 - 9.81;
    dydt[2] = (clamp(4.0 * (0.1 - z), -1.0, 1.0) - spool) / 0.01;
    dydt[3] = 800.0 / (5e-4 + 1e-3 * z) * (1.5e-4 * (open * sqrt(10.0 - below) + shut * sqrt(below)) - 1e-3 * v);
    dydt[4] =
        800.0 / (5e-4 + 1e-3 * (0.3 - z)) * (1e-3 * v - 1.5e-4 * (open * sqrt(above) + shut * sqrt(10.0 - above)));
    return GSL_SUCCESS;
}

/* The rod is a cylinder. Its inertia about its end has the terms l^2/3 and r^2/4. */
static int arm(double t, const double y[], double dydt[], void *unused) {
    const double m = 1.2, l = 0.6, r = 0.02, J = m * (l * l / 3.0 + r * r / 4.0), error = acos(-1.0) / 3.0 - y[0];
    const double wanted = 30.0 * error + 40.0 * y[2] - 6.0 * y[1], given = clamp(wanted, -8.0, 8.0);
    (void)t, (void)unused;
    dydt[0] = y[1];
    dydt[1] = (given - m * 9.81 * 0.5 * l * cos(y[0])) / J;
    dydt[2] = error + 0.5 * (given - wanted);
    return GSL_SUCCESS;
}

static int block(double t, const double y[], double dydt[], void *unused) {
    const double v = y[1], s = v / 1e-3, g = 1.0 + 0.5 * exp(-s * s), rate = v - 1e5 * fabs(v) / g * y[2];
    (void)unused;
    dydt[0] = v;
    dydt[1] = 2.0 * (0.1 * t - y[0]) - 1e5 * y[2] - 316.22776601683796 * rate - 0.4 * v;
    dydt[2] = rate;
    return GSL_SUCCESS;
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

typedef int right_hand_side(double t, const double y[], double dydt[], void *unused);

/* How a scene is run. */
typedef struct way {
    const char *method;
    double step;      /* 0: adaptive */
    double tolerance; /* then */
} way;

/* The state at the end of the scene after this duration. */
static void run(const char *name, const way *by, double duration, double y[NUMBERS], size_t *n) {
    const kt_scene *scene = kt_test_bundled(name);
    kt_run how = scene->run;
    how.duration = duration;
    how.integrator = by->method;
    how.step = by->step;
    how.relative = by->tolerance;
    how.absolute = 1e-3 * by->tolerance;
    kt_model *model = kt_scene_compile(&scene->description);
    kt_simulation *simulation = kt_test_simulation(model, &how, NULL);
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model),
                 nx = (size_t)kt_auxiliary_state_count(model);
    kt_error error = {0};
    kt_need_fine(by->method, kt_simulation_advance(simulation, duration, &error), &error);
    memcpy(y, kt_simulation_positions(simulation), nq * sizeof *y);
    memcpy(y + nq, kt_simulation_velocities(simulation), nv * sizeof *y);
    memcpy(y + nq + nv, kt_simulation_auxiliary_states(simulation), nx * sizeof *y);
    *n = nq + nv + nx;
}

static void integrate(right_hand_side *f, double duration, double *y, size_t n) {
    const gsl_odeiv2_system system = {f, NULL, n, NULL};
    gsl_odeiv2_driver *driver = gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-6, 1e-16, 1e-13);
    double t = 0.0;
    kt_check_equal_int("GSL", gsl_odeiv2_driver_apply(driver, &t, duration, y), GSL_SUCCESS);
    gsl_odeiv2_driver_free(driver);
}

/* Relative to the sizes of the components that the motion has. The largest error is that of radau5, whose iteration
 * leaves more than the tolerance, or of fixed steps at a corner. Bounds are some ten times this error. For components
 * at rest, the bound is the tolerance of GSL. */
static void compare(const char *scene, const way *ways, size_t count, double duration, const double *expected,
                    const double *size, size_t n, double bound) {
    KT_WORST worst = kt_worst_make(scene);
    for (size_t k = 0; k < count; k++) {
        double y[NUMBERS];
        size_t found;
        run(scene, &ways[k], duration, y, &found);
        kt_need(kt_check_equal_int("numbers", (long long)found, (long long)n));
        for (size_t i = 0; i < n; i++)
            kt_worst_near(&worst, y[i] / size[i], expected[i] / size[i], bound, "%s %zu", ways[k].method, i);
    }
}

#define COUNT(array) (sizeof(array) / sizeof *(array))

/* ---- the scenes -------------------------------------------------------------------------------------------------- */

/* thrust = 2 + a sin(w t) + b cos(w t) + c exp(-t/T), which is integrated twice. */
KT_TEST(thruster_with_a_lag_follows_its_closed_form) {
    const double T = 0.3, w = 3.0, m = 2.0, d = 1.0 + w * w * T * T, t = 2.0;
    const double a = 1.0 / d, b = -w * T / d, c = 0.5 - 2.0 - b;
    const double e = exp(-t / T), s = sin(w * t), k = cos(w * t);
    const double x = 2.0 + a * s + b * k + c * e;
    const double v = (2.0 * t + a * (1.0 - k) / w + b * s / w + c * T * (1.0 - e)) / m;
    const double q = (t * t + a * (t - s / w) / w + b * (1.0 - k) / (w * w) + c * T * (t - T * (1.0 - e))) / m;
    static const way ways[] = {{"dopri5", 0.0, 1e-12}, {"dop853", 0.0, 1e-12},  {"rkc4", 0.0, 1e-11},
                               {"radau5", 0.0, 1e-11}, {"rodas5p", 0.0, 1e-11}, {"auto", 0.0, 1e-12},
                               {"ab4", 1e-3, 0.0},     {"rk4", 1e-3, 0.0}};
    const double expected[] = {q, v, x}, size[] = {1.0, 1.0, 1.0};
    compare("thruster-lag", ways, COUNT(ways), t, expected, size, 3, 1e-10);
}

static void against_gsl(const char *scene, right_hand_side *f, const double *start, const double *size, size_t n,
                        double duration, const way *ways, size_t count, double bound) {
    double y[NUMBERS];
    memcpy(y, start, n * sizeof *y);
    integrate(f, duration, y, n);
    compare(scene, ways, count, duration, y, size, n, bound);
}

KT_TEST(motor_with_a_current_moves_as_its_equations) {
    static const double start[] = {0.0, 0.0, 0.0, 0.0, 0.0}, size[] = {10.0, 10.0, 100.0, 100.0, 10.0};
    static const way ways[] = {
        {"dopri5", 0.0, 1e-12}, {"radau5", 0.0, 1e-12}, {"rkc4", 0.0, 1e-12}, {"ab4", 2e-5, 0.0}};
    against_gsl("dc-motor", motor, start, size, 5, 0.5, ways, COUNT(ways), 1e-9);
}

KT_TEST(cylinder_with_a_valve_moves_as_its_equations) {
    static const double start[] = {0.0, 0.0, 0.0, 5.981, 4.019}, size[] = {0.1, 0.1, 1.0, 6.0, 6.0};
    static const way ways[] = {
        {"dopri5", 0.0, 1e-12}, {"dop853", 0.0, 1e-12}, {"radau5", 0.0, 1e-12}, {"ab4", 1e-5, 0.0}};
    against_gsl("hydraulic-cylinder", cylinder, start, size, 5, 0.6, ways, COUNT(ways), 1e-9);
}

/* The torque leaves its limit at a corner: steps of a fixed length see it with an error of their second order. */
KT_TEST(arm_with_a_limited_controller_moves_as_its_equations) {
    const double start[] = {-0.5 * acos(-1.0), 0.0, 0.0};
    static const double size[] = {1.0, 1.0, 1.0};
    static const way ways[] = {{"dopri5", 0.0, 1e-13}, {"radau5", 0.0, 1e-13}, {"ab4", 1e-5, 0.0}};
    against_gsl("pid-arm", arm, start, size, 3, 1.5, ways, COUNT(ways), 1e-9);
}

/* It slips for the first time after some 7.5 s, when the bristles' rate makes the equations stiff (1e5 1/s). Then it
 * sticks again. The deflection of the bristles is of the size 1e-5. */
KT_TEST(block_on_bristles_moves_as_its_equations) {
    static const double start[] = {0.0, 0.0, 0.0}, size[] = {1.0, 1.0, 1e-5};
    static const way ways[] = {{"dopri5", 0.0, 1e-12}, {"dop853", 0.0, 1e-13}, {"radau5", 0.0, 1e-13}},
                     stuck[] = {{"ab4", 1e-4, 0.0}};
    against_gsl("lugre", block, start, size, 3, 13.0, ways, COUNT(ways), 1e-10);
    against_gsl("lugre", block, start, size, 3, 7.0, stuck, COUNT(stuck), 1e-13);
}
