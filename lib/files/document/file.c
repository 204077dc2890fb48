/* A whole file in memory. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const kt_file_kind scene_file = {.thing = "a scene", .file = "a scene file", .most = KT_FILE_SIZE_MAX};

/* /proc/kmsg and pipes of traces report to be regular files, and a read of them waits for what others write. Files are
 * opened without waiting, and EAGAIN is the answer in place of the wait. */
kt_status kt_file_reject(const char *path, const kt_file_kind *kind, int number, kt_error *error) {
    char reason[160];
    if (number == EAGAIN)
        return kt_error_set(error, KT_ERROR_FILE, path, "a read of it waits until something is written; name %s",
                            kind->file);
    if (strerror_r(number, reason, sizeof reason) != 0)
        (void)snprintf(reason, sizeof reason, "error %d", number);
    return kt_error_set(error, KT_ERROR_FILE, path, "cannot be read: %s", reason);
}

/* Returns a word for the kind of a file that is not regular. Sockets are missing, because they cannot be opened. */
static const char *file_kind_of(mode_t mode) {
    return S_ISDIR(mode) ? "a directory" : S_ISFIFO(mode) ? "a pipe" : "a device";
}

static kt_status check_kind(const char *path, const kt_file_kind *kind, int file, kt_error *error) {
    struct stat status;
    if (fstat(file, &status) != 0)
        return kt_file_reject(path, kind, errno, error);
    if (!S_ISREG(status.st_mode))
        return kt_error_set(error, KT_ERROR_FILE, path, "this is %s; name %s", file_kind_of(status.st_mode),
                            kind->file);
    if (status.st_size > 0 && (unsigned long long)status.st_size > kind->most)
        return kt_error_set(error, KT_ERROR_FILE, path, "the file has %.0f MB; %s has at most %zu",
                            (double)status.st_size / 1048576.0, kind->thing, kind->most >> 20);
    return KT_OK;
}

kt_status kt_file_open(const char *path, const kt_file_kind *kind, int *file, kt_error *error) {
    const int opened = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (opened < 0)
        return kt_file_reject(path, kind, errno, error);
    const kt_status status = check_kind(path, kind, opened, error);
    if (status == KT_OK)
        *file = opened;
    else
        (void)close(opened);
    return status;
}

/* Checks `got` bytes more, so that a file of the wrong kind is not read to its end. */
static kt_status check_bytes(const char *path, const kt_file_kind *kind, const char *bytes, size_t got, size_t length,
                             kt_error *error) {
    if (kind->is_text && memchr(bytes + length - got, '\0', got) != NULL)
        return kt_error_set(error, KT_ERROR_FILE, path, "the file has bytes of zero, so it is no text; name %s",
                            kind->file);
    if (length > kind->most)
        return kt_error_set(error, KT_ERROR_FILE, path, "the file has more than %zu MB; %s has at most that",
                            kind->most >> 20, kind->thing);
    return KT_OK;
}

/* The size of the file is not relied on: the file may grow, and some report no size. */
kt_status kt_file_read_open(int file, const char *path, const kt_file_kind *kind, char **text, size_t *size,
                            kt_error *error) {
    size_t room = 1 << 16, length = 0;
    char *bytes = malloc(room);
    while (bytes != NULL) {
        ssize_t got = read(file, bytes + length, room - length - 1);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            const int number = errno;
            bytes[length] = '\0';
            if (got < 0)
                free(bytes);
            if (got < 0)
                return kt_file_reject(path, kind, number, error);
            *text = bytes;
            *size = length;
            return KT_OK;
        }
        length += (size_t)got;
        const kt_status status = check_bytes(path, kind, bytes, (size_t)got, length, error);
        if (status != KT_OK) {
            free(bytes);
            return status;
        }
        if (length + 1 < room)
            continue;
        room *= 2;
        char *more = realloc(bytes, room);
        if (more == NULL)
            free(bytes);
        bytes = more;
    }
    return kt_error_set(error, KT_ERROR_MEMORY, path, "there is not enough memory for the file");
}

kt_status kt_file_read_as(const char *path, const kt_file_kind *kind, char **text, size_t *size, kt_error *error) {
    int file = -1;
    kt_status status = kt_file_open(path, kind, &file, error);
    if (status != KT_OK)
        return status;
    status = kt_file_read_open(file, path, kind, text, size, error);
    (void)close(file);
    return status;
}

kt_status kt_file_read(const char *path, char **text, size_t *size, kt_error *error) {
    return kt_file_read_as(path, &scene_file, text, size, error);
}
