/* The solid that the file of a mesh encloses: its volume, centre of mass and inertia. FMUs read no files, and leave
 * this source out (apps/fmu/no_file.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "document/file.h"
#include "scene/shapes.h"

#include <stdlib.h>

static kt_status read_mesh_surface(const kt_scene_mesh *mesh, kt_triangles *surface, kt_error *error) {
    char *text = NULL;
    size_t size = 0;
    kt_status status = kt_file_read(mesh->file, &text, &size, error);
    if (status == KT_OK)
        status = kt_triangles_parse(text, size, surface, error);
    free(text);
    return status;
}

kt_status kt_scene_mesh_enclosed(const kt_scene_mesh *mesh, kt_enclosed *solid, kt_error *error) {
    kt_triangles surface = {.vertices = NULL};
    kt_mat3 r = kt_mat3_identity();
    kt_status status = kt_rotation_evaluate(&mesh->rotation, &r, error);
    if (status == KT_OK)
        status = read_mesh_surface(mesh, &surface, error);
    if (status == KT_OK)
        status = kt_triangles_check_closed(&surface, error);
    if (status == KT_OK) {
        kt_triangles_place(&surface, kt_pose_identity(), mesh->scale);
        *solid = kt_triangles_enclosed(&surface, KT_VOLUME_SIGNED);
        if (!(solid->volume > 0.0)) { /* a mirror turns all triangles inside out; some files have them inside out */
            kt_triangles_turn_over(&surface);
            *solid = kt_triangles_enclosed(&surface, KT_VOLUME_SIGNED);
        }
        if (!(solid->volume > 0.0))
            status = kt_error_set(error, KT_ERROR_SCENE, "", "the surface encloses no volume");
    }
    kt_triangles_free(&surface);
    solid->com = kt_vec3_add(mesh->at, kt_mat3_apply(r, solid->com));
    solid->inertia = kt_sym3_rotate(r, solid->inertia);
    return status;
}
