#include "problems.h"

#include "check.h"

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

bool is_ok(const char *what, kt_status status, const kt_error *error) {
    if (status == KT_OK)
        return true;
    kt_note("%s: %s: %s", what, error->where, error->message);
    return kt_check_equal_int(what, status, KT_OK);
}

/* On a cache line, where the integrator then begins: so that its address is the block's. */
kt_integrator *integrator_make(const kt_method *method, size_t n, const kt_integrator_options *options) {
    kt_error error;
    kt_integrator *integrator = NULL;
    const size_t size = (kt_integrator_size(method, n) + 63) / 64 * 64;
    void *memory = aligned_alloc(64, size);
    if (!is_ok("placed", kt_integrator_init(memory, size, method, n, options, &integrator, &error), &error)) {
        free(memory);
        return NULL;
    }
    return integrator;
}

void integrator_free(kt_integrator *integrator) { free(integrator); }

kt_integrator *integrator_begin(const kt_method *method, const problem *p, const kt_integrator_options *options) {
    kt_error error;
    double y[PROBLEM_MAX];
    p->solution(p->start, y);
    const kt_integrator_callbacks callbacks = {p->rhs, NULL, NULL};
    kt_integrator *integrator = integrator_make(method, p->n, options);
    if (integrator == NULL)
        return NULL;
    is_ok("started", kt_integrator_start(integrator, p->start, y, &callbacks, &error), &error);
    return integrator;
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
    kt_error error;
    while (kt_integrator_time(integrator) != t) {
        const kt_status status = kt_integrator_step(integrator, t, &error);
        if (status != KT_OK)
            return is_ok("step", status, &error);
    }
    return true;
}

double error_at(const problem *p, double t, const double *y) {
    double exact[PROBLEM_MAX], worst = 0.0;
    p->solution(t, exact);
    for (size_t i = 0; i < p->n; i++)
        worst = fmax(worst, fabs(y[i] - exact[i]));
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
    kt_error error;
    const kt_integrator_options options = fixed_step(1.5 / steps);
    const kt_integrator_callbacks callbacks = {forced, NULL, &lambda};
    kt_integrator *it = integrator_make(method, 1, &options);
    is_ok("start", kt_integrator_start(it, 0.25, (double[]){sin(0.25)}, &callbacks, &error), &error);
    double worst = 0.0;
    while (kt_integrator_time(it) < 1.75 && is_ok("step", kt_integrator_step(it, 1.75, &error), &error))
        worst = fmax(worst, fabs(kt_integrator_state(it)[0] - sin(kt_integrator_time(it))));
    integrator_free(it);
    return worst;
}
