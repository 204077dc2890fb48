/* HDF5 files from strangers: false sizes, data in other files, links, and damaged chunks. Each ends with a message, and
 * nothing of another file is read.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "random.h"
#include "sanitized.h"
#include "shell.h"

#include <hdf5.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PLOT "timeout 120 $K plot %s --out o.svg"

/* The names of three columns. */
static void write_columns(hid_t file, const char *name, size_t size, hsize_t count) {
    static const char names[3][16] = {"time", "position.a", "velocity.a"};
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate_simple(1, &count, NULL);
    (void)H5Tset_size(type, size);
    const hid_t set = H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (count == 3)
        (void)H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, names);
    (void)H5Dclose(set);
    (void)H5Sclose(space);
    (void)H5Tclose(type);
}

/* A dataset of this size, with numbers unless `creation` puts them elsewhere. */
static void write_numbers(hid_t place, const char *name, hsize_t rows, hsize_t columns, hid_t creation, bool has_data) {
    const hsize_t extent[2] = {rows, columns};
    const hid_t space = H5Screate_simple(2, extent, NULL);
    const hid_t set = H5Dcreate2(place, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    double *x = has_data ? calloc((size_t)(rows * columns) + 1, sizeof *x) : NULL;
    for (size_t i = 0; x != NULL && i < rows * columns; i++)
        x[i] = (double)(i * i % 1009);
    if (x != NULL)
        (void)H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x);
    free(x);
    (void)H5Dclose(set);
    (void)H5Sclose(space);
}

static hid_t create_in_folder(const char *name) {
    char path[4096], folder[4000];
    const kt_ran ran = kt_shell("pwd");
    (void)snprintf(folder, sizeof folder, "%s", ran.out);
    folder[strcspn(folder, "\n")] = '\0';
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
}

static hid_t chunked(hsize_t rows, hsize_t columns) {
    const hsize_t chunk[2] = {rows, columns};
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    (void)H5Pset_chunk(creation, 2, chunk);
    (void)H5Pset_deflate(creation, 4);
    return creation;
}

/* The number of columns was cut to 32 bits, and rows times columns were not compared with the room. */
KT_TEST(hdf5_with_false_sizes_is_rejected) {
    static const hsize_t extents[][2] = {
        {3, ((hsize_t)1 << 32) + 3}, {(hsize_t)1 << 40, 3}, {(hsize_t)1 << 62, 3}, {3, 4}};
    for (size_t i = 0; i < sizeof extents / sizeof *extents; i++) {
        const hid_t file = create_in_folder("wide.h5"), creation = chunked(3, 3);
        write_columns(file, "columns", 16, 3);
        write_numbers(file, "records", extents[i][0], extents[i][1], creation, false);
        (void)H5Pclose(creation);
        (void)H5Fclose(file);
        kt_expect(2, extents[i][1] == 3 ? "more numbers than a table may have" : "another number of columns than names",
                  PLOT, "wide.h5");
    }
    const hid_t file = create_in_folder("names.h5"), creation = chunked(1, 3);
    write_columns(file, "columns", (size_t)1 << 31, 100000);
    write_numbers(file, "records", 1, 3, creation, true);
    (void)H5Pclose(creation);
    (void)H5Fclose(file);
    kt_expect(2, "names.h5 cannot be read: it is no HDF5 file that", PLOT, "names.h5");
    /* A right file is read. */
    kt_expect(0, NULL, "$K make pendulum >p.yaml; $K run p.yaml --duration 0.1 --quiet --out right.h5");
    kt_expect(0, "picture: o.svg", PLOT, "right.h5");
    kt_expect(0, NULL,
              "$K run p.yaml --duration 0.1 --quiet --out right.csv; for from in right.h5 right.csv; do $K run p.yaml "
              "--from $from --duration 0.1 --quiet --out $from.next.csv 2>/dev/null; done; "
              "cmp right.h5.next.csv right.csv.next.csv");
}

