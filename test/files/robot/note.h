/* Notes of the readers of robots. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_NOTE_H
#define KT_TEST_ROBOT_NOTE_H

#include "kinetree/scene.h"

#include <stdbool.h>
#include <string.h>

/* How many notes have these words. */
static inline int count_notes(const kt_scene *scene, const char *words) {
    int count = 0;
    for (int i = 0; i < scene->note_count; i++)
        count += strstr(scene->notes[i].what, words) != NULL;
    return count;
}

static inline bool has_note(const kt_scene *scene, const char *words) { return count_notes(scene, words) > 0; }

static inline bool has_ranked_note(const kt_scene *scene, kt_note_rank rank, const char *words) {
    bool found = false;
    for (int i = 0; i < scene->note_count; i++)
        found = found || (scene->notes[i].rank == rank && strstr(scene->notes[i].what, words) != NULL);
    return found;
}

#endif
