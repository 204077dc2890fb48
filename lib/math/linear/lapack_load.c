/* LAPACK for the shared library: loaded when it is first needed, from a module in the library's folder or else in the
 * loader's search path. The module is never unloaded: its threads could not be ended safely.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* dladdr */
#include "linear/lapack.h"

#include <dlfcn.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { KT_ROOM = 192 << 20 }; /* bytes that must be available for loading OpenBLAS: see has_room */

/* The module's table, constant once it is loaded; every thread finds the same table. */
static _Atomic(const kt_lapack_table *) loaded;

#define KT_LAPACK_PASS(name, parameters, arguments)                                                                    \
    int kt_lapack_##name parameters {                                                                                  \
        const kt_lapack_table *table = atomic_load_explicit(&loaded, memory_order_acquire);                            \
        return table ? table->name arguments : -1;                                                                     \
    }
KT_LAPACK_CORE_LIST(KT_LAPACK_PASS)
#ifdef KT_LAPACK_STUDY /* in libkinetree-study */
KT_LAPACK_STUDY_LIST(KT_LAPACK_PASS)
#endif
#undef KT_LAPACK_PASS

/* Writes the path of the module in the folder of this library; returns false if the module does not exist. */
static bool find_module(char *path, size_t size) {
    Dl_info own;
    if (dladdr((void *)&loaded, &own) == 0 || own.dli_fname == NULL)
        return false;
    const char *slash = strrchr(own.dli_fname, '/');
    if (slash == NULL)
        return false;
    const int length =
        snprintf(path, size, "%.*s%s", (int)(slash + 1 - own.dli_fname), own.dli_fname, KT_LAPACK_MODULE);
    return length > 0 && (size_t)length < size && access(path, F_OK) == 0;
}

/* If the address space is limited (ulimit -v), OpenBLAS retries the allocation of its buffers without end. With one
 * thread, OpenBLAS allocates 120 MB (0.3.21, measured). */
static bool has_room(void) {
    struct rlimit all, data;
    const bool is_limited = (getrlimit(RLIMIT_AS, &all) == 0 && all.rlim_cur != RLIM_INFINITY) ||
                            (getrlimit(RLIMIT_DATA, &data) == 0 && data.rlim_cur != RLIM_INFINITY);
    if (!is_limited)
        return true;
    void *room = malloc(KT_ROOM);
    free(room);
    return room != NULL;
}

static kt_status reject_lapack(const char *reason, kt_error *error) {
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, KT_LAPACK_MODULE,
                        "LAPACK, needed for groups of loops with 40 coordinates and more, the reduction by singular "
                        "values, modes, equilibria and constraint formulations, cannot be loaded: %s",
                        reason != NULL ? reason : "no reason was given");
}

kt_status kt_lapack_open(kt_error *error) {
    char path[4096];
    if (atomic_load_explicit(&loaded, memory_order_acquire) != NULL)
        return KT_OK;
    if (!has_room())
        return reject_lapack(
            "OpenBLAS takes more memory than this process may have; raise its limit (ulimit -v, ulimit -d)", error);
    void *module = dlopen(find_module(path, sizeof path) ? path : KT_LAPACK_MODULE, RTLD_NOW | RTLD_LOCAL);
    const kt_lapack_table *table = module != NULL ? dlsym(module, "kt_lapack_module") : NULL;
    if (table == NULL)
        return reject_lapack(dlerror(), error);
    if (strcmp(table->version, kt_version()) != 0)
        return reject_lapack("it is of another version than the library; install both together", error);
    atomic_store_explicit(&loaded, table, memory_order_release);
    return KT_OK;
}
