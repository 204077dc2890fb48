/* A mesh is read in a child process, which answers with a record, then vertices, then triangles. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/mesh_apart.h"

#include "document/apart.h"

#include <stdlib.h>
#include <string.h>

typedef struct answer {
    kt_status status;
    int vertex_count, triangle_count;
    kt_error error;
} answer;

/* The input of the child process. */
typedef struct question {
    kt_mesh_reader *reader;
    const char *path, *text;
    size_t size;
} question;

/* Runs in the child process. An error is part of the answer; false means that the answer could not be written. */
static bool read_mesh_in_child(int to, void *user) {
    const question *q = user;
    kt_triangles made = {.vertices = NULL};
    answer a;
    memset(&a, 0, sizeof a);
    a.status = q->reader(q->path, q->text, q->size, &made, &a.error);
    a.vertex_count = made.vertex_count;
    a.triangle_count = made.triangle_count;
    return kt_apart_write(to, &a, sizeof a) &&
           kt_apart_write(to, made.vertices, (size_t)a.vertex_count * sizeof *made.vertices) &&
           kt_apart_write(to, made.triangles, (size_t)a.triangle_count * sizeof *made.triangles);
}

static bool is_count(int count) { return count >= 0 && count <= KT_TRIANGLES_MOST; }

/* Whether all corners are vertices of the mesh: a child with damaged memory may answer anything. */
static bool is_sound(const kt_triangles *mesh) {
    for (int i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++)
            if (mesh->triangles[i].corner[k] < 0 || mesh->triangles[i].corner[k] >= mesh->vertex_count)
                return false;
    return true;
}

/* Reads an answer and its mesh; returns false if the answer is incomplete. */
static bool read_answer(const kt_apart *apart, answer *a, kt_triangles *mesh) {
    if (!kt_apart_read(apart, a, sizeof *a) || !is_count(a->vertex_count) || !is_count(a->triangle_count))
        return false;
    a->error.where[sizeof a->error.where - 1] = a->error.message[sizeof a->error.message - 1] = '\0';
    if (a->status != KT_OK)
        return true;
    const size_t vertices = (size_t)a->vertex_count, triangles = (size_t)a->triangle_count;
    mesh->vertices = calloc(vertices + 1, sizeof *mesh->vertices);
    mesh->triangles = calloc(triangles + 1, sizeof *mesh->triangles);
    if (mesh->vertices == NULL || mesh->triangles == NULL) {
        a->status = kt_error_set(&a->error, KT_ERROR_MEMORY, "", "there is not enough memory for a mesh");
        return true;
    }
    mesh->vertex_count = a->vertex_count;
    mesh->triangle_count = a->triangle_count;
    return kt_apart_read(apart, mesh->vertices, vertices * sizeof *mesh->vertices) &&
           kt_apart_read(apart, mesh->triangles, triangles * sizeof *mesh->triangles);
}

kt_status kt_mesh_read_apart(kt_mesh_reader *reader, double seconds, const char *path, const char *text, size_t size,
                             kt_triangles *mesh, kt_error *error) {
    question q = {reader, path, text, size};
    kt_triangles made = {.vertices = NULL};
    answer a = {.status = KT_OK};
    kt_apart apart;
    kt_status status = kt_apart_start(&apart, read_mesh_in_child, &q, seconds, error);
    if (status != KT_OK)
        return status;
    status = kt_apart_end(&apart, read_answer(&apart, &a, &made), error);
    if (status == KT_OK && a.status == KT_OK && !is_sound(&made))
        a.status =
            kt_error_set(&a.error, KT_ERROR_SCENE, "", "it could not be read: corners are vertices that are not there");
    if (status == KT_OK && a.status == KT_OK) {
        *mesh = made;
        return KT_OK;
    }
    kt_triangles_free(&made);
    return status != KT_OK ? status : kt_error_set(error, a.status, a.error.where, "%s", a.error.message);
}
