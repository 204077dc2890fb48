/* The subject of a program whose instructions are counted: a scene's model with the kernels of the baseline, data, and
 * a simulation with fixed steps. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PLAN_SUBJECT_H
#define KT_PLAN_SUBJECT_H

#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>

enum { STEPS = 20 };

typedef struct subject {
    const char *what;
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_data *data;
    kt_run run;
} subject;

/* Reads the scene and compiles its model; the run has steps of 1e-4 of the scene's duration. */
static kt_status open_subject(subject *s, const char *method, const char *path, kt_error *error) {
    kt_model_options options = kt_model_options_default();
    options.isa = KT_ISA_BASE; /* valgrind lacks AVX-512 */
    kt_status status = kt_scene_read(path, &s->scene, NULL, NULL, error);
    if (status == KT_OK)
        status = kt_model_compile(&s->scene.description, &options, &s->model, error);
    if (status == KT_OK)
        status = kt_data_create(s->model, &s->data, error);
    s->run = kt_run_default();
    s->run.integrator = method;
    s->run.step = 1e-4 * s->scene.run.duration;
    return status;
}

/* Reports a failure, releases everything, and returns the program's exit status. */
static int close_subject(subject *s, kt_status status, const kt_error *error) {
    if (status != KT_OK)
        fprintf(stderr, "%s: %s\n", error->where, error->message);
    kt_simulation_free(s->simulation);
    kt_data_free(s->data);
    kt_model_free(s->model);
    kt_scene_free(&s->scene);
    return status == KT_OK ? 0 : 1;
}

#endif
