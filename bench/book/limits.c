/* Evaluations of a scene that a counting tool watches, for bench/book/limits.py.
 *
 *     bench-book-limits SCENE FUNCTION COUNT [base]
 *
 * FUNCTION is forward (accelerations, of a tree without effects), lanes (the same for LANES states at once) or
 * derivatives (those of a tree's forward dynamics by position and velocity). It is evaluated COUNT times at the
 * assembled start. The output is the number of bodies, of bytes of the model and its data, of states, and of states in
 * a vector. base: with the lowest level of the instruction set. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "equations.h"

#include "kinetree/batch.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LANES = 8 };

typedef struct limits {
    equations e;
    kt_batch *batch;
    double *tau, *out;
    void *work;
    size_t work_size;
} limits;

static kt_status evaluate_forward(limits *l) {
    equations *e = &l->e;
    if (kt_loop_count(e->model) == 0)
        return kt_dynamics_forward(e->model, e->data, e->start, e->start + e->nq, l->tau, NULL, l->out, &e->error);
    return kt_acceleration_evaluate(e->model, e->data, 0.0, e->start, e->start + e->nq, NULL, NULL, l->out, &e->error);
}

static kt_status evaluate_derivatives(limits *l) {
    equations *e = &l->e;
    const size_t square = (size_t)e->nv * (size_t)e->nv;
    return kt_dynamics_forward_derivatives(e->model, e->data, l->work, l->work_size, e->start, e->start + e->nq, l->tau,
                                           NULL, l->out, l->out + square, l->out + 2 * square, &e->error);
}

static kt_status evaluate_lanes(limits *l) { return kt_batch_forward(l->batch, &l->e.error); }

static bool open_batch(limits *l) {
    kt_batch_options options = kt_batch_options_default();
    options.states = LANES;
    kt_status status = kt_batch_create(l->e.model, &options, &l->batch, &l->e.error);
    for (size_t i = 0; i < LANES && status == KT_OK; i++)
        status = kt_batch_set_state(l->batch, i, 0.0, l->e.start, l->e.start + l->e.nq, &l->e.error);
    return status == KT_OK;
}

static bool open_limits(limits *l, const char *scene, kt_isa isa) {
    if (!equations_open(&l->e, scene, NULL, isa))
        return false;
    const size_t nv = (size_t)l->e.nv;
    l->tau = calloc(nv + 1, sizeof *l->tau);
    l->out = calloc(3 * nv * nv + nv + 1, sizeof *l->out);
    l->work_size = (kt_dynamics_work_size(l->e.model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    l->work = l->work_size > 0 ? aligned_alloc(KT_ALIGNMENT, l->work_size) : NULL;
    return l->tau != NULL && l->out != NULL && (l->work != NULL || l->work_size == 0) && open_batch(l);
}

static void close_limits(limits *l) {
    kt_batch_free(l->batch);
    free(l->tau);
    free(l->out);
    free(l->work);
    equations_close(&l->e);
}

int main(int argc, char **argv) {
    static limits l;
    if (argc < 4)
        return 2;
    kt_status status = open_limits(&l, argv[1], argc > 4 ? KT_ISA_BASE : KT_ISA_AUTO) ? KT_OK : KT_ERROR_MEMORY;
    const bool derives = strcmp(argv[2], "derivatives") == 0, has_lanes = strcmp(argv[2], "lanes") == 0;
    const long count = strtol(argv[3], NULL, 10);
    for (long k = 0; k < count && status == KT_OK; k++)
        status = derives ? evaluate_derivatives(&l) : has_lanes ? evaluate_lanes(&l) : evaluate_forward(&l);
    const kt_batch_options options = {.size = sizeof options, .states = LANES, .threads = 1};
    if (status == KT_OK)
        printf("%d,%zu,%d,%zu\n", kt_model_body_count(l.e.model) - 1,
               kt_model_size(l.e.model) + (has_lanes ? kt_batch_size(l.e.model, &options) : kt_data_size(l.e.model)),
               has_lanes ? LANES : 1, has_lanes ? kt_batch_lanes_of(l.batch).width : 1);
    close_limits(&l);
    return status == KT_OK ? 0 : 2;
}
