/* Work in a child process that answers through a pipe. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/apart.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* ---- the child --------------------------------------------------------------------------------------------------- */

static void set_limit(int what, rlim_t most) {
    struct rlimit limit;
    if (getrlimit(what, &limit) != 0 || (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur <= most))
        return;
    limit.rlim_cur = most;
    (void)setrlimit(what, &limit);
}

/* Bounds the time and the memory of the child process, and silences its streams: a library may print on its own. */
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

/* Sets the soft and the hard limit, so that the process cannot raise the soft one again. */
void kt_apart_forbid_files(void) {
    const struct rlimit none = {0, 0};
    (void)setrlimit(RLIMIT_NOFILE, &none);
}

bool kt_apart_write(int to, const void *data, size_t size) {
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

/* ---- the parent -------------------------------------------------------------------------------------------------- */

/* Milliseconds. */
static long long now(void) {
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return 1000LL * (long long)t.tv_sec + (long long)t.tv_nsec / 1000000LL;
}

bool kt_apart_read(const kt_apart *apart, void *data, size_t size) {
    char *at = data;
    while (size > 0) {
        const long long left = apart->until - now();
        struct pollfd one = {.fd = apart->from, .events = POLLIN};
        const int has_data = left > 0 ? poll(&one, 1, (int)left) : 0;
        const ssize_t done = has_data > 0 ? read(apart->from, at, size) : -1;
        if (has_data == 0 || done == 0 || (done < 0 && errno != EINTR))
            return false;
        at += done > 0 ? done : 0;
        size -= done > 0 ? (size_t)done : 0;
    }
    return true;
}

kt_status kt_apart_start(kt_apart *apart, kt_apart_work *work, void *user, double seconds, kt_error *error) {
    int ends[2];
    if (pipe(ends) != 0)
        return kt_error_set(error, KT_ERROR_MEMORY, "",
                            "the system supplies no pipe for the process that reads the file: %s", strerror(errno));
    *apart = (kt_apart){.from = ends[0], .until = now() + (long long)(1e3 * seconds), .seconds = seconds};
    apart->child = fork();
    if (apart->child < 0) {
        (void)close(ends[0]);
        (void)close(ends[1]);
        return kt_error_set(error, KT_ERROR_MEMORY, "", "there is no process to read it in: %s", strerror(errno));
    }
    if (apart->child == 0) {
        const int to = fcntl(ends[1], F_DUPFD, 3); /* the pipe may have taken a standard stream's place */
        if (to < 0)
            _exit(1);
        (void)close(ends[0]);
        (void)close(ends[1]);
        set_limits(seconds);
        _exit(work(to, user) ? 0 : 1);
    }
    (void)close(ends[1]);
    return KT_OK;
}

static int wait_for(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return 0;
    return status;
}

/* SIGKILL is the parent's own. */
kt_status kt_apart_end(kt_apart *apart, bool is_answered, kt_error *error) {
    const bool is_late = !is_answered && now() >= apart->until;
    (void)close(apart->from);
    (void)kill(apart->child, SIGKILL); /* it may still be writing what this process does not read */
    const int status = wait_for(apart->child);
    if (is_answered)
        return KT_OK;
    if (is_late)
        return kt_error_set(error, KT_ERROR_SCENE, "", "it could not be read within %g s", apart->seconds);
    if (WIFSIGNALED(status) && WTERMSIG(status) != SIGKILL)
        return kt_error_set(error, KT_ERROR_SCENE, "",
                            "it could not be read: signal %d ended the process that reads it; is the file damaged?",
                            WTERMSIG(status));
    return kt_error_set(error, KT_ERROR_SCENE, "",
                        "it could not be read: the process that reads it gave no answer; is the file damaged?");
}
