/* Finds the folder of the bundled scenes, and other installed files. If the environment variable KINETREE_SCENES is
 * set, it names the folder of the scenes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/bundled.h"
#include "command.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { FOLDER_SIZE = 4096 };

static bool is_folder(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

/* Linux has /proc/self/exe; on other systems this returns false. */
static bool find_own_folder(char *folder, size_t size) {
    ssize_t length = readlink("/proc/self/exe", folder, size - 1);
    if (length <= 0)
        return false;
    folder[length] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash == NULL)
        return false;
    *slash = '\0';
    return true;
}

bool kt_find_installed(const char *const places[KT_PLACES], const char *name, char *path, size_t size) {
    char own[FOLDER_SIZE];
    for (int i = find_own_folder(own, sizeof own) ? 0 : 1; i < KT_PLACES; i++)
        if ((size_t)snprintf(path, size, "%s%s%s%s%s", i == 0 ? own : "", i == 0 ? "/" : "", places[i],
                             *name != '\0' ? "/" : "", name) < size &&
            access(path, R_OK) == 0)
            return true;
    return false;
}

int kt_is_bundled_scene(const struct dirent *entry) {
    const size_t length = strlen(entry->d_name);
    return length > 5 && entry->d_name[0] != '.' && strcmp(entry->d_name + length - 5, ".yaml") == 0;
}

bool kt_bundled_find(char *folder, size_t size, bool reports) {
    static const char *const places[KT_PLACES] = {KT_SCENES_FROM_PROGRAM, KT_SCENES_SOURCE, KT_SCENES_INSTALLED};
    const char *given = getenv("KINETREE_SCENES");
    if (given != NULL && *given != '\0') {
        snprintf(folder, size, "%s", given);
        if (is_folder(folder))
            return true;
        if (reports)
            kt_say("demo: KINETREE_SCENES is '%s', which is no folder", given);
        return false;
    }
    if (kt_find_installed(places, "", folder, size))
        return true;
    if (reports)
        kt_say("demo: the bundled scenes are neither next to the program (%s) nor in %s; set KINETREE_SCENES=FOLDER to "
               "their folder",
               KT_SCENES_FROM_PROGRAM, KT_SCENES_INSTALLED);
    return false;
}
