/* Several shapes of a body. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SHAPES_H
#define KT_SCENE_SHAPES_H

#include "algebra/vector_parts.h"
#include "mesh/mesh.h"
#include "scene/scene_part.h"

/* The solid that a mesh encloses, in the body frame. Errors: those of the file, KT_ERROR_SCENE if the surface is not
 * closed or encloses nothing, KT_ERROR_MEMORY. */
kt_status kt_scene_mesh_enclosed(const kt_scene_mesh *mesh, kt_enclosed *solid, kt_error *error);

/* Adds a solid of a density to the mass, com and inertia of a body, which are those of solids before it. */
void kt_body_add_enclosed(kt_body *body, double density, const kt_enclosed *solid);

/* A shape, and its own mass, NaN if it has none. */
typedef struct kt_scene_part {
    kt_shape shape;
    double mass;
} kt_scene_part;

/* The properties that the scene gives for the body itself. */
enum { KT_GIVES_MASS = 1, KT_GIVES_COM = 2, KT_GIVES_INERTIA = 4 };

/* Checks the shapes, and gives the body their mass, com and inertia, except those that are given. Here `node` is that
 * of the list, and `nodes` are those of its items. Returns false after reporting the reason. */
bool kt_parts_settle(kt_reader *r, const kt_scope *scope, kt_node *node, kt_node *const *nodes, kt_scene_part *parts,
                     int count, unsigned given, kt_body *body);

#endif
