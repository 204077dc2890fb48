/* A mechanism from the text of a scene: its model and data. The running test owns them, and ends if
 * they cannot be made. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SIMULATION_PARSED_H
#define KT_TEST_SIMULATION_PARSED_H

#include "scenes.h"

#include "kinetree/scene.h"

#include <stdlib.h>
#include <string.h>

static inline void kt_release_scene(void *scene) {
    kt_scene_free(scene);
    free(scene);
}

/* Gives a scene to the running test, which keeps a copy to free. */
static inline void kt_parsed_own(const kt_scene *scene) {
    kt_scene *kept = malloc(sizeof *kept);
    kt_need(kt_check_true("memory", kept != NULL));
    *kept = *scene;
    kt_test_own(kept, kt_release_scene);
}

static inline void kt_parsed_scene(const char *text, kt_scene *scene) {
    kt_error error = {0};
    kt_need_fine("scene", kt_scene_parse("x", text, strlen(text), scene, NULL, NULL, &error), &error);
    kt_parsed_own(scene);
}

typedef struct kt_parsed {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
} kt_parsed;

static inline void kt_parsed_make(kt_parsed *m, const char *text) {
    memset(m, 0, sizeof *m);
    kt_parsed_scene(text, &m->scene);
    m->model = kt_scene_compile(&m->scene.description);
    m->data = kt_test_data(m->model);
}

#endif
