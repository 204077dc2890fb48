/* The C programs (for the arm of seven joints) that bench/python/python holds the package against: loop SCENE PART
 * COUNT [ROUNDS].
 *
 * PART is one of
 *
 *     call      forward dynamics at one state
 *     tick      steps of 1 ms by rk4
 *     feedback  a control loop of 1 ms steps by rk4 whose law is a feedback of positions and velocities
 *     torque    a control loop of 1 ms steps by rk4 whose law is computed torque
 *     batch     forward dynamics of COUNT states, which are set and read
 *
 * Each round does COUNT turns, or one batch. The program prints the least seconds of a turn (of the batch) by the clock
 * of the thread. It also prints a number of the result, and the package must have the same number.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 200809L
#include "kinetree/batch.h"
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { NV = 64 };

static const double stiffness = 20.0, damping = 4.0, period = 1e-3;

typedef struct program {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    kt_simulation *simulation;
    kt_batch *batch;
    double *rows; /* of the batch: q, v, tau and a of each state */
    size_t states;
    int n;
    bool is_torque; /* of the loops: computed torque */
    double q0[NV], v0[NV], a[NV];
    kt_error error;
} program;

static double now(void) {
    struct timespec at;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &at);
    return (double)at.tv_sec + 1e-9 * (double)at.tv_nsec;
}

static kt_status call(program *p, long count) {
    const double q[NV] = {0.3, -0.2, 0.1}, v[NV] = {0.5}, tau[NV] = {1.0};
    kt_status status = KT_OK;
    for (long i = 0; i < count && status == KT_OK; i++)
        status = kt_acceleration_evaluate(p->model, p->data, 0.0, q, v, tau, NULL, p->a, &p->error);
    return status;
}

static kt_status tick(program *p, long count) {
    kt_status status = KT_OK;
    for (long i = 0; i < count && status == KT_OK; i++)
        status = kt_simulation_tick(p->simulation, period, &p->error);
    p->a[0] = kt_simulation_positions(p->simulation)[0];
    return status;
}

/* The law of one period. */
static kt_status think(program *p, double *tau) {
    const double *q = kt_simulation_positions(p->simulation), *v = kt_simulation_velocities(p->simulation);
    double *wanted = p->is_torque ? p->a : tau;
    for (int i = 0; i < p->n; i++)
        wanted[i] = -stiffness * q[i] - damping * v[i];
    return p->is_torque ? kt_dynamics_inverse(p->model, p->data, q, v, p->a, NULL, tau, &p->error) : KT_OK;
}

static kt_status loop(program *p, long count) {
    double tau[NV];
    kt_status status = KT_OK;
    for (long i = 0; i < count && status == KT_OK; i++) {
        status = think(p, tau);
        if (status == KT_OK)
            status = kt_simulation_set_torque(p->simulation, tau, &p->error);
        if (status == KT_OK)
            status = kt_simulation_tick(p->simulation, period, &p->error);
    }
    memcpy(p->a, kt_simulation_positions(p->simulation), (size_t)p->n * sizeof *p->a);
    return status;
}

static kt_status batch(program *p, long count) {
    const size_t n = (size_t)p->n, all = (size_t)count * n;
    double *q = p->rows, *v = q + all, *tau = v + all, *a = tau + all;
    kt_status status = KT_OK;
    for (size_t i = 0; i < (size_t)count && status == KT_OK; i++) {
        status = kt_batch_set_state(p->batch, i, 0.0, q + i * n, v + i * n, &p->error);
        if (status == KT_OK)
            status = kt_batch_set_torque(p->batch, i, tau + i * n, &p->error);
    }
    if (status == KT_OK)
        status = kt_batch_forward(p->batch, &p->error);
    for (size_t i = 0; i < (size_t)count && status == KT_OK; i++)
        status = kt_batch_get_acceleration(p->batch, i, a + i * n, &p->error);
    p->a[0] = a[all - n];
    return status;
}

static kt_status make_batch(program *p, long count) {
    kt_batch_options options = kt_batch_options_default();
    const size_t all = (size_t)count * (size_t)p->n;
    options.states = (size_t)count;
    p->rows = calloc(4 * all, sizeof *p->rows);
    for (size_t i = 0; i < 3 * all && p->rows; i++)
        p->rows[i] = (double)(i % 97) / 97.0 - 0.5;
    return p->rows ? kt_batch_create(p->model, &options, &p->batch, &p->error) : KT_ERROR_MEMORY;
}

static kt_status set_up(program *p, const char *path, const char *part, long count) {
    kt_status status = kt_scene_read(path, &p->scene, NULL, NULL, &p->error);
    if (status == KT_OK)
        status = kt_model_compile(&p->scene.description, NULL, &p->model, &p->error);
    if (status != KT_OK)
        return status;
    p->n = kt_model_nv(p->model);
    kt_model_initial(p->model, p->q0, p->v0);
    p->is_torque = strcmp(part, "torque") == 0;
    kt_run run = p->scene.run;
    run.step = period;
    run.integrator = "rk4";
    status = kt_data_create(p->model, &p->data, &p->error);
    if (status == KT_OK)
        status = kt_simulation_create(p->model, &run, NULL, &p->simulation, &p->error);
    return status == KT_OK && strcmp(part, "batch") == 0 ? make_batch(p, count) : status;
}

int main(int argc, char **argv) {
    static program p;
    const char *part = argc > 3 ? argv[2] : "";
    const long count = argc > 3 ? strtol(argv[3], NULL, 10) : 0, rounds = argc > 4 ? strtol(argv[4], NULL, 10) : 5;
    const bool is_batch = strcmp(part, "batch") == 0;
    kt_status (*turn)(program *, long) = is_batch                    ? batch
                                         : strcmp(part, "call") == 0 ? call
                                         : strcmp(part, "tick") == 0 ? tick
                                                                     : loop;
    double least = HUGE_VAL;
    if (count <= 0)
        return fprintf(stderr, "loop SCENE call|tick|feedback|torque|batch COUNT [ROUNDS]\n"), 2;
    kt_status status = set_up(&p, argv[1], part, count);
    for (long i = 0; i < rounds && status == KT_OK; i++) {
        status = kt_simulation_set_state(p.simulation, 0.0, p.q0, p.v0, &p.error);
        const double start = now();
        if (status == KT_OK)
            status = turn(&p, count);
        least = fmin(least, (now() - start) / (is_batch ? 1.0 : (double)count));
    }
    if (status != KT_OK)
        return fprintf(stderr, "%s: %s\n", p.error.where, p.error.message), 1;
    printf("%.9g %.17g\n", least, p.a[0]);
    return 0;
}
