/* Finds the folder of the bundled scenes. If the environment variable KINETREE_SCENES is set, it names the folder.
 * Otherwise three folders are tried, in this order. The first is relative to the installed program, so that an
 * installation can be moved, if the system provides the program's own path. The second is in the source tree from which
 * the program was built. The third is the folder in which the build was configured to install the scenes. */
#include "scene/bundled.h"
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
bool kt_own_folder(char *folder, size_t size) {
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

static bool find_near_program(char *folder, size_t size) {
    char own[FOLDER_SIZE];
    if (!kt_own_folder(own, sizeof own))
        return false;
    int length = snprintf(folder, size, "%s/%s", own, KT_SCENES_FROM_PROGRAM);
    return length > 0 && (size_t)length < size && is_folder(folder);
}

int kt_is_bundled_scene(const struct dirent *entry) {
    const size_t length = strlen(entry->d_name);
    return length > 5 && entry->d_name[0] != '.' && strcmp(entry->d_name + length - 5, ".yaml") == 0;
}

bool kt_bundled_find(char *folder, size_t size, bool reports) {
    static const char *const configured[] = {KT_SCENES_SOURCE, KT_SCENES_INSTALLED};
    const char *given = getenv("KINETREE_SCENES");
    if (given != NULL && *given != '\0') {
        snprintf(folder, size, "%s", given);
        if (is_folder(folder))
            return true;
        if (reports)
            kt_say("demo: KINETREE_SCENES is '%s', which is no folder", given);
        return false;
    }
    if (find_near_program(folder, size))
        return true;
    for (size_t i = 0; i < sizeof configured / sizeof *configured; i++) {
        snprintf(folder, size, "%s", configured[i]);
        if (is_folder(folder))
            return true;
    }
    if (reports)
        kt_say("demo: the bundled scenes are neither next to the program (%s) nor in %s; set KINETREE_SCENES=FOLDER to "
               "their folder",
               KT_SCENES_FROM_PROGRAM, KT_SCENES_INSTALLED);
    return false;
}
