/* Finds the trees that move in a plane (model/planar.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMPILE_FIND_PLANAR_H
#define KT_COMPILE_FIND_PLANAR_H

#include "model/model.h"

/* A body in the search for planar trees; arrays are in the order of the bodies. */
typedef struct kt_body_plane {
    kt_mat3 rest;   /* the body's axes in the world at q = 0 */
    kt_mat3 basis;  /* e1, e2, n of the plane in the body's axes at q = 0 */
    kt_vec3 at;     /* for bodies of the ground: the origin in the world */
    double height;  /* for other bodies: the origin's coordinate along n */
    double reach;   /* sum of the lengths of the joint offsets from the world's origin to it */
    int32_t source; /* index in the description */
    int32_t parent;
    int32_t tree;      /* the body whose joint on the ground carries it; 0: it is part of the ground */
    int32_t component; /* for a tree: one of the trees with which loops connect it, the same for all of them */
    int32_t plane;     /* plane of the tree that this body's joint connects with the ground; -1: none, or not planar */
    int32_t known;     /* kind of the joints that determine that tree's normal (find_planar.c) */
} kt_body_plane;

/* The scope of the names of bodies. The scope of the markers of a body is the index of the body in the description. */
enum { KT_NAMES_OF_BODIES = -1 };

/* A description whose bodies have been put in order. */
typedef struct kt_ordered {
    const kt_description *description;
    const kt_names *names;  /* names of bodies, and of markers where there are loops, to indices in the description */
    const int32_t *body_of; /* indices from the description to bodies */
    size_t count;           /* number of bodies, without the ground */
} kt_ordered;

/* Finds the planar trees and returns the number of planes. Fills all members of body[0] to body[count] except source
 * and parent, which are given (a parent precedes its children). Fills the bases of the planes, which have room for
 * count. Trees that loops connect are planar together or not at all. flat (one for each loop): the planar forms of the
 * loops of planar trees, except the members that kt_planar_ends fills.
 * Cost: nearly linear in bodies and loops.
 * A tree is compared with the last few planes only, so that a normal may get a second plane if there are many. */
size_t kt_planes_find(const kt_ordered *o, kt_body_plane *body, kt_plane *plane, kt_planar_loop *flat);

/* Gives trees that loops connect the same component. */
void kt_trees_join(const kt_ordered *o, kt_body_plane *body);

/* Makes a component spatial if one of its loops cannot be closed in the plane; fills the rows of the other loops. */
void kt_loops_planar_rows(const kt_ordered *o, kt_body_plane *body, const kt_plane *plane, kt_planar_loop *flat);

/* Fills the planar indices and the arms of a loop's ends, which are on planar links or the ground. */
void kt_planar_ends(const kt_model *model, const kt_loop_record *loop, kt_planar_loop *flat);

/* Fills `planar` and `planar_rest` of a model that has its links, and the remaining members of its planes. */
void kt_planar_links_fill(kt_model *model, const kt_body_plane *body);

#endif
