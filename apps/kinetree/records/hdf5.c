/* Records as HDF5, which h5py, MATLAB and Julia read. The file has /columns and /units, and a dataset of rows and
 * columns for each run. The datasets have compressed chunks, and the run's values as attributes.
 *
 * Times are not stored, so that equal runs give equal bytes.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/keep.h"

#include <hdf5.h>
#include <stdlib.h>
#include <string.h>

int kt_keep_check(const char *path) {
    (void)path;
    return -1;
}

enum { CHUNK = 1 << 14 /* numbers: 128 kB */, LEVEL = 4 };

/* Identifiers of an open file, and whether any call has failed. */
typedef struct writer {
    hid_t file, group, creation;
    bool failed;
} writer;

static hid_t taken(writer *w, hid_t id) {
    w->failed = w->failed || id < 0;
    return id;
}

static void check_hdf5(writer *w, herr_t result) { w->failed = w->failed || result < 0; }

/* Returns the bytes of the longest text, with its terminating zero. */
static size_t longest(const char *const *texts, size_t count) {
    size_t most = 1;
    for (size_t i = 0; i < count; i++)
        most = strlen(texts[i]) + 1 > most ? strlen(texts[i]) + 1 : most;
    return most;
}

static hid_t type_of_text(writer *w, size_t size) {
    const hid_t type = taken(w, H5Tcopy(H5T_C_S1));
    check_hdf5(w, H5Tset_size(type, size));
    check_hdf5(w, H5Tset_cset(type, H5T_CSET_UTF8));
    return type;
}

