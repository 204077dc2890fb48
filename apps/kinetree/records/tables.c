/* Several results as one table. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/keep.h"

int kt_table_read_files(char *const *paths, int count, kt_table *table) {
    int code = -1;
    *table = (kt_table){0};
    if (count == 1 && !kt_keep_is_meant(paths[0]))
        return kt_table_read_file(paths[0], table);
    for (int i = 0; i < count && code < 0; i++) {
        kt_table one = {0};
        if (kt_keep_is_meant(paths[i])) {
            code = kt_hdf5_read(paths[i], table);
            continue;
        }
        code = kt_table_read_file(paths[i], &one);
        if (code < 0)
            code = kt_table_join(table, &one, paths[i]);
        kt_table_free(&one);
    }
    if (code >= 0)
        kt_table_free(table);
    return code;
}
