/* Attaches loops and effects to a tree: declarations that attach.c, gather.c and batch.c share. */
#ifndef KT_COMPILE_ATTACH_H
#define KT_COMPILE_ATTACH_H

#include "base/arena.h"
#include "compile/compile.h"
#include "loop/loop.h"

/* Working arrays, in one block. */
#define ATTACH_FIELDS(X)                                                                                               \
    X(int32_t, depth, n->link, "of the links under the ground")                                                        \
    X(int32_t, above, n->link, "union-find: towards the root of a link's set")                                         \
    X(int32_t, number, n->link, "group of a set's root, -1: none")                                                     \
    X(kt_pose, pose, n->link, "at the initial positions")                                                              \
    X(kt_loop_record, loop, n->loop, "as they will be in the model")                                                   \
    X(kt_effect_record, effect, n->effect, "in the description's order")                                               \
    X(int32_t, force_link, n->link, "index of a link in force_link; 0: not in it")

typedef struct kt_attach {
    const kt_description *description;
    const kt_planar_loop *flat; /* planar forms of the description's loops */
    const kt_model *tree;
    KT_ARENA_DECLARE(ATTACH_FIELDS)
} kt_attach;

static inline bool kt_attach_is_relation(int32_t type) { return kt_loop_is_relation((kt_loop_type)type); }

/* Rotates the frame of an end until its z axis is along `axis`. */
static inline void kt_attach_align_axis(kt_pose *frame, kt_vec3 axis) {
    frame->rotation = kt_mat3_multiply(frame->rotation, kt_triad_from_axis(kt_vec3_normalize(axis), 2));
}

/* Returns the deepest link that carries both or is one of them. */
int32_t kt_attach_ancestor(const kt_attach *a, int32_t i, int32_t j);

/* Joins the links from i up to the child of the ancestor into one set with i; returns their number. */
int32_t kt_attach_join_path(kt_attach *a, int32_t i, int32_t ancestor);

/* Unites the sets of i and j. */
void kt_attach_join(kt_attach *a, int32_t i, int32_t j);

/* Numbers the sets of links that loops have joined, in the order of the loops, and counts them. */
void kt_attach_number_groups(kt_attach *a, kt_counts *n);

/* Counts what effects add to a model: batches, links that carry forces and their angles, names. */
void kt_attach_count_effects(kt_attach *a, kt_counts *n);

/* Fills batches, effects and links that carry forces of a model whose effects are in a->effect. */
void kt_attach_fill_effects(kt_attach *a, kt_model *m);

/* Fills the constraint groups of a model that has its loops. */
void kt_attach_fill_groups(kt_attach *a, kt_model *m);

#endif
