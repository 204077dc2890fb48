/* Messages of a kinetree without assimp about meshes that assimp would read. This program has its own foreign.c,
 * compiled without assimp. And readers that end, that do not end, and that take all memory, in processes of their
 * own. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "document/apart.h"
#include "picture/foreign.h"
#include "picture/mesh_apart.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

KT_TEST(without_assimp_the_format_and_the_remedy_are_told) {
    static const char text[] = "<COLLADA/>";
    kt_triangles mesh = {.vertex_count = 7};
    kt_error error = {0};
    kt_check_equal_int("status", kt_foreign_parse("/robots/arm.v2/hand.dae", text, strlen(text), &mesh, &error),
                       KT_ERROR_SCENE);
    kt_check_text(
        "error", error.message,
        "this is neither STL nor OBJ nor MSH; '.dae' needs a kinetree that was built with assimp (libassimp-dev)");
    kt_check_equal_int("the mesh is untouched", mesh.vertex_count, 7);
}

/* ---- readers in a process of their own --------------------------------------------------------------------------- */

/* Its action is in the text. */
static kt_status read_oddly(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    (void)path, (void)size;
    if (strcmp(text, "end") == 0)
        abort();
    for (volatile bool goes_on = strcmp(text, "endless") == 0; goes_on;)
        ;
    if (strcmp(text, "miscounted") == 0) {
        mesh->vertex_count = -1;
        return KT_OK;
    }
    void *space = strcmp(text, "large") == 0
                      ? mmap(NULL, (size_t)16 << 30, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)
                      : NULL;
    if (space == MAP_FAILED)
        return kt_error_set(error, KT_ERROR_MEMORY, "mesh", "there is not enough memory");
    mesh->vertices = calloc(3, sizeof *mesh->vertices);
    mesh->triangles = calloc(1, sizeof *mesh->triangles);
    if (mesh->vertices == NULL || mesh->triangles == NULL)
        return KT_ERROR_MEMORY;
    mesh->vertices[2] = kt_vec3_make(0.1, 0.2, 0.3);
    mesh->triangles[0] = (kt_triangle){{0, 1, strcmp(text, "unsound") == 0 ? 3 : 2}};
    mesh->vertex_count = 3;
    mesh->triangle_count = 1;
    return KT_OK;
}

static void check_odd(const char *text, kt_status expected, const char *message) {
    kt_triangles mesh = {.vertex_count = 7};
    kt_error error = {0};
    kt_check_equal_int(text, kt_mesh_read_apart(read_oddly, 0.5, "a", text, strlen(text), &mesh, &error), expected);
    kt_check_text("error", error.message, message);
    kt_check_equal_int("the mesh is untouched", mesh.vertex_count, 7);
}

KT_TEST(what_ends_a_reader_does_not_end_the_program) {
    kt_triangles mesh = {.vertex_count = 7};
    kt_error error = {0};
    kt_need(kt_check_equal_int("status", kt_mesh_read_apart(read_oddly, 60.0, "a", "", 0, &mesh, &error), KT_OK));
    kt_check_equal_bits("its mesh", &mesh.vertices[2].x, (const double[]){0.1, 0.2, 0.3}, 3);
    kt_check_equal_int("triangles", mesh.triangle_count, 1);
    kt_check_equal_int("corner", mesh.triangles[0].corner[2], 2);
    kt_triangles_free(&mesh);
    check_odd("end", KT_ERROR_SCENE,
              "it could not be read: signal 6 ended the process that reads it; is the file damaged?");
    check_odd("miscounted", KT_ERROR_SCENE,
              "it could not be read: the process that reads it gave no answer; is the file damaged?");
    check_odd("endless", KT_ERROR_SCENE, "it could not be read within 0.5 s");
    check_odd("unsound", KT_ERROR_SCENE, "it could not be read: corners are vertices that are not there");
#ifdef KT_LIMITS_ADDRESSES
    check_odd("large", KT_ERROR_MEMORY, "there is not enough memory");
#endif
}

/* There the pipe gets the number of a standard stream, which the child must not replace by /dev/null. */
KT_TEST(a_program_without_standard_streams_reads_meshes) {
    kt_triangles mesh = {.vertex_count = 7};
    kt_error error = {0};
    int kept[3];
    for (int i = 0; i < 3; i++)
        kept[i] = fcntl(i, F_DUPFD, 10);
    for (int i = 0; i < 3; i++)
        (void)close(i);
    const kt_status status = kt_mesh_read_apart(read_oddly, 60.0, "a", "", 0, &mesh, &error);
    for (int i = 0; i < 3; i++) {
        (void)dup2(kept[i], i);
        (void)close(kept[i]);
    }
    kt_check_text("error", error.message, "");
    kt_need(kt_check_equal_int("status", status, KT_OK));
    kt_check_equal_int("vertices", mesh.vertex_count, 3);
    kt_triangles_free(&mesh);
}

#ifdef KT_LIMITS_ADDRESSES
enum { MANY = 4000000, SPARE = 32 << 20 /* bytes */ };

/* More than its parent has memory for: a limit of the user that the child has, too, until it takes it away. */
static kt_status read_many(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    struct rlimit limit;
    (void)path, (void)text, (void)size;
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= (rlim_t)4 << 30)
        return kt_error_set(error, KT_ERROR_SCENE, "", "the user's limit is gone");
    limit.rlim_cur = limit.rlim_max;
    if (setrlimit(RLIMIT_AS, &limit) != 0)
        return kt_error_set(error, KT_ERROR_SCENE, "", "the limit stays");
    mesh->vertices = calloc(MANY, sizeof *mesh->vertices);
    mesh->vertex_count = mesh->vertices != NULL ? MANY : 0;
    return KT_OK;
}

/* Bytes of addresses that this process has. 0: the system does not report them. */
static rlim_t addresses(void) {
    char line[200] = "";
    FILE *stream = fopen("/proc/self/statm", "r");
    if (stream == NULL)
        return 0;
    const bool is_read = fgets(line, sizeof line, stream) != NULL;
    (void)fclose(stream);
    return is_read ? (rlim_t)strtoul(line, NULL, 10) * (rlim_t)sysconf(_SC_PAGESIZE) : 0;
}

/* The parent has no memory for the mesh that the child still writes: it must not wait for the child's end. */
KT_TEST(a_mesh_that_the_program_has_no_memory_for_is_rejected_at_once) {
    kt_triangles mesh = {.vertex_count = 7};
    kt_error error = {0};
    struct rlimit limit;
    const rlim_t used = addresses();
    if (used == 0 || used >= (rlim_t)3 << 30 || getrlimit(RLIMIT_AS, &limit) != 0) {
        kt_skip("a limit of memory", "the system does not tell how much this program has");
        return;
    }
    const rlim_t before = limit.rlim_cur;
    limit.rlim_cur = used + SPARE;
    (void)setrlimit(RLIMIT_AS, &limit);
    const kt_status status = kt_mesh_read_apart(read_many, 60.0, "a", "", 0, &mesh, &error);
    limit.rlim_cur = before;
    (void)setrlimit(RLIMIT_AS, &limit);
    kt_check_equal_int("status", status, KT_ERROR_MEMORY);
    kt_check_text("error", error.message, "there is not enough memory for a mesh");
    kt_check_equal_int("the mesh is untouched", mesh.vertex_count, 7);
}
#endif
