/* Surfaces in formats that assimp reads. assimp receives only the file's contents, so that it cannot open another file.
 * The file's units count, but not the file's upward direction, because robots state their own. Since assimp crashes at
 * some damaged files, it runs in a separate process. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/foreign.h"

#include <string.h>

#ifdef KT_WITH_ASSIMP
#include "picture/mesh_apart.h"
#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <limits.h>
#include <stdlib.h>

enum { MOST = KT_TRIANGLES_MOST }; /* vertices, and triangles */
static const double seconds_most = 60.0;

static kt_status count_foreign(const struct aiScene *scene, size_t *vertices, size_t *triangles, kt_error *error) {
    *vertices = *triangles = 0;
    for (unsigned i = 0; i < scene->mNumMeshes; i++) {
        *vertices += scene->mMeshes[i]->mNumVertices;
        *triangles += scene->mMeshes[i]->mNumFaces;
    }
    if (*vertices > MOST || *triangles > MOST)
        return kt_error_set(error, KT_ERROR_SCENE, "", "a mesh has too many triangles");
    return *triangles > 0 ? KT_OK : kt_error_set(error, KT_ERROR_SCENE, "", "there is no triangle in the mesh");
}

/* Faces of points and lines are left out. */
static void add_foreign_mesh(const struct aiMesh *from, kt_triangles *to) {
    const int first = to->vertex_count;
    for (unsigned i = 0; i < from->mNumVertices; i++) {
        const struct aiVector3D v = from->mVertices[i];
        to->vertices[to->vertex_count++] = kt_vec3_make((double)v.x, (double)v.y, (double)v.z);
    }
    for (unsigned i = 0; i < from->mNumFaces; i++) {
        const struct aiFace *face = &from->mFaces[i];
        if (face->mNumIndices == 3)
            to->triangles[to->triangle_count++] = (kt_triangle){
                {first + (int)face->mIndices[0], first + (int)face->mIndices[1], first + (int)face->mIndices[2]}};
    }
}

static bool triangles_are_finite(const kt_triangles *mesh) {
    bool finite = true;
    for (int i = 0; i < mesh->vertex_count; i++)
        finite = finite && kt_vec3_is_finite(mesh->vertices[i]);
    return finite;
}

/* Joins all meshes of a file. On failure *mesh is untouched. */
static kt_status take_foreign_scene(const struct aiScene *scene, kt_triangles *mesh, kt_error *error) {
    size_t vertices, triangles;
    kt_triangles made = {.vertices = NULL};
    kt_status status = count_foreign(scene, &vertices, &triangles, error);
    if (status != KT_OK)
        return status;
    made.vertices = calloc(vertices + 1, sizeof *made.vertices);
    made.triangles = calloc(triangles + 1, sizeof *made.triangles);
    if (made.vertices == NULL || made.triangles == NULL) {
        status = kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
    } else {
        for (unsigned i = 0; i < scene->mNumMeshes; i++)
            add_foreign_mesh(scene->mMeshes[i], &made);
        if (!triangles_are_finite(&made))
            status = kt_error_set(error, KT_ERROR_SCENE, "", "a vertex of the mesh is not finite");
    }
    if (status == KT_OK)
        *mesh = made;
    else
        kt_triangles_free(&made);
    return status;
}

/* The number of an attribute `count` whose name ends at `at`; 0: there is none. */
static double announced(const char *at, const char *end) {
    double count = 0.0;
    while (at < end && strchr(" \t\r\n=\"'", *at) != NULL && *at != '\0')
        at++;
    for (; at < end && *at >= '0' && *at <= '9'; at++)
        count = 10.0 * count + (*at - '0');
    return count;
}

/* assimp allocates memory for as many numbers as a file announces. A file that announces more numbers than it has bytes
 * is damaged. */
static bool announces_too_much(const char *text, size_t size) {
    static const char word[] = {'c', 'o', 'u', 'n', 't'};
    const char *end = text + size;
    for (const char *at = text; (size_t)(end - at) >= sizeof word; at++)
        if (memcmp(at, word, sizeof word) == 0 && announced(at + sizeof word, end) > (double)size)
            return true;
    return false;
}

/* The axes of the file remain: Collada's up direction is ignored, as in mesh files of other formats. */
static kt_status read_by_assimp(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    const char *dot = strrchr(path, '.');
    struct aiPropertyStore *how = aiCreatePropertyStore();
    if (how == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
    aiSetImportPropertyInteger(how, AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, 1);
    const struct aiScene *scene = aiImportFileFromMemoryWithProperties(
        text, (unsigned)size, aiProcess_Triangulate | aiProcess_PreTransformVertices, dot != NULL ? dot + 1 : "", how);
    const kt_status status = scene != NULL
                                 ? take_foreign_scene(scene, mesh, error)
                                 : kt_error_set(error, KT_ERROR_SCENE, "", "assimp: %.200s", aiGetErrorString());
    aiReleaseImport(scene);
    aiReleasePropertyStore(how);
    return status;
}

kt_status kt_foreign_parse(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    if (size == 0)
        return kt_error_set(error, KT_ERROR_SCENE, "", "the file is empty");
    if (size > UINT_MAX)
        return kt_error_set(error, KT_ERROR_SCENE, "", "the file is too large for assimp");
    if (announces_too_much(text, size))
        return kt_error_set(error, KT_ERROR_SCENE, "", "the file announces more numbers (count) than it has bytes");
    return kt_mesh_read_apart(read_by_assimp, seconds_most, path, text, size, mesh, error);
}
#else
kt_status kt_foreign_parse(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    const char *dot = strrchr(path, '.');
    (void)text, (void)size, (void)mesh;
    return kt_error_set(error, KT_ERROR_SCENE, "",
                        "this is neither STL nor OBJ nor MSH; '%.20s' needs a kinetree that was built with assimp "
                        "(libassimp-dev)",
                        dot != NULL ? dot : path);
}
#endif
