/* Files of meshes that a robot names, and models on the search path.
 *
 * "package://NAME/REST" and "model://NAME/REST" are searched in the folders of the search path, in the order given. For
 * meshes, the folder of the robot and those around it follow. A match is FOLDER/NAME/REST, or FOLDER/REST if FOLDER
 * itself is called NAME. Without REST, NAME is a folder or a file. "file://PATH" and PATH are used as they are if they
 * are absolute. Else they are in the robot's folder, or on the search path. Meshes may lie anywhere, since robots are
 * published as NAME/urdf next to NAME/meshes. Included files may not (include.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "base/text.h"
#include "robot/robot.h"

#include <stdlib.h>
#include <string.h>

/* How many folders around the robot's own are searched. */
enum { AROUND_MOST = 6 };

typedef struct search {
    kt_reader *r;
    const char *package; /* not ended by a zero; NULL: none */
    int length;
    const char *rest; /* below the package */
    const char *found;
} search;

/* Keeps the path if there is such a file. */
static bool try_path(search *s, const char *folder, int size, const char *package, int length) {
    const char *path = kt_robot_print(s->r, &s->r->scratch, "%.*s%s%.*s%s%s", size, folder, size > 0 ? "/" : "", length,
                                      length > 0 ? package : "", length > 0 && *s->rest != '\0' ? "/" : "", s->rest);
    char *real = path != NULL ? realpath(path, NULL) : NULL;
    if (real != NULL)
        s->found = kt_reader_text(s->r, &s->r->keep, real, strlen(real));
    free(real);
    return s->found != NULL;
}

/* Whether the last part of a folder's path is the name of the package. */
static bool is_package(const search *s, const char *folder, int size) {
    return size >= s->length && strncmp(folder + size - s->length, s->package, (size_t)s->length) == 0 &&
           (size == s->length || folder[size - s->length - 1] == '/');
}

static bool try_folder(search *s, const char *folder, int size) {
    while (size > 1 && folder[size - 1] == '/')
        size--;
    if (s->package == NULL)
        return try_path(s, folder, size, NULL, 0);
    return try_path(s, folder, size, s->package, s->length) ||
           (is_package(s, folder, size) && try_path(s, folder, size, NULL, 0));
}

static bool try_search_path(search *s, const char *folders) {
    for (const char *at = folders; at != NULL && *at != '\0' && !s->r->out_of_memory;) {
        const size_t size = strcspn(at, ":");
        if (size > 0 && size < 4096 && try_folder(s, at, (int)size))
            return true;
        at += size + (at[size] == ':');
    }
    return false;
}

/* A folder, and those around it. */
static void try_upwards(search *s, const char *folder, int size) {
    for (int i = 0; i < AROUND_MOST && size > 0 && s->found == NULL && !s->r->out_of_memory; i++) {
        (void)try_folder(s, folder, size);
        do
            size--;
        while (size > 0 && folder[size] != '/');
    }
}

/* Around the robot's folder, and around its path as it is written: a link may have the package's name. */
static bool try_around(search *s, const char *folder) {
    char *base = realpath(folder, NULL);
    if (base != NULL)
        try_upwards(s, base, (int)strlen(base));
    try_upwards(s, folder, (int)strlen(folder));
    free(base);
    return s->found != NULL;
}

/* Splits NAME/REST, before which some write a third slash. */
static void split_package(search *s, const char *name) {
    name += strspn(name, "/");
    s->package = name;
    s->length = (int)strcspn(name, "/");
    s->rest = name + s->length + (name[s->length] == '/');
}

const char *kt_search_path(kt_reader *r, const kt_robot_source *source, const char *name) {
    search s = {.r = r};
    split_package(&s, name);
    if (s.length > 0 && strlen(name) < 4096)
        (void)try_search_path(&s, source->options->search);
    return s.found;
}

const char *kt_mesh_path(kt_reader *r, const kt_robot_source *source, const char *name) {
    search s = {.r = r, .rest = name};
    if (source->folder == NULL || *name == '\0' || strlen(name) > 4096)
        return NULL;
    if (kt_text_begins(name, "package://") || kt_text_begins(name, "model://")) {
        split_package(&s, strstr(name, "://") + 3);
        if (s.length > 0 && !try_search_path(&s, source->options->search))
            (void)try_around(&s, source->folder);
        return s.found;
    }
    s.rest = kt_text_begins(name, "file://") ? name + strlen("file://") : name;
    if (s.rest[0] == '/')
        (void)try_path(&s, "", 0, NULL, 0);
    else if (!try_folder(&s, source->folder, (int)strlen(source->folder)))
        (void)try_search_path(&s, source->options->search);
    return s.found;
}
