/* A program without HDF5. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/keep.h"

const bool kt_hdf5_is_there = false;

int kt_hdf5_write(const char *path, FILE *file, const kt_keep_words *words) {
    (void)file, (void)words;
    (void)kt_keep_check(path);
    return -1;
}

int kt_hdf5_read(const char *path, kt_table *table) {
    (void)table;
    return kt_keep_check(path);
}
