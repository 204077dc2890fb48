/* Surfaces of triangles, from the files of robots, and the mass of the enclosed bodies. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MESH_MESH_H
#define KT_MESH_MESH_H

#include "kinetree/algebra.h"

#include <stddef.h>

typedef struct kt_triangle {
    int corner[3]; /* vertices, counterclockwise from outside */
} kt_triangle;

/* Belongs to the caller; a struct of zeros is empty. */
typedef struct kt_triangles {
    kt_vec3 *vertices;
    kt_triangle *triangles;
    int vertex_count, triangle_count;
    bool is_hull;  /* made of vertices alone */
    bool is_lines; /* made of lines alone: the last two corners of each triangle are equal */
} kt_triangles;

enum { KT_TRIANGLES_MOST = 1 << 24 };

/* Reads STL (binary or text), OBJ, or MuJoCo's MSH. Text is read in the format that its contents show. If it is neither
 * a solid of STL nor has the length of a binary STL or MSH, it is read as OBJ. Polygons of OBJ are divided into
 * triangles; materials, normals and textures are passed over. Without polygons, its lines are triangles without area.
 * Vertices without triangles and lines are their convex hull.
 * Ownership: on success *mesh is released with kt_triangles_free; on failure it is untouched.
 * Errors: KT_ERROR_SCENE (with the fault in words), KT_ERROR_MEMORY.
 * Cost: O(size). */
kt_status kt_triangles_parse(const char *text, size_t size, kt_triangles *mesh, kt_error *error);

/* Whether the contents of a file are a binary STL. */
bool kt_triangles_is_binary_stl(const char *text, size_t size);

/* Vertices and triangles from lists of numbers, three each; vertices are shared. Without triangles: the convex hull. */
kt_status kt_triangles_make(const double *vertices, int vertex_count, const double *corners, int triangle_count,
                            kt_triangles *mesh, kt_error *error);

void kt_triangles_free(kt_triangles *mesh);

/* x <- R' (x - origin), each component then times its scale. */
void kt_triangles_place(kt_triangles *mesh, kt_pose frame, kt_vec3 scale);

/* Rounds the coordinates of all vertices to single precision. False if one is beyond its range. */
bool kt_triangles_round(kt_triangles *mesh);

/* Makes all triangles face the other way. */
void kt_triangles_turn_over(kt_triangles *mesh);

/* Shares vertices, and leaves no more than `most` triangles (>= 0), as near to the surface as cubes of one size allow;
 * triangles without area vanish. On failure the mesh is unchanged. Errors: KT_ERROR_MEMORY. O(size) some fifteen
 * times. */
kt_status kt_triangles_decimate(kt_triangles *mesh, int most, kt_error *error);

/* Whether the surface is closed, and its triangles all face outwards or all inwards.
 * Errors: KT_ERROR_SCENE, with the number of open edges, and the position of one of them; KT_ERROR_MEMORY.
 * Cost: O(n log n). */
kt_status kt_triangles_check_closed(const kt_triangles *mesh, kt_error *error);

/* Replaces the triangles by the triangles of the convex hull of all vertices. Coordinates that differ by less than 1e-9
 * of their range are the same. On failure the mesh is as it was.
 * Errors: KT_ERROR_SCENE if all vertices are in a plane; KT_ERROR_MEMORY.
 * Cost: O(n log n) for n vertices, on average over the order in which they are taken. */
kt_status kt_triangles_hull(kt_triangles *mesh, kt_error *error);

/* How the tetrahedra under triangles are summed. */
typedef enum kt_volume_rule {
    KT_VOLUME_SIGNED,   /* exactly: the surface is closed, its triangles outwards */
    KT_VOLUME_ABSOLUTE, /* each as positive, seen from the surface's centroid: MuJoCo's `legacy` */
    KT_VOLUME_SURFACE,  /* none: the mass is that of the triangles, by their areas */
} kt_volume_rule;

/* The mass properties of the body that a surface encloses, at density 1. */
typedef struct kt_enclosed {
    double volume; /* for KT_VOLUME_SURFACE the area */
    kt_vec3 com;
    kt_sym3 inertia; /* about com */
} kt_enclosed;

/* Computes volume, centroid and inertia of the enclosed body, or of the surface itself. If the volume is not above
 * zero, the surface encloses nothing. O(triangles). */
kt_enclosed kt_triangles_enclosed(const kt_triangles *mesh, kt_volume_rule rule);

#endif
