/* Triangles with normals, for solids and symbols. A mesh starts as {0} and grows; kt_mesh_free releases the memory. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_PICTURE_MESH_H
#define KT_PICTURE_PICTURE_MESH_H

#include "picture/picture.h"

typedef struct kt_mesh {
    kt_vec3 *points, *normals; /* point_count of each; normals of unit length, out of the solid */
    int point_count;
    int *corners; /* 3 a triangle: points, anticlockwise as seen from outside */
    int triangle_count;
    size_t point_room, triangle_room;
} kt_mesh;

/* Adds the surface of a solid. Frame: the frame of the solid's pose, usually the frame of its body. sides: corners
 * of a circle, at least 3. The surface is closed: each edge belongs to two triangles. Edges at which normals jump have
 * two points at one place. The surface of a mesh is copied from its file. Returns false, with the mesh unchanged, if
 * memory is insufficient. */
bool kt_mesh_add_solid(kt_mesh *mesh, const kt_solid *solid, int sides);

void kt_mesh_free(kt_mesh *mesh);

#endif
