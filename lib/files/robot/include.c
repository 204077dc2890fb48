/* Files that a robot includes.
 *
 * These files are in the folder of the robot, or in folders that the caller names (options->search, options->allow). A
 * path to another folder is rejected, also if the path leads there through links of the file system. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath, stat */
#include "base/text.h"
#include "document/file.h"
#include "robot/robot.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Whether a file is in a folder, after links of the file system are followed. Returns true for a missing file, because
 * reading then reports the fault. */
static bool lies_in(const char *path, const char *folder) {
    char *file = realpath(path, NULL), *base = realpath(folder, NULL);
    const size_t length = base != NULL ? strlen(base) : 0;
    const bool is_root = length == 1; /* "/" */
    const bool lies =
        file == NULL || (base != NULL && strncmp(file, base, length) == 0 && (is_root || file[length] == '/'));
    free(file);
    free(base);
    return lies;
}

bool kt_include_exists(const char *path, bool folder) {
    struct stat status;
    return stat(path, &status) == 0 && (folder ? S_ISDIR(status.st_mode) : S_ISREG(status.st_mode));
}

/* Whether a path is in one of several folders, which ':' separates, after links are followed. */
static bool lies_in_any(kt_reader *r, const char *path, const char *folders) {
    for (const char *at = folders; at != NULL && *at != '\0';) {
        const size_t size = strcspn(at, ":");
        const char *folder = size > 0 ? kt_reader_text(r, &r->scratch, at, size) : NULL;
        if (size > 0 && folder == NULL)
            return false;
        if (folder != NULL && lies_in(path, folder))
            return true;
        at += size + (at[size] == ':');
    }
    return false;
}

static bool begins_with_folder(const char *path, const char *folder) {
    const size_t length = folder != NULL ? strlen(folder) : 0;
    return length > 0 && strncmp(path, folder, length) == 0 && path[length] == '/';
}

const char *kt_include_relative(kt_reader *r, const kt_robot_source *source, const kt_element *e, const char *name) {
    const char *slash = e->file != NULL ? strrchr(e->file, '/') : NULL;
    const bool is_outside = slash != NULL && e->file[0] == '/' && !begins_with_folder(e->file, source->folder);
    const size_t folder = source->folder != NULL && !is_outside ? strlen(source->folder) + 1 : 0;
    const size_t length = slash != NULL && (size_t)(slash - e->file) > folder ? (size_t)(slash - e->file) - folder : 0;
    return kt_robot_print(r, &r->scratch, "%.*s%s%s", (int)length, length > 0 ? e->file + folder : "",
                          length > 0 ? "/" : "", name);
}

/* The path to open, of a name that is relative to the robot's folder, or absolute; NULL: no memory. */
static const char *whole_path(kt_reader *r, const kt_robot_source *source, const char *name) {
    const bool is_absolute = name[0] == '/';
    return kt_robot_print(r, &r->keep, "%s%s%s", is_absolute ? "" : source->folder, is_absolute ? "" : "/", name);
}

bool kt_include_is_there(kt_reader *r, const kt_robot_source *source, const char *name) {
    const char *path = source->folder != NULL ? whole_path(r, source, name) : NULL;
    return path != NULL && (kt_include_exists(path, false) || kt_include_exists(path, true));
}

/* The real path of a file, after links are followed, if a folder that the caller names has it; else NULL. */
static const char *find_allowed(kt_reader *r, const kt_robot_source *source, const char *path) {
    char *real = realpath(path, NULL);
    const char *found = NULL;
    if (real != NULL && (lies_in(real, source->folder) || lies_in_any(r, real, source->options->allow) ||
                         lies_in_any(r, real, source->options->search))) {
        found = kt_reader_text(r, &r->keep, real, strlen(real));
    }
    free(real);
    return found;
}

const char *kt_include_path(kt_reader *r, const kt_robot_source *source, const kt_element *e, const char *name) {
    if (source->folder == NULL) {
        (void)kt_robot_fault(r, e, "a robot that is no file, but text, cannot include files");
        return NULL;
    }
    const bool is_plain = kt_path_is_inner(name);
    const char *path = whole_path(r, source, name);
    if (path == NULL)
        return NULL;
    if (is_plain && lies_in(path, source->folder))
        return path;
    const char *allowed = find_allowed(r, source, path);
    if (allowed == NULL && !r->out_of_memory)
        (void)kt_robot_fault(r, e, "%s",
                             is_plain ? "the file lies outside of the model's folder, by a link; allow its folder "
                                        "(--allow FOLDER)"
                                      : "a file is included from the model's folder alone, and this one lies "
                                        "elsewhere or nowhere; allow its folder (--allow FOLDER)");
    return allowed;
}

bool kt_include_is_circular(const kt_element *e, const char *outermost, const char *path, int most) {
    int depth = 0;
    for (; e->by != NULL && e->file != outermost; e = e->by)
        if (strcmp(e->file, path) == 0 || ++depth == most)
            return true;
    return false;
}

kt_element *kt_include_read(kt_reader *r, const kt_element *e, const char *path, size_t *bytes) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {0};
    kt_element *root = NULL;
    if (r->included >= KT_INCLUDED_MOST) {
        (void)kt_robot_fault(r, e, "more than %d files are included; a file that is included again counts again",
                             (int)KT_INCLUDED_MOST);
        return NULL;
    }
    r->included++;
    const kt_status status = kt_file_read(path, &text, &size, &error);
    if (status == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(r);
    else if (status != KT_OK)
        (void)kt_robot_fault(r, e, "%s", error.message);
    if (status != KT_OK)
        return NULL;
    *bytes += size;
    if (*bytes > KT_FILE_SIZE_MAX)
        (void)kt_robot_fault(r, e, "the included files have more than %d MB", KT_FILE_SIZE_MAX >> 20);
    else if (!kt_xml_parse_included(r, text, size, path, e, &root))
        root = NULL;
    free(text);
    return root;
}
