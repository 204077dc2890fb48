/* sense-count WHAT METHOD SCENE: twenty fixed steps (take_steps), for callgrind to count their instructions. After each
 * but the last WHAT is done: nothing; `points`, sensors with accelerations; `wrenches`, with reactions, too; `anew`,
 * the same as `wrenches` by kt_reaction_evaluate, with data of its own. The kernels are those of the baseline. */
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 20 };

typedef struct subject {
    const char *what;
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_data *data;
    kt_wrench *wrenches;
} subject;

static kt_status open_subject(subject *s, const char *method, const char *path, kt_error *error) {
    kt_model_options options = kt_model_options_default();
    kt_simulation_options extra = kt_simulation_options_default();
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
    run.record = KT_RECORD_ACCELERATION | (strcmp(s->what, "wrenches") == 0 ? (unsigned)KT_RECORD_REACTION : 0U);
    extra.kinematics = true;
    s->wrenches = calloc((size_t)(kt_model_body_count(s->model) + kt_loop_count(s->model)), sizeof *s->wrenches);
    return s->wrenches != NULL ? kt_simulation_create(s->model, &run, &extra, &s->simulation, error) : KT_ERROR_MEMORY;
}

static kt_status look(const subject *s, kt_error *error) {
    kt_record record;
    if (strcmp(s->what, "nothing") == 0)
        return KT_OK;
    if (strcmp(s->what, "anew") != 0)
        return kt_simulation_sense(s->simulation, &record, error);
    return kt_reaction_evaluate(s->model, s->data, kt_simulation_time(s->simulation),
                                kt_simulation_positions(s->simulation), kt_simulation_velocities(s->simulation), NULL,
                                NULL, s->wrenches, s->wrenches + kt_model_body_count(s->model), error);
}

kt_status take_steps(const subject *s, kt_error *error);

__attribute__((noinline)) kt_status take_steps(const subject *s, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < STEPS && status == KT_OK; k++) {
        status = kt_simulation_step(s->simulation, HUGE_VAL, error);
        if (status == KT_OK && k < STEPS - 1)
            status = look(s, error);
    }
    return status;
}

int main(int argc, char **argv) {
    subject s = {.what = argc == 4 ? argv[1] : ""};
    kt_error error = {0};
    kt_status status = argc == 4 ? open_subject(&s, argv[2], argv[3], &error) : KT_ERROR_ARGUMENT;
    if (status == KT_OK)
        status = take_steps(&s, &error);
    if (status != KT_OK)
        fprintf(stderr, "%s: %s\n", error.where, error.message);
    kt_simulation_free(s.simulation);
    kt_data_free(s.data);
    kt_model_free(s.model);
    kt_scene_free(&s.scene);
    free(s.wrenches);
    return status == KT_OK ? 0 : 1;
}
