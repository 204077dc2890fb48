/* Meshes of a scene as surfaces of solids. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_LOAD_H
#define KT_PICTURE_LOAD_H

#include "kinetree/scene.h"
#include "picture/picture.h"
#include "picture/picture_mesh.h"

/* Reads a mesh, reduces it to at most `most` triangles, and fills the surface and the solid. The solid has the type
 * of the box around the mesh; its body and its mesh remain to be set. Ownership: the caller releases the surface with
 * kt_mesh_free. Errors: KT_ERROR_FILE, KT_ERROR_SCENE (the fault of the file), KT_ERROR_MEMORY; *surface is then
 * untouched. */
kt_status kt_mesh_load(const kt_scene_mesh *from, int most, kt_mesh *surface, kt_solid *solid, kt_error *error);

#endif
