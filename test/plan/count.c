/* `count TASK SCENE...` does one task once with each scene in turn, for callgrind to count its instructions. With the
 * kernels of the baseline, the tasks work in the assembled initial state. They evaluate accelerations (acceleration),
 * with powers (power), or run the scene (run). With the kernels of x86-64-v3, the task evaluates accelerations, and
 * mass, stiffness and damping matrices (stiffness). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"
#include "kinetree/study.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct subject {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    double *q, *v, *a, *matrix;
} subject;

static bool has_matrices(const char *what) { return strcmp(what, "stiffness") == 0; }

static int open_subject(subject *s, const char *what, const char *path) {
    kt_error error = {0};
    kt_model_options options = kt_model_options_default();
    options.isa = has_matrices(what) ? KT_ISA_V3 : KT_ISA_BASE; /* valgrind lacks AVX-512 */
    if (kt_scene_read(path, &s->scene, NULL, NULL, &error) != KT_OK)
        return fprintf(stderr, "%s: %s\n", error.where, error.message);
    options.reduction = kt_reduction_method_of(s->scene.reduction);
    options.plan = s->scene.run.plan;
    if (kt_model_compile(&s->scene.description, &options, &s->model, &error) != KT_OK ||
        kt_data_create(s->model, &s->data, &error) != KT_OK)
        return fprintf(stderr, "%s: %s: %s\n", path, error.where, error.message);
    const size_t nq = (size_t)kt_model_nq(s->model), nv = (size_t)kt_model_nv(s->model);
    s->q = calloc(nq + 2 * nv + 4 * nv * nv + 1, sizeof *s->q);
    if (s->q == NULL)
        return fputs("out of memory\n", stderr);
    s->v = s->q + nq;
    s->a = s->v + nv;
    s->matrix = s->a + nv;
    kt_model_initial(s->model, s->q, s->v);
    if (kt_state_assemble(s->model, s->data, 0.0, s->q, s->v, &error) != KT_OK)
        return fprintf(stderr, "%s: %s: %s\n", path, error.where, error.message);
    return 0;
}

static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

static kt_status run(const subject *s, kt_error *error) {
    kt_simulation *simulation = NULL;
    kt_status status = kt_simulation_create(s->model, &s->scene.run, NULL, &simulation, error);
    if (status == KT_OK)
        status = kt_simulation_run(simulation, ignore, NULL, error);
    kt_simulation_free(simulation);
    return status;
}

/* For a tree the basis is the identity, and is not requested. */
static kt_status find_matrices(const subject *s, kt_error *error) {
    const size_t size = kt_stiffness_work_size(s->model), nv = (size_t)kt_model_nv(s->model);
    void *scratch = aligned_alloc(KT_ALIGNMENT, size);
    const kt_status status =
        scratch ? kt_stiffness_evaluate(s->model, s->data, scratch, size, 0.0, s->q, s->v, NULL, NULL, s->a,
                                        kt_loop_count(s->model) > 0 ? s->matrix + 3 * nv * nv : NULL, s->matrix,
                                        s->matrix + nv * nv, s->matrix + 2 * nv * nv, error)
                : KT_ERROR_MEMORY;
    free(scratch);
    return status;
}

static int work(const subject *s, const char *what) {
    kt_error error = {0};
    kt_power p;
    kt_status status = KT_OK;
    if (strcmp(what, "run") == 0)
        status = run(s, &error);
    else if (strcmp(what, "power") == 0)
        status = kt_power_evaluate(s->model, s->data, 0.0, s->q, s->v, NULL, NULL, s->a, &p, &error);
    else
        status = kt_acceleration_evaluate(s->model, s->data, 0.0, s->q, s->v, NULL, NULL, s->a, &error);
    if (status == KT_OK && has_matrices(what))
        status = find_matrices(s, &error);
    return status == KT_OK ? 0 : fprintf(stderr, "%s: %s\n", error.where, error.message);
}

int main(int argc, char **argv) {
    static subject subjects[16];
    const int count = argc - 2;
    int failed = count < 1 || count > 16;
    for (int i = 0; i < count && !failed; i++)
        failed = open_subject(&subjects[i], argv[1], argv[2 + i]) != 0;
    for (int i = 0; i < count && !failed; i++)
        failed = work(&subjects[i], argv[1]) != 0;
    for (int i = 0; i < count; i++) {
        kt_data_free(subjects[i].data);
        kt_model_free(subjects[i].model);
        kt_scene_free(&subjects[i].scene);
        free(subjects[i].q);
    }
    return failed ? 1 : 0;
}
