/* Hard stops, contacts and sticking friction of a description, as switched loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMPILE_ONE_SIDED_H
#define KT_COMPILE_ONE_SIDED_H

#include "model/check.h"
#include "model/model.h"

/* Counts the loops that bound one side, the hard stops and the contacts (hard_loops.c). */
int kt_contacts_count(const kt_description *description);
/* Notes in the effects of a compiled model which loops are in their place. first: scratch, one number an effect. */
void kt_contacts_link(const kt_description *expanded, int32_t *first, kt_model *model);

/* Describes a loop of an expanded description. */
typedef struct kt_hard_loop {
    int32_t effect; /* effect whose friction sticks by the loop, or the contact with friction that it is; -1: none */
    bool released;  /* at first: the loop or its effect is switched off, or it is the friction of a contact */
} kt_hard_loop;

/* The description in which all of these are switched loops, and their effects are off. */
typedef struct kt_expansion {
    kt_description description;
    kt_hard_loop *hard; /* for each loop */
    void *memory;       /* block that holds all arrays */
} kt_expansion;

/* Writes an expansion (one_sided.c). The caller frees its memory, also after an error. */
KT_CHECKED kt_status kt_contacts_expand(const kt_description *description, kt_expansion *to, kt_error *error);

static inline bool kt_loop_is_rope(const kt_loop *loop) {
    return (loop->type == KT_LOOP_DISTANCE || loop->type == KT_LOOP_SPAN) && loop->slack;
}
/* Whether a loop holds on one side only. */
static inline bool kt_loop_bounds(const kt_loop *loop) { return loop->side != KT_SIDE_NONE || kt_loop_is_rope(loop); }

#endif
