/* Error against evaluations and processor time of solvers on the same equations, as CSV for bench/book/solvers.py.
 *
 *     bench-book-solvers SCENE DURATION LIMIT SECONDS
 *
 * Each method runs at the tolerances 1e-2 to 1e-12, two a decade. The reference is the mean of two runs at 1e-13 with
 * different codes, and `spread` is half their difference. `error` is the largest difference of a position at the end.
 * LIMIT: evaluations that a run may take. SECONDS: processor time of repetitions for a time; the least is printed. The
 * right-hand side counts its calls, so all solvers are counted alike, with the differences for their Jacobians. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "equations.h"
#include "kinetree/integrator.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const char *const own_methods[] = {"dopri5", "tsit5", "dop853", "rkc4", "rodas5p", "radau5", "auto", NULL};

static int rate_of(double t, const double *y, double *dydt, void *user) { return equations_rate(user, t, y, dydt); }
static int project_of(double t, double *y, bool *changed, void *user) { return equations_project(user, t, y, changed); }

static const char *own_run(equations *e, const char *method, double tolerance, double end, double *y) {
    kt_integrator_options options = kt_integrator_options_default();
    const kt_integrator_callbacks callbacks = {.rhs = rate_of, .project = project_of, .user = e};
    const kt_method *table = kt_method_find(method);
    const size_t size = kt_integrator_size(table, e->n);
    void *memory = malloc(size);
    kt_integrator *integrator = NULL;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    kt_status status = memory ? KT_OK : KT_ERROR_MEMORY;
    if (status == KT_OK)
        status = kt_integrator_init(memory, size, table, e->n, &options, &integrator, &e->error);
    if (status == KT_OK)
        status = kt_integrator_start(integrator, 0.0, e->start, &callbacks, &e->error);
    while (status == KT_OK && kt_integrator_time(integrator) < end)
        status = kt_integrator_step(integrator, end, &e->error);
    if (status == KT_OK)
        memcpy(y, kt_integrator_state(integrator), e->n * sizeof *y);
    free(memory);
    return status == KT_OK ? NULL : "the solver gave up";
}

static double distance(const equations *e, const double *a, const double *b) {
    double largest = 0.0;
    for (int k = 0; k < e->nq; k++)
        if (!(fabs(a[k] - b[k]) <= largest))
            largest = fabs(a[k] - b[k]);
    return largest;
}

static double seconds_now(void) { return (double)clock() / CLOCKS_PER_SEC; }

/* The data that all runs of one scene share. */
typedef struct problem {
    equations e;
    double end, seconds;
    double *known, *y; /* the reference; the end of a run */
} problem;

/* Prints a line of a method at a tolerance. */
static void measure(problem *p, solver_run *run, const char *family, const char *method, double tolerance) {
    equations *e = &p->e;
    e->evaluations = 0;
    const char *failed = run(e, method, tolerance, p->end, p->y);
    printf("%s,%s,%.3g,", family, method, tolerance);
    if (failed != NULL) {
        printf(",,,%s\n", e->evaluations > e->limit ? "too many evaluations" : failed);
        return;
    }
    const long evaluations = e->evaluations;
    const double error = distance(e, p->y, p->known), begin = seconds_now();
    double least = INFINITY;
    while (seconds_now() - begin < p->seconds) {
        const double from = seconds_now();
        e->evaluations = 0;
        (void)run(e, method, tolerance, p->end, p->y);
        least = fmin(least, seconds_now() - from);
    }
    printf("%.6g,%ld,%.6g,\n", error, evaluations, least);
}

static void ladder(problem *p, solver_run *run, const char *family, const char *const *methods) {
    for (; *methods != NULL; methods++)
        for (int k = 4; k <= 24; k++)
            measure(p, run, family, *methods, pow(10.0, -0.5 * k));
}

/* The reference, and its spread; a message if there is none. */
static const char *find_reference(problem *p, double *spread) {
    p->e.limit = 100000000;
    const char *failed = own_run(&p->e, "dop853", 1e-13, p->end, p->known);
    if (failed == NULL)
        failed = sundials_run(&p->e, "erk8", 1e-13, p->end, p->y);
    if (failed != NULL)
        return failed;
    *spread = 0.5 * distance(&p->e, p->known, p->y);
    for (size_t k = 0; k < p->e.n; k++)
        p->known[k] = 0.5 * (p->known[k] + p->y[k]);
    return NULL;
}

int main(int argc, char **argv) {
    problem p = {.end = 0.0};
    double spread = 0.0;
    if (argc != 5 || !equations_open(&p.e, argv[1], NULL, KT_ISA_AUTO))
        return 2;
    p.end = strtod(argv[2], NULL);
    p.seconds = strtod(argv[4], NULL);
    p.known = calloc(p.e.n, sizeof *p.known);
    p.y = calloc(p.e.n, sizeof *p.y);
    const char *failed = p.known && p.y ? find_reference(&p, &spread) : "no memory";
    if (failed == NULL) {
        p.e.limit = strtol(argv[3], NULL, 10);
        printf("# SUNDIALS %s, spread %.3g, dimension %zu\n", sundials_version(), spread, p.e.n);
        printf("family,method,tolerance,error,evaluations,seconds,fault\n");
        ladder(&p, own_run, "kinetree", own_methods);
        ladder(&p, sundials_run, "sundials", sundials_methods);
    } else
        fprintf(stderr, "no reference: %s: %s\n", failed, p.e.error.message);
    free(p.known);
    free(p.y);
    equations_close(&p.e);
    return failed == NULL ? 0 : 2;
}
