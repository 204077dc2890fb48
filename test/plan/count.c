/* count WHAT SCENE...: does one thing once, with the kernels of the baseline, for callgrind to count its instructions.
 * WHAT: what the plan says of each scene, as lines "flops STEP" (plan); or evaluates accelerations (acceleration), with
 * powers (power), of each scene in turn, in its initial state, assembled. */
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct subject {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    double *q, *v, *a;
} subject;

static int open_subject(subject *s, const char *path) {
    kt_error error = {0};
    kt_model_options options = kt_model_options_default();
    options.level = KT_LEVEL_BASE; /* valgrind knows no AVX-512 */
    if (kt_scene_read(path, &s->scene, NULL, NULL, &error) != KT_OK)
        return fprintf(stderr, "%s: %s\n", error.where, error.message);
    options.reduction = s->scene.run.reduction;
    options.plan = s->scene.run.plan;
    if (kt_model_compile(&s->scene.description, &options, &s->model, &error) != KT_OK ||
        kt_data_create(s->model, &s->data, &error) != KT_OK)
        return fprintf(stderr, "%s: %s: %s\n", path, error.where, error.message);
    const size_t nq = (size_t)kt_model_nq(s->model), nv = (size_t)kt_model_nv(s->model);
    s->q = calloc(nq + 2 * nv + 1, sizeof *s->q);
    if (s->q == NULL)
        return fputs("out of memory\n", stderr);
    s->v = s->q + nq;
    s->a = s->v + nv;
    kt_model_initial(s->model, s->q, s->v);
    if (kt_state_assemble(s->model, s->data, 0.0, s->q, s->v, &error) != KT_OK)
        return fprintf(stderr, "%s: %s: %s\n", path, error.where, error.message);
    return 0;
}

static int evaluate(const subject *s, bool power) {
    kt_error error = {0};
    kt_power p;
    const kt_status status =
        power ? kt_power_evaluate(s->model, s->data, 0.0, s->q, s->v, NULL, NULL, s->a, &p, &error)
              : kt_acceleration_evaluate(s->model, s->data, 0.0, s->q, s->v, NULL, NULL, s->a, &error);
    return status == KT_OK ? 0 : fprintf(stderr, "%s: %s\n", error.where, error.message);
}

int main(int argc, char **argv) {
    static subject subjects[16];
    const int count = argc - 2;
    int failed = count < 1 || count > 16;
    for (int i = 0; i < count && !failed; i++)
        failed = open_subject(&subjects[i], argv[2 + i]) != 0;
    for (int i = 0; i < count && !failed; i++)
        failed = evaluate(&subjects[i], strcmp(argv[1], "power") == 0) != 0;
    for (int i = 0; i < count; i++) {
        kt_data_free(subjects[i].data);
        kt_model_free(subjects[i].model);
        kt_scene_free(&subjects[i].scene);
        free(subjects[i].q);
    }
    return failed ? 1 : 0;
}
