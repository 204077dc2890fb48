/* Shared helpers for the tests of the readers of robots. ROBOT is the file's name in messages. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_IMPORT_ROBOT_H
#define KT_TEST_IMPORT_ROBOT_H

#include "check.h"
#include "files/scene/collect.h"
#include "note.h"

#include "kinetree/import.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static kt_collected faults;

static inline kt_status parse(const char *text, const kt_robot_options *options, kt_scene *scene) {
    kt_error error = {0};
    memset(&faults, 0, sizeof faults);
    (void)snprintf(faults.path, sizeof faults.path, ROBOT);
    return kt_robot_parse(ROBOT, text, strlen(text), options, scene, kt_collect, &faults, &error);
}

/* The scene of a robot, for the running test (see fixture.h). */
static inline kt_scene *test_robot(const char *text, const kt_robot_options *options) {
    kt_scene *scene = kt_test_scene_place();
    const kt_status status = parse(text, options, scene);
    if (status != KT_OK) {
        kt_note("%s", faults.text);
        kt_need(kt_check_true("it is read", false));
    }
    return scene;
}

/* The scene of a robot's file. */
static inline kt_scene *test_robot_file(const char *path, const kt_robot_options *options) {
    kt_scene *scene = kt_test_scene_place();
    kt_error error = {0};
    kt_need_fine(path, kt_robot_read(path, options, scene, NULL, NULL, &error), &error);
    return scene;
}

/* printf-style. */
static inline kt_scene *test_robot_of(const kt_robot_options *options, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static inline kt_scene *test_robot_of(const kt_robot_options *options, const char *format, ...) {
    static char text[4000];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return test_robot(text, options);
}

static inline const kt_body *find_body(const kt_scene *scene, const char *name) {
    for (int i = 0; i < scene->description.body_count; i++)
        if (strcmp(scene->description.bodies[i].name, name) == 0)
            return &scene->description.bodies[i];
    (void)kt_check_true(name, false);
    return &scene->description.bodies[0];
}

#endif
