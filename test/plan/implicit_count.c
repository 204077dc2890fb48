/* implicit-count WHAT METHOD SCENE: after twenty steps of a simulation one call, for callgrind to count its
 * instructions: `simulate`, a further step; `step`, kt_step_evaluate from the same state; `derivatives` and `adjoint`.
 * The kernels are those of the baseline. */
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 20, MOST = 64 };

typedef struct subject {
    const char *what;
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_data *data;
    void *work;
    size_t size;
    kt_step step;
} subject;

static kt_status open_subject(subject *s, const char *method, const char *path, kt_error *error) {
    kt_model_options options = kt_model_options_default();
    kt_run run = kt_run_default();
    options.isa = KT_ISA_BASE; /* valgrind knows no AVX-512 */
    kt_status status = kt_scene_read(path, &s->scene, NULL, NULL, error);
    if (status == KT_OK)
        status = kt_model_compile(&s->scene.description, &options, &s->model, error);
    if (status == KT_OK)
        status = kt_data_create(s->model, &s->data, error);
    if (status != KT_OK)
        return status;
    run.integrator = method;
    run.step = 1e-4 * s->scene.run.duration;
    status = kt_simulation_create(s->model, &run, NULL, &s->simulation, error);
    for (int k = 0; k < STEPS && status == KT_OK; k++)
        status = kt_simulation_step(s->simulation, HUGE_VAL, error);
    s->step = (kt_step){.method = kt_method_find(method), .t = kt_simulation_time(s->simulation), .h = run.step};
    s->size = kt_step_work_size(s->model, s->step.method);
    s->work = aligned_alloc(KT_ALIGNMENT, (s->size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    return status == KT_OK && s->work == NULL ? KT_ERROR_MEMORY : status;
}

kt_status call(const subject *s, kt_error *error);

__attribute__((noinline)) kt_status call(const subject *s, kt_error *error) {
    static double next_q[MOST], next_v[MOST], matrices[6 * MOST * MOST], y[5 * MOST] = {1.0};
    const double *q = kt_simulation_positions(s->simulation), *v = kt_simulation_velocities(s->simulation);
    const size_t n = (size_t)kt_model_nv(s->model);
    if (strcmp(s->what, "simulate") == 0)
        return kt_simulation_step(s->simulation, HUGE_VAL, error);
    if (strcmp(s->what, "step") == 0)
        return kt_step_evaluate(s->model, s->data, s->work, s->size, &s->step, q, v, next_q, next_v, error);
    if (strcmp(s->what, "derivatives") == 0)
        return kt_step_derivatives(s->model, s->data, s->work, s->size, &s->step, q, v, next_q, next_v, matrices,
                                   matrices + 4 * n * n, error);
    return kt_step_adjoint(s->model, s->data, s->work, s->size, &s->step, q, v, y, y + 2 * n, y + 4 * n, error);
}

int main(int argc, char **argv) {
    subject s = {.what = argc == 4 ? argv[1] : ""};
    kt_error error = {0};
    kt_status status = argc == 4 ? open_subject(&s, argv[2], argv[3], &error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status = call(&s, &error);
    if (status != KT_OK)
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    kt_simulation_free(s.simulation);
    kt_data_free(s.data);
    kt_model_free(s.model);
    kt_scene_free(&s.scene);
    free(s.work);
    return status == KT_OK ? 0 : 1;
}
