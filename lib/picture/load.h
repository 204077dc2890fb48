/* Meshes of a scene as surfaces of solids. */
#ifndef KT_PICTURE_LOAD_H
#define KT_PICTURE_LOAD_H

#include "kinetree/scene.h"
#include "picture/mesh.h"
#include "picture/picture.h"

/* Reads a mesh, thins it out to at most that many triangles, and fills the surface, which the caller releases with
 * kt_mesh_free, and the solid, whose type is the box around it and which is all but its body and mesh. Errors:
 * KT_ERROR_FILE, KT_ERROR_SCENE (what is wrong with the file), KT_ERROR_MEMORY; *surface is then untouched. */
kt_status kt_mesh_load(const kt_scene_mesh *from, int most, kt_mesh *surface, kt_solid *solid, kt_error *error);

#endif
