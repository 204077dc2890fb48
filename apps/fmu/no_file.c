/* Scenes of FMUs have no other files: an FMU reads its own resource alone. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/file.h"
#include "scene/shapes.h"

/* NOLINTNEXTLINE(readability-non-const-parameter): the declaration of the reader of files */
kt_status kt_file_read(const char *path, char **text, size_t *size, kt_error *error) {
    (void)text, (void)size;
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, path, "a scene in an FMU cannot read files");
}

/* NOLINTNEXTLINE(readability-non-const-parameter): the declaration of the reader of meshes */
kt_status kt_scene_mesh_enclosed(const kt_scene_mesh *mesh, kt_enclosed *solid, kt_error *error) {
    (void)solid;
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, mesh->file, "a scene in an FMU cannot read files");
}
