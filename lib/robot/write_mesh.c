/* Meshes of an export: references to the files, seen from the folder of the robot. */
#define _XOPEN_SOURCE 700 /* realpath */
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

static bool find_mesh(kt_export *x, int i, const char *folder, const char *endings) {
    const char *file = x->meshes[i].file;
    if (x->meshes[i].builtin != NULL) {
        if (endings == NULL)
            kt_export_lose(x, "meshes that MuJoCo has built in, which URDF lacks");
        return true;
    }
    char *real = file != NULL ? realpath(file, NULL) : NULL;
    if (real == NULL || access(real, R_OK) != 0)
        kt_export_lose(x, "meshes whose files are not there");
    else if (endings != NULL && !has_ending(real, endings))
        kt_export_lose(x, "meshes in formats that MuJoCo does not read (it reads STL, OBJ and MSH)");
    else if ((x->mesh_files[i] =
                  folder != NULL ? path_from(x, folder, real) : kt_pool_text(&x->pool, real, strlen(real))) == NULL) {
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
