/* A whole file in memory. */
#ifndef KT_DOCUMENT_FILE_H
#define KT_DOCUMENT_FILE_H

#include "kinetree/status.h"

#include <stddef.h>

enum { KT_FILE_SIZE_MAX = 64 << 20 };

/* Reads a regular file of up to KT_FILE_SIZE_MAX bytes into *text, which the caller frees. Errors: KT_ERROR_FILE, with
 * the reason in words; KT_ERROR_MEMORY. It never waits (for instance for the other end of a pipe). */
kt_status kt_file_read(const char *path, char **text, size_t *size, kt_error *error);

#endif
