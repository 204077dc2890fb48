/* The module of foreign.c, which is linked to assimp. Loading it takes a fifth of the time of a start. Therefore the
 * command loads it when a scene first has a mesh in a format of assimp. The module is never unloaded. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/foreign.h"

#include <dlfcn.h>
#include <string.h>

kt_status kt_foreign_parse(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) {
    kt_status (*parse)(const char *path, const char *text, size_t size, kt_triangles *mesh, kt_error *error) = NULL;
    void *const module = dlopen(KT_ASSIMP_MODULE, RTLD_NOW | RTLD_LOCAL);
    void *const found = module != NULL ? dlsym(module, "kt_foreign_parse") : NULL;
    if (found == NULL)
        return kt_error_set(error, KT_ERROR_SCENE, "", "assimp cannot be loaded: %.200s; install Kinetree as a whole",
                            dlerror());
    memcpy(&parse, &found, sizeof parse);
    return parse(path, text, size, mesh, error);
}
