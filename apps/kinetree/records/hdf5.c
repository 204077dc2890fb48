/* Records as HDF5, which h5py, MATLAB and Julia read. The file has /columns and /units, and a dataset of rows and
 * columns for each run. The datasets have compressed chunks, and the run's values as attributes.
 *
 * Times are not stored, so that equal runs give equal bytes.
 */
#include "command.h"
#include "records/keep.h"

#include <hdf5.h>
#include <stdlib.h>
#include <string.h>

const bool kt_hdf5_is_there = true;

enum { CHUNK = 1 << 14 /* numbers: 128 kB */, LEVEL = 4, RUNS_MOST = 200 /* curves that a picture can show */ };

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
    if (words->only == NULL && words->lanes != NULL)
        write_text_attribute(w, w->group, "lanes", words->lanes);
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
    w.file = taken(&w, H5Fcreate(path, H5F_ACC_TRUNC, creation, access));
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

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* Returns the texts of a dataset, each with its terminating zero; *size: bytes of each text. */
static char *read_texts(writer *w, const char *name, size_t *count, size_t *size) {
    hsize_t extent = 0;
    const hid_t set = taken(w, H5Dopen2(w->file, name, H5P_DEFAULT));
    const hid_t type = taken(w, H5Dget_type(set)), space = taken(w, H5Dget_space(set));
    *size = H5Tget_size(type) + 1;
    const bool is_right = H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0 &&
                          H5Sget_simple_extent_dims(space, &extent, NULL) == 1 && extent < 1000000;
    w->failed = w->failed || !is_right;
    char *texts = is_right ? calloc((size_t)extent + 1, *size) : NULL;
    const hid_t own = taken(w, H5Tcopy(H5T_C_S1));
    check_hdf5(w, H5Tset_size(own, *size));
    check_hdf5(w, H5Tset_cset(own, H5T_CSET_UTF8));
    w->failed = w->failed || texts == NULL;
    if (!w->failed)
        check_hdf5(w, H5Dread(set, own, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts));
    *count = (size_t)extent;
    (void)H5Tclose(own);
    (void)H5Sclose(space);
    (void)H5Tclose(type);
    (void)H5Dclose(set);
    return texts;
}

/* Reads the names of the columns into a table without rows. */
static void read_column_names(writer *w, kt_table *table) {
    size_t count = 0, size = 0;
    table->text = read_texts(w, "columns", &count, &size);
    table->names = calloc(count + 1, sizeof *table->names);
    w->failed = w->failed || table->names == NULL || count == 0;
    table->columns = (int)count;
    for (size_t i = 0; !w->failed && i < count; i++)
        table->names[i] = table->text + i * size;
}

/* Reads the rows of a dataset into the columns of a table. */
static void read_dataset_rows(writer *w, hid_t place, const char *name, kt_table *table) {
    hsize_t extent[2] = {0, 0};
    const hid_t set = taken(w, H5Dopen2(place, name, H5P_DEFAULT)), space = taken(w, H5Dget_space(set));
    w->failed = w->failed || H5Sget_simple_extent_dims(space, extent, NULL) != 2 || (int)extent[1] != table->columns;
    const size_t rows = (size_t)extent[0], columns = (size_t)table->columns;
    double *numbers = w->failed ? NULL : malloc((rows * columns + 1) * sizeof *numbers);
    table->cells = w->failed ? NULL : malloc((rows * columns + 1) * sizeof *numbers);
    w->failed = w->failed || numbers == NULL || table->cells == NULL;
    if (!w->failed && rows > 0)
        check_hdf5(w, H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers));
    for (size_t i = 0; !w->failed && i < rows * columns; i++)
        table->cells[i % columns * rows + i / columns] = numbers[i];
    table->rows = rows;
    free(numbers);
    (void)H5Sclose(space);
    (void)H5Dclose(set);
}

/* Adds one run. Returns -1, or an exit code. */
static int add_run(writer *w, hid_t place, const char *name, const char *label, kt_table *table) {
    kt_table one = {0};
    int code = -1;
    read_column_names(w, &one);
    if (!w->failed)
        read_dataset_rows(w, place, name, &one);
    if (!w->failed && one.rows > 0) /* others have failed before their first record */
        code = kt_table_join(table, &one, label);
    kt_table_free(&one);
    return code;
}

static int add_runs(writer *w, kt_table *table) {
    char name[32], label[48];
    int code = -1;
    w->group = taken(w, H5Gopen2(w->file, "runs", H5P_DEFAULT));
    H5G_info_t info = {.nlinks = 0};
    check_hdf5(w, H5Gget_info(w->group, &info));
    const hsize_t runs = info.nlinks < RUNS_MOST ? info.nlinks : RUNS_MOST;
    if (runs < info.nlinks)
        kt_say("plot: %d of %llu runs are drawn", (int)RUNS_MOST, (unsigned long long)info.nlinks);
    for (hsize_t i = 0; i < runs && !w->failed && code < 0; i++) {
        (void)H5Lget_name_by_idx(w->group, ".", H5_INDEX_NAME, H5_ITER_INC, i * info.nlinks / runs, name, sizeof name,
                                 H5P_DEFAULT);
        (void)snprintf(label, sizeof label, "run %s", name);
        code = add_run(w, w->group, name, label, table);
    }
    (void)H5Gclose(w->group);
    return code;
}

int kt_hdf5_read(const char *path, kt_table *table) {
    writer w = {.group = -1};
    int code = -1;
    (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    w.file = taken(&w, H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT));
    if (!w.failed && H5Lexists(w.file, "records", H5P_DEFAULT) > 0)
        code = add_run(&w, w.file, "records", path, table);
    else if (!w.failed)
        code = add_runs(&w, table);
    if (w.file >= 0)
        (void)H5Fclose(w.file);
    if (!w.failed && code < 0 && table->rows > 0)
        return -1;
    if (code < 0)
        kt_say("%s cannot be read: it is no HDF5 file that `run --out` or `sweep --keep` has written, or it has no "
               "records",
               path);
    return code < 0 ? KT_EXIT_SCENE : code;
}
