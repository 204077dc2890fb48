/* Names of files: robots by their endings, and suggestions for a path that does not exist. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/names.h"
#include "command.h"
#include "open/bundled.h"
#include "open/load.h"
#include "records/output.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };

bool kt_is_robot_name(const char *path) { return kt_stem_length(path, ".urdf|.xml|.sdf|.world|.mjcf") >= 0; }

/* Builds a path from a folder and a name with an ending. Returns whether a readable file is there. */
static bool find_file(char *path, const char *folder, const char *name, const char *ending) {
    const int length = snprintf(path, PATH_SIZE, "%s%s%s", folder, name, ending);
    return length > 0 && length < PATH_SIZE && access(path, R_OK) == 0;
}

static bool suggest_bundled(const char *path) {
    char folder[PATH_SIZE - 1], file[PATH_SIZE];
    const size_t length = strlen(path);
    const bool has_ending = length > 5 && strcmp(path + length - 5, ".yaml") == 0;
    if (strchr(path, '/') != NULL || !kt_bundled_find(folder, sizeof folder, false))
        return false;
    const size_t end = strlen(folder);
    if (end + 2 > sizeof folder)
        return false;
    memcpy(folder + end, "/", 2);
    if (!find_file(file, folder, path, has_ending ? "" : ".yaml"))
        return false;
    kt_say("'kinetree demo %.*s' runs the bundled scene of this name; its file is %s",
           (int)(has_ending ? length - 5 : length), path, file);
    return true;
}

bool kt_is_scene_name(const char *path) { return kt_stem_length(path, ".yaml|.yml") >= 0 || kt_is_robot_name(path); }

static int is_scene_or_robot(const struct dirent *entry) { return kt_is_scene_name(entry->d_name); }

/* Returns the index of the file whose name is nearest to that of a path; -1: none is near. Endings do not count, since
 * they make short names alike. */
static int find_nearest_file(struct dirent **files, int count, const char *path) {
    char wanted[256];
    const char *slash = strrchr(path, '/'), *last = slash != NULL ? slash + 1 : path, *dot = strrchr(last, '.');
    int64_t effort = 10000000;
    int found = -1;
    (void)snprintf(wanted, sizeof wanted, "%.*s", dot != NULL ? (int)(dot - last) : (int)strlen(last), last);
    kt_nearest nearest = kt_nearest_make(wanted, &effort);
    for (int i = 0; i < count; i++) {
        char *ending = strrchr(files[i]->d_name, '.');
        *ending = '\0';
        (void)kt_nearest_try(&nearest, files[i]->d_name);
        *ending = '.';
        found = nearest.best == files[i]->d_name ? i : found;
    }
    return found;
}

static void free_files(struct dirent **files, int count) {
    for (int i = 0; i < count; i++)
        free(files[i]);
    free(files);
}

/* Suggests the nearest name of a scene or a robot in the folder of a path. Returns whether there is one. */
static bool suggest_nearest(const char *path) {
    char folder[PATH_SIZE];
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    struct dirent **files = NULL;
    if (name - path >= PATH_SIZE)
        return false;
    snprintf(folder, sizeof folder, "%.*s", (int)(name - path), path);
    const int count = scandir(folder[0] != '\0' ? folder : ".", &files, is_scene_or_robot, alphasort);
    const int found = find_nearest_file(files, count, path);
    if (found >= 0)
        kt_say("did you mean '%s%s'?", folder, files[found]->d_name);
    free_files(files, count);
    return found >= 0;
}

/* Suggests the bundled scene whose name is nearest to the last part of a path. */
static void suggest_near_bundled(const char *path) {
    char folder[PATH_SIZE];
    struct dirent **files = NULL;
    const bool has_folder = kt_bundled_find(folder, sizeof folder, false);
    const int count = has_folder ? scandir(folder, &files, kt_is_bundled_scene, alphasort) : 0;
    const int found = find_nearest_file(files, count, path);
    const char *best = found >= 0 ? files[found]->d_name : NULL;
    if (best != NULL)
        kt_say("did you mean the bundled scene '%s'? 'kinetree demo %.*s' runs it; its file is %s/%s", best,
               (int)strlen(best) - 5, best, folder, best);
    free_files(files, count);
}

void kt_missing_suggest(const char *path) {
    char file[PATH_SIZE];
    if (access(path, F_OK) == 0)
        return;
    if (find_file(file, "", path, ".yaml"))
        kt_say("did you mean '%s'?", file);
    else if (!suggest_bundled(path) && !suggest_nearest(path) && !kt_is_robot_name(path))
        suggest_near_bundled(path);
}
