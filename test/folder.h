/* Folders and files of the running test. They are removed at its end, unless KT_KEEP is set. All paths are absolute and
 * valid until then. If one cannot be made, a check fails, and the test ends. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_FOLDER_H
#define KT_TEST_FOLDER_H

#include <stddef.h>

/* A new folder. */
const char *kt_test_folder(void);

/* The path FOLDER/NAME. */
const char *kt_test_path(const char *folder, const char *name);

/* Writes FOLDER/NAME and returns its path. Folders in NAME are made. */
const char *kt_test_file(const char *folder, const char *name, const char *text);
const char *kt_test_bytes(const char *folder, const char *name, const void *bytes, size_t size);

/* The bytes of a file and a 0 behind them. size may be NULL. */
char *kt_test_read(const char *path, size_t *size);

#endif
