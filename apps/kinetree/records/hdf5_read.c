/* HDF5 files of results, read into tables. The file may be anyone's, and HDF5 reads out of bounds where chunks are
 * damaged: a child process reads it. The child follows nothing that leads out of the file, and decodes with filters of
 * HDF5's own alone. It answers with a part for each run: a head, the names of the columns, and rows.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/keep.h"
#include "text/input.h"

#include "document/apart.h"

#include <hdf5.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    RUNS_MOST = 200,      /* curves that a picture can show */
    BLOCK = 1 << 16,      /* numbers that the child reads at a time */
    NAMES_MOST = 1 << 26, /* bytes of all names */
    SECONDS_MOST = 60,
};

/* The beginning of the answer. */
typedef struct file_head {
    unsigned long long runs, drawn;
} file_head;

/* The beginning of each part. columns = 0: the end. */
typedef struct part_head {
    unsigned long long rows, columns, text; /* text: bytes of the names, each with a zero behind it */
    char label[48];
    char reason[160]; /* of the failure, at the end; empty: none */
} part_head;

/* ---- the child --------------------------------------------------------------------------------------------------- */

typedef struct hdf5_reader {
    hid_t file;
    int to;
    bool failed;
    bool is_cut;        /* within the rows of a part: no end follows */
    const char *reason; /* "": it is not a file of this program */
} hdf5_reader;

static hid_t opened(hdf5_reader *r, hid_t id) {
    r->failed = r->failed || id < 0;
    return id;
}

static void reject_hdf5(hdf5_reader *r, const char *reason) {
    r->failed = true;
    r->reason = *r->reason != '\0' ? r->reason : reason;
}

/* Whether only filters that are part of HDF5 and that results use decode the chunks. */
static bool has_own_filters(hid_t creation) {
    bool own = true;
    const int count = H5Pget_nfilters(creation);
    for (int i = 0; i < count; i++) {
        unsigned flags = 0;
        size_t values = 0;
        const H5Z_filter_t filter = H5Pget_filter2(creation, (unsigned)i, &flags, &values, NULL, 0, NULL, NULL);
        own = own && (filter == H5Z_FILTER_DEFLATE || filter == H5Z_FILTER_SHUFFLE || filter == H5Z_FILTER_FLETCHER32);
    }
    return own && count >= 0;
}

/* Rejects links out of their group, and soft links, which no result has. */
static bool check_link(hdf5_reader *r, hid_t place, const char *name) {
    H5L_info_t link;
    if (H5Lget_info(place, name, &link, H5P_DEFAULT) < 0)
        r->failed = true;
    else if (link.type != H5L_TYPE_HARD)
        reject_hdf5(r, "it has a link in place of a dataset or a group, and links are not followed");
    return !r->failed;
}

/* Opens a dataset whose numbers are in the file. */
static hid_t open_dataset(hdf5_reader *r, hid_t place, const char *name) {
    if (!check_link(r, place, name))
        return -1;
    const hid_t set = opened(r, H5Dopen2(place, name, H5P_DEFAULT));
    const hid_t creation = opened(r, H5Dget_create_plist(set));
    if (!r->failed && (H5Pget_layout(creation) == H5D_VIRTUAL || H5Pget_external_count(creation) != 0))
        reject_hdf5(r, "a dataset is stored in other files, which are not read");
    else if (!r->failed && !has_own_filters(creation))
        reject_hdf5(r, "a dataset has filters other than deflate, shuffle and fletcher32, which are not loaded");
    (void)H5Pclose(creation);
    if (!r->failed)
        return set;
    (void)H5Dclose(set);
    return -1;
}

/* Reads the names of the columns, one behind the other. The caller frees them. */
static char *read_names(hdf5_reader *r, part_head *head) {
    hsize_t extent = 0;
    const hid_t set = open_dataset(r, r->file, "columns");
    const hid_t type = opened(r, H5Dget_type(set)), space = opened(r, H5Dget_space(set));
    const size_t size = H5Tget_size(type) + 1;
    const bool is_right = !r->failed && H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0 &&
                          H5Sget_simple_extent_ndims(space) == 1 &&
                          H5Sget_simple_extent_dims(space, &extent, NULL) == 1 && extent > 0 &&
                          extent <= KT_TABLE_COLUMNS_MOST && size <= NAMES_MOST / extent;
    char *cells = is_right ? calloc((size_t)extent + 1, size) : NULL;
    const hid_t own = opened(r, H5Tcopy(H5T_C_S1));
    r->failed = r->failed || cells == NULL || H5Tset_size(own, size) < 0 || H5Tset_cset(own, H5Tget_cset(type)) < 0 ||
                H5Dread(set, own, H5S_ALL, H5S_ALL, H5P_DEFAULT, cells) < 0;
    head->columns = extent;
    head->text = 0;
    for (size_t i = 0; !r->failed && i < extent; i++) {
        const size_t length = strnlen(cells + i * size, size - 1);
        memmove(cells + head->text, cells + i * size, length);
        cells[head->text + length] = '\0';
        head->text += length + 1;
    }
    (void)H5Tclose(own);
    (void)H5Sclose(space);
    (void)H5Tclose(type);
    (void)H5Dclose(set);
    return cells;
}

