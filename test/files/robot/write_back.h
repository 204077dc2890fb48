/* Mechanisms written as robots, and what is reported on the way. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_WRITE_BACK_H
#define KT_TEST_ROBOT_WRITE_BACK_H

#include "files/scene/collect.h"
#include "told.h"

#include "kinetree/export.h"
#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Writes a mechanism to *text, which the running test owns. */
static inline kt_status write_back(const kt_description *d, kt_robot_format format, told *t, char **text,
                                   kt_error *error) {
    size_t size = 0;
    FILE *stream = open_memstream(text, &size);
    memset(t, 0, sizeof *t);
    if (stream == NULL)
        return KT_ERROR_MEMORY;
    const kt_status status = kt_robot_write(d, format, stream, hear, t, error);
    (void)fclose(stream);
    kt_test_own(*text, free);
    return status;
}

/* Writes a mechanism that has a place in the format, and reads it back. The test ends if a call fails. */
static inline const kt_scene *come_back(const kt_description *d, kt_robot_format format,
                                        const kt_robot_options *options, told *t) {
    kt_scene *back = kt_test_scene_place();
    char *text = NULL;
    kt_error error = {0};
    kt_need_fine("written", write_back(d, format, t, &text, &error), &error);
    const kt_status status = kt_robot_parse("back", text, strlen(text), options, back, NULL, NULL, &error);
    if (status != KT_OK)
        kt_note("%s", text);
    kt_need_fine("read", status, &error);
    return back;
}

/* Our body that a joint of this name moves; 0: none. */
static inline int body_of_joint(const kt_model *model, const char *joint) {
    int b = kt_model_body_count(model) - 1;
    while (b > 0 && strcmp(kt_joint_name(model, b), joint) != 0)
        b--;
    return b;
}

/* A body of 1 kg and 1 kg m^2. */
static inline kt_body make_body(const char *name, const char *parent, kt_joint_type type) {
    kt_body b = kt_body_of(name, parent, type, 1.0);
    b.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    return b;
}

#endif
