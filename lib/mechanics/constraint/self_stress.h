/* The reactions that redundant loops leave undetermined (self_stress.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_SELF_STRESS_H
#define KT_CONSTRAINT_SELF_STRESS_H

#include "base/arena.h"
#include "constraint/group.h"

/* Rows of the wrenches W of a group: six of each joint, and of each loop six and its relation. Moments come first. */
enum { KT_STRESS_JOINT = 6, KT_STRESS_LOOP = 7, KT_STRESS_RELATION = 6 };

/* A group has k equations of loops that hold both ways, in m coordinates. At generic positions, `redundant` of these
 * equations depend on others. There is room for `most` self-stresses, which are the columns of N and W: two more are
 * found at singular positions. W has at most `rows` rows. */
#define KT_STRESS_FIELDS(X)                                                                                            \
    X(double, a, s->m * s->k, "A' in the units of rows and coordinates, then its factors")                             \
    X(double, tau, s->k, "of their reflectors")                                                                        \
    X(double, norm, s->k, "squared norms of their columns; then those of W")                                           \
    X(kt_index1, pivot, s->k, "their order; then that of W")                                                           \
    X(double, unit, 6 * s->k, "wrench of each unit multiplier about the second end's point")                           \
    X(double, scale, s->k, "of each equation")                                                                         \
    X(int32_t, equation, s->k, "its index among all equations")                                                        \
    X(double, basis, s->k * s->most, "N, k x d: A' N = 0")                                                             \
    X(double, wrench, s->rows * s->most, "W, rows x d: what each column of N adds to joints and loops")                \
    X(double, factor, s->rows * s->most, "W in the units of the objective, then its factors")                          \
    X(double, reflector_scale, s->most, "of its reflectors")                                                           \
    X(double, value, s->rows, "reactions before they are shared")                                                      \
    X(double, amount, s->most, "z")

typedef struct kt_stress {
    size_t k, m, redundant, most, rows;
    KT_ARENA_DECLARE(KT_STRESS_FIELDS)
} kt_stress;

/* Finds the arrays of a group in data->stress. */
kt_stress kt_stress_of(const kt_model *model, const kt_data *data, size_t g);

/* Plans these arrays for all groups, once their ranks are known: sets kt_group.stress and model->n.stress. */
void kt_stress_plan(kt_model *model);

/* Whether the multipliers of a loop belong to the reactions that are shared. Contacts, stops and friction that sticks
 * have laws of their own (math/cone). Wheels also press on their bearings by |lambda| (kt_loop_kind.load). */
static inline bool kt_stress_shares(const kt_loop_record *loop) {
    return !kt_loop_is_off(loop) && loop->side == 0 && loop->friction == 0 && loop->rubs == 0 &&
           (loop->type < KT_LOOP_GEAR || loop->type > KT_LOOP_BELT);
}

/* A walk over the bodies whose joints are on the two paths of a loop, from the ends towards the root. */
typedef struct kt_stress_path {
    int32_t body[2];
} kt_stress_path;

/* The next body on the paths from both ends to their common ancestor; -1: none. *end: which path it is on. */
static inline int32_t kt_stress_path_next(const kt_model *model, kt_stress_path *path, int *end) {
    if (path->body[0] == path->body[1])
        return -1;
    *end = path->body[1] > path->body[0]; /* parents have smaller indices */
    const int32_t next = path->body[*end];
    path->body[*end] = model->body[next].parent;
    return next;
}

/* Numbers the joints on the paths of a group's loops, from 0, in `joint`, by bodies; returns their number. */
int32_t kt_stress_number_joints(const kt_model *model, size_t g, int32_t *joint);

/* Computes N and W of a group from the poses of the links. The number of self-stresses goes to data->stress_count.
 * Garbage is allowed in all arrays before. */
#define KT_STRESS_DECLARE(isa)                                                                                         \
    void kt_stress_find_##isa(const kt_model *model, kt_data *data, size_t g, double t, const double *q);
KT_EACH_ISA(KT_STRESS_DECLARE)
#undef KT_STRESS_DECLARE

#endif
