/* Attaches loops and effects to a tree: declarations that attach.c, paths.c, gather.c, front_order.c and
 * effect_batches.c share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMPILE_ATTACH_H
#define KT_COMPILE_ATTACH_H

#include "base/arena.h"
#include "compile/compile.h"
#include "loop/loop.h"
#include "model/formula_names.h"

/* Working arrays, in one block. */
#define ATTACH_FIELDS(X)                                                                                               \
    X(int32_t, depth, n->link, "of the links under the ground")                                                        \
    X(int32_t, above, n->link, "union-find: towards the root of a link's set")                                         \
    X(int32_t, jump, n->link, "a link above, or the ground (paths.c)")                                                 \
    X(int32_t, top, n->link, "union-find: towards the highest link that paths have joined with a link")                \
    X(int32_t, base, n->link, "first link of the support")                                                             \
    X(double, far, n->link, "distance from there along the support, at the initial positions")                         \
    X(int32_t, from, n->link, "ancestor below which the path begins that leads through a link, -1: none")              \
    X(int32_t, place, n->link, "place of the link in that path")                                                       \
    X(int32_t, number, n->link, "group of a set's root, -1: none; once groups are filled, scratch of islands")         \
    X(kt_pose, pose, n->link, "at the initial positions")                                                              \
    X(kt_loop_record, loop, n->loop, "as they will be in the model")                                                   \
    X(kt_effect_record, effect, n->effect + n->effect_off, "in the description's order")                               \
    X(int32_t, force_link, n->link, "index of a link in force_link; 0: not in it")                                     \
    X(int32_t, coupled, n->link, "union-find: towards the root of the links that couplings join (group_units.c)")      \
    X(double, exponent, n->link, "logarithm of a link's unit over that of the link above in this set")                 \
    X(double, highest, n->link, "of a root: the largest of these in its set")                                          \
    X(int32_t, order, n->link, "links of a group as a front may take them (front_order.c)")                            \
    X(int32_t, best, n->link, "the best of these orders")                                                              \
    X(int32_t, step, n->link, "of a link in an order; -1: not taken yet")                                              \
    X(int32_t, last_use, n->link, "step at which nothing depends on a link any more")                                  \
    X(int32_t, child, n->link, "first child in the group, 0: none")                                                    \
    X(int32_t, sibling, n->link, "next child of the same parent, 0: none")                                             \
    X(int32_t, waiting, n->link, "children that are not taken yet, and loops that are open")                           \
    X(int32_t, slot, n->link, "of a link in the front")                                                                \
    X(int32_t, change, n->link + 1, "sums step by step")                                                               \
    X(int32_t, begun, n->link + 1, "relations that begin at a step, minus those that end")                             \
    X(int32_t, end, n->link, "first end of a loop on a link: 1 + 2 loop + end, 0: none")                               \
    X(int32_t, next_end, 2 * n->loop, "the next end on the same link")                                                 \
    X(int32_t, complete, n->loop, "step that completes a loop")                                                        \
    X(int32_t, relation, n->loop, "slot of a relation's equation")

typedef struct kt_attach {
    const kt_description *description;
    const kt_planar_loop *flat; /* planar forms of the description's loops */
    const kt_model *tree;
    size_t loop_terms;  /* terms of loops; those of effects follow */
    int loop_of_effect; /* in whose coordinate the last one acts that acts in one */
    KT_ARENA_DECLARE(ATTACH_FIELDS)
} kt_attach;

static inline bool kt_attach_is_relation(int32_t type) { return kt_loop_is_relation((kt_loop_type)type); }

/* Rotates the frame of an end until its z axis is along `axis`. */
static inline void kt_attach_align_axis(kt_pose *frame, kt_vec3 axis) {
    frame->rotation = kt_mat3_multiply(frame->rotation, kt_triad_from_axis(kt_vec3_normalize(axis), 2));
}

/* The joint or loop in whose coordinate an effect without ends acts (relative_effects.c): its body in the tree, or -1
 * and its loop. */
typedef struct kt_attach_coordinate {
    int body, loop, component;
} kt_attach_coordinate;

/* The link of a joint's coordinate: "NAME", or "NAME[k]" of friction that sticks and hard stops. */
int32_t kt_attach_joint_link(const kt_model *m, const char *joint);

/* The number of ends of an effect: two in a coordinate of a loop; and the name of the body on which the k-th is. */
int kt_attach_end_count(kt_attach *a, const kt_effect *effect);
const char *kt_attach_end_body(kt_attach *a, const kt_effect *effect, int k);

/* Places an effect in a coordinate: on a link, or on the ends of a loop. The terms from *term on then belong to the
 * effect. */
void kt_attach_place_in_coordinate(kt_attach *a, const kt_model *m, const kt_effect *effect, kt_effect_record *r);
size_t kt_attach_count_turns(kt_attach *a, const kt_effect *effect);
void kt_attach_fill_turns(const kt_attach *a, kt_model *m, kt_effect_record *r, size_t *term);

/* Formulas of effects (compile_formula.c): counts numbers and variables, of which `names` then has the list; and fills
 * the model. */
