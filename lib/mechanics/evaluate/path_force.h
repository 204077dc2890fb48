/* Effects along paths (effect/path.c): the frames of the path's links, and the transfer of a force along the path to
 * the bodies. For one state, and for several states in lanes (algebra/real3.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MECHANISM_PATH_FORCE_H
#define KT_MECHANISM_PATH_FORCE_H

#include "effect/path.h"

/* The frame of a link of a path at the link's origin. Positions are relative to `origin`. */
KT_INLINE kt_effect_frame kt_path_frame_of(const kt_data *data, const kt_path_link *link, kt_real3 origin) {
    const kt_force_frame *force_link = &data->force_link[link->force_link];
    return (kt_effect_frame){
        .axes = kt_columns_of3(force_link->link.axes),
        .point = kt_triple_add(kt_triple_of3(kt_sub3(force_link->base, origin)), kt_triple_of3(force_link->local)),
        .omega = kt_triple_of3(force_link->link.omega),
        .velocity = kt_triple_of3(force_link->velocity)};
}

/* Writes the frames of all links of an effect's path. Positions are relative to the base of the first link that moves,
 * so that no digits are lost far from the world's origin. */
KT_INLINE void kt_path_frames_of(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                                 kt_effect_frame *frame) {
    const kt_path_link *link = model->path_link + effect->path_link;
    int32_t first = 0;
    while (first + 1 < effect->path_link_count && link[first].force_link == 0)
        first++;
    const kt_real3 origin = data->force_link[link[first].force_link].base;
    for (int32_t k = 0; k < effect->path_link_count; k++)
        frame[k] = kt_path_frame_of(data, &link[k], origin);
}

/* Two ends whose distance and rate of the distance equal those of a path, so that formulas read `length` and `speed`
 * from these ends. */
KT_INLINE void kt_path_as_ends(kt_real length, kt_real rate, kt_effect_frame end[2]) {
    const kt_real zero = kt_real_of(0.0);
    end[0].point = end[0].velocity = kt_triple_zero();
    end[1].point = kt_triple_constant(length, zero, zero);
    end[1].velocity = kt_triple_constant(rate, zero, zero);
}

/* Adds a force along the path to the wrenches on bodies, about the body frames' origins. unit: kt_path_value. Returns
 * the sum of x - x over all numbers. */
KT_INLINE kt_real kt_path_wrenches_add(const kt_model *model, const kt_data *data, const kt_effect_record *effect,
                                       kt_real force, const kt_effect_wrench *unit, kt_external *applied) {
    const kt_path_link *link = model->path_link + effect->path_link;
    kt_real excess = kt_real_of(0.0);
    for (int32_t k = 0; k < effect->path_link_count; k++, link++) {
        const kt_triple_columns axes = kt_columns_of3(data->force_link[link->force_link].link.axes);
        const kt_triple arm = kt_columns_apply(axes, kt_triple_of_model(link->arm));
        const kt_triple f = kt_triple_scale(force, unit[k].force), m = kt_triple_scale(force, unit[k].moment);
        kt_external *body = &applied[link->body];
        body->moment = kt_triple_add(body->moment, kt_triple_add(m, kt_triple_cross(arm, f)));
        body->force = kt_triple_add(body->force, f);
        const kt_real all = f.x + f.y + f.z + m.x + m.y + m.z;
        excess += all - all;
    }
    return excess;
}

/* For one state: evaluate the path of an effect, and the force along the path. Poses are taken from `kinematics` or, if
 * NULL, from the links that carry forces. `balance` may be NULL. The second function returns the code of a callback,
 * otherwise 0. */
#ifndef KT_LANES
void kt_path_value_find(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                        const kt_effect_record *effect, kt_path_value *value);
int kt_path_force_find(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                       const kt_effect_record *effect, const kt_dynamic_state *at, kt_path_value *value, double *force,
                       kt_effect_balance *balance);

/* Evaluates a path outside of a model (kt_path_evaluate). */
KT_INNER void kt_path_measure(const kt_path_point_record *points, int count, const kt_effect_end *frame, int links,
                              kt_path_value *value);

/* The lines of a picture of an effect's path (kt_path_trace), with the poses of all bodies, or NULL if `each` is. The
 * call returns 0 for other effects. effect: the index in the description. */
KT_INNER int kt_path_lines(const kt_model *model, int effect, const kt_pose *poses, kt_path_line *each, void *user);
#endif

#endif
