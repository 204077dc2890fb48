/* HDF5 of the command. In Debian its library brings twenty others, such as those of encrypted networks, and a third of
 * the time of a start went into loading them. The command therefore loads records/hdf5.c and records/hdf5_read.c, a
 * module that is linked to HDF5, when it first writes or reads such a file. The module is never unloaded. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "records/keep.h"

#include <dlfcn.h>
#include <string.h>

/* Writes the address of a function of the module. Returns -1, or an exit code after printing the error. */
static int find_in_hdf5_module(const char *path, const char *name, void *function, size_t size) {
    void *const module = dlopen(KT_HDF5_MODULE, RTLD_NOW | RTLD_LOCAL);
    void *const found = module != NULL ? dlsym(module, name) : NULL;
    if (found == NULL)
        return kt_reject(KT_EXIT_INTEGRATION,
                         "%s: HDF5 cannot be loaded: %s; install Kinetree as a whole, or write CSV", path, dlerror());
    memcpy(function, &found, size);
    return -1;
}

int kt_keep_check(const char *path) {
    void *function;
    return find_in_hdf5_module(path, "kt_hdf5_write", &function, sizeof function);
}

int kt_hdf5_write(const char *path, FILE *file, const kt_keep_words *words) {
    int (*write)(const char *path, FILE *file, const kt_keep_words *words) = NULL;
    return find_in_hdf5_module(path, "kt_hdf5_write", &write, sizeof write) < 0 ? write(path, file, words) : -1;
}

int kt_hdf5_read(const char *path, kt_table *table) {
    int (*read)(const char *path, kt_table *table) = NULL;
    const int code = find_in_hdf5_module(path, "kt_hdf5_read", &read, sizeof read);
    return code < 0 ? read(path, table) : code;
}
