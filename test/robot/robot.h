/* Shared helpers for the tests of the readers of robots. ROBOT is the file's name in messages. */
#ifndef KT_TEST_IMPORT_ROBOT_H
#define KT_TEST_IMPORT_ROBOT_H

#include "../scene/collect.h"
#include "check.h"
#include "note.h"

#include "kinetree/import.h"

#include <stdio.h>
#include <string.h>

static kt_collected faults;

static inline kt_status parse(const char *text, const kt_robot_options *options, kt_scene *scene) {
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, ROBOT);
    return kt_robot_parse(ROBOT, text, strlen(text), options, scene, kt_collect, &faults, &error);
}

static inline bool parse_right(const char *text, const kt_robot_options *options, kt_scene *scene) {
    const kt_status status = parse(text, options, scene);
    if (status != KT_OK)
        kt_note("%s", faults.text);
    return status == KT_OK || kt_check_true("it is read", false);
}

static inline const kt_body *find_body(const kt_scene *scene, const char *name) {
    for (int i = 0; i < scene->description.body_count; i++)
        if (strcmp(scene->description.bodies[i].name, name) == 0)
            return &scene->description.bodies[i];
    (void)kt_check_true(name, false);
    return &scene->description.bodies[0];
}

#endif
