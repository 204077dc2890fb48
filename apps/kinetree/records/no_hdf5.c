/* A program without HDF5. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/keep.h"

int kt_keep_check(const char *path) {
    return kt_misuse(
        "%s: this kinetree was built without HDF5; build it with libhdf5-dev and -Dhdf5=enabled, or take CSV", path);
}

int kt_hdf5_write(const char *path, FILE *file, const kt_keep_words *words) {
    (void)file, (void)words;
    (void)kt_keep_check(path);
    return -1;
}

int kt_hdf5_read(const char *path, kt_table *table) {
    (void)table;
    return kt_keep_check(path);
}
