/* Position and motion of the ends of an effect, and the transfer of its wrenches to the bodies. Both use the motion of
 * the links that carry forces. For one state, and for several in lanes (algebra/real3.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_EFFECT_ENDS_H
#define KT_MECHANISM_EFFECT_ENDS_H

#include "effect/effect.h"

/* Returns the point to which the positions of both ends are relative: the base of the tree of a moving end. A caller's
 * effect receives world coordinates. */
KT_INLINE kt_real3 kt_effect_origin(const kt_data *data, const kt_effect_record *effect) {
    if (effect->type == KT_EFFECT_CUSTOM)
        return kt_zero3();
    return data->force_link[effect->force_link[effect->force_link[0] == 0 && effect->ends == 2 ? 1 : 0]].base;
}

/* How the point of end k moves; its axes are not set. */
KT_INLINE void kt_effect_point_of(const kt_data *data, const kt_effect_record *effect, int k, kt_real3 origin,
                                  kt_effect_frame *end) {
    const kt_force_frame *force_link = &data->force_link[effect->force_link[k]];
    const kt_triple arm =
        kt_columns_apply(kt_columns_of3(force_link->link.axes), kt_triple_of_model(effect->frame[k].position));
    end[k].omega = kt_triple_of3(force_link->link.omega);
    end[k].point = kt_triple_add(kt_triple_of3(kt_sub3(force_link->base, origin)),
                                 kt_triple_add(kt_triple_of3(force_link->local), arm));
    end[k].velocity = kt_triple_add(kt_triple_of3(force_link->velocity), kt_triple_cross(end[k].omega, arm));
}

KT_INLINE kt_triple_columns kt_effect_axes_of(const kt_data *data, const kt_effect_record *effect, int k) {
    return kt_columns_multiply(kt_columns_of3(data->force_link[effect->force_link[k]].link.axes),
                               kt_columns_of_model(effect->frame[k].rotation));
}

KT_INLINE void kt_effect_ends_of(const kt_data *data, const kt_effect_record *effect, kt_effect_frame *end) {
    const kt_real3 origin = kt_effect_origin(data, effect);
    for (int k = 0; k < effect->ends; k++) {
        end[k].axes = kt_effect_axes_of(data, effect, k);
        kt_effect_point_of(data, effect, k, origin, end);
    }
}

/* The sum of x - x over all numbers: 0 if they are finite, otherwise NaN. */
KT_INLINE kt_real kt_effect_excess(const kt_effect_wrench *w) {
    const kt_real all = w->moment.x + w->moment.y + w->moment.z + w->force.x + w->force.y + w->force.z;
    return all - all;
}

/* Adds the wrenches on the ends to the wrenches on their bodies, about the body frames' origins. Returns the sum of
 * their kt_effect_excess. */
KT_INLINE kt_real kt_effect_wrenches_add(const kt_data *data, const kt_effect_record *effect,
                                         const kt_effect_wrench *wrench, kt_external *applied) {
    kt_real excess = kt_real_of(0.0);
    for (int k = 0; k < effect->ends; k++) {
        const kt_triple_columns axes = kt_columns_of3(data->force_link[effect->force_link[k]].link.axes);
        const kt_triple arm = kt_columns_apply(axes, kt_triple_of_model(effect->arm[k]));
        kt_external *body = &applied[effect->body[k]];
        body->moment =
            kt_triple_add(body->moment, kt_triple_add(wrench[k].moment, kt_triple_cross(arm, wrench[k].force)));
        body->force = kt_triple_add(body->force, wrench[k].force);
        excess += kt_effect_excess(&wrench[k]);
    }
    return excess;
}

#endif