/* Sends the rows of a dataset, some at a time. */
static void send_rows(hdf5_reader *r, hid_t set, hid_t space, const part_head *head) {
    const hsize_t most = BLOCK / head->columns > 0 ? BLOCK / head->columns : 1;
    double *rows = malloc((size_t)(most * head->columns) * sizeof *rows);
    r->failed = r->failed || rows == NULL;
    for (hsize_t from = 0; from < head->rows && !r->failed; from += most) {
        const hsize_t begin[2] = {from, 0},
                      count[2] = {head->rows - from < most ? head->rows - from : most, head->columns};
        const hid_t part = opened(r, H5Screate_simple(2, count, NULL));
        r->failed = r->failed || H5Sselect_hyperslab(space, H5S_SELECT_SET, begin, NULL, count, NULL) < 0 ||
                    H5Dread(set, H5T_NATIVE_DOUBLE, part, space, H5P_DEFAULT, rows) < 0 ||
                    !kt_apart_write(r->to, rows, (size_t)(count[0] * count[1]) * sizeof *rows);
        (void)H5Sclose(part);
    }
    free(rows);
}

/* Sends a run as a part, unless it has failed before its first record. */
static void send_run(hdf5_reader *r, hid_t place, const char *name, const char *label) {
    part_head head;
    hsize_t extent[2] = {0, 0};
    memset(&head, 0, sizeof head);
    (void)snprintf(head.label, sizeof head.label, "%s", label);
    char *names = read_names(r, &head);
    const hid_t set = r->failed ? -1 : open_dataset(r, place, name);
    const hid_t space = opened(r, H5Dget_space(set)), type = opened(r, H5Dget_type(set));
    const H5T_class_t class = H5Tget_class(type);
    r->failed = r->failed || H5Sget_simple_extent_ndims(space) != 2 ||
                H5Sget_simple_extent_dims(space, extent, NULL) != 2 || (class != H5T_FLOAT && class != H5T_INTEGER);
    head.rows = extent[0];
    if (!r->failed && extent[1] != head.columns)
        reject_hdf5(r, "a dataset has another number of columns than names");
    if (!r->failed && head.rows > KT_TABLE_NUMBERS_MOST / head.columns)
        reject_hdf5(r, "a dataset has more numbers than a table may have, 2^27");
    if (!r->failed && head.rows > 0) {
        r->failed = !kt_apart_write(r->to, &head, sizeof head) || !kt_apart_write(r->to, names, (size_t)head.text);
        send_rows(r, set, space, &head);
        r->is_cut = r->failed;
    }
    (void)H5Tclose(type);
    (void)H5Sclose(space);
    (void)H5Dclose(set);
    free(names);
}

/* Opens the group of the runs of a sweep, and counts them. */
static hid_t open_runs(hdf5_reader *r, file_head *head) {
    H5G_info_t info = {.nlinks = 0};
    const hid_t group = check_link(r, r->file, "runs") ? opened(r, H5Gopen2(r->file, "runs", H5P_DEFAULT)) : -1;
    r->failed = r->failed || H5Gget_info(group, &info) < 0;
    *head = (file_head){info.nlinks, info.nlinks < RUNS_MOST ? info.nlinks : RUNS_MOST};
    return group;
}

static void send_runs(hdf5_reader *r, hid_t group, const file_head *head) {
    char name[32], label[48];
    for (hsize_t i = 0; i < head->drawn && !r->failed; i++) {
        r->failed = H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i * head->runs / head->drawn, name,
                                       sizeof name, H5P_DEFAULT) < 0;
        (void)snprintf(label, sizeof label, "run %s", name);
        if (!r->failed)
            send_run(r, group, name, label);
    }
}

/* user: the path. */
static bool read_hdf5_in_child(int to, void *user) {
    const char *path = user;
    hdf5_reader r = {.to = to, .reason = ""};
    file_head head = {1, 1};
    part_head end;
    hid_t group = -1;
    (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    (void)H5PLset_loading_state(0);
    r.file = opened(&r, H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT));
    kt_apart_forbid_files();
    const bool is_run = !r.failed && H5Lexists(r.file, "records", H5P_DEFAULT) > 0;
    if (!r.failed && !is_run)
        group = open_runs(&r, &head);
    if (!kt_apart_write(to, &head, sizeof head))
        return false;
    if (is_run)
        send_run(&r, r.file, "records", "");
    else if (!r.failed)
        send_runs(&r, group, &head);
    if (r.is_cut)
        return false;
    memset(&end, 0, sizeof end);
    (void)snprintf(end.reason, sizeof end.reason, "%s", r.failed && *r.reason == '\0' ? "?" : r.reason);
    return kt_apart_write(to, &end, sizeof end);
}

