/* Files that a robot includes.
 *
 * They are looked for in the folder of the robot alone: a path that leads out of it, by its words or by links of the
 * file system, is refused. */
#define _XOPEN_SOURCE 700 /* realpath, stat */
#include "import/robot.h"
#include "scene/file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Whether a path is relative and has no '..' in it. */
static bool is_inner(const char *path) {
    if (path[0] == '/' || path[0] == '\0' || strchr(path, '\\') != NULL)
        return false;
    for (const char *part = path; part != NULL; part = strchr(part, '/')) {
        part += *part == '/';
        if (strncmp(part, "..", 2) == 0 && (part[2] == '/' || part[2] == '\0'))
            return false;
    }
    return true;
}

/* Whether a file lies in a folder, links of the file system followed. One that does not exist does: reading says so. */
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

const char *kt_include_relative(kt_reader *r, const kt_robot_source *source, const kt_element *e, const char *name) {
    const size_t folder = source->folder != NULL ? strlen(source->folder) + 1 : 0;
    const char *slash = e->file != NULL ? strrchr(e->file, '/') : NULL;
    const size_t length = slash != NULL && (size_t)(slash - e->file) > folder ? (size_t)(slash - e->file) - folder : 0;
    const size_t room = length + strlen(name) + 2;
    char *whole = kt_pool_take(&r->scratch, room, 1);
    if (whole == NULL)
        (void)kt_reader_out_of_memory(r);
    else
        (void)snprintf(whole, room, "%.*s%s%s", (int)length, length > 0 ? e->file + folder : "", length > 0 ? "/" : "",
                       name);
    return whole;
}

const char *kt_include_path(kt_reader *r, const kt_robot_source *source, const kt_element *e, const char *name) {
    if (source->folder == NULL || !is_inner(name)) {
        (void)kt_robot_fault(r, e, "%s",
                             source->folder == NULL ? "a robot that is no file, but text, cannot include files"
                                                    : "a file is included from the model's folder alone, by a path "
                                                      "without '..' at the beginning or within");
        return NULL;
    }
    const size_t room = strlen(source->folder) + strlen(name) + 2;
    char *path = kt_pool_take(&r->keep, room, 1);
    if (path == NULL) {
        (void)kt_reader_out_of_memory(r);
        return NULL;
    }
    (void)snprintf(path, room, "%s/%s", source->folder, name);
    if (lies_in(path, source->folder))
        return path;
    (void)kt_robot_fault(r, e, "the file lies outside of the model's folder, by a link");
    return NULL;
}

kt_element *kt_include_read(kt_reader *r, const kt_element *e, const char *path, size_t *bytes) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {0};
    kt_element *root = NULL;
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
