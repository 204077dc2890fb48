/* The folder of compiled files.
 *
 * A file is compiled in a folder of its own and then renamed, so that a name always belongs to a whole file. Processes
 * that compile the same file at the same time both end with it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _DEFAULT_SOURCE 1 /* mkdtemp on systems that lack it in POSIX */
#include "command.h"
#include "native/native.h"
#include "records/output.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Joins a folder and a name. Returns false if the path is too long. */
static bool join_path(char path[KT_NATIVE_PATH], const char *folder, const char *name) {
    return snprintf(path, KT_NATIVE_PATH, "%s/%s", folder, name) < KT_NATIVE_PATH;
}

/* Makes a folder with all folders above, for this user alone. */
static bool make_folder(const char *path) {
    char part[KT_NATIVE_PATH];
    (void)snprintf(part, sizeof part, "%s", path);
    for (char *at = strchr(part + 1, '/'); at != NULL; at = strchr(at + 1, '/')) {
        *at = '\0';
        (void)mkdir(part, 0700);
        *at = '/';
    }
    return mkdir(part, 0700) == 0 || errno == EEXIST;
}

/* Whether only this user can write to a file or folder. */
static bool is_private(const struct stat *status) {
    return status->st_uid == geteuid() && (status->st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

bool kt_code_cache_has(const char *command, const char *path, bool *is_foreign) {
    struct stat status;
    *is_foreign = false;
    if (stat(path, &status) != 0)
        return false;
    *is_foreign = !is_private(&status) || !S_ISREG(status.st_mode);
    if (*is_foreign)
        kt_say("%s: --native: others can write %s, which is not loaded: remove it, or set XDG_CACHE_HOME to a folder "
               "of your own",
               command, kt_show(path).text);
    return !*is_foreign;
}

static bool name_cache(char folder[KT_NATIVE_PATH]) {
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    if (cache != NULL && cache[0] == '/')
        return join_path(folder, cache, "kinetree");
    return home != NULL && home[0] == '/' && join_path(folder, home, ".cache/kinetree");
}

bool kt_code_cache_open(kt_code_cache *cache, const char *command) {
    struct stat status;
    *cache = (kt_code_cache){.is_temporary = false};
    const bool is_named = name_cache(cache->folder);
    if (is_named && make_folder(cache->folder) && access(cache->folder, W_OK | X_OK) == 0 &&
        stat(cache->folder, &status) == 0 && is_private(&status))
        return true;
    kt_say("%s: --native: compiled files cannot be kept: %s%s; set XDG_CACHE_HOME to a folder of your own", command,
           is_named ? kt_show(cache->folder).text : "neither XDG_CACHE_HOME nor HOME is a folder",
           is_named ? " cannot be written by this user alone" : "");
    const char *folder = kt_temporary_folder();
    cache->is_temporary = true;
    if (join_path(cache->folder, folder, "kinetree-XXXXXX") && mkdtemp(cache->folder) != NULL)
        return true;
    kt_say("%s: --native: no folder for temporary files can be made in %s: %s; set TMPDIR to a folder of your own, or "
           "leave --native out",
           command, kt_show(folder).text, strerror(errno));
    return false;
}

bool kt_code_cache_path(const kt_code_cache *cache, const char *key, char path[KT_NATIVE_PATH]) {
    return join_path(path, cache->folder, key);
}

bool kt_code_cache_begin(kt_code_cache *cache, const char *command) {
    if (join_path(cache->build, cache->folder, "build-XXXXXX") && mkdtemp(cache->build) != NULL)
        return true;
    kt_say("%s: --native: a folder in %s cannot be made: %s", command, kt_show(cache->folder).text, strerror(errno));
    return false;
}

bool kt_code_cache_end(kt_code_cache *cache, const char *command, const char *path, bool fine) {
    static const char *const made[] = {"native.c", "native.h", "native.log", "native.so"};
    char file[KT_NATIVE_PATH];
    if (fine && join_path(file, cache->build, "native.so") && (chmod(file, 0600) != 0 || rename(file, path) != 0)) {
        kt_say("%s: --native: %s cannot be written: %s", command, kt_show(path).text, strerror(errno));
        fine = false;
    }
    for (size_t i = 0; i < sizeof made / sizeof *made; i++)
        if (join_path(file, cache->build, made[i]))
            (void)unlink(file);
    (void)rmdir(cache->build);
    return fine;
}
