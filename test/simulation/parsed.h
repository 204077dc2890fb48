/* A mechanism from the text of a scene: its model and data. */
#ifndef KT_TEST_SIMULATION_PARSED_H
#define KT_TEST_SIMULATION_PARSED_H

#include "scenes.h"

#include "kinetree/scene.h"

#include <string.h>

typedef struct kt_parsed {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
} kt_parsed;

/* Returns false after a failed check. kt_parsed_free must follow in any case. */
static inline bool kt_parsed_make(kt_parsed *m, const char *text) {
    kt_error error = {0};
    memset(m, 0, sizeof *m);
    return kt_fine("scene", kt_scene_parse("x", text, strlen(text), &m->scene, NULL, NULL, &error), &error) &&
           kt_fine("model", kt_model_compile(&m->scene.description, NULL, &m->model, &error), &error) &&
           kt_fine("data", kt_data_create(m->model, &m->data, &error), &error);
}

static inline void kt_parsed_free(kt_parsed *m) {
    kt_data_free(m->data);
    kt_model_free(m->model);
    kt_scene_free(&m->scene);
}

#endif
