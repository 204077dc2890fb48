/* `implicit-count TASK METHOD SCENE` makes one call after twenty steps of a simulation, for callgrind to count its
 * instructions. The tasks are `simulate`, a further step; `step`, kt_step_evaluate from the same state; `derivatives`
 * and `adjoint`. The kernels are those of the baseline. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subject.h"

#include "kinetree/sensitivity.h"

#include <stdlib.h>
#include <string.h>

enum { MOST = 64 };

typedef struct stepping {
    subject of;
    void *work;
    size_t size;
    kt_step step;
} stepping;

static kt_status begin(stepping *s, const char *method, const char *path, kt_error *error) {
    kt_status status = open_subject(&s->of, method, path, error);
    if (status != KT_OK)
        return status;
    status = kt_simulation_create(s->of.model, &s->of.run, NULL, &s->of.simulation, error);
    for (int k = 0; k < STEPS && status == KT_OK; k++)
        status = kt_simulation_step(s->of.simulation, HUGE_VAL, error);
    s->step =
        (kt_step){.method = kt_method_find(method), .t = kt_simulation_time(s->of.simulation), .h = s->of.run.step};
    s->size = kt_step_work_size(s->of.model, s->step.method);
    s->work = aligned_alloc(KT_ALIGNMENT, (s->size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
    return status == KT_OK && s->work == NULL ? KT_ERROR_MEMORY : status;
}

kt_status call(const stepping *s, kt_error *error);

__attribute__((noinline)) kt_status call(const stepping *s, kt_error *error) {
    static double next_q[MOST], next_v[MOST], matrices[6 * MOST * MOST], y[5 * MOST] = {1.0};
    const double *q = kt_simulation_positions(s->of.simulation), *v = kt_simulation_velocities(s->of.simulation);
    const size_t n = (size_t)kt_model_nv(s->of.model);
    if (strcmp(s->of.what, "simulate") == 0)
        return kt_simulation_step(s->of.simulation, HUGE_VAL, error);
    if (strcmp(s->of.what, "step") == 0)
        return kt_step_evaluate(s->of.model, s->of.data, s->work, s->size, &s->step, q, v, next_q, next_v, error);
    if (strcmp(s->of.what, "derivatives") == 0)
        return kt_step_derivatives(s->of.model, s->of.data, s->work, s->size, &s->step, q, v, next_q, next_v, matrices,
                                   matrices + 4 * n * n, error);
    return kt_step_adjoint(s->of.model, s->of.data, s->work, s->size, &s->step, q, v, y, y + 2 * n, y + 4 * n, error);
}

int main(int argc, char **argv) {
    stepping s = {.of.what = argc == 4 ? argv[1] : ""};
    kt_error error = {0};
    kt_status status = argc == 4 ? begin(&s, argv[2], argv[3], &error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status = call(&s, &error);
    free(s.work);
    return close_subject(&s.of, status, &error);
}