/* Writes a dataset of texts, which are padded to the longest. */
static void write_texts(writer *w, const char *name, const char *const *texts, size_t count) {
    const size_t size = longest(texts, count);
    const hsize_t extent = count;
    char *cells = calloc(count + 1, size);
    for (size_t i = 0; cells != NULL && i < count; i++)
        memcpy(cells + i * size, texts[i], strlen(texts[i]) + 1);
    const hid_t type = type_of_text(w, size), space = taken(w, H5Screate_simple(1, &extent, NULL));
    const hid_t properties = taken(w, H5Pcreate(H5P_DATASET_CREATE));
    check_hdf5(w, H5Pset_obj_track_times(properties, false));
    const hid_t set = taken(w, H5Dcreate2(w->file, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    if (count > 0)
        check_hdf5(w, H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, cells));
    w->failed = w->failed || cells == NULL;
    (void)H5Dclose(set);
    (void)H5Pclose(properties);
    (void)H5Sclose(space);
    (void)H5Tclose(type);
    free(cells);
}

static void write_hdf5_attribute(writer *w, hid_t object, const char *name, hid_t type, const void *value) {
    const hid_t space = taken(w, H5Screate(H5S_SCALAR));
    const hid_t attribute = taken(w, H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
    check_hdf5(w, H5Awrite(attribute, type, value));
    (void)H5Aclose(attribute);
    (void)H5Sclose(space);
}

static void write_text_attribute(writer *w, hid_t object, const char *name, const char *text) {
    const hid_t type = type_of_text(w, strlen(text) + 1);
    write_hdf5_attribute(w, object, name, type, text);
    (void)H5Tclose(type);
}

static void describe_run(writer *w, hid_t set, const kt_kept_run *head, const kt_keep_words *words) {
    double *values = calloc(words->name_count + 1, sizeof *values);
    if (values == NULL) {
        w->failed = true;
        return;
    }
    words->values(words->user, head->run, values);
    for (size_t i = 0; i < words->name_count; i++)
        write_hdf5_attribute(w, set, words->names[i], H5T_NATIVE_DOUBLE, &values[i]);
    write_text_attribute(w, set, "status", kt_exit_name((int)head->status));
    free(values);
}

/* Returns the layout of a dataset: compressed chunks of whole rows, or no chunks if the dataset has no rows. */
static hid_t dataset_layout(writer *w, const hsize_t extent[2]) {
    const hid_t properties = taken(w, H5Pcreate(H5P_DATASET_CREATE));
    check_hdf5(w, H5Pset_obj_track_times(properties, false));
    if (extent[0] == 0 || extent[1] == 0)
        return properties;
    hsize_t chunk[2] = {CHUNK / extent[1] > 0 ? CHUNK / extent[1] : 1, extent[1]};
    chunk[0] = chunk[0] < extent[0] ? chunk[0] : extent[0];
    check_hdf5(w, H5Pset_chunk(properties, 2, chunk));
    check_hdf5(w, H5Pset_shuffle(properties));
    check_hdf5(w, H5Pset_deflate(properties, LEVEL));
    return properties;
}

/* Writes rows as they come from the side file, some at a time. */
static void copy_rows(writer *w, hid_t set, hid_t space, FILE *file, const hsize_t extent[2]) {
    const hsize_t most = CHUNK / extent[1] > 0 ? CHUNK / extent[1] : 1;
    double *rows = malloc((size_t)(most * extent[1]) * sizeof *rows);
    w->failed = w->failed || rows == NULL;
    for (hsize_t from = 0; from < extent[0] && !w->failed; from += most) {
        const hsize_t begin[2] = {from, 0}, count[2] = {extent[0] - from < most ? extent[0] - from : most, extent[1]};
        const size_t numbers = (size_t)(count[0] * count[1]);
        if (fread(rows, sizeof *rows, numbers, file) != numbers) {
            w->failed = true;
            break;
        }
        const hid_t part = taken(w, H5Screate_simple(2, count, NULL));
        check_hdf5(w, H5Sselect_hyperslab(space, H5S_SELECT_SET, begin, NULL, count, NULL));
        check_hdf5(w, H5Dwrite(set, H5T_NATIVE_DOUBLE, part, space, H5P_DEFAULT, rows));
        (void)H5Sclose(part);
    }
    free(rows);
}

static void write_run(writer *w, FILE *file, const kt_kept_run *head, const kt_keep_words *words) {
    const hsize_t extent[2] = {(hsize_t)head->rows, (hsize_t)head->columns};
    char name[32];
    (void)snprintf(name, sizeof name, "%lld", (long long)head->run);
    const hid_t space = taken(w, H5Screate_simple(2, extent, NULL)), properties = dataset_layout(w, extent);
    const hid_t set =
        taken(w, H5Dcreate2(words->only != NULL ? w->file : w->group, words->only != NULL ? words->only : name,
                            H5T_IEEE_F64LE, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    if (!w->failed && extent[0] > 0 && extent[1] > 0)
        copy_rows(w, set, space, file, extent);
    if (!w->failed)
        describe_run(w, set, head, words);
    (void)H5Dclose(set);
    (void)H5Pclose(properties);
    (void)H5Sclose(space);
}

static void write_all_runs(writer *w, FILE *file, const kt_keep_words *words) {
    kt_kept_run head;
    write_texts(w, "columns", words->columns, words->column_count);
    write_texts(w, "units", words->units, words->column_count);
    if (words->only == NULL)
        w->group = taken(w, H5Gcreate2(w->file, "runs", H5P_DEFAULT, w->creation, H5P_DEFAULT));
    while (!w->failed && fread(&head, sizeof head, 1, file) == 1)
        write_run(w, file, &head, words);
    w->failed = w->failed || ferror(file) != 0;
    if (words->only == NULL)
        (void)H5Gclose(w->group);
}

int kt_hdf5_write(const char *path, FILE *file, const kt_keep_words *words) {
    writer w = {.group = -1};
    (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* errors are reported below */
    const hid_t access = taken(&w, H5Pcreate(H5P_FILE_ACCESS));
    check_hdf5(&w, H5Pset_libver_bounds(access, H5F_LIBVER_EARLIEST, H5F_LIBVER_V18)); /* its groups have no times */
    w.creation = taken(&w, H5Pcreate(H5P_GROUP_CREATE));
    check_hdf5(&w, H5Pset_obj_track_times(w.creation, false));
    const hid_t creation = taken(&w, H5Pcreate(H5P_FILE_CREATE));
    check_hdf5(&w, H5Pset_istore_k(creation, 2)); /* nodes of the trees of chunks: most runs have few chunks */
    w.file = taken(&w, H5Fcreate(path, H5F_ACC_EXCL, creation, access));
    if (!w.failed)
        write_all_runs(&w, file, words);
    if (w.file >= 0)
        check_hdf5(&w, H5Fclose(w.file));
    (void)H5Pclose(creation);
    (void)H5Pclose(w.creation);
    (void)H5Pclose(access);
    if (w.failed)
        kt_say("%s cannot be written by HDF5: the disk may be full, or the name of a value is none for it", path);
    return w.failed ? -1 : 0;
}
