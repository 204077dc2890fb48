/* Meshes of an export: references to the files, seen from the folder of the robot.
 *
 * MuJoCo rejects a model with a mesh that it cannot use: STL as text or with more than 200000 triangles, lines, and
 * meshes without area. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "document/file.h"
#include "mesh/mesh.h"
#include "robot/write.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

/* Whether a file's name has one of the endings, apart by blanks. */
static bool has_ending(const char *file, const char *endings) {
    const char *dot = strrchr(file, '.');
    const size_t length = dot != NULL && strchr(dot, '/') == NULL ? strlen(dot) : 0;
    for (const char *at = endings; length > 0 && at != NULL && *at != '\0'; at += strcspn(at, " ")) {
        at += strspn(at, " ");
        if (strcspn(at, " ") == length && strncasecmp(at, dot, length) == 0)
            return true;
    }
    return false;
}

/* The real path of a file, seen from a real folder: "../" for each folder that is not around both. */
static const char *path_from(kt_export *x, const char *folder, const char *file) {
    size_t same = 0, up = 0;
    for (size_t i = 0; folder[i] == file[i] && folder[i] != '\0'; i++)
        same = folder[i] == '/' ? i + 1 : same;
    const size_t length = strlen(folder);
    if (strncmp(folder, file, length) == 0 && file[length] == '/')
        same = length + 1;
    for (size_t i = same; i < length; i++)
        up += i == same || folder[i] == '/';
    const size_t rest = strlen(file) - same;
    char *path = kt_pool_take(&x->pool, 3 * up + rest + 1, 1);
    if (path == NULL)
        return NULL;
    for (size_t i = 0; i < 3 * up; i++)
        path[i] = "../"[i % 3];
    for (size_t i = 0; i <= rest; i++)
        path[3 * up + i] = file[same + i];
    return path;
}

/* Why MuJoCo rejects a mesh; NULL: it does not. */
static const char *find_mesh_fault(const char *path, bool is_stl) {
    enum { STL_MOST = 200000 };
    kt_triangles mesh = {.vertices = NULL};
    kt_error error = {0};
    const char *fault = NULL;
    char *text = NULL;
    size_t size = 0;
    if (kt_file_read(path, &text, &size, &error) != KT_OK || kt_triangles_parse(text, size, &mesh, &error) != KT_OK)
        fault = "meshes that MuJoCo rejects, since they have no triangles";
    else if (is_stl && !kt_triangles_is_binary_stl(text, size))
        fault = "meshes that MuJoCo rejects, since they are STL as text (it reads binary STL, OBJ and MSH)";
    else if (is_stl && mesh.triangle_count > STL_MOST)
        fault = "meshes that MuJoCo rejects, since they are STL with more than 200000 triangles";
    else if (mesh.is_lines || !(kt_triangles_enclosed(&mesh, KT_VOLUME_SURFACE).volume > 0.0))
        fault = "meshes that MuJoCo rejects, since they have no area";
    kt_triangles_free(&mesh);
    free(text);
    return fault;
}

/* Counts a mesh that is left out; false if it can be written. */
static bool lose_mesh(kt_export *x, const char *path, const char *endings) {
    const char *fault = NULL;
    if (path == NULL || access(path, R_OK) != 0)
        fault = "meshes whose files are not there";
    else if (endings != NULL && !has_ending(path, endings))
        fault = "meshes in formats that MuJoCo does not read (it reads STL, OBJ and MSH)";
    else if (endings != NULL)
        fault = find_mesh_fault(path, has_ending(path, " .stl "));
    if (fault != NULL)
        kt_export_lose(x, fault);
    return fault != NULL;
}

static bool find_mesh(kt_export *x, int i, const char *folder, const char *endings) {
    const char *file = x->meshes[i].file;
    char *real = file != NULL ? realpath(file, NULL) : NULL;
    if (!lose_mesh(x, real, endings) &&
        (x->mesh_files[i] = folder != NULL ? path_from(x, folder, real) : kt_pool_text(&x->pool, real, strlen(real))) ==
            NULL) {
        free(real);
        return false;
    }
    free(real);
    return true;
}

bool kt_export_find_meshes(kt_export *x, const char *endings) {
    char *folder = x->folder != NULL && x->mesh_count > 0 ? realpath(x->folder, NULL) : NULL;
    bool fine = true;
    for (int i = 0; i < x->mesh_count && fine; i++)
        fine = find_mesh(x, i, folder, endings);
    free(folder);
    return fine;
}
