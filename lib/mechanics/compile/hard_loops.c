/* The loops that replace hard effects: stops, contacts, and friction that sticks (one_sided.c makes them).
 * These loops are the last loops of a description, in the order of the effects. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/one_sided.h"

#include "effect/effect.h"

#include <math.h>

/* How many loops a hard effect is. */
static int loops_of(const kt_effect *effect) {
    if (kt_effect_sticks(effect))
        return 1;
    if (!kt_effect_is_hard(effect))
        return 0;
    return effect->type == KT_EFFECT_CONTACT ? 1 + (int)(effect->friction > 0.0)
                                             : (int)isfinite(effect->lower) + (int)isfinite(effect->upper);
}

int kt_contacts_count(const kt_description *d) {
    int count = 0;
    for (int i = 0; i < d->loop_count; i++)
        count += kt_loop_bounds(&d->loops[i]);
    for (int i = 0; i < d->effect_count; i++)
        count += loops_of(&d->effects[i]);
    return count;
}

void kt_contacts_link(const kt_description *expanded, int32_t *first, kt_model *model) {
    int loop = expanded->loop_count;
    for (int i = expanded->effect_count - 1; i >= 0; i--)
        first[i] = loop -= loops_of(&expanded->effects[i]);
    for (size_t k = 0; k < model->n.effect + model->n.effect_off; k++) {
        kt_effect_record *effect = &model->effect[k];
        effect->loop = first[effect->source];
        effect->loops = loops_of(&expanded->effects[effect->source]);
    }
}
