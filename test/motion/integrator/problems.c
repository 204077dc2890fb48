/* SPDX-License-Identifier: Apache-2.0 */
#include "problems.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static int chirp(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = 2.0 * t * pow(y[1], 0.2) * y[3];
    dydt[1] = 10.0 * t * exp(5.0 * (y[2] - 1.0)) * y[3];
    dydt[2] = 2.0 * t * y[3];
    dydt[3] = -2.0 * t * log(y[0]);
    return 0;
}

static void chirp_solution(double t, double *y) {
    y[0] = exp(sin(t * t));
    y[1] = exp(5.0 * sin(t * t));
    y[2] = 1.0 + sin(t * t);
    y[3] = cos(t * t);
}

const problem problem_chirp = {"chirp", 4, 0.25, 1.5, chirp, chirp_solution};

static int tangent(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = 2.0 * t * (1.0 + y[0] * y[0]);
    return 0;
}

static void tangent_solution(double t, double *y) { y[0] = tan(t * t + 0.5); }

const problem problem_tangent = {"tangent", 1, -0.5, 0.75, tangent, tangent_solution};

static int kepler(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    const double r = sqrt(y[0] * y[0] + y[1] * y[1]), r3 = r * r * r;
    dydt[0] = y[2];
    dydt[1] = y[3];
    dydt[2] = -y[0] / r3;
    dydt[3] = -y[1] / r3;
    return 0;
}

/* Kepler's equation t = E - e sin E by Newton's method. */
static void kepler_solution(double t, double *y) {
    const double e = 0.2, b = sqrt(1.0 - e * e);
    double E = t;
    for (int i = 0; i < 30; i++)
        E -= (E - e * sin(E) - t) / (1.0 - e * cos(E));
    const double rate = 1.0 / (1.0 - e * cos(E));
    y[0] = cos(E) - e;
    y[1] = b * sin(E);
    y[2] = -sin(E) * rate;
    y[3] = b * cos(E) * rate;
}

const problem problem_kepler = {"kepler", 4, 0.0, 9.0, kepler, kepler_solution};

bool goes_by_its_table(const kt_method *m) { return strcmp(kt_method_family_name(m), "explicit") == 0; }

int van_der_pol(double t, const double *y, double *dydt, void *user) {
    (void)t;
    (void)user;
    dydt[0] = y[1];
    dydt[1] = 1e6 * ((1.0 - y[0] * y[0]) * y[1] - y[0]);
    return 0;
}

int forced(double t, const double *y, double *dydt, void *user) {
    const double lambda = *(const double *)user;
    dydt[0] = lambda * (y[0] - sin(t)) + cos(t);
    return 0;
}

/* On a cache line, where the integrator then begins: so that its address is the block's. */
kt_integrator *integrator_make(const kt_method *method, size_t n, kt_integrator_options options) {
    kt_error error;
    kt_integrator *integrator = NULL;
    const size_t size = (kt_integrator_size(method, n) + 63) / 64 * 64;
    void *memory = aligned_alloc(64, size);
    kt_test_own(memory, free);
    kt_need_fine("placed", kt_integrator_init(memory, size, method, n, &options, &integrator, &error), &error);
    return integrator;
}

kt_integrator *integrator_start(const kt_method *method, size_t n, kt_integrator_options options,
                                int (*rhs)(double t, const double *y, double *dydt, void *user), void *user, double t,
                                const double *y) {
    kt_error error;
    const kt_integrator_callbacks callbacks = {rhs, NULL, user};
    kt_integrator *integrator = integrator_make(method, n, options);
    kt_fine("started", kt_integrator_start(integrator, t, y, &callbacks, &error), &error);
    return integrator;
}

kt_integrator *integrator_begin(const kt_method *method, const problem *p, kt_integrator_options options) {
    double y[PROBLEM_MAX];
    p->solution(p->start, y);
    return integrator_start(method, p->n, options, p->rhs, NULL, p->start, y);
}

bool integrator_step(kt_integrator *integrator, double limit) {
    kt_error error;
    return kt_fine("step", kt_integrator_step(integrator, limit, &error), &error);
}

bool integrator_value(kt_integrator *integrator, double t, double *y) {
    kt_error error;
    return kt_fine("value", kt_integrator_interpolate(integrator, t, y, &error), &error);
}

kt_integrator_options fixed_step(double step) {
    kt_integrator_options options = kt_integrator_options_default();
    options.step = step;
    return options;
}

kt_integrator_options tolerance(double relative, double absolute) {
    kt_integrator_options options = kt_integrator_options_default();
    options.relative_tolerance = relative;
    options.absolute_tolerance = absolute;
    return options;
}

bool integrate_to(kt_integrator *integrator, double t) {
    while (kt_integrator_time(integrator) != t)
        if (!integrator_step(integrator, t))
            return false;
    return true;
}

double error_at(const problem *p, double t, const double *y) {
    double exact[PROBLEM_MAX], worst = 0.0;
    p->solution(t, exact);
    for (size_t i = 0; i < p->n; i++)
        worst = fmax(worst, fabs(y[i] - exact[i]));
    return worst;
}