/* The numbers of another file of the user would be in the picture. */
KT_TEST(hdf5_reads_no_other_file) {
    kt_shell("printf '%%0240d' 7 >other.bin");
    hid_t file = create_in_folder("external.h5"), creation = H5Pcreate(H5P_DATASET_CREATE);
    (void)H5Pset_external(creation, "other.bin", 0, 240);
    write_columns(file, "columns", 16, 3);
    write_numbers(file, "records", 10, 3, creation, false);
    (void)H5Pclose(creation);
    (void)H5Fclose(file);
    kt_expect(2, "external.h5 cannot be read: a dataset is stored in other files, which are not read", PLOT,
              "external.h5");

    file = create_in_folder("source.h5");
    creation = H5Pcreate(H5P_DATASET_CREATE);
    write_columns(file, "columns", 16, 3);
    write_numbers(file, "records", 10, 3, creation, true);
    (void)H5Fclose(file);
    kt_expect(0, "picture: o.svg", PLOT, "source.h5");

    file = create_in_folder("virtual.h5");
    const hsize_t extent[2] = {10, 3};
    const hid_t space = H5Screate_simple(2, extent, NULL);
    (void)H5Pset_virtual(creation, space, "source.h5", "/records", space);
    write_columns(file, "columns", 16, 3);
    write_numbers(file, "records", 10, 3, creation, false);
    (void)H5Sclose(space);
    (void)H5Pclose(creation);
    (void)H5Fclose(file);
    kt_expect(2, "virtual.h5 cannot be read: a dataset is stored in other files", PLOT, "virtual.h5");

    for (int part = 0; part < 3; part++) { /* the records, the names, the group of runs */
        file = create_in_folder("link.h5");
        if (part != 1)
            write_columns(file, "columns", 16, 3);
        else
            (void)H5Lcreate_external("source.h5", "/columns", file, "columns", H5P_DEFAULT, H5P_DEFAULT);
        if (part == 0)
            (void)H5Lcreate_external("source.h5", "/records", file, "records", H5P_DEFAULT, H5P_DEFAULT);
        if (part == 1)
            write_numbers(file, "records", 10, 3, H5P_DEFAULT, true);
        if (part == 2)
            (void)H5Lcreate_external("source.h5", "/", file, "runs", H5P_DEFAULT, H5P_DEFAULT);
        (void)H5Fclose(file);
        kt_expect(2, "link.h5 cannot be read: it has a link in place of a dataset or a group", PLOT, "link.h5");
    }
    file = create_in_folder("soft.h5");
    write_columns(file, "names", 16, 3);
    write_numbers(file, "records", 10, 3, H5P_DEFAULT, true);
    (void)H5Lcreate_soft("/names", file, "columns", H5P_DEFAULT, H5P_DEFAULT);
    (void)H5Fclose(file);
    kt_expect(2, "soft.h5 cannot be read: it has a link", PLOT, "soft.h5");
}

/* A filter that is no part of HDF5 is code, which HDF5 loads from a folder. */
KT_TEST(hdf5_loads_no_filters) {
    const hid_t file = create_in_folder("filter.h5"), creation = chunked(10, 3);
    const unsigned values[1] = {0};
    (void)H5Pset_filter(creation, 32008, H5Z_FLAG_OPTIONAL, 0, values);
    write_columns(file, "columns", 16, 3);
    write_numbers(file, "records", 10, 3, creation, true);
    (void)H5Pclose(creation);
    (void)H5Fclose(file);
    kt_expect(2, "a dataset has filters other than deflate, shuffle and fletcher32", PLOT, "filter.h5");
}

/* Each byte of a small file, changed in three ways. The command ends with a message or a picture, and not by a
 * signal. */
KT_TEST(hdf5_with_damage_ends_with_a_message) {
    static char bytes[1 << 16];
    const hid_t file = create_in_folder("small.h5"), creation = chunked(4, 3);
    write_columns(file, "columns", 16, 3);
    write_numbers(file, "records", 10, 3, creation, true);
    (void)H5Pclose(creation);
    (void)H5Fclose(file);
    const size_t size = strtoul(kt_shell("wc -c <small.h5").out, NULL, 10);
    kt_need(kt_check_true("a small file", size > 1000 && size <= sizeof bytes));
    const int step = KT_ADDRESS_SANITIZER ? 401 : KT_SHORT(101, 23);
    const kt_ran ran = kt_shell(
        "for at in $(seq 0 %d %zu); do cp small.h5 bad.h5; "
        "printf \"\\\\$(printf %%o $((at * 7 %% 256)))\" | dd of=bad.h5 bs=1 seek=$at conv=notrunc 2>/dev/null; "
        "timeout 120 $K plot bad.h5 --out o.svg >words 2>&1; code=$?; "
        "test $code = 0 || test $code = 2 || echo \"$at $code\"; test -s words || echo silent; done",
        step, size - 1);
    kt_check_text("ends that are neither a message nor a picture", ran.out, "");
}