kt_status kt_attach_count_formulas(const kt_description *description, const kt_effect *effect, kt_formula_names *names,
                                   kt_counts *n, kt_error *error);
kt_status kt_attach_fill_formulas(const kt_attach *a, kt_model *m, const kt_effect *effect, kt_effect_record *r,
                                  size_t *number, size_t *variable, size_t *part, kt_error *error);

/* The body of a name that has been checked; no name is the world. */
static inline int kt_attach_body_named(const kt_model *m, const char *name) { return name ? kt_body_find(m, name) : 0; }

/* The link of a chain that has a velocity coordinate; `link` is the last link of the joint. */
static inline int32_t kt_attach_link_of_velocity(const kt_model *m, int32_t link, int32_t v) {
    while (v < m->link[link].v)
        link = m->link[link].parent;
    return link;
}

/* Finds an end's body, link, and frame in the link's frame, before a rotation to the axis of the item. */
kt_status kt_attach_place_end(const kt_model *m, const kt_end *end, int32_t *body, int32_t *link, kt_pose *frame,
                              kt_error *error);

/* Paths of effects (effect_path.c): counts their points and links, and fills the model from *point and *link on. */
void kt_attach_count_path(const kt_model *tree, const kt_effect *effect, kt_counts *n);
kt_status kt_attach_fill_path(kt_model *m, const kt_effect *effect, kt_effect_record *r, size_t *point, size_t *link,
                              kt_error *error);

/* Marks the links of the markers among the variables as links that carry forces. */
void kt_attach_mark_variables(kt_attach *a, kt_counts *n, const kt_formula_names *names);

/* Auxiliary states (compile_state.c): counts their numbers, and fills the model from *number, *variable, ... on. */
kt_status kt_attach_count_states(kt_attach *a, kt_counts *n, kt_error *error);
kt_status kt_attach_fill_states(const kt_attach *a, kt_model *m, size_t *number, size_t *variable, size_t *part,
                                size_t *text, kt_error *error);

/* Masses that are functions of time (compile_variable_mass.c): counts their numbers, and fills the model from *number
 * on. */
void kt_attach_count_masses(const kt_description *description, kt_counts *n);
void kt_attach_fill_masses(const kt_description *description, kt_model *m, size_t *number);

/* Prepares the functions below for links whose depth and pose are in the arrays. */
void kt_attach_measure_links(kt_attach *a, size_t count);

/* Returns the deepest link that carries both links or is one of the two. */
int32_t kt_attach_ancestor(const kt_attach *a, int32_t i, int32_t j);

/* Joins the links from i up to the child of the ancestor into one set with i; returns their number. */
int32_t kt_attach_join_path(kt_attach *a, int32_t i, int32_t ancestor);

/* Finds places in model->path for the paths of all loops, and counts its numbers. */
void kt_attach_place_paths(kt_attach *a, kt_counts *n);

/* Fills model->path. */
void kt_paths_fill(kt_model *m);

/* Finds the point to which the positions of a loop on the ground are relative, as the loop may lie far from the world's
 * origin. If its paths begin with links that only rotate, the origins of these links are fixed in the world. One of
 * these origins is the point. Returns false if a path begins with a prismatic, screw or free motion: its coordinate
 * contains the distance, so that nothing would be gained. Needs the paths. */
bool kt_attach_find_origin(const kt_model *m, const kt_loop_record *r, kt_vec3 *origin);

/* Stores the length of the longest loop, once around, at the initial positions. Also stores the rounding errors that
 * result from the lengths as given (assembly/rounding.h). In the first length, points on the ground count by their
 * distance from one common origin: the mean of the points that kt_attach_find_origin finds. In the lengths as given,
 * points count by their distance from the world's origin. If all loops are shorter than rounding, such as a hinge on a
 * joint, the lengths as given count, or else the lengths of the tree. Without any length, the result is 1. Needs the
 * paths. */
void kt_attach_measure_loops(const kt_attach *a, kt_model *m);

/* Unites the sets of i and j. */
void kt_attach_join(kt_attach *a, int32_t i, int32_t j);

/* Numbers the sets of links that loops have joined, in the order of the loops, and counts these sets. */
void kt_attach_number_groups(kt_attach *a, kt_counts *n);

/* Counts the parts that effects add to a model: batches, links that carry forces and their angles, names. */
KT_CHECKED kt_status kt_attach_count_effects(kt_attach *a, kt_counts *n, kt_error *error);

/* Fills batches, effects and links that carry forces of a model whose effects are in a->effect. */
void kt_attach_fill_effects(kt_attach *a, kt_model *m);

/* Decides for every group whether fronts reduce the group, and in which order. The model must have the lists of its
 * groups. */
void kt_attach_plan_fronts(kt_attach *a, kt_model *m);

/* Fills the constraint groups of a model that has its loops. */
void kt_attach_fill_groups(kt_attach *a, kt_model *m);

/* Sets the units of coordinates whose couplings have large ratios, and marks their groups (kt_group.balanced). */
void kt_attach_balance(kt_attach *a, kt_model *m);

/* Marks the dense groups of mechanisms that are far larger or smaller than a metre in the same way. */
void kt_attach_balance_lengths(kt_model *m);

#endif
