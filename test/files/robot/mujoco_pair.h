/* A robot in a file, read here and by MuJoCo itself. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_MUJOCO_PAIR_H
#define KT_TEST_ROBOT_MUJOCO_PAIR_H

#include "files/scene/collect.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <mujoco/mujoco.h>

typedef struct mujoco_pair {
    kt_scene *scene;
    kt_model *model;
    kt_data *data;
    mjModel *m;
    mjData *d;
} mujoco_pair;

static inline void release_mujoco_model(void *model) { mj_deleteModel(model); }

static inline void release_mujoco_data(void *data) { mj_deleteData(data); }

/* The running test owns both. A failure ends the test. */
static inline void load_mujoco_pair(mujoco_pair *p, const char *path, const kt_robot_options *options) {
    kt_error error = {0};
    char said[1000] = "";
    p->scene = kt_test_scene_place();
    kt_need_fine("it is read", kt_robot_read(path, options, p->scene, NULL, NULL, &error), &error);
    p->model = kt_test_model(&p->scene->description, NULL);
    p->data = kt_test_data(p->model);
    p->m = mj_loadXML(path, NULL, said, sizeof said);
    kt_need(p->m != NULL || kt_check_text("MuJoCo reads it", said, ""));
    kt_test_own(p->m, release_mujoco_model);
    p->d = mj_makeData(p->m);
    kt_test_own(p->d, release_mujoco_data);
}

#endif
