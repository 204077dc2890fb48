/* Scene files: YAML to a description and back. A library of its own, libkinetree-scene.
 */
#ifndef KINETREE_SCENE_H
#define KINETREE_SCENE_H

#include "kinetree/simulation.h"

#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a scene file says. All strings and arrays in it belong to it. */
typedef struct kt_scene {
    kt_description description;
    kt_run run;
    void *memory; /* where the arrays and strings live; for kt_scene_free */
} kt_scene;

/* Called once for each fault of a file, in the order of their lines. error->where is "FILE:LINE:COLUMN". */
typedef void kt_scene_report(void *user, const kt_error *error);

/* Reads a scene from a file (`path`), or from `size` bytes of text (`path` is then only its name in messages). The file's
 * form and the mechanism are both checked (kt_description_check); every fault is reported (report may be NULL).
 * On success *scene is released with kt_scene_free. Errors: KT_ERROR_FILE, KT_ERROR_SCENE, KT_ERROR_MODEL,
 * KT_ERROR_UNSUPPORTED, KT_ERROR_MEMORY, with the first fault in *error. */
KT_API KT_CHECKED kt_status kt_scene_read(const char *path, kt_scene *scene, kt_scene_report *report, void *user,
                                          kt_error *error);
KT_API KT_CHECKED kt_status kt_scene_parse(const char *path, const char *text, size_t size, kt_scene *scene,
                                           kt_scene_report *report, void *user, kt_error *error);
KT_API void kt_scene_free(kt_scene *scene);

/* Writes a scene file: numbers with as many digits as read back to the same bits, defaults left out;
 * write(read(write(x))) equals write(x) to the byte. Errors: KT_ERROR_FILE. */
KT_API KT_CHECKED kt_status kt_scene_write(const kt_scene *scene, FILE *stream, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
