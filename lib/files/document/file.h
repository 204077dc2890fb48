/* Files that a scene or a command names: opened and read with one set of rules. A device, a pipe and a folder are
 * rejected, no call waits, and each kind of file has a limit of its size. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_FILE_H
#define KT_DOCUMENT_FILE_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { KT_FILE_SIZE_MAX = 64 << 20 };

/* The kind as which a file is read. */
typedef struct kt_file_kind {
    const char *thing; /* "a scene", which has at most so many bytes */
    const char *file;  /* "a scene file", which the user shall name */
    size_t most;       /* bytes */
    bool is_text;      /* a byte of zero is an error */
} kt_file_kind;

/* Reports that a file cannot be read: number is errno after open() or read(). Returns KT_ERROR_FILE. */
kt_status kt_file_reject(const char *path, const kt_file_kind *kind, int number, kt_error *error);

/* Opens a regular file of at most kind->most bytes for reading. *file: its descriptor, which the caller closes. Errors:
 * KT_ERROR_FILE, with the path and the reason in words. */
kt_status kt_file_open(const char *path, const kt_file_kind *kind, int *file, kt_error *error);

/* Reads what is left of an open file of any kind into *text, which the caller frees. A byte of zero follows the *size
 * bytes. path: for messages. Errors: KT_ERROR_FILE, also for more than kind->most bytes; KT_ERROR_MEMORY. */
kt_status kt_file_read_open(int file, const char *path, const kt_file_kind *kind, char **text, size_t *size,
                            kt_error *error);

/* Opens a regular file, reads it and closes it. Errors: those of both. */
kt_status kt_file_read_as(const char *path, const kt_file_kind *kind, char **text, size_t *size, kt_error *error);

/* Reads a file of a scene, of up to KT_FILE_SIZE_MAX bytes of any value. */
kt_status kt_file_read(const char *path, char **text, size_t *size, kt_error *error);

#endif
