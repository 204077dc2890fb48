/* A whole file in memory. */
#include "document/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static kt_status reject_scene_file(kt_error *error, const char *path, int number) {
    char reason[160];
    if (strerror_r(number, reason, sizeof reason) != 0)
        (void)snprintf(reason, sizeof reason, "error %d", number);
    return kt_error_set(error, KT_ERROR_FILE, path, "cannot be read: %s", reason);
}

/* The kind of a file that is not a regular one; a socket could not have been opened. */
static const char *file_kind_of(mode_t mode) {
    return S_ISDIR(mode) ? "a directory" : S_ISFIFO(mode) ? "a pipe" : "a device";
}

static kt_status check_kind(const char *path, int file, kt_error *error) {
    struct stat status;
    if (fstat(file, &status) != 0)
        return reject_scene_file(error, path, errno);
    if (!S_ISREG(status.st_mode))
        return kt_error_set(error, KT_ERROR_FILE, path, "this is %s; name a scene file", file_kind_of(status.st_mode));
    if (status.st_size > KT_FILE_SIZE_MAX)
        return kt_error_set(error, KT_ERROR_FILE, path, "the file has %.0f MB; a scene has at most %d",
                            (double)status.st_size / 1048576.0, KT_FILE_SIZE_MAX >> 20);
    return KT_OK;
}

/* Reads up to the end of the file without relying on its size: the file may grow, and some report no size. */
static kt_status read_whole_file(const char *path, int file, char **text, size_t *size, kt_error *error) {
    size_t room = 1 << 16, length = 0;
    char *bytes = malloc(room);
    while (bytes != NULL) {
        ssize_t got = read(file, bytes + length, room - length);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            int number = errno;
            free(bytes);
            return reject_scene_file(error, path, number);
        }
        if (got == 0) {
            *text = bytes;
            *size = length;
            return KT_OK;
        }
        length += (size_t)got;
        if (length > KT_FILE_SIZE_MAX) {
            free(bytes);
            return kt_error_set(error, KT_ERROR_FILE, path, "the file has more than %d MB; a scene has at most that",
                                KT_FILE_SIZE_MAX >> 20);
        }
        if (length < room)
            continue;
        room *= 2;
        char *more = realloc(bytes, room);
        if (more == NULL)
            free(bytes);
        bytes = more;
    }
    return kt_error_set(error, KT_ERROR_MEMORY, path, "there is not enough memory for the file");
}

kt_status kt_file_read(const char *path, char **text, size_t *size, kt_error *error) {
    int file = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (file < 0)
        return reject_scene_file(error, path, errno);
    kt_status status = check_kind(path, file, error);
    if (status == KT_OK)
        status = read_whole_file(path, file, text, size, error);
    (void)close(file);
    return status;
}
