/* Evaluations of a scene that a counting tool watches, for bench/book/limits.py.
 *
 *     bench-book-limits SCENE FUNCTION COUNT [base]
 *
 * FUNCTION is forward (accelerations, of a tree without effects) or derivatives (those of a tree's forward dynamics by
 * position and velocity). It is evaluated COUNT times at the assembled start. The output is the number of bodies, of
 * freedoms, and of bytes of the model and its data. base: with the lowest level of the instruction set. */
#include "equations.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct limits {
    equations e;
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

static bool open_limits(limits *l, const char *scene, kt_isa isa) {
    if (!equations_open(&l->e, scene, NULL, isa))
        return false;
    const size_t nv = (size_t)l->e.nv;
    l->tau = calloc(nv + 1, sizeof *l->tau);
    l->out = calloc(3 * nv * nv + nv + 1, sizeof *l->out);
    l->work_size = (kt_derivative_work_size(l->e.model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    l->work = l->work_size > 0 ? aligned_alloc(KT_ALIGNMENT, l->work_size) : NULL;
    return l->tau != NULL && l->out != NULL && (l->work != NULL || l->work_size == 0);
}

static void close_limits(limits *l) {
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
    const bool derives = strcmp(argv[2], "derivatives") == 0;
    const long count = strtol(argv[3], NULL, 10);
    for (long k = 0; k < count && status == KT_OK; k++)
        status = derives ? evaluate_derivatives(&l) : evaluate_forward(&l);
    if (status == KT_OK)
        printf("%d,%d,%zu\n", kt_model_body_count(l.e.model) - 1, l.e.nv,
               kt_model_size(l.e.model) + kt_data_size(l.e.model));
    close_limits(&l);
    return status == KT_OK ? 0 : 2;
}
