/* A mesh is read in a child process, which answers through a pipe: a record, then vertices, then triangles. */
#include "picture/apart.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

typedef struct answer {
    kt_status status;
    int vertex_count, triangle_count;
    kt_error error;
} answer;

/* ---- the child --------------------------------------------------------------------------------------------------- */

static void set_limit(int what, rlim_t most) {
    struct rlimit limit;
    if (getrlimit(what, &limit) != 0 || (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur <= most))
        return;
    limit.rlim_cur = most;
    (void)setrlimit(what, &limit);
}

static void set_limits(double seconds) {
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_CPU, (rlim_t)seconds + 1); /* it ends, too, if its parent has ended before */
#ifdef KT_LIMITS_ADDRESSES
    set_limit(RLIMIT_AS, (rlim_t)4 << 30);
#endif
    const int nothing = open("/dev/null", O_RDWR);
    for (int stream = 0; stream < 3 && nothing >= 0; stream++)
        (void)dup2(nothing, stream);
}

static bool write_to_pipe(int to, const void *data, size_t size) {
    const char *at = data;
    while (size > 0) {
        const ssize_t done = write(to, at, size);
        if (done < 0 && errno != EINTR)
            return false;
        at += done > 0 ? done : 0;
        size -= done > 0 ? (size_t)done : 0;
    }
    return true;
}

static bool write_answer(int to, const answer *a, const kt_triangles *mesh) {
    return write_to_pipe(to, a, sizeof *a) &&
           write_to_pipe(to, mesh->vertices, (size_t)a->vertex_count * sizeof *mesh->vertices) &&
           write_to_pipe(to, mesh->triangles, (size_t)a->triangle_count * sizeof *mesh->triangles);
}

/* ---- the parent -------------------------------------------------------------------------------------------------- */

/* Milliseconds. */
static long long now(void) {
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return 1000LL * (long long)t.tv_sec + (long long)t.tv_nsec / 1000000LL;
}

/* Reads all, until a time; false if it ends before, or takes longer. */
static bool read_from_pipe(int from, void *data, size_t size, long long until) {
    char *at = data;
    while (size > 0) {
        const long long left = until - now();
        struct pollfd one = {.fd = from, .events = POLLIN};
        const int has_data = left > 0 ? poll(&one, 1, (int)left) : 0;
        const ssize_t done = has_data > 0 ? read(from, at, size) : -1;
        if (has_data == 0 || done == 0 || (done < 0 && errno != EINTR))
            return false;
        at += done > 0 ? done : 0;
        size -= done > 0 ? (size_t)done : 0;
    }
    return true;
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

/* An answer and its mesh; false: it has not come whole. */
static bool read_answer(int from, long long until, answer *a, kt_triangles *mesh) {
    if (!read_from_pipe(from, a, sizeof *a, until) || !is_count(a->vertex_count) || !is_count(a->triangle_count))
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
    return read_from_pipe(from, mesh->vertices, vertices * sizeof *mesh->vertices, until) &&
           read_from_pipe(from, mesh->triangles, triangles * sizeof *mesh->triangles, until);
}

static int wait_for(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return 0;
    return status;
}

/* SIGKILL is the parent's own. */
static kt_status explain(int status, double seconds, bool is_late, kt_error *error) {
    if (is_late)
        return kt_error_set(error, KT_ERROR_SCENE, "", "it could not be read within %g s", seconds);
    if (WIFSIGNALED(status) && WTERMSIG(status) != SIGKILL)
        return kt_error_set(error, KT_ERROR_SCENE, "",
                            "it could not be read: signal %d ended the process that reads it; is the file damaged?",
                            WTERMSIG(status));
    return kt_error_set(error, KT_ERROR_SCENE, "",
                        "it could not be read: the process that reads it gave no answer; is the file damaged?");
}

static kt_status take_mesh(pid_t child, int from, double seconds, kt_triangles *mesh, kt_error *error) {
    const long long until = now() + (long long)(1e3 * seconds);
    kt_triangles made = {.vertices = NULL};
    answer a = {.status = KT_OK};
    const bool is_answered = read_answer(from, until, &a, &made), is_late = !is_answered && now() >= until;
    (void)kill(child, SIGKILL); /* it may still be writing a mesh for which this process has no memory */
    const int status = wait_for(child);
    if (is_answered && a.status == KT_OK && !is_sound(&made))
        a.status =
            kt_error_set(&a.error, KT_ERROR_SCENE, "", "it could not be read: corners are vertices that are not there");
    if (is_answered && a.status == KT_OK) {
        *mesh = made;
        return KT_OK;
    }
    kt_triangles_free(&made);
    if (!is_answered)
        return explain(status, seconds, is_late, error);
    return kt_error_set(error, a.status, a.error.where, "%s", a.error.message);
}

kt_status kt_mesh_read_apart(kt_mesh_reader *reader, double seconds, const char *path, const char *text, size_t size,
                             kt_triangles *mesh, kt_error *error) {
    int ends[2];
    if (pipe(ends) != 0)
        return kt_error_set(error, KT_ERROR_MEMORY, "", "there is no pipe to read a mesh through: %s", strerror(errno));
    const pid_t child = fork();
    if (child < 0) {
        (void)close(ends[0]);
        (void)close(ends[1]);
        return kt_error_set(error, KT_ERROR_MEMORY, "", "there is no process to read a mesh in: %s", strerror(errno));
    }
    if (child == 0) {
        kt_triangles made = {.vertices = NULL};
        answer a;
        memset(&a, 0, sizeof a);
        const int to = fcntl(ends[1], F_DUPFD, 3); /* the pipe may have taken a standard stream's place */
        if (to < 0)
            _exit(1);
        (void)close(ends[0]);
        (void)close(ends[1]);
        set_limits(seconds);
        a.status = reader(path, text, size, &made, &a.error);
        a.vertex_count = made.vertex_count;
        a.triangle_count = made.triangle_count;
        _exit(write_answer(to, &a, &made) ? 0 : 1);
    }
    (void)close(ends[1]);
    const kt_status status = take_mesh(child, ends[0], seconds, mesh, error);
    (void)close(ends[0]);
    return status;
}
