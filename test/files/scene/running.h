/* A scene that runs with its events, for the running test (see fixture.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_RUNNING_H
#define KT_TEST_SCENE_RUNNING_H

#include "kinetree/scene.h"

#include "collect.h"

typedef struct running {
    kt_scene *scene;
    kt_model *model;
    kt_simulation *simulation;
    kt_scene_watch *watch;
} running;

/* What reading the last scene has reported. */
extern kt_collected running_faults;

bool running_parse(const char *text, const kt_scene_options *options, kt_scene *scene);

/* The scene of a text that must be right. */
kt_scene *running_read(const char *text, const kt_scene_options *options);

/* Begins a scene whose simulation or events may be rejected. */
kt_status running_open(running *to, kt_scene *scene, const kt_simulation_options *options, kt_error *error);

/* Begins a scene, of which nothing may fail. */
running running_begin(kt_scene *scene, unsigned record);
running running_start(const char *text, const kt_scene_options *options);

/* Checks that a scene has one fault, with these words, at a place (NULL: any). */
void running_check_fault(const char *what, const char *text, const char *place, const char *words);

/* Memory for saved states of a simulation, which the running test owns. */
void *running_room(const running *r, size_t count);

/* Advances to a time, which must not fail. */
void running_advance(const running *r, double time);

#endif
