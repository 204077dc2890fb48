/* Convex solids: position, extent, and intersection with rays. Unless a comment states another frame, everything is in
 * the frame of the solid, whose origin is the solid's centre. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_SOLID_H
#define KT_PICTURE_SOLID_H

#include "picture/picture.h"

/* The matrix of a rotation of a checked description. */
kt_mat3 kt_solid_rotation(const kt_rotation *rotation);

/* The solid of a shape, in the frame of its body. Returns false if the shape is none. Rods without radius and points
 * are of KT_SOURCE_SLENDER, their radius zero. */
bool kt_solid_of_shape(const kt_shape *shape, kt_solid *solid);

/* A polygon is shown by its edges: the edges of two faces, and the edges between the faces. The first function returns
 * the number of edges, 0 for another shape. The second function returns the k-th edge, a rod of KT_SOURCE_SLENDER in
 * the body's frame. */
size_t kt_solid_edge_count(const kt_shape *shape);
kt_solid kt_solid_edge(const kt_shape *shape, size_t k);

/* A rod between two points, or a ball if the points coincide. */
kt_solid kt_solid_rod(kt_vec3 from, kt_vec3 to, double radius);

/* The largest coordinate along a direction (support function). */
double kt_solid_reach(const kt_solid *solid, kt_vec3 direction);

/* The point of the solid nearest to a point; for a rod, the nearest point of the line between the centres of its
 * ends. */
kt_vec3 kt_solid_nearest(const kt_solid *solid, kt_vec3 point);

/* Intersects the solid with the line `from` + s `direction`, of unit length: s is inside from *enter to *leave. Returns
 * false if the line misses the solid. */
bool kt_solid_cut(const kt_solid *solid, kt_vec3 from, kt_vec3 direction, double *enter, double *leave);

#endif
