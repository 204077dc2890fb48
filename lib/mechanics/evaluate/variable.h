/* The variables of formulas, read from a state and from the links that carry forces. For one state, and for several in
 * lanes (algebra/real3.h).
 *
 * The distance r of two ends a and b, and its rate:
 *
 *     d = b - a,    r = |d|,    r' = d . d' / r,    and |d'| where r is zero
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_VARIABLE_H
#define KT_MECHANISM_VARIABLE_H

#include "effect/effect.h"

typedef struct kt_variable_source {
    const kt_data *data;       /* the links that carry forces */
    const kt_real1 *q, *v, *x; /* x: auxiliary states */
    kt_real1 t;
} kt_variable_source;

/* A coordinate of a marker in the world, or its rate (is_rate). */
KT_INLINE kt_real1 kt_variable_marker(const kt_data *data, const kt_variable_record *variable, bool is_rate) {
    const kt_force_frame *link = &data->force_link[variable->force_link];
    const kt_triple arm = kt_columns_apply(kt_columns_of3(link->link.axes), kt_triple_of_model(variable->arm));
    const kt_triple point =
        is_rate ? kt_triple_add(kt_triple_of3(link->velocity), kt_triple_cross(kt_triple_of3(link->link.omega), arm))
                : kt_triple_add(kt_triple_of3(link->base), kt_triple_add(kt_triple_of3(link->local), arm));
    return variable->component == 0 ? point.x : variable->component == 1 ? point.y : point.z;
}

/* r, or r' (is_rate). */
KT_INLINE kt_real1 kt_variable_distance(const kt_effect_frame *end, bool is_rate) {
    const kt_triple d = kt_triple_sub(end[1].point, end[0].point);
    const kt_triple moving = kt_triple_sub(end[1].velocity, end[0].velocity);
    const kt_real1 length = kt_triple_norm(d);
    return is_rate ? KT_CHOOSE(length > kt_real1_splat(0.0), kt_triple_dot(d, moving) / length, kt_triple_norm(moving))
                   : length;
}

/* The value of a variable; `end` holds the ends of an effect that acts between two. */
KT_INLINE kt_real1 kt_variable_value(const kt_variable_source *from, const kt_variable_record *variable,
                                     const kt_effect_frame *end) {
    switch (variable->type) {
    case KT_VARIABLE_POSITION:
        return from->q[variable->q];
    case KT_VARIABLE_VELOCITY:
        return from->v[variable->v];
    case KT_VARIABLE_MARKER:
    case KT_VARIABLE_MARKER_VELOCITY:
        return kt_variable_marker(from->data, variable, variable->type == KT_VARIABLE_MARKER_VELOCITY);
    case KT_VARIABLE_STATE:
        return from->x[variable->x];
    case KT_VARIABLE_GRAVITY:
        return from->data->gravity_force[variable->v];
    case KT_VARIABLE_LENGTH:
    case KT_VARIABLE_SPEED:
        return kt_variable_distance(end, variable->type == KT_VARIABLE_SPEED);
    default:
        return from->t;
    }
}

#endif