double error_until_end(kt_integrator *integrator, const problem *p) {
    double worst = 0.0;
    while (kt_integrator_time(integrator) != p->end && integrator_step(integrator, p->end))
        worst = fmax(worst, error_at(p, kt_integrator_time(integrator), kt_integrator_state(integrator)));
    return worst;
}

bool same_bits(const double *a, const double *b, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint64_t x, y;
        memcpy(&x, &a[i], sizeof x);
        memcpy(&y, &b[i], sizeof y);
        if (x != y)
            return false;
    }
    return true;
}

double slope_of(const double *h, const double *error, int count) {
    double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    for (int i = 0; i < count; i++) {
        const double a = log(h[i]), b = log(error[i]);
        x += a;
        y += b;
        xx += a * a;
        xy += a * b;
    }
    return (count * xy - x * y) / (count * xx - x * x);
}

double forced_error(const kt_method *method, double lambda, int steps) {
    kt_integrator *it =
        integrator_start(method, 1, fixed_step(1.5 / steps), forced, &lambda, 0.25, (double[]){sin(0.25)});
    double worst = 0.0;
    while (kt_integrator_time(it) < 1.75 && integrator_step(it, 1.75))
        worst = fmax(worst, fabs(kt_integrator_state(it)[0] - sin(kt_integrator_time(it))));
    return worst;
}

void check_forced_order(const kt_method *method, double lambda, int first_steps, int levels, double order,
                        double room) {
    double h[4], error[4];
    for (int l = 0; l < levels; l++) {
        h[l] = 1.5 / (first_steps << l);
        error[l] = forced_error(method, lambda, first_steps << l);
    }
    kt_note("lambda = %g: errors %.2g ... %.2g", lambda, error[0], error[levels - 1]);
    kt_check_near("order", slope_of(h, error, levels), order, room);
}

/* y(2) = 1.7061677321702..., published in E. Hairer, G. Wanner, Solving ODE II, IV.10, (10.3). */
kt_integrator_counts check_stiff_oscillator(const kt_method *method, double tol, double bound) {
    kt_integrator *it = integrator_start(method, 2, tolerance(tol, tol), van_der_pol, NULL, 0.0, (double[]){2.0, 0.0});
    integrate_to(it, 2.0);
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_note("tolerance %g: %d steps, %d rejected, %d evaluations, %d Jacobians, %d factorizations", tol,
            (int)counts.steps, (int)counts.rejected, (int)counts.evaluations, (int)counts.jacobians,
            (int)counts.factorizations);
    kt_check_near("y1", kt_integrator_state(it)[0], 1.706167732170483, bound);
    kt_check_below("steps", (double)counts.steps, 1500.0);
    return counts;
}

/* The argument of its functions. The first equation of `forced` has the real sigma, and the complex one. */
typedef struct changing {
    double lambda, jacobian;
    kt_complex sigma[2];
    bool known;
} changing;

static int changing_rhs(double t, const double *y, double *dydt, void *user) {
    return forced(t, y, dydt, &((changing *)user)->lambda);
}

static int changing_jacobian(double t, const double *y, const double *dydt, void *user) {
    changing *s = user;
    (void)t, (void)y, (void)dydt;
    if (s->known)
        s->jacobian = s->lambda;
    return s->known ? 0 : 1;
}

static int changing_factor(kt_complex sigma, void *user) {
    ((changing *)user)->sigma[sigma.im != 0.0] = sigma;
    return 0;
}

static int changing_solve(double *re, double *im, void *user) {
    const changing *s = user;
    const kt_complex sigma = s->sigma[im != NULL];
    const double x = re[0], y = im != NULL ? im[0] : 0.0, real = sigma.re - s->jacobian;
    const double square = real * real + sigma.im * sigma.im;
    re[0] = (x * real + y * sigma.im) / square;
    if (im != NULL)
        im[0] = (y * real - x * sigma.im) / square;
    return 0;
}

void check_lost_jacobian(const kt_method *method, double evaluations, double bound) {
    static const kt_newton newton = {changing_jacobian, changing_factor, changing_solve, NULL, NULL};
    static const struct {
        double lambda, end;
        bool known;
    } part[] = {{-1e5, 1.0, true}, {-1.0, 3.0, false}, {-1e5, 4.0, false}, {-1.0, 6.0, true}};
    kt_integrator_options options = tolerance(1e-6, 1e-6);
    options.newton = &newton;
    changing s = {.lambda = -1e5};
    kt_integrator *it = integrator_start(method, 1, options, changing_rhs, &s, 0.0, (double[]){0.0});
    for (size_t i = 0; i < sizeof part / sizeof *part; i++) {
        const uint64_t before = kt_integrator_counts_of(it).evaluations;
        s.lambda = part[i].lambda;
        s.known = part[i].known;
        integrate_to(it, part[i].end);
        kt_note("until %g s", part[i].end);
        kt_check_below("evaluations", (double)(kt_integrator_counts_of(it).evaluations - before), evaluations);
        kt_check_near("y", kt_integrator_state(it)[0], sin(part[i].end), bound);
    }
}
