/* A scene that runs with its events. */
#ifndef KT_TEST_SCENE_RUNNING_H
#define KT_TEST_SCENE_RUNNING_H

#include "kinetree/scene.h"

#include "collect.h"

typedef struct running {
    kt_scene scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_scene_watch *watch;
} running;

/* What reading the last scene has reported. */
extern kt_collected running_faults;

bool running_parse(const char *text, const kt_scene_options *options, kt_scene *scene);

/* Starts `to->scene`. */
bool running_start_read(running *to);

bool running_start(const char *text, const kt_scene_options *options, running *to);

/* Also after a start that failed. */
void running_stop(running *of);

#endif
