/* Writes lines to a file. The kernel may act on SIGKILL between two pages of one write, so that a line across a page
 * boundary could be truncated. Files are therefore written by a child process, which completes its write. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _DEFAULT_SOURCE /* vfork */
#include "records/lines.h"

#include "subcommands/run.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { MOST_BYTES = 1 << 18 };      /* size at which the buffer is written */
static const double longest = 0.02; /* s, after which the buffer is written; many times the cost of a child process */

/* ---- writing ----------------------------------------------------------------------------------------------------- */

int kt_write_bytes(int file, const void *bytes, size_t size, size_t *done) {
    const char *text = bytes;
    for (*done = 0; *done < size;) {
        const ssize_t count = write(file, text + *done, size - *done);
        if (count < 0 && errno != EINTR)
            return errno;
        *done += count > 0 ? (size_t)count : 0;
    }
    return 0;
}

/* Writes whole lines. On failure the complete lines already written remain, and the incomplete one is cut off. Returns
 * 0 or the errno. */
static int write_whole(const kt_lines *lines) {
    size_t done;
    const int reason = kt_write_bytes(lines->file, lines->buffer.text, lines->whole, &done);
    while (reason != 0 && done > 0 && lines->buffer.text[done - 1] != '\n')
        done--;
    /* Standard output may be a file of another program. If the file cannot be cut, either, the first reason counts. */
    if (reason != 0 && lines->file != STDOUT_FILENO && ftruncate(lines->file, lines->written + (long long)done) != 0)
        return reason;
    return reason;
}

/* Writes whole lines from a child process in a separate session. Signals to this process or its group do not reach the
 * child. SIGINT is blocked until then: its handler would report in the child, too. The child shares this process's
 * memory (vfork) and changes nothing in it that is used afterwards. */
static int write_apart(const kt_lines *lines) {
    int status = 0;
    sigset_t interrupt, before;
    (void)sigemptyset(&interrupt);
    (void)sigaddset(&interrupt, SIGINT);
    (void)pthread_sigmask(SIG_BLOCK, &interrupt, &before);
    /* NOLINTBEGIN(clang-analyzer-security.insecureAPI.vfork,clang-analyzer-unix.Vfork): fork costs much more */
    const pid_t child = vfork();
    if (child == 0) {
        (void)setsid();
        _exit(write_whole(lines));
    }
    /* NOLINTEND(clang-analyzer-security.insecureAPI.vfork,clang-analyzer-unix.Vfork) */
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (child < 0)
        return write_whole(lines);
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return errno;
    return WIFEXITED(status) ? WEXITSTATUS(status) : EINTR;
}

/* ---- buffering --------------------------------------------------------------------------------------------------- */

void kt_lines_start(kt_lines *lines, int file, const char *path, long long written) {
    struct stat status;
    *lines = (kt_lines){.file = file, .path = path, .written = written, .last = kt_clock()};
    lines->is_regular = fstat(file, &status) == 0 && S_ISREG(status.st_mode);
    if (lines->is_regular && file == STDOUT_FILENO) /* which may be appended to a file */
        lines->before = status.st_size;
    (void)signal(SIGXFSZ, SIG_IGN); /* exceeding the file size limit becomes an error of write */
    (void)signal(SIGCHLD, SIG_DFL); /* waitpid works even if SIGCHLD was inherited as ignored */
}

static const char *shown_path(const kt_lines *lines) {
    return lines->file == STDOUT_FILENO ? "standard output" : lines->path;
}

/* Counts the lines of the buffer behind its first `done` bytes. */
static long long count_lines_after(const kt_lines *lines, size_t done) {
    long long count = 0;
    for (size_t i = done; i < lines->whole; i++)
        count += lines->buffer.text[i] == '\n';
    return count;
}

/* Returns how many bytes of the buffer a regular file has, after a write that failed. The child process that wrote them
 * returns no number. */
static size_t measure_written(const kt_lines *lines) {
    const off_t end = lseek(lines->file, 0, SEEK_END);
    const long long done = end - lines->before - lines->written;
    return done < 0 ? 0 : done > (long long)lines->whole ? lines->whole : (size_t)done;
}

int kt_lines_flush(kt_lines *lines) {
    size_t done = 0;
    int reason = 0;
    if (lines->whole > 0)
        reason = lines->is_regular ? write_apart(lines)
                                   : kt_write_bytes(lines->file, lines->buffer.text, lines->whole, &done);
    if (reason != 0) {
        done = lines->is_regular ? measure_written(lines) : done;
        lines->lost += count_lines_after(lines, done);
        lines->written += (long long)done;
        kt_say("%s cannot be written: %s", shown_path(lines), strerror(reason));
    } else {
        lines->written += (long long)lines->whole;
    }
    lines->buffer.used = lines->whole = 0; /* after an error the lines are dropped, so that it is reported once */
    lines->last = kt_clock();
    return reason == 0 ? 0 : -1;
}

int kt_lines_end(kt_lines *lines) {
    kt_bytes_add(&lines->buffer, "\n", 1);
    if (lines->buffer.is_short) {
        lines->buffer.used = lines->whole;
        kt_say("there is not enough memory for a line of %s", shown_path(lines));
        return -1;
    }
    lines->whole = lines->buffer.used;
    const bool waits = lines->is_regular && lines->whole < MOST_BYTES && kt_clock() - lines->last < longest;
    return waits ? 0 : kt_lines_flush(lines);
}

int kt_lines_close(kt_lines *lines) {
    int failed = kt_lines_flush(lines);
    if (lines->file > STDOUT_FILENO && close(lines->file) != 0) {
        kt_say("%s cannot be written: %s", lines->path, strerror(errno));
        failed = -1;
    }
    free(lines->buffer.text);
    *lines = (kt_lines){.file = -1, .lost = lines->lost};
    return failed;
}
