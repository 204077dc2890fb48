/* Reads the events of a run from its summary. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/marks.h"

#include "command.h"
#include "text/input.h"
#include "text/json.h"

#include <stdio.h>
#include <stdlib.h>

static int say_no_marks(const char *command, const char *path) {
    return kt_reject(KT_EXIT_SCENE,
                     "%s: --marks: %s has none: it takes the file of 'kinetree run SCENE --summary FILE' for a scene "
                     "with events, hard contacts, slack ropes or friction that sticks",
                     command, path);
}

int kt_marks_load(const char *path, const char *command, kt_marks *marks, char *name, size_t size) {
    kt_error error = {0};
    char *text = NULL;
    size_t length = 0;
    if (kt_input_read(path, &kt_input_summary, &text, &length, &error) != KT_OK)
        return kt_reject(KT_EXIT_SCENE, "%s: --marks: %s", command, kt_words_of(&error).text);
    json_t *root = kt_input_json(path, text, length, "summary");
    free(text);
    if (root == NULL)
        return KT_EXIT_SCENE;
    const bool fine = kt_marks_read(marks, root);
    const char *scene = json_string_value(json_object_get(root, "scene"));
    if (name != NULL)
        (void)snprintf(name, size, "%s", scene != NULL ? scene : "");
    json_decref(root);
    return fine ? -1 : say_no_marks(command, path);
}
