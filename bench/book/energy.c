/* Energy kept at the step sizes of reinforcement learning, as CSV for bench/book/energy.py.
 *
 *     bench-book-energy SCENE MJCF DURATION STEP
 *
 * MJCF is the same mechanism as 'kinetree export --mjcf' writes it. All engines take the fixed STEP. The lines of
 * dopri5 and dop853 are runs with adaptive steps, at the smallest tolerance whose evaluations are no more than those of
 * rk4.
 * Semi-implicit Euler, v' = v + h a(q, v), q' = q + h v', represents game engines. All coordinates must be lengths and
 * angles of single axes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "energy.h"
#include "equations.h"
#include "kinetree/integrator.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void energy_watch_add(energy_watch *watch, double kinetic, double potential) {
    const double total = kinetic + potential;
    if (!watch->begun)
        watch->start = total;
    watch->begun = true;
    watch->kinetic = fmax(watch->kinetic, kinetic);
    if (!(fabs(total - watch->start) <= watch->change))
        watch->change = fabs(total - watch->start);
}

static bool add_state(equations *e, energy_watch *watch, const double *y) {
    if (kt_kinematics_update(e->model, e->data, y, y + e->nq, NULL, &e->error) != KT_OK)
        return false;
    energy_watch_add(watch, kt_kinetic_energy(e->model, e->data), kt_potential_energy(e->model, e->data));
    return true;
}

static void print_line(const char *method, const equations *e, const energy_watch *watch) {
    printf("Kinetree,%s,%ld,%.6g\n", method, e->evaluations, watch->change / watch->kinetic);
}

static bool run_semi_implicit(equations *e, double duration, double step) {
    double y[64], rate[64];
    energy_watch watch = {.begun = false};
    bool good = e->n <= 64;
    memcpy(y, e->start, good ? e->n * sizeof *y : 0);
    e->evaluations = 0;
    for (long k = 0; good && (double)k * step < duration - 0.5 * step; k++) {
        good = add_state(e, &watch, y) && equations_rate(e, (double)k * step, y, rate) == 0;
        for (int i = 0; i < e->nv; i++)
            y[e->nq + i] += step * rate[e->nq + i];
        for (int i = 0; i < e->nv; i++)
            y[i] += step * y[e->nq + i];
    }
    good = good && add_state(e, &watch, y);
    if (good)
        print_line("semi-implicit Euler", e, &watch);
    return good;
}

static int rate_of(double t, const double *y, double *dydt, void *user) { return equations_rate(user, t, y, dydt); }

/* One of step and tolerance is 0. */
static bool run_method(equations *e, const char *method, double duration, double step, double tolerance,
                       energy_watch *watch) {
    kt_integrator_options options = kt_integrator_options_default();
    const kt_integrator_callbacks callbacks = {.rhs = rate_of, .user = e};
    const kt_method *table = kt_method_find(method);
    const size_t size = kt_integrator_size(table, e->n);
    void *memory = malloc(size);
    kt_integrator *integrator = NULL;
    options.step = step;
    if (tolerance > 0.0)
        options.relative_tolerance = options.absolute_tolerance = tolerance;
    *watch = (energy_watch){.begun = false};
    e->evaluations = 0;
    bool good =
        memory != NULL && kt_integrator_init(memory, size, table, e->n, &options, &integrator, &e->error) == KT_OK &&
        kt_integrator_start(integrator, 0.0, e->start, &callbacks, &e->error) == KT_OK && add_state(e, watch, e->start);
    while (good && kt_integrator_time(integrator) < duration)
        good = kt_integrator_step(integrator, duration, &e->error) == KT_OK &&
               add_state(e, watch, kt_integrator_state(integrator));
    free(memory);
    return good;
}

/* At large tolerances a run may diverge; then it does not count. */
static void run_adaptive(equations *e, const char *method, double duration, long most) {
    energy_watch watch, best = {.begun = false};
    long evaluations = 0;
    e->limit = most;
    for (int k = 4; k <= 48; k++)
        if (run_method(e, method, duration, 0.0, pow(10.0, -0.25 * k), &watch)) {
            best = watch;
            evaluations = e->evaluations;
        }
    e->evaluations = evaluations;
    if (best.begun)
        print_line(method, e, &best);
}

int main(int argc, char **argv) {
    equations e;
    energy_watch watch;
    if (argc != 5 || !equations_open(&e, argv[1], NULL, KT_ISA_AUTO))
        return 2;
    const double duration = strtod(argv[3], NULL), step = strtod(argv[4], NULL);
    e.limit = 100000000;
    printf("engine,method,evaluations,error\n");
    bool good = energy_mujoco(argv[2], duration, step) && run_semi_implicit(&e, duration, step);
    good = good && run_method(&e, "rk4", duration, step, 0.0, &watch);
    if (good) {
        const long most = e.evaluations;
        print_line("rk4", &e, &watch);
        run_adaptive(&e, "dopri5", duration, most);
        run_adaptive(&e, "dop853", duration, most);
    }
    if (!good)
        fprintf(stderr, "%s: %s\n", argv[1], e.error.message);
    equations_close(&e);
    return good ? 0 : 2;
}
