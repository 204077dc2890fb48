/* Reading in tests: scenes from text, and the reported faults. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_COLLECT_H
#define KT_TEST_SCENE_COLLECT_H

#include "kinetree/scene.h"

#include <stdbool.h>
#include <stddef.h>

#include "fixture.h"

/* All faults of a reading, "LINE:COLUMN: MESSAGE" and a line end each. Faults that do not fit are only counted. */
typedef struct kt_collected {
    char path[256]; /* the required beginning of every `where` */
    int count;
    int strange; /* faults whose `where` is not PATH:LINE:COLUMN, that come out of order, or that are cut */
    unsigned line, column;
    kt_error first, last;
    size_t length;
    char text[1 << 16];
} kt_collected;

void kt_collect(void *user, const kt_error *fault);

/* Reads text. */
kt_status kt_collect_parse(kt_collected *faults, const char *text, kt_scene *scene);

/* The scene of a text, for the running test (see fixture.h). */
kt_scene *kt_test_scene(const char *text);

/* printf-style. */
kt_scene *kt_test_scene_of(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* The scene of a file. */
kt_scene *kt_test_scene_file(const char *path);

/* The names of the bundled scenes, such as "four-bar", in alphabetical order; NULL behind the last one. */
const char *kt_bundled(int i);
int kt_bundled_count(void);

/* The path of a bundled scene, in storage that the next call overwrites, and the scene of a name. */
const char *kt_bundled_path(const char *name);
kt_scene *kt_test_bundled(const char *name);

/* An empty scene, for other readers to fill. */
kt_scene *kt_test_scene_place(void);

/* Equal in every byte. */
bool kt_same_bytes(const void *a, const void *b, size_t size);

/* A scene with its model and data. */
typedef struct kt_opened {
    kt_scene *scene;
    kt_model *model;
    kt_data *data;
} kt_opened;

kt_opened kt_test_open(kt_scene *scene, const kt_model_options *options);

/* The text of a scene, in memory that the end of the test frees. */
const char *kt_test_written(const kt_scene *scene);

/* Checks that a scene cannot be written, with this part of the message, and that nothing is. */
void kt_check_unwritable(const char *what, const kt_scene *scene, kt_status expected, const char *part);

#endif
