/* Models for sets of some of the contacts (model/switching.h), which are made during a run, without allocation.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONTACT_MASK_H
#define KT_CONTACT_MASK_H

#include "model/model.h"

/* Every array: type, name, count, meaning. n: of the model in which all contacts are closed and all other switches are
 * on; effects: their number if friction of joints sticks, or 0; groups: their largest number in any model, since a loop
 * that is on may join groups. */
#define KT_MASK_FIELDS(X)                                                                                              \
    X(kt_loop_record, loop, n->loop, "those of contacts that are open are off")                                        \
    X(bool, open, n->loop, "whether it is a contact that is open, or friction that does not stick, an input")          \
    X(kt_effect_record, effect, effects, "friction of joints has the direction of the set")                            \
    X(kt_group, group, groups, "of the loops that are on")                                                             \
    X(int, group_loop, n->loop, "these loops, group by group")                                                         \
    X(int32_t, slot, n->row, "of their equations")                                                                     \
    X(double, weight, KT_ROWS_COUNT * n->row, "likewise")                                                              \
    X(int32_t, rank, KT_ROWS_COUNT *(groups), "the largest ranks so far, while they are measured")                     \
    X(double, q, n->q, "a position next to the state, at which ranks are measured")                                    \
    X(double, closed_q, n->q, "likewise, if loops are open in the state")

typedef struct kt_mask {
    const kt_model *all; /* the model in which all contacts are closed */
    kt_model model;      /* shares its other arrays with that */
    KT_ARENA_DECLARE(KT_MASK_FIELDS)
} kt_mask;

/* Bytes of a mask, and of its ranks; 0 if each set has its own model. */
size_t kt_mask_size(const kt_model *model);
size_t kt_mask_ranks_size(const kt_model *model);

/* Lays a mask out in memory of kt_mask_size. */
kt_mask *kt_mask_init(const kt_model *model, void *memory);

/* Makes the model in which the loops of mask->open are off. `set`: its set. The ranks of this model are the largest
 * possible ranks. */
void kt_mask_make(kt_mask *mask, const kt_model *all, uint64_t set);

/* Determines the ranks at a state, or at a nearby state that closes loops with a gap. The data belong to the model, and
 * have room for all loops. */
void kt_mask_rank(kt_mask *mask, kt_data *data, double t, const double *q);

/* Copies the ranks, because the ranks and the set determine the model. */
void kt_mask_take_ranks(const kt_mask *mask, double *ranks);
/* Whether ranks from outside (a checkpoint) are possible for an existing mask: as many independent equations as a group
 * may have, and finite positive weights. */
bool kt_mask_ranks_fit(const kt_mask *mask, const double *ranks);
void kt_mask_put_ranks(kt_mask *mask, const double *ranks);

#endif
