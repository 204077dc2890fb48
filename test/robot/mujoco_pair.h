/* A robot in a file, read here and by MuJoCo itself. */
#ifndef KT_TEST_ROBOT_MUJOCO_PAIR_H
#define KT_TEST_ROBOT_MUJOCO_PAIR_H

#include "check.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <mujoco/mujoco.h>
#include <string.h>

typedef struct mujoco_pair {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    mjModel *m;
    mjData *d;
} mujoco_pair;

/* A failure fails the test and returns false. Either way release_mujoco_pair may follow. */
static inline bool load_mujoco_pair(mujoco_pair *p, const char *path, const kt_robot_options *options) {
    kt_error error = {0};
    char said[1000] = "";
    memset(p, 0, sizeof *p);
    if (kt_robot_read(path, options, &p->scene, NULL, NULL, &error) != KT_OK ||
        kt_model_compile(&p->scene.description, NULL, &p->model, &error) != KT_OK ||
        kt_data_create(p->model, &p->data, &error) != KT_OK)
        return kt_note("%s: %s", error.where, error.message), kt_check_true("it is read and compiled", false);
    p->m = mj_loadXML(path, NULL, said, sizeof said);
    if (p->m == NULL)
        return kt_note("%s", said), kt_check_true("MuJoCo reads it", false);
    p->d = mj_makeData(p->m);
    return true;
}

static inline void release_mujoco_pair(mujoco_pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->model);
    kt_scene_free(&p->scene);
    if (p->d != NULL)
        mj_deleteData(p->d);
    if (p->m != NULL)
        mj_deleteModel(p->m);
}

#endif
