/* SPDX-License-Identifier: Apache-2.0 */
#include "equations.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_fault(void *user, const kt_error *fault) {
    (void)user;
    fprintf(stderr, "%s: %s\n", fault->where, fault->message);
}

bool equations_open(equations *e, const char *path, const kt_scene_options *options, kt_isa isa) {
    kt_model_options compiled = kt_model_options_default();
    compiled.isa = isa;
    memset(e, 0, sizeof *e);
    e->scene = kt_scene_default();
    if (kt_scene_read_with(path, options, &e->scene, print_fault, NULL, &e->error) != KT_OK ||
        kt_model_compile(&e->scene.description, &compiled, &e->model, &e->error) != KT_OK ||
        kt_data_create(e->model, &e->data, &e->error) != KT_OK) {
        fprintf(stderr, "%s: %s: %s\n", path, e->error.where, e->error.message);
        return false;
    }
    e->nq = kt_model_nq(e->model);
    e->nv = kt_model_nv(e->model);
    e->n = (size_t)e->nq + (size_t)e->nv;
    e->start = calloc(e->n, sizeof *e->start);
    if (e->start == NULL)
        return false;
    kt_model_initial(e->model, e->start, e->start + e->nq);
    return kt_state_assemble(e->model, e->data, 0.0, e->start, e->start + e->nq, &e->error) == KT_OK;
}

void equations_close(equations *e) {
    free(e->start);
    kt_data_free(e->data);
    kt_model_free(e->model);
    kt_scene_free(&e->scene);
}

int equations_rate(equations *e, double t, const double *y, double *dydt) {
    if (++e->evaluations > e->limit)
        return -1;
    kt_position_rate(e->model, y, y + e->nq, dydt);
    return kt_acceleration_evaluate(e->model, e->data, t, y, y + e->nq, NULL, NULL, dydt + e->nq, &e->error) == KT_OK
               ? 0
               : -1;
}

int equations_project(equations *e, double t, double *y, bool *changed) {
    return kt_state_project(e->model, e->data, t, y, y + e->nq, changed, &e->error) == KT_OK ? 0 : -1;
}