/* ---- the parent -------------------------------------------------------------------------------------------------- */

/* Splits the names of a part. Returns whether each has a zero behind it, and they are as many as the columns. */
static bool split_names(kt_table *table, size_t size) {
    size_t at = 0;
    for (int i = 0; i < table->columns; i++) {
        const char *end = at < size ? memchr(table->text + at, '\0', size - at) : NULL;
        if (end == NULL)
            return false;
        table->names[i] = table->text + at;
        at = (size_t)(end - table->text) + 1;
    }
    return at == size;
}

/* Reads the names and numbers of a part. Returns false if they have not come, or memory is insufficient. */
static bool read_part(const kt_apart *apart, const part_head *head, kt_table *table) {
    const size_t rows = (size_t)head->rows, columns = (size_t)head->columns;
    const size_t most = BLOCK / columns > 0 ? BLOCK / columns : 1;
    double *block = malloc(most * columns * sizeof *block);
    *table = (kt_table){.columns = (int)columns,
                        .rows = rows,
                        .text = malloc((size_t)head->text + 1),
                        .names = calloc(columns, sizeof *table->names),
                        .cells = malloc(rows * columns * sizeof *table->cells)};
    bool fine = block != NULL && table->text != NULL && table->names != NULL && table->cells != NULL &&
                kt_apart_read(apart, table->text, (size_t)head->text) && split_names(table, (size_t)head->text);
    for (size_t from = 0; fine && from < rows; from += most) {
        const size_t count = rows - from < most ? rows - from : most;
        fine = kt_apart_read(apart, block, count * columns * sizeof *block);
        for (size_t i = 0; fine && i < count * columns; i++)
            table->cells[i % columns * rows + from + i / columns] = block[i];
    }
    free(block);
    return fine;
}

/* Whether the head of a part may be true; *left: numbers that the file may still have. */
static bool check_part(const part_head *head, unsigned long long *left) {
    const bool fine = head->columns <= KT_TABLE_COLUMNS_MOST && head->text <= NAMES_MOST + KT_TABLE_COLUMNS_MOST &&
                      head->rows > 0 && head->rows <= *left / head->columns;
    *left -= fine ? head->rows * head->columns : 0;
    return fine;
}

/* Reads all parts into the table. *end: the end of the answer. Returns -1, or an exit code after printing an error;
 * *is_answered: the whole answer has come. */
static int read_parts(const kt_apart *apart, const char *path, kt_table *table, part_head *end, bool *is_answered) {
    unsigned long long left = KT_TABLE_NUMBERS_MOST;
    file_head head;
    int code = -1;
    *is_answered = kt_apart_read(apart, &head, sizeof head);
    if (*is_answered && head.drawn < head.runs)
        kt_say("plot: %llu of %llu runs are drawn", head.drawn, head.runs);
    while (code < 0 && *is_answered) {
        kt_table one = {0};
        *is_answered = kt_apart_read(apart, end, sizeof *end);
        end->label[sizeof end->label - 1] = end->reason[sizeof end->reason - 1] = '\0';
        if (!*is_answered || end->columns == 0)
            break;
        if (!check_part(end, &left)) {
            code = kt_reject(KT_EXIT_SCENE, "%s has more numbers than a table may have, 2^27", path);
            break;
        }
        *is_answered = read_part(apart, end, &one);
        if (*is_answered)
            code = kt_table_join(table, &one, end->label[0] != '\0' ? end->label : path);
        kt_table_free(&one);
    }
    return code;
}

int kt_hdf5_read(const char *path, kt_table *table) {
    const kt_file_kind kind = {"a table", "a file with a table (HDF5)", SIZE_MAX, false};
    const char *reason = "it is no HDF5 file that `run --out` or `sweep --keep` has written, or it has no records";
    kt_error error = {0};
    kt_apart apart;
    part_head end;
    bool is_answered;
    int file = -1;
    memset(&end, 0, sizeof end);
    if (kt_file_open(path, &kind, &file, &error) != KT_OK) {
        kt_say_error(&error);
        return KT_EXIT_SCENE;
    }
    (void)close(file); /* HDF5 opens its files by their names */
    if (kt_apart_start(&apart, read_hdf5_in_child, (char *)(uintptr_t)path, SECONDS_MOST, &error) != KT_OK)
        return kt_reject(KT_EXIT_INTEGRATION, "%s: %s", path, error.message);
    const int code = read_parts(&apart, path, table, &end, &is_answered);
    const kt_status status = kt_apart_end(&apart, is_answered || code >= 0, &error);
    if (code >= 0)
        return code;
    if (status == KT_OK && end.reason[0] == '\0' && table->rows > 0)
        return -1;
    if (status != KT_OK)
        return kt_reject(KT_EXIT_SCENE, "%s: %s", path, error.message);
    if (end.reason[0] != '\0' && end.reason[0] != '?')
        reason = end.reason;
    return kt_reject(KT_EXIT_SCENE, "%s cannot be read: %s", path, reason);
}
