/* Questions to today's MuJoCo: mujoco_wasm.mjs, which node runs once for all files. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_NODE_H
#define KT_TEST_ROBOT_NODE_H

#include "check.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Whether the package is here; else the test reports that it is skipped. */
static inline bool has_mujoco(void) {
    const bool is_here = getenv("KT_MUJOCO_WASM") != NULL;
    if (!is_here)
        kt_skip("today's MuJoCo", "KT_MUJOCO_WASM does not name the folder of npm's @mujoco/mujoco");
    return is_here;
}

/* Begins to answer for files, in their order. `states` is a number of states, or another word of the script. NULL after
 * a failed check. */
static inline FILE *ask_mujoco(const char *states, const char *const *paths, int count) {
    size_t room = 2000, used = 0;
    for (int i = 0; i < count; i++)
        room += strlen(paths[i]) + 4;
    char *command = malloc(room);
    FILE *from = NULL;
    if (command != NULL)
        used = (size_t)snprintf(command, room, "node '%s' '%.1000s' %s", SCRIPT, getenv("KT_MUJOCO_WASM"), states);
    for (int i = 0; i < count && used > 0 && used < room; i++)
        used += (size_t)snprintf(command + used, room - used, " '%s'", paths[i]);
    if (used > 0 && used < room)
        from = popen(command, "r");
    free(command);
    (void)kt_check_true("node runs", from != NULL);
    return from;
}

/* Returns whether MuJoCo reads the next file. If it rejects the file, the test reports the reason. */
static inline bool is_read_by_mujoco(FILE *from, const char *path) {
    char word[1000];
    if (!kt_check_true("its file is asked", fscanf(from, "%999s", word) == 1 && strcmp(word, path) == 0) ||
        !kt_check_true("it is answered", fscanf(from, "%999s", word) == 1))
        return false;
    if (strcmp(word, "read") == 0)
        return true;
    kt_note("%s: rejected by MuJoCo:%s", path, fgets(word, sizeof word, from) != NULL ? word : "");
    return false;
}

static inline void end_answers(FILE *from) {
    while (fgetc(from) != EOF) /* node may still write the end of the last line */
        continue;
    kt_check_equal_int("node ends", pclose(from), 0);
}

#endif
