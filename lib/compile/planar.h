/* Which trees move in a plane (model/planar.h), as the compiler finds out. */
#ifndef KT_COMPILE_PLANAR_H
#define KT_COMPILE_PLANAR_H

#include "model/model.h"

/* How a body moves, index by index of the bodies. */
typedef struct kt_body_plane {
    kt_mat3 rest;   /* its axes in the world at q = 0 */
    kt_mat3 basis;  /* e1, e2, n of the plane in its axes at q = 0 */
    kt_vec3 at;     /* of bodies of the ground: the origin in the world */
    double height;  /* of others: of the origin along n */
    double reach;   /* the length of the way to it from the world's origin, by its frames */
    int32_t source; /* index in the description */
    int32_t parent;
    int32_t tree;      /* the body whose joint on the ground carries it; 0: it is part of the ground */
    int32_t component; /* of a tree: one of the trees that loops connect it with, the same for all of them */
    int32_t plane;     /* of the tree whose joint on the ground is this body's; -1: none, or the tree is spatial */
    int32_t known;     /* of that tree: what its normal is known from */
} kt_body_plane;

/* A description whose bodies have been put in order. */
typedef struct kt_ordered {
    const kt_description *description;
    const kt_names *names;  /* to indices in the description */
    const int32_t *body_of; /* of these: bodies */
    size_t count;           /* of bodies, without the ground */
} kt_ordered;

/* Finds the planar trees: fills all but source and parent of bodies 0 to count (a parent precedes its children), and
 * the bases of the planes, which have room for count; returns their number. Trees that loops connect are planar
 * together or not at all; flat (one a loop): how the loops of planar trees lie in their plane, but for kt_planar_ends.
 * O(count) but for many different planes. */
size_t kt_planes_find(const kt_ordered *o, kt_body_plane *body, kt_plane *plane, kt_planar_loop *flat);

/* Trees that loops connect get one component. */
void kt_trees_join(const kt_ordered *o, kt_body_plane *body);

/* Components of which a loop cannot be closed in their plane lose it; the others' loops are laid flat. */
void kt_loops_planar_rows(const kt_ordered *o, kt_body_plane *body, const kt_plane *plane, kt_planar_loop *flat);

/* Places and arms of a loop's ends, which are on planar links or the ground. */
void kt_planar_ends(const kt_model *model, const kt_loop_record *loop, kt_planar_loop *flat);

/* Fills planar and planar_rest of a model whose links are strung, and the rest of its planes. */
void kt_planar_links_fill(kt_model *model, const kt_body_plane *body);

#endif
